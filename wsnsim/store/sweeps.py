"""One SQLite file for all runs of a study.

Results are kept under the hash of their scenario: a study that changes finds
what it has done before, and cells that come to the same scenario share a run.
`cells` and `plan` say what the study asks for now; the views `runs`, and one for
each table that is kept, join both and are what one reads. Each result is
committed by itself, with full synchronisation: a kill loses nothing recorded.
"""

import json
import sqlite3
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any
from urllib.parse import quote

import pandas as pd

from wsnsim.errors import OutputError, OutputFolderError
from wsnsim.metrics.figures import SUMMARY_KEYS, Figures
from wsnsim.store.derived import plain_values, sql_type
from wsnsim.store.reader import typed_series
from wsnsim.store.schema import check_version, quoted
from wsnsim.store.writer import cannot_write

APPLICATION_ID = 0x7773776E
"""The letters `wswn` in the SQLite header: a sweep of ours."""

SCHEMA_VERSION = 1

FIGURES = tuple(sorted(SUMMARY_KEYS - {"wall_s"}))
"""Columns of `runs` that are figures of a run's summary; the wall time is no property of what was run."""

COMPLETE, FAILED, PENDING = "complete", "failed", "pending"

_TABLES = """
CREATE TABLE study (name TEXT NOT NULL, text TEXT NOT NULL, overrides TEXT NOT NULL);
CREATE TABLE cells (
    cell INTEGER PRIMARY KEY, name TEXT NOT NULL, scenario TEXT NOT NULL, factor TEXT NOT NULL,
    level TEXT NOT NULL, baseline INTEGER NOT NULL, settings TEXT NOT NULL
);
CREATE TABLE plan (
    cell INTEGER NOT NULL, seed INTEGER NOT NULL, scenario_sha256 TEXT NOT NULL, PRIMARY KEY (cell, seed)
);
CREATE TABLE provenance (
    provenance INTEGER PRIMARY KEY, wsnsim TEXT NOT NULL, python TEXT NOT NULL, libraries TEXT NOT NULL,
    platform TEXT NOT NULL, machine TEXT NOT NULL
);
CREATE TABLE results (
    scenario_sha256 TEXT PRIMARY KEY, status TEXT NOT NULL, error TEXT, attempts INTEGER NOT NULL,
    wall_s REAL, cpu_s REAL, provenance INTEGER NOT NULL, kept TEXT NOT NULL
);
"""


@dataclass(frozen=True)
class CellRow:
    """A cell as the file knows it; `baseline` is the cell it is compared to."""

    cell: int
    name: str
    scenario: str
    factor: str
    level: str
    baseline: int
    settings: Mapping[str, Any]


@dataclass(frozen=True)
class KeptTable:
    """A table of a run in plain values, as it travels between processes."""

    name: str
    columns: tuple[tuple[str, str], ...]
    rows: tuple[tuple[Any, ...], ...]


@dataclass(frozen=True)
class Result:
    """What became of a run.

    Parameters
    ----------
    figures : of its summary; empty for a run that failed
    wall_s, cpu_s : what it took, its worker's start left out; None where its worker died
    tables : those that are kept
    error : why it failed; None for a run that did not
    """

    figures: Figures
    wall_s: float | None
    cpu_s: float | None
    tables: tuple[KeptTable, ...] = ()
    error: str | None = None


def kept_table(name: str, frame: pd.DataFrame) -> KeptTable:
    """Return a table in plain values."""
    columns = tuple((str(column), sql_type(frame[column])) for column in frame.columns)
    values = [plain_values(frame[column]) for column in frame.columns]
    return KeptTable(name, columns, tuple(zip(*values, strict=True)))


