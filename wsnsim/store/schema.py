"""The shape of results.sqlite, derived from the record dataclasses.

Each record type is a table and each of its fields a column, so that a new
field needs no second place to be written down.
"""

import sqlite3
from dataclasses import fields
from pathlib import Path
from types import NoneType
from typing import get_args, get_type_hints

from wsnsim.errors import OutputError
from wsnsim.records import ROW_TYPES, Row

SCHEMA_VERSION = 1
"""Goes up whenever a reader of older files would misread newer ones."""

APPLICATION_ID = 0x77736E73
"""The four letters `wsns` in the SQLite header: tells our files from others."""

_SQL_TYPES = {float: "REAL", int: "INTEGER", str: "TEXT", bytes: "BLOB"}


def create_statement(row_type: type[Row]) -> str:
    """Return the CREATE TABLE statement for a record type.

    A REAL column may be NULL, because that is how SQLite stores NaN.
    """
    hints = get_type_hints(row_type)
    columns = []
    for field in fields(row_type):
        options = get_args(hints[field.name]) or (hints[field.name],)
        (kind,) = (option for option in options if option is not NoneType)
        optional = NoneType in options or kind is float
        columns.append(f"{quoted(field.name)} {_SQL_TYPES[kind]}{'' if optional else ' NOT NULL'}")
    return f"CREATE TABLE {quoted(row_type.table)} ({', '.join(columns)})"


def insert_statement(row_type: type[Row]) -> str:
    """Return the INSERT statement for a record type."""
    columns = [quoted(field.name) for field in fields(row_type)]
    marks = ", ".join("?" * len(columns))
    return f"INSERT INTO {quoted(row_type.table)} ({', '.join(columns)}) VALUES ({marks})"


def create_tables(connection: sqlite3.Connection) -> None:
    """Make all record tables in an empty file and stamp it with the schema's version."""
    with connection:
        connection.execute("BEGIN IMMEDIATE")
        connection.execute(f"PRAGMA application_id = {APPLICATION_ID}")
        connection.execute(f"PRAGMA user_version = {SCHEMA_VERSION}")
        for row_type in ROW_TYPES:
            connection.execute(create_statement(row_type))


def check_version(
    connection: sqlite3.Connection,
    path: Path,
    application_id: int = APPLICATION_ID,
    schema_version: int = SCHEMA_VERSION,
) -> None:
    """Refuse a file that is not ours or of another schema version.

    Raises
    ------
    OutputError : the file was not written by wsnsim, or by another version of it
    """
    (application,) = connection.execute("PRAGMA application_id").fetchone()
    if application != application_id:
        raise OutputError(f"{path}: must be a results file of wsnsim, but its header says it is not")
    (version,) = connection.execute("PRAGMA user_version").fetchone()
    if version != schema_version:
        raise OutputError(
            f"{path}: schema version must be {schema_version}, got {version}; "
            "run the scenario again, or read the file with the wsnsim version in its manifest.json"
        )


def quoted(name: str) -> str:
    """Return a name as an SQL identifier."""
    return '"' + name.replace('"', '""') + '"'
