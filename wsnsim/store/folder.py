"""The folder of one run: what belongs to it, and how files get there whole."""

import json
import os
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from enum import Enum
from pathlib import Path
from typing import Any

from wsnsim.errors import OutputError, OutputFolderError
from wsnsim.store.writer import cannot_write


class Status(Enum):
    """How far a run has come."""

    RUNNING = "running"
    COMPLETE = "complete"
    INTERRUPTED = "interrupted"
    FAILED = "failed"


class RunFolder:
    """Where the results of one run live.

    Parameters
    ----------
    path : the folder, existing or not
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.manifest = path / "manifest.json"
        self.scenario = path / "scenario.yaml"
        self.database = path / "results.sqlite"
        self.summary = path / "summary.json"
        self.report = path / "report.html"

    def check(self, force: bool = False) -> None:
        """Refuse a folder that cannot be taken, before anything is changed.

        Parameters
        ----------
        force : an earlier run may be replaced

        Raises
        ------
        OutputFolderError : the folder holds a run, or is no folder
        """
        try:
            taken = self.path.exists() and not self.path.is_dir()
        except OSError as error:
            raise OutputFolderError(
                f"{self.path}: output must be a folder, got '{error.strerror}'"
            ) from error
        if taken:
            raise OutputFolderError(f"{self.path}: output must be a folder, got a file; choose another --out")
        existing = self._existing()
        if existing and not force:
            names = ", ".join(file.name for file in existing)
            raise OutputFolderError(
                f"{self.path}: output folder must not hold another run, found {names}; "
                "choose another --out, or replace that run with --force"
            )

    def create(self, force: bool = False) -> None:
        """Make the folder, or take an existing one that holds no run.

        Parameters
        ----------
        force : remove the files of an earlier run first, and nothing else

        Raises
        ------
        OutputFolderError : the folder holds a run, or is no folder
        OutputError : it cannot be written to
        """
        self.check(force)
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            for file in self._existing():
                file.unlink()
            with tempfile.TemporaryFile(dir=self.path):
                pass
        except OSError as error:
            raise cannot_write(self.path, error) from error

    @contextmanager
    def held(self) -> Iterator[None]:
        """Keep other runs out of the folder, which is made if need be; the system lets go of it with us.

        Where folders cannot be locked (some network file systems), nobody is kept out.

        Raises
        ------
        OutputFolderError : another run writes into it
        OutputError : it cannot be made
        """
        import fcntl

        try:
            self.path.mkdir(parents=True, exist_ok=True)
            handle = os.open(self.path, os.O_RDONLY)
        except OSError as error:
            raise cannot_write(self.path, error) from error
        try:
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise OutputFolderError(
                    f"{self.path}: output folder must not be in use, another run is writing into it; "
                    "wait for its end, or choose another --out"
                ) from None
            except OSError:
                pass
            yield
        finally:
            os.close(handle)

    def write_manifest(self, status: Status, facts: Mapping[str, Any]) -> None:
        """Write manifest.json: the status first, then `facts`.

        Where there is no room for a second file, the first is written over: a
        run that failed because the disk is full must not look as if it went on.

        Raises
        ------
        OutputError : the file cannot be written
        """
        text = _json_text({"status": status.value, **facts})
        try:
            write_text(self.manifest, text)
        except OutputError as error:
            try:
                with self.manifest.open("r+b") as file:
                    file.write(text.encode())
                    file.truncate()
            except OSError:
                raise error from None

    def discard_results(self) -> None:
        """Remove summary and report of a run that did not come to its end."""
        for file in (self.summary, self.report):
            with suppress(OSError):
                file.unlink(missing_ok=True)

    def write_summary(self, figures: Mapping[str, float | int | None]) -> None:
        """Write summary.json.

        Raises
        ------
        OutputError : the file cannot be written
        """
        write_json(self.summary, figures)

    def _existing(self) -> list[Path]:
        return [file for file in self._files() if file.exists() or file.is_symlink()]

    def _files(self) -> tuple[Path, ...]:
        logs = (Path(f"{self.database}-wal"), Path(f"{self.database}-shm"), Path(f"{self.database}-journal"))
        return (self.manifest, self.scenario, self.database, *logs, self.summary, self.report)


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """Write a JSON object, whole or not at all; NaN is refused.

    Raises
    ------
    ValueError : `content` holds a NaN or an infinity, which JSON has no word for
    OutputError : the file cannot be written
    """
    write_text(path, _json_text(content))


def _json_text(content: Mapping[str, Any]) -> str:
    return json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def write_text(path: Path, text: str) -> None:
    """Write a text file in UTF-8, whole or not at all.

    Raises
    ------
    OutputError : the file cannot be written
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        try:
            with temporary.open("w", encoding="utf-8", newline="\n") as file:
                file.write(text)
                file.flush()
                os.fsync(file.fileno())
            temporary.replace(path)
        finally:
            with suppress(FileNotFoundError):
                temporary.unlink()
    except OSError as error:
        raise cannot_write(path, error) from error
