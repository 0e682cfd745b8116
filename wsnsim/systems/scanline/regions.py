"""The room, and which cameras walls and fields of view allow to see a place (Ercan et al. 2007, Sec. 4.3).

The paper divides the room into regions beforehand, with each of which go the cameras that see it. Here a
grid of cells does that; in the cells through which a border of two regions runs the points are asked one
by one, so that the answer is exact. Left out: heights. A wall hides whatever is behind it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from wsnsim.geometry.polygons import half_planes, is_convex
from wsnsim.kernels.jit import frozen
from wsnsim.kernels.sightlines import free_of_walls, sight_masks, table_masks
from wsnsim.systems.scanline.measurement import MeasurementNoise, ScanCamera, camera_rows
from wsnsim.types import BoolArray, FloatArray, IntArray

_CELLS = 128
"""Of the table on the room's longer side."""
_MOST_CAMERAS = 62
"""That a bit mask holds."""


@dataclass(frozen=True, eq=False)
class Room:
    """A rectangle with static occluders in it.

    Parameters
    ----------
    low, high : (2,) - opposite corners [m]
    walls : convex polygons (k, 2), their corners in either order [m]

    Raises
    ------
    ValueError : the room has no area, or a polygon is not convex or has none
    """

    low: FloatArray
    high: FloatArray
    walls: tuple[FloatArray, ...] = ()

    def __post_init__(self) -> None:
        if not (self.low < self.high).all():
            raise ValueError(f"low: must be below high, got {self.low.tolist()} and {self.high.tolist()} [m]")
        for number, polygon in enumerate(self.walls):
            if not is_convex(polygon):
                raise ValueError(
                    f"walls[{number}]: must be convex with an area and no straight corner, "
                    f"got {polygon.tolist()} [m]; divide it or leave the corner out"
                )

    @property
    def sides(self) -> FloatArray:
        """Its lengths along the axes (2,) [m]."""
        return self.high - self.low

    @property
    def centre(self) -> FloatArray:
        """Its middle (2,) [m]."""
        return 0.5 * (self.low + self.high)

    @cached_property
    def half_planes(self) -> tuple[FloatArray, IntArray]:
        """The polygons' half-planes (e, 3), and where each polygon's begin (p + 1,), for the kernels."""
        planes, starts = half_planes(self.walls)
        return frozen(planes, np.float64), frozen(starts, np.int64)

    def wall_of(self, points: FloatArray) -> IntArray:
        """Return the number of the wall that each point (m, 2) is inside, -1 for none, (m,)."""
        planes, starts = self.half_planes
        found = np.full(len(points), -1, dtype=np.int64)
        for number, (start, end) in enumerate(pairwise(starts)):
            beyond = points @ planes[start:end, :2].T - planes[start:end, 2]
            found[beyond.max(axis=1) < 0.0] = number
        return found

    def within(self, points: FloatArray, margin_m: float = 0.0) -> BoolArray:
        """Tell which points (m, 2) are in the room, and so far from its sides and walls at least, (m,)."""
        low, high = frozen(self.low, np.float64), frozen(self.high, np.float64)
        return free_of_walls(frozen(points, np.float64), low, high, *self.half_planes, margin_m)


@dataclass(frozen=True, eq=False)
class Rig:
    """Cameras in a room, as the cluster head knows them.

    Parameters
    ----------
    cameras : at most 62
    noise : of their measurements
    room : around them

    Raises
    ------
    ValueError : no camera, or too many
    """

    cameras: Sequence[ScanCamera]
    noise: MeasurementNoise
    room: Room

    def __post_init__(self) -> None:
        if not 1 <= len(self.cameras) <= _MOST_CAMERAS:
            raise ValueError(f"cameras: must be 1 to {_MOST_CAMERAS}, got {len(self.cameras)}")

    @cached_property
    def rows(self) -> FloatArray:
        """The cameras (n, 6) as the kernels take them."""
        return camera_rows(self.cameras)

    @cached_property
    def table(self) -> "RegionTable":
        """The room's regions."""
        return region_table(self.rows, self.room)

    def masks(self, points: FloatArray) -> IntArray:
        """Return for each point (m, 2) the cameras that may see it, as bit masks (m,)."""
        table = self.table
        return table_masks(
            frozen(points, np.float64),
            self.rows,
            *self.room.half_planes,
            table.low,
            table.cell,
            table.sure,
            table.mixed,
        )


@dataclass(frozen=True, eq=False)
class RegionTable:
    """Cells of a room with the cameras that see all of each, and those that see it in part.

    Parameters
    ----------
    low, cell : (2,), (2,) - corner of the table, sides of a cell [m]
    sure, mixed : (nx, ny), (nx, ny) - bit masks
    """

    low: FloatArray
    cell: FloatArray
    sure: IntArray
    mixed: IntArray


def region_table(rows: FloatArray, room: Room) -> RegionTable:
    """Divide a room by the borders of the cameras' views.

    A border is a side of a field of view, a side of a wall, or the edge of a wall's shadow: a ray from the
    wall's corner away from the camera. A cell that none of them comes near is seen as its middle is.

    Parameters
    ----------
    rows : (n, 6) - the cameras
    room : to divide
    """
    counts = np.maximum(np.ceil(_CELLS * room.sides / room.sides.max()).astype(np.int64), 1)
    cell = room.sides / counts
    x, y = (room.low[k] + cell[k] * (np.arange(counts[k]) + 0.5) for k in range(2))
    middles = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    sure = sight_masks(frozen(middles, np.float64), rows, *room.half_planes)
    mixed = np.zeros_like(sure)
    near = 0.51 * float(np.hypot(*cell))
    far = 2.0 * float(np.hypot(*room.sides))
    for k, row in enumerate(rows):
        apex = row[:2]
        half = np.arctan(row[5])
        heading = np.arctan2(row[3], row[2])
        borders = [
            (apex, apex + 1e3 * far * np.array([np.cos(heading + a), np.sin(heading + a)]))
            for a in (half, -half)
        ]
        for polygon in room.walls:
            borders += list(zip(polygon, np.roll(polygon, -1, axis=0), strict=True))
            away = polygon - apex
            reach = far / np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-9 * far)
            borders += list(zip(polygon, polygon + reach * away, strict=True))
        close = np.zeros(len(middles), np.bool_)
        for start, end in borders:
            close |= _distances(middles, start, end) <= near
        mixed[close] |= 1 << k
        sure[close] &= ~(1 << k)
    shape = tuple(counts)
    return RegionTable(
        frozen(room.low, np.float64),
        frozen(cell, np.float64),
        frozen(sure.reshape(shape), np.int64),
        frozen(mixed.reshape(shape), np.int64),
    )


def _distances(points: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    """Return the distances of points (m, 2) from a segment, (m,)."""
    along = end - start
    shares = np.clip((points - start) @ along / max(float(along @ along), 1e-300), 0.0, 1.0)
    return np.asarray(np.linalg.norm(points - start - shares[:, np.newaxis] * along, axis=1))
