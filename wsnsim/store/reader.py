"""Reads results.sqlite back as pandas tables, of a finished or an interrupted run."""

import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pandas as pd

from wsnsim.errors import OutputError
from wsnsim.store.schema import check_version, quoted


class RunStore:
    """The tables of one results file.

    Parameters
    ----------
    path : a results.sqlite

    Raises
    ------
    OutputError : no such file, or not a results file of this version
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        if not path.is_file():
            raise OutputError(f"{path}: results file must exist; run the scenario first")
        with self._open() as connection:
            try:
                check_version(connection, path)
            except sqlite3.Error as error:
                raise self._unreadable(error) from error

    @property
    def tables(self) -> tuple[str, ...]:
        """Names of the tables, in the order in which they were made."""
        with self._open() as connection:
            rows = self._fetch(
                connection, "SELECT name FROM sqlite_master WHERE type = 'table' ORDER BY rowid"
            )
        return tuple(name for (name,) in rows)

    def table(self, name: str) -> pd.DataFrame:
        """Return one table, its rows in the order in which they were written.

        Whole numbers come back as int64 (Int64 where some are missing),
        numbers as float64 with NaN for missing ones, text as str with NaN,
        pictures as bytes.

        Raises
        ------
        OutputError : no such table
        """
        with self._open() as connection:
            columns = self._fetch(connection, f"PRAGMA table_info({quoted(name)})")
            if not columns:
                raise OutputError(f"{self.path}: table must be one of {', '.join(self.tables)}; got {name!r}")
            rows = self._fetch(connection, f"SELECT * FROM {quoted(name)} ORDER BY rowid")
        values = list(zip(*rows, strict=True)) or [()] * len(columns)
        return pd.DataFrame(
            {column: typed_series(values[i], declared) for i, (_, column, declared, *_) in enumerate(columns)}
        )

    def _open(self) -> "closing[sqlite3.Connection]":
        uri = f"file:{quote(str(self.path.resolve()))}?mode=ro"
        try:
            return closing(sqlite3.connect(uri, uri=True))
        except sqlite3.Error as error:
            raise self._unreadable(error) from error

    def _fetch(self, connection: sqlite3.Connection, query: str) -> list[tuple[Any, ...]]:
        try:
            return connection.execute(query).fetchall()
        except sqlite3.Error as error:
            raise self._unreadable(error) from error

    def _unreadable(self, error: sqlite3.Error) -> OutputError:
        return OutputError(
            f"{self.path}: must be a readable results file, got '{error}'; "
            "a file of an interrupted run needs its -wal file beside it and a folder that can be written to"
        )


def typed_series(values: tuple[Any, ...], declared: str) -> "pd.Series[Any]":
    """Return a column with the type it was declared with."""
    if declared == "REAL":
        return pd.Series(values, dtype="float64")
    if declared == "INTEGER":
        return pd.Series(values, dtype="Int64" if None in values else "int64")
    if declared == "BOOLEAN":
        return pd.Series(values, dtype="boolean" if None in values else "bool")
    return pd.Series(values, dtype="object" if declared == "BLOB" else "str")
