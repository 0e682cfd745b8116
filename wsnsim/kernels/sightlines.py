"""Which cameras see which points of a floor plan: fields of view, convex polygons and discs in the way.

A set of cameras is a bit mask, camera k its bit k. A camera is a row (x, y, cos ψ, sin ψ, f,
tan(fov / 2)) with ψ the direction in which it looks; a convex polygon is a run of half-planes (nx, ny, c),
inside where nx x + ny y ≤ c.
"""

import numpy as np

from wsnsim.kernels.crowd import is_free
from wsnsim.kernels.jit import kernel
from wsnsim.types import BoolArray, FloatArray, IntArray


@kernel
def crosses_polygon(
    x0: float, y0: float, x1: float, y1: float, half_planes: FloatArray, first: int, last: int
) -> bool:
    """Tell whether a segment passes through the inside of a convex polygon.

    Parameters
    ----------
    x0, y0, x1, y1 : the segment's ends [m]
    half_planes : (e, 3) - of all polygons, unit normals
    first, last : the polygon's half-planes are those of [first, last)

    References
    ----------
    Cyrus & Beck (1978), Generalized two- and three-dimensional clipping.
    """
    enters, leaves = 0.0, 1.0
    for e in range(first, last):
        nx, ny, c = half_planes[e, 0], half_planes[e, 1], half_planes[e, 2]
        start = nx * x0 + ny * y0 - c
        change = nx * (x1 - x0) + ny * (y1 - y0)
        if change == 0.0:
            if start >= 0.0:
                return False
        elif change < 0.0:
            enters = max(enters, -start / change)
        else:
            leaves = min(leaves, -start / change)
        if enters >= leaves:
            return False
    return True


@kernel
def sees(camera: FloatArray, x: float, y: float, half_planes: FloatArray, starts: IntArray) -> bool:
    """Tell whether a point is in a camera's field of view with no polygon before it.

    Parameters
    ----------
    camera : (6,) - one row
    x, y : the point [m]
    half_planes : (e, 3) - of the polygons
    starts : (p + 1,) - polygon i has the half-planes of [starts[i], starts[i + 1])
    """
    dx, dy = x - camera[0], y - camera[1]
    depth = camera[2] * dx + camera[3] * dy
    if depth <= 0.0 or abs(camera[2] * dy - camera[3] * dx) > depth * camera[5]:
        return False
    for i in range(len(starts) - 1):
        if crosses_polygon(camera[0], camera[1], x, y, half_planes, starts[i], starts[i + 1]):
            return False
    return True


@kernel
def sight_masks(
    points: FloatArray, cameras: FloatArray, half_planes: FloatArray, starts: IntArray
) -> IntArray:
    """Return for each point (m, 2) the cameras (n, 6) that see it, as bit masks (m,)."""
    masks = np.zeros(len(points), np.int64)
    for i in range(len(points)):
        for k in range(len(cameras)):
            if sees(cameras[k], points[i, 0], points[i, 1], half_planes, starts):
                masks[i] |= 1 << k
    return masks


@kernel
def table_masks(
    points: FloatArray,
    cameras: FloatArray,
    half_planes: FloatArray,
    starts: IntArray,
    low: FloatArray,
    cell: FloatArray,
    sure: IntArray,
    mixed: IntArray,
) -> IntArray:
    """Return what `sight_masks` does, by a table of the cells in which the answer is the same everywhere.

    Parameters
    ----------
    points : (m, 2) - [m]
    cameras, half_planes, starts : as in `sight_masks`
    low : (2,) - corner of the table [m]
    cell : (2,) - sides of its cells [m]
    sure : (nx, ny) - cameras that see all of a cell
    mixed : (nx, ny) - cameras whose view has a border in the cell: asked point by point
    """
    masks = np.zeros(len(points), np.int64)
    nx, ny = sure.shape
    every = (1 << len(cameras)) - 1
    for i in range(len(points)):
        u, v = (points[i, 0] - low[0]) / cell[0], (points[i, 1] - low[1]) / cell[1]
        ask = every
        if 0.0 <= u < nx and 0.0 <= v < ny:
            masks[i] = sure[int(u), int(v)]
            ask = mixed[int(u), int(v)]
        if ask == 0:
            continue
        for k in range(len(cameras)):
            if ask >> k & 1 and sees(cameras[k], points[i, 0], points[i, 1], half_planes, starts):
                masks[i] |= 1 << k
    return masks


@kernel
def free_of_walls(
    points: FloatArray,
    low: FloatArray,
    high: FloatArray,
    half_planes: FloatArray,
    starts: IntArray,
    margin: float,
) -> BoolArray:
    """Tell which points (m, 2) are in a room and so far from its sides and polygons at least, (m,).

    Parameters
    ----------
    points : (m, 2) - [m]
    low, high : (2,) - corners of the room [m]
    half_planes, starts : as in `sees`
    margin : from the nearest side of the room and of each polygon [m]
    """
    free = np.empty(len(points), np.bool_)
    for i in range(len(points)):
        free[i] = is_free(points[i, 0], points[i, 1], margin, low, high, half_planes, starts)
    return free


@kernel
def meets_disc(
    camera: FloatArray, x: float, y: float, squared: float, centres: FloatArray, radius: float
) -> bool:
    """Tell whether the line from a camera meets one of some discs.

    Parameters
    ----------
    camera : (6,) - one row
    x, y : from the camera to the end of the line [m]
    squared : the square of its length [m²]
    centres : (k, 2) - of the discs [m]
    radius : of all discs [m]
    """
    least = radius * radius
    for j in range(len(centres)):
        rx, ry = centres[j, 0] - camera[0], centres[j, 1] - camera[1]
        across = x * ry - y * rx
        if across * across >= least * squared and squared > 0.0:
            continue
        along = x * rx + y * ry
        if along <= 0.0:
            near = rx * rx + ry * ry < least
        elif along >= squared:
            near = (rx - x) ** 2 + (ry - y) ** 2 < least
        else:
            near = True
        if near:
            return True
    return False


@kernel
def disc_masks(points: FloatArray, cameras: FloatArray, centres: FloatArray, radius: float) -> IntArray:
    """Return the cameras (n, 6) whose line to a point (m, 2) meets a disc, as bit masks (m,).

    Parameters
    ----------
    points : (m, 2) - [m]
    cameras : (n, 6)
    centres : (k, 2) - of the discs [m]
    radius : of all discs [m]
    """
    masks = np.full(len(points), (1 << len(cameras)) - 1, np.int64)
    clear = undisturbed(points, masks, cameras, centres, radius)
    return np.asarray(masks ^ clear)


@kernel
def undisturbed(
    points: FloatArray, masks: IntArray, cameras: FloatArray, centres: FloatArray, radius: float
) -> IntArray:
    """Return of the cameras in `masks` (m,) those whose line to a point (m, 2) meets no disc, (m,).

    Parameters
    ----------
    points, cameras, centres, radius : as in `disc_masks`
    """
    result = masks.copy()
    for i in range(len(points)):
        for k in range(len(cameras)):
            if masks[i] >> k & 1:
                x, y = points[i, 0] - cameras[k, 0], points[i, 1] - cameras[k, 1]
                if meets_disc(cameras[k], x, y, x * x + y * y, centres, radius):
                    result[i] ^= 1 << k
    return result