class SweepFile:
    """The file of a sweep, open for one writer.

    Parameters
    ----------
    path : sweep.sqlite; made if it does not exist
    study : name of the study

    Raises
    ------
    OutputFolderError : the file belongs to another study
    OutputError : not a file of a sweep, or it cannot be written
    """

    def __init__(self, path: Path, study: str) -> None:
        self.path = path
        if path.exists() and path.stat().st_size:
            # before anything of a file is touched that is not ours
            check_study(path, study)
        with self._told():
            self._connection = sqlite3.connect(path)
        try:
            self._open()
        except BaseException:
            self._connection.close()
            raise

    def _open(self) -> None:
        connection = self._connection
        with self._told():
            connection.execute("PRAGMA journal_mode = WAL")
            connection.execute("PRAGMA synchronous = FULL")
            (tables,) = connection.execute("SELECT count(*) FROM sqlite_master").fetchone()
            if tables == 0:
                connection.executescript(
                    f"BEGIN IMMEDIATE; PRAGMA application_id = {APPLICATION_ID}; "
                    f"PRAGMA user_version = {SCHEMA_VERSION}; {_TABLES} COMMIT;"
                )
            present = {name for _, name, *_ in connection.execute("PRAGMA table_info(results)")}
            with connection:
                for key in FIGURES:
                    if key not in present:
                        connection.execute(f"ALTER TABLE results ADD COLUMN {quoted(key)} REAL")

    def plan(
        self,
        study: str,
        text: str,
        overrides: Sequence[str],
        cells: Sequence[CellRow],
        runs: Iterable[tuple[int, int, str]],
    ) -> None:
        """Put down what the study asks for now, in place of what it asked for before.

        Parameters
        ----------
        study, text : its name and its file's text
        overrides : from the command line
        cells : in their order
        runs : cell, seed and scenario hash of each
        """
        rows = [
            (c.cell, c.name, c.scenario, c.factor, c.level, c.baseline, json.dumps(c.settings)) for c in cells
        ]
        with self._told(), self._connection as connection:
            connection.execute("BEGIN IMMEDIATE")
            for table in ("study", "cells", "plan"):
                connection.execute(f"DELETE FROM {table}")
            connection.execute("INSERT INTO study VALUES (?, ?, ?)", (study, text, json.dumps([*overrides])))
            connection.executemany("INSERT INTO cells VALUES (?, ?, ?, ?, ?, ?, ?)", rows)
            connection.executemany("INSERT INTO plan VALUES (?, ?, ?)", runs)
            connection.execute("DROP VIEW IF EXISTS runs")
            connection.execute(_runs_view())

    def provenance(self, facts: Mapping[str, Any]) -> int:
        """Return the number of a set of versions, new or known."""
        row = tuple(facts[key] for key in ("wsnsim", "python", "libraries", "platform", "machine"))
        row = tuple(each if isinstance(each, str) else json.dumps(each, sort_keys=True) for each in row)
        with self._told(), self._connection as connection:
            known = connection.execute(
                "SELECT provenance FROM provenance WHERE (wsnsim, python, libraries, platform, machine) "
                "= (?, ?, ?, ?, ?)",
                row,
            ).fetchone()
            if known is not None:
                return int(known[0])
            cursor = connection.execute(
                "INSERT INTO provenance (wsnsim, python, libraries, platform, machine) "
                "VALUES (?, ?, ?, ?, ?)",
                row,
            )
        return int(cursor.lastrowid or 0)

    def complete(self, keep: Collection[str]) -> dict[str, int]:
        """Return the complete results that have these tables: hashes, and their versions' numbers."""
        return complete_results(read_sweep(self.path, "results"), keep)

    def record(self, scenario_sha256: str, result: Result, attempts: int, provenance: int) -> None:
        """Keep a result; it is on the disk when this returns.

        Raises
        ------
        OutputError : it cannot be written
        """
        status = COMPLETE if result.error is None else FAILED
        kept = json.dumps(sorted(table.name for table in result.tables))
        row = [scenario_sha256, status, result.error, attempts, result.wall_s, result.cpu_s, provenance, kept]
        row += [result.figures.get(key) for key in FIGURES]
        names = ["scenario_sha256", "status", "error", "attempts", "wall_s", "cpu_s", "provenance", "kept"]
        columns = ", ".join(quoted(name) for name in (*names, *FIGURES))
        with self._told(), self._connection as connection:
            connection.execute("BEGIN IMMEDIATE")
            connection.execute(f"INSERT OR REPLACE INTO results ({columns}) VALUES ({_marks(row)})", row)
            for table in result.tables:
                self._keep(scenario_sha256, table)

    def _keep(self, scenario_sha256: str, table: KeptTable) -> None:
        name = quoted(f"kept_{table.name}")
        columns = ", ".join(f"{quoted(column)} {declared}" for column, declared in table.columns)
        known = self._connection.execute(f"PRAGMA table_info({name})").fetchall()
        if not known:
            self._connection.execute(f"CREATE TABLE {name} (scenario_sha256 TEXT NOT NULL, {columns})")
            index = quoted(f"kept_{table.name}_by_run")
            self._connection.execute(f"CREATE INDEX {index} ON {name} (scenario_sha256)")
            self._connection.execute(_kept_view(table))
        elif {each[1] for each in known} != {"scenario_sha256", *(column for column, _ in table.columns)}:
            raise OutputError(
                f"{self.path}: the table {table.name} must have the columns that this version makes; "
                "start anew with --fresh"
            )
        self._connection.execute(f"DELETE FROM {name} WHERE scenario_sha256 = ?", (scenario_sha256,))
        into = ", ".join(quoted(column) for column in ("scenario_sha256", *(c for c, _ in table.columns)))
        self._connection.executemany(
            f"INSERT INTO {name} ({into}) VALUES (?, {_marks(table.columns)})",
            ((scenario_sha256, *row) for row in table.rows),
        )

    def close(self) -> None:
        """Fold the log into one single file."""
        try:
            # a reader or a full disk keeps the log; nothing is lost by that
            with suppress(sqlite3.OperationalError):
                self._connection.execute("PRAGMA journal_mode = DELETE")
        finally:
            self._connection.close()

    def __enter__(self) -> "SweepFile":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @contextmanager
    def _told(self) -> Iterator[None]:
        try:
            yield
        except sqlite3.Error as error:
            raise cannot_write(self.path, error) from error


