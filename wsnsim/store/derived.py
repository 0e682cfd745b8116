"""Tables that are computed after a run and kept beside its records."""

import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import pandas as pd

from wsnsim.errors import OutputError
from wsnsim.records import ROW_TYPES
from wsnsim.store.schema import check_version, quoted
from wsnsim.store.writer import cannot_write


def write_table(path: Path, name: str, frame: pd.DataFrame) -> None:
    """Write a table into a results file, in place of an older one of that name.

    All of it is written or nothing.

    Parameters
    ----------
    path : an existing results.sqlite
    name : the table, none of the record tables
    frame : its columns and rows; the index is left out

    Raises
    ------
    ValueError : `name` is a table of records
    OutputError : the file is not ours, or cannot be written
    """
    if name in {row_type.table for row_type in ROW_TYPES}:
        raise ValueError(f"table must not be one of the run's records, got {name!r}")
    if not path.is_file():
        raise OutputError(f"{path}: results file must exist; run the scenario first")
    declared = ", ".join(f"{quoted(str(c))} {sql_type(frame[c])}" for c in frame.columns)
    marks = ", ".join("?" * len(frame.columns))
    columns = [plain_values(frame[c]) for c in frame.columns]
    try:
        with closing(sqlite3.connect(path)) as connection:
            check_version(connection, path)
            with connection:
                connection.execute("BEGIN IMMEDIATE")
                connection.execute(f"DROP TABLE IF EXISTS {quoted(name)}")
                connection.execute(f"CREATE TABLE {quoted(name)} ({declared})")
                connection.executemany(
                    f"INSERT INTO {quoted(name)} VALUES ({marks})", zip(*columns, strict=True)
                )
    except sqlite3.Error as error:
        raise cannot_write(path, error) from error


def sql_type(column: "pd.Series[Any]") -> str:
    """Return the type that a column is declared with."""
    if pd.api.types.is_bool_dtype(column.dtype):
        return "BOOLEAN"
    if pd.api.types.is_integer_dtype(column.dtype):
        return "INTEGER"
    if pd.api.types.is_float_dtype(column.dtype):
        return "REAL"
    return "TEXT"


def plain_values(column: "pd.Series[Any]") -> list[Any]:
    """Return plain Python values, None for missing ones."""
    missing = column.isna().tolist()
    return [None if gone else value for value, gone in zip(column.tolist(), missing, strict=True)]
