"""Tracks that were recorded elsewhere, one to a file, from CSV files.

The file's header names its columns: `time_s`, `x_m`, `y_m`, if it has heights `z_m`, and if it has
orientations `qw`, `qx`, `qy`, `qz`; others are ignored. Blank lines and what follows a `#` are skipped.
"""

from math import isfinite
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from wsnsim.errors import Problem
from wsnsim.geometry.rotations import IDENTITY, quaternion_multiply
from wsnsim.types import FloatArray
from wsnsim.world.motion import TimedPath
from wsnsim.world.track_text import Row, content_rows, fail

_REQUIRED = ("time_s", "x_m", "y_m")
_QUATERNION = ("qw", "qx", "qy", "qz")


def read_track_csv(
    path: Path | str,
    *,
    scale: float = 1.0,
    offset_m: ArrayLike = (0.0, 0.0, 0.0),
    height_m: float = 0.0,
    orientation: FloatArray = IDENTITY,
) -> TimedPath:
    """Read a recorded track.

    Parameters
    ----------
    path : of the CSV file
    scale : of the file's coordinates (heights included)
    offset_m : (3,) - added to the scaled coordinates [m]
    height_m : z of the target where the file has no `z_m` [m]
    orientation : (4,) - unit quaternion of the target; where the file has orientations, they turn it besides

    Raises
    ------
    ScenarioError : the file cannot be read, has no rows, lacks a column, holds something that is not a
        finite number, or its times do not increase; each problem with its line
    """
    file = Path(path)
    rows = content_rows(file)
    header = next(rows, None)
    if header is None:
        fail([Problem("", "must hold a header and at least one row, got an empty file", file)])
    columns = _columns(header, file)
    problems: list[Problem] = []
    values: list[list[float]] = []
    previous = -np.inf
    for row in rows:
        numbers = [row.number(name, index, file, problems) for name, index in columns.items()]
        if isfinite(numbers[0]):
            if numbers[0] <= previous:
                message = f"time_s: must increase from row to row, got {numbers[0]:g} after {previous:g} [s]"
                problems.append(Problem("", message, file, row.line, row.column(columns["time_s"])))
            previous = numbers[0]
        if "qw" in columns and not any(numbers[-4:]):
            message = "qw: must be a quaternion other than zero, got all zeros"
            problems.append(Problem("", message, file, row.line, row.column(columns["qw"])))
        values.append(numbers)
    if not values:
        problems.append(Problem("", "must hold at least one row below the header", file, header.line, 1))
    if problems:
        fail(problems)
    table = np.array(values)
    places = table[:, 1 : 4 if "z_m" in columns else 3]
    points = np.empty((len(table), 3))
    points[:, 2] = height_m
    points[:, : places.shape[1]] = scale * places
    points += np.asarray(offset_m, dtype=np.float64)
    return TimedPath(table[:, 0], points, _orientations(table, columns, orientation))


def _columns(header: Row, file: Path) -> dict[str, int]:
    """Return the place of each column that is used, in the order time, x, y, z, quaternion."""
    names = header.fields
    turns = _QUATERNION if any(name in names for name in _QUATERNION) else ()
    required = (*_REQUIRED, *turns)
    problems = [
        Problem("", f"the header must name {name!r} once, got {', '.join(names)}", file, header.line, 1)
        for name in (*required, "z_m")
        if names.count(name) != 1 and (name in required or name in names)
    ]
    if problems:
        fail(problems)
    return {name: names.index(name) for name in (*_REQUIRED, "z_m", *turns) if name in names}


def _orientations(table: FloatArray, columns: dict[str, int], orientation: FloatArray) -> FloatArray:
    """Return the orientation of the target at each row (n, 4), or the same at all (1, 4)."""
    if "qw" not in columns:
        return orientation[np.newaxis].copy()
    turns = table[:, -4:] / np.linalg.norm(table[:, -4:], axis=1, keepdims=True)
    return np.array([quaternion_multiply(turn, orientation) for turn in turns])