def check_study(path: Path, study: str) -> None:
    """Refuse the file of another study.

    Raises
    ------
    OutputFolderError : it is one
    """
    names = set(read_sweep(path, "study")["name"])
    if names - {study}:
        raise OutputFolderError(
            f"{path}: must be a sweep of the study {study!r}, got one of {names.pop()!r}; "
            "choose another --out, or delete it and start anew with --fresh"
        )


def complete_results(results: pd.DataFrame, keep: Collection[str]) -> dict[str, int]:
    """Return the complete results that have these tables: hashes, and their versions' numbers."""
    done = results[results["status"] == COMPLETE]
    rows = zip(done["scenario_sha256"], done["kept"], done["provenance"], strict=True)
    return {str(digest): int(made) for digest, kept, made in rows if set(keep) <= set(json.loads(kept))}


def read_sweep(path: Path, name: str) -> pd.DataFrame:
    """Return a table or view of a sweep's file: `runs`, `cells`, `steps` where it is kept.

    Raises
    ------
    OutputError : no such file or table, or not a file of a sweep
    """
    if not path.is_file():
        raise OutputError(f"{path}: the file of a sweep must exist; run the study first")
    try:
        with closing(sqlite3.connect(f"file:{quote(str(path.resolve()))}?mode=ro", uri=True)) as connection:
            check_version(connection, path, APPLICATION_ID, SCHEMA_VERSION)
            columns = connection.execute(f"PRAGMA table_info({quoted(name)})").fetchall()
            if not columns:
                known = connection.execute("SELECT name FROM sqlite_master WHERE type != 'index'").fetchall()
                names = ", ".join(sorted(each for (each,) in known))
                raise OutputError(f"{path}: table must be one of {names}; got {name!r}")
            rows = connection.execute(f"SELECT * FROM {quoted(name)}").fetchall()
    except sqlite3.Error as error:
        raise OutputError(
            f"{path}: must be a readable file of a sweep, got '{error}'; choose another --out"
        ) from error
    values = list(zip(*rows, strict=True)) or [()] * len(columns)
    return pd.DataFrame(
        {column: typed_series(values[at], declared) for at, (_, column, declared, *_) in enumerate(columns)}
    )


def _runs_view() -> str:
    figures = ", ".join(f"r.{quoted(key)}" for key in FIGURES)
    return (
        "CREATE VIEW runs AS SELECT p.cell, c.name, c.scenario, c.factor, c.level, p.seed, "
        # a bare column keeps its declared type, an expression has none
        f"CAST(COALESCE(r.status, '{PENDING}') AS TEXT) AS status, p.scenario_sha256, {figures}, "
        "r.error, r.attempts, r.wall_s, r.cpu_s, r.provenance "
        "FROM plan AS p JOIN cells AS c USING (cell) LEFT JOIN results AS r USING (scenario_sha256) "
        "ORDER BY p.cell, p.seed"
    )


def _kept_view(table: KeptTable) -> str:
    columns = ", ".join(f"k.{quoted(column)}" for column, _ in table.columns)
    return (
        f"CREATE VIEW {quoted(table.name)} AS SELECT p.cell, p.seed, {columns} "
        f"FROM plan AS p JOIN {quoted(f'kept_{table.name}')} AS k USING (scenario_sha256) "
        "ORDER BY p.cell, p.seed, k.rowid"
    )


def _marks(values: Sequence[Any]) -> str:
    return ", ".join("?" * len(values))
