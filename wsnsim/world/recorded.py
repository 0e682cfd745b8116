"""Tracks that were recorded elsewhere, from CSV files.

The file's header names its columns: `time_s`, `x_m`, `y_m` and, if it has heights,
`z_m`; others are ignored. Blank lines and what follows a `#` are skipped.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from math import isfinite
from pathlib import Path
from typing import NamedTuple, NoReturn

import numpy as np
from numpy.typing import ArrayLike

from wsnsim.errors import Problem, ScenarioError
from wsnsim.geometry.rotations import IDENTITY
from wsnsim.types import FloatArray, Seconds
from wsnsim.world.motion import Pose, interpolate

_REQUIRED = ("time_s", "x_m", "y_m")
_SHOWN_PROBLEMS = 10
_LARGEST = 1e9


@dataclass(frozen=True, eq=False)
class RecordedTrack:
    """Straight lines between recorded places; outside the recording the target stands at its end.

    Parameters
    ----------
    times : (n,) - increasing [s]
    points : (n, 3) - [m]
    orientation : (4,) - unit quaternion, the same all the way
    """

    times: FloatArray
    points: FloatArray
    orientation: FloatArray = field(default_factory=IDENTITY.copy)

    def at(self, time: Seconds) -> Pose:
        """Return the pose at `time` [s]."""
        return interpolate(self.times, self.points, time, self.orientation)


def read_track_csv(
    path: Path | str,
    *,
    scale: float = 1.0,
    offset_m: ArrayLike = (0.0, 0.0, 0.0),
    height_m: float = 0.0,
    start_s: Seconds = 0.0,
    orientation: FloatArray = IDENTITY,
) -> RecordedTrack:
    """Read a recorded track.

    Parameters
    ----------
    path : of the CSV file
    scale : of the file's coordinates (heights included)
    offset_m : (3,) - added to the scaled coordinates [m]
    height_m : z of the target where the file has no `z_m` [m]
    start_s : time in the recording at which the run begins [s]
    orientation : (4,) - unit quaternion of the target

    Raises
    ------
    ScenarioError : the file cannot be read, has no rows, lacks a column, holds something that is not a
        finite number, or its times do not increase; each problem with its line
    """
    file = Path(path)
    rows = _content_lines(_read_text(file))
    header = next(rows, None)
    if header is None:
        _fail([Problem("", "must hold a header and at least one row, got an empty file", file)])
    columns = _columns(header, file)
    problems: list[Problem] = []
    values: list[list[float]] = []
    previous = -np.inf
    for row in rows:
        numbers = [_number(row, name, index, file, problems) for name, index in columns.items()]
        if isfinite(numbers[0]):
            if numbers[0] <= previous:
                message = f"time_s: must increase from row to row, got {numbers[0]:g} after {previous:g} [s]"
                problems.append(Problem("", message, file, row.line, row.column(columns["time_s"])))
            previous = numbers[0]
        values.append(numbers)
    if not values:
        problems.append(Problem("", "must hold at least one row below the header", file, header.line, 1))
    if problems:
        _fail(problems)
    table = np.array(values)
    points = np.empty((len(table), 3))
    points[:, 2] = height_m
    points[:, : table.shape[1] - 1] = scale * table[:, 1:]
    points += np.asarray(offset_m, dtype=np.float64)
    return RecordedTrack(table[:, 0] - start_s, points, np.array(orientation))


class _Row(NamedTuple):
    """The fields of one line."""

    line: int
    fields: list[str]

    def column(self, index: int) -> int:
        """Return where a field begins in the line, from 1; the end of the line if it is missing."""
        if index >= len(self.fields):
            return len(",".join(self.fields)) + 1
        text = self.fields[index]
        return sum(len(field) + 1 for field in self.fields[:index]) + len(text) - len(text.lstrip()) + 1


def _read_text(file: Path) -> str:
    try:
        return file.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        _fail([Problem("", "must be a file that exists; check the name and the folder", file)])
    except (OSError, UnicodeDecodeError) as error:
        _fail([Problem("", f"must be a readable text file, got: {error}", file)])


def _content_lines(text: str) -> Iterator[_Row]:
    for number, line in enumerate(text.splitlines(), start=1):
        content = line.split("#", 1)[0]
        if content.strip():
            yield _Row(number, content.split(","))


def _columns(header: _Row, file: Path) -> dict[str, int]:
    """Return the place of each column that is used, in the order time, x, y, z."""
    names = [field.strip() for field in header.fields]
    problems = [
        Problem("", f"the header must name {name!r} once, got {', '.join(names)}", file, header.line, 1)
        for name in (*_REQUIRED, "z_m")
        if names.count(name) != 1 and (name in _REQUIRED or name in names)
    ]
    if problems:
        _fail(problems)
    return {name: names.index(name) for name in (*_REQUIRED, "z_m") if name in names}


def _number(row: _Row, name: str, index: int, file: Path, problems: list[Problem]) -> float:
    """Return a field as a number, or NaN and one more problem."""
    text = row.fields[index].strip() if index < len(row.fields) else ""
    try:
        value = float(text)
    except ValueError:
        value = np.nan
    if isfinite(value) and abs(value) <= _LARGEST:
        return value
    must = "a finite number" if not isfinite(value) else f"a number of size {_LARGEST:g} or less"
    message = f"{name}: must be {must}, got {text!r}"
    problems.append(Problem("", message, file, row.line, row.column(index)))
    return np.nan


def _fail(problems: list[Problem]) -> NoReturn:
    shown = problems[:_SHOWN_PROBLEMS]
    if len(problems) > len(shown):
        more = f"{len(problems) - len(shown)} more problems like these"
        shown = [*shown, Problem("", more, shown[0].file)]
    raise ScenarioError(shown)
