"""Recordings of many people in one file: `obsmat` of ETH and UCY, and MOTChallenge.

obsmat has the columns frame, id, x, z, y, vx, vz, vy, with blanks between them, x and y on the floor in
metres; z is not used, and velocities follow from the places here. MOTChallenge has frame, id, bb_left,
bb_top, bb_width, bb_height, conf, x, y, z, with commas between them; x, y, z are where the person stands, or
all -1. Then the middle of the box's lower edge, as the image shows it, tells the place by a homography.

References
----------
Pellegrini, Ess, Schindler, Van Gool (2009), You'll never walk alone, ICCV; the README of its data set.
Leal-Taixé, Milan, Reid, Roth, Schindler (2015), MOTChallenge 2015, arXiv:1504.01942.
"""

from dataclasses import dataclass
from math import isfinite
from pathlib import Path

import numpy as np

from wsnsim.errors import Problem
from wsnsim.types import FloatArray, IntArray
from wsnsim.world.track_text import Row, content_rows, fail

_OBSMAT = ("frame", "id", "x", "z", "y")
_MOTCHALLENGE = ("frame", "id", "bb_left", "bb_top", "bb_width", "bb_height")
_MOTCHALLENGE_PLACE = ("x", "y", "z")
_PLACE_FROM = 7
"""Column of x in MOTChallenge, from 0; files of 8 or 9 columns have classes and visibility there."""
_WITH_PLACE = 10
"""Columns of a row of MOTChallenge that has a place."""


@dataclass(frozen=True, eq=False)
class TrackTable:
    """The rows of a file, in its order.

    Parameters
    ----------
    file : they came from
    lines : (n,) - in the file, from 1
    frames : (n,) - numbers of images [-]
    ids : (n,) - whose place it is
    places : (n, 3) - on the floor, in the file's unit; NaN where the file has none
    feet : (n, 2) - in the image; NaN where the file has none [px]
    """

    file: Path
    lines: IntArray
    frames: FloatArray
    ids: IntArray
    places: FloatArray
    feet: FloatArray

    @property
    def known_ids(self) -> tuple[int, ...]:
        """All ids, in rising order."""
        return tuple(int(each) for each in np.unique(self.ids))

    def line_without_place(self, track: int) -> int | None:
        """Return the first line of a track that tells no place on the floor, or None."""
        bare = self.lines[(self.ids == track) & np.isnan(self.places).any(axis=1)]
        return int(bare[0]) if len(bare) else None

    def track(self, track: int, homography: FloatArray | None = None) -> tuple[FloatArray, FloatArray]:
        """Return the frames (n,) of one track and its places (n, 3) in the file's unit.

        Parameters
        ----------
        track : id
        homography : (3, 3) - from (u, v, 1) in the image to (x, y, 1) on the floor, for rows without a place

        Raises
        ------
        ScenarioError : frames do not increase from row to row, or the homography sends a foot to infinity
        """
        own = self.ids == track
        lines, frames, places = self.lines[own], self.frames[own], self.places[own]
        problems = []
        for line, frame, before, last in zip(lines[1:], frames[1:], frames[:-1], lines[:-1], strict=True):
            if frame <= before:
                again = "again" if frame == before else f"after {before:g}"
                must = f"frame: must increase from row to row of track {track}"
                message = f"{must}, got {frame:g} {again} (line {last})"
                problems.append(Problem("", message, self.file, int(line), 1))
        if homography is not None:
            bare = np.isnan(places).any(axis=1)
            u_v_1 = np.column_stack([self.feet[own][bare], np.ones(int(bare.sum()))])
            x, y, w = homography @ u_v_1.T
            for line in lines[bare][w * w[:1] <= 0.0]:
                message = "the lower edge of the box must be below the horizon of the homography"
                problems.append(Problem("", message, self.file, int(line), 1))
            if not problems:
                places[bare] = np.column_stack([x / w, y / w, np.zeros(len(w))])
        if problems:
            fail(problems)
        return frames, places


def read_obsmat(file: Path) -> TrackTable:
    """Read a recording in the format of the ETH and UCY data sets.

    Raises
    ------
    ScenarioError : the file cannot be read, has no rows, or a row is wrong; each problem with its line
    """
    rows: list[list[float]] = []
    problems: list[Problem] = []
    for row in content_rows(file, commas=False):
        numbers = [row.number(name, index, file, problems) for index, name in enumerate(_OBSMAT)]
        _check_whole(numbers[1], row, file, problems)
        frame, track, x, _, y = numbers
        rows.append([row.line, frame, track, x, y, 0.0, np.nan, np.nan])
    return _table(file, rows, problems)


def read_motchallenge(file: Path) -> TrackTable:
    """Read a recording in the format of the MOTChallenge benchmarks.

    Raises
    ------
    ScenarioError : the file cannot be read, has no rows, or a row is wrong; each problem with its line
    """
    rows: list[list[float]] = []
    problems: list[Problem] = []
    for row in content_rows(file):
        numbers = [row.number(name, index, file, problems) for index, name in enumerate(_MOTCHALLENGE)]
        _check_whole(numbers[1], row, file, problems)
        frame, track, left, top, width, height = numbers
        place = [np.nan] * 3
        if len(row.fields) >= _WITH_PLACE:
            found = [
                row.number(name, index, file, problems)
                for index, name in enumerate(_MOTCHALLENGE_PLACE, start=_PLACE_FROM)
            ]
            place = place if found == [-1.0] * 3 else found
        rows.append([row.line, frame, track, *place, left + 0.5 * width, top + height])
    return _table(file, rows, problems)


def read_homography(file: Path) -> FloatArray:
    """Read a 3 × 3 matrix, three numbers a line with blanks between them.

    Raises
    ------
    ScenarioError : the file cannot be read, is no such matrix, or the matrix has no inverse
    """
    problems: list[Problem] = []
    rows = list(content_rows(file, commas=False))
    shape = [len(row.fields) for row in rows]
    if shape != [3, 3, 3]:
        fail([Problem("", f"must hold 3 lines of 3 numbers, got lines of {shape} numbers", file)])
    matrix = np.array([[row.number("entry", index, file, problems) for index in range(3)] for row in rows])
    if not problems and np.linalg.matrix_rank(matrix) < 3:
        problems.append(Problem("", "must be a matrix that has an inverse", file, rows[0].line, 1))
    if problems:
        fail(problems)
    return matrix


def _check_whole(track: float, row: Row, file: Path, problems: list[Problem]) -> None:
    if isfinite(track) and not track.is_integer():
        message = f"id: must be a whole number, got {track:g}"
        problems.append(Problem("", message, file, row.line, row.column(1)))


def _table(file: Path, rows: list[list[float]], problems: list[Problem]) -> TrackTable:
    """Make a table of rows of line, frame, id, place and foot."""
    if not rows:
        problems.append(Problem("", "must hold at least one row, got an empty file", file))
    if problems:
        fail(problems)
    table = np.array(rows)
    lines, ids = table[:, 0].astype(np.int64), table[:, 2].astype(np.int64)
    return TrackTable(file, lines, table[:, 1], ids, table[:, 3:6], table[:, 6:8])
