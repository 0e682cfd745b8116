"""Writes the rows of a run into SQLite while it goes on.

Rows are gathered and committed in batches to a write-ahead log, so that a run
that is killed loses its last batch at most. How the batches fall depends on
the wall clock; what the tables hold does not.
"""

import errno
import sqlite3
import time
from collections.abc import Callable
from dataclasses import fields
from operator import attrgetter
from pathlib import Path
from types import TracebackType
from typing import Any

from wsnsim.errors import OutputError
from wsnsim.records import ROW_TYPES, Row
from wsnsim.store.schema import create_tables, insert_statement

FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""What the system says where there is no room left: on the disk, by a quota, by a limit on files."""

_BATCH_ROWS = 5_000
_BATCH_S = 0.5


class SqliteSink:
    """A sink that keeps rows in a new SQLite file.

    Parameters
    ----------
    path : the file to make; it must not exist yet

    Raises
    ------
    OutputError : the file exists, or cannot be written
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        if path.exists():
            raise OutputError(f"{path}: must not exist yet; choose another folder or remove the file")
        self._take: dict[type[Row], Callable[[Any], tuple[Any, ...]]] = {}
        self._inserts: dict[type[Row], str] = {}
        self._batches: dict[type[Row], list[tuple[Any, ...]]] = {}
        for row_type in ROW_TYPES:
            self._take[row_type] = attrgetter(*(field.name for field in fields(row_type)))
            self._inserts[row_type] = insert_statement(row_type)
            self._batches[row_type] = []
        self._waiting = 0
        self._flushed_at = time.monotonic()
        self._closed = False
        try:
            self._connection = sqlite3.connect(path)
            self._connection.execute("PRAGMA journal_mode = WAL")
            self._connection.execute("PRAGMA synchronous = NORMAL")
            create_tables(self._connection)
        except sqlite3.Error as error:
            raise cannot_write(path, error) from error

    def write(self, row: Row) -> None:
        """Take one row; it is on disk after the next batch.

        Raises
        ------
        OutputError : the batch that the row completes cannot be written
        """
        row_type = type(row)
        self._batches[row_type].append(self._take[row_type](row))
        self._waiting += 1
        if self._waiting >= _BATCH_ROWS or time.monotonic() - self._flushed_at >= _BATCH_S:
            self.flush()

    def flush(self) -> None:
        """Commit all rows taken so far.

        Raises
        ------
        OutputError : they cannot be written
        """
        try:
            with self._connection:
                for row_type, batch in self._batches.items():
                    if batch:
                        self._connection.executemany(self._inserts[row_type], batch)
        except sqlite3.Error as error:
            raise cannot_write(self.path, error) from error
        for batch in self._batches.values():
            batch.clear()
        self._waiting = 0
        self._flushed_at = time.monotonic()

    def close(self) -> None:
        """Commit what is left and fold the log into one single file; a second call does nothing.

        Raises
        ------
        OutputError : the rows cannot be written
        """
        if self._closed:
            return
        self._closed = True
        try:
            self.flush()
            self._fold_log()
        except sqlite3.Error as error:
            raise cannot_write(self.path, error) from error
        finally:
            self._connection.close()

    def _fold_log(self) -> None:
        try:
            self._connection.execute("PRAGMA journal_mode = DELETE")
        except sqlite3.OperationalError as error:
            # Someone is reading the file: the rows are safe, the log goes with its last reader.
            if "locked" not in str(error):
                raise

    def __enter__(self) -> "SqliteSink":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def cannot_write(path: Path, error: sqlite3.Error | OSError) -> OutputError:
    """Return the error to raise for results that did not get to the disk, with what to do."""
    reason = (error.strerror if isinstance(error, OSError) else None) or str(error)
    full = isinstance(error, OSError) and error.errno in FULL
    if full or "full" in reason or "disk I/O" in reason:
        advice = "free some space, or choose a folder on another disk with --out"
    else:
        advice = "choose a folder you may write to with --out"
    return OutputError(f"{path}: results must be writable, got '{reason}'; {advice}")
