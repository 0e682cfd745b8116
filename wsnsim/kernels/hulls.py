"""Convex polygons cut by half-planes, and how much of them lies in a rectangle round a line of sight."""

import numpy as np

from wsnsim.kernels.jit import kernel
from wsnsim.types import FloatArray, IntArray


@kernel
def cut(polygon: FloatArray, count: int, nx: float, ny: float, c: float, result: FloatArray) -> int:
    """Cut a convex polygon by nx x + ny y ≤ c.

    Parameters
    ----------
    polygon : (w, 2) - corners in the first `count` rows [m]
    count : of corners
    nx, ny, c : the half-plane
    result : (w, 2) - is filled with the corners that remain; one row more than `count` is enough

    Returns
    -------
    how many they are

    References
    ----------
    Sutherland & Hodgman (1974), Reentrant polygon clipping.
    """
    kept = 0
    for i in range(count):
        j = i + 1 if i + 1 < count else 0
        here = nx * polygon[i, 0] + ny * polygon[i, 1] - c
        there = nx * polygon[j, 0] + ny * polygon[j, 1] - c
        if here <= 0.0:
            result[kept, 0], result[kept, 1] = polygon[i, 0], polygon[i, 1]
            kept += 1
        if (here < 0.0 < there) or (there < 0.0 < here):
            share = here / (here - there)
            result[kept, 0] = polygon[i, 0] + share * (polygon[j, 0] - polygon[i, 0])
            result[kept, 1] = polygon[i, 1] + share * (polygon[j, 1] - polygon[i, 1])
            kept += 1
    return kept


@kernel
def cut_by_ray(
    polygon: FloatArray, count: int, camera: FloatArray, slope: float, left: bool, result: FloatArray
) -> int:
    """Keep of a convex polygon what is on one side of the line through a camera at slope h / d.

    Parameters
    ----------
    polygon, count, result : as in `cut`
    camera : (6,) - row as in `sightlines`
    slope : of the line against the optical axis, positive on its left
    left : keep h ≥ slope d, else h ≤ slope d

    Returns
    -------
    how many corners remain
    """
    sign = 1.0 if left else -1.0
    nx, ny = sign * (camera[3] + slope * camera[2]), sign * (slope * camera[3] - camera[2])
    return cut(polygon, count, nx, ny, nx * camera[0] + ny * camera[1], result)


@kernel
def area(polygon: FloatArray, count: int) -> float:
    """Return the area of a polygon of `count` corners (w, 2), in either order [m²]."""
    twice = 0.0
    for i in range(1, count - 1):
        ax, ay = polygon[i, 0] - polygon[0, 0], polygon[i, 1] - polygon[0, 1]
        bx, by = polygon[i + 1, 0] - polygon[0, 0], polygon[i + 1, 1] - polygon[0, 1]
        twice += ax * by - ay * bx
    return abs(0.5 * twice)


@kernel
def polygon_coverage(
    points: FloatArray,
    masks: IntArray,
    cameras: FloatArray,
    corners: FloatArray,
    starts: IntArray,
    radius: float,
) -> FloatArray:
    """Return the shares of polygons that lie in the rectangle between a camera and a point, 2 `radius` wide.

    Parameters
    ----------
    points : (m, 2) - [m]
    masks : (m,) - cameras for which the shares are wanted, as bit masks
    cameras : (n, 6) - rows as in `sightlines`
    corners : (c, 2) - of convex polygons [m]
    starts : (k + 1,) - polygon j has the corners of [starts[j], starts[j + 1])
    radius : half the rectangle's width [m]

    Returns
    -------
    (m, n, k) - 0 for cameras that are not wanted and polygons without area
    """
    polygons = len(starts) - 1
    q = np.zeros((len(points), len(cameras), polygons))
    widest = 0
    for j in range(polygons):
        widest = max(widest, starts[j + 1] - starts[j])
    first, second = np.empty((widest + 4, 2)), np.empty((widest + 4, 2))
    wholes = np.empty(polygons)
    for j in range(polygons):
        wholes[j] = area(corners[starts[j] : starts[j + 1]], starts[j + 1] - starts[j])
    for i in range(len(points)):
        for s in range(len(cameras)):
            if not masks[i] >> s & 1:
                continue
            dx, dy = points[i, 0] - cameras[s, 0], points[i, 1] - cameras[s, 1]
            length = np.sqrt(dx * dx + dy * dy)
            if length == 0.0:
                continue
            ux, uy = dx / length, dy / length
            start = ux * cameras[s, 0] + uy * cameras[s, 1]
            side = ux * cameras[s, 1] - uy * cameras[s, 0]
            for j in range(polygons):
                least, most = np.inf, -np.inf
                near, far = np.inf, -np.inf
                for e in range(starts[j], starts[j + 1]):
                    across = ux * corners[e, 1] - uy * corners[e, 0] - side
                    along = ux * corners[e, 0] + uy * corners[e, 1] - start
                    least, most = min(least, across), max(most, across)
                    near, far = min(near, along), max(far, along)
                if least >= radius or most <= -radius or near >= length or far <= 0.0 or wholes[j] == 0.0:
                    continue
                count = starts[j + 1] - starts[j]
                for e in range(count):
                    first[e, 0], first[e, 1] = corners[starts[j] + e, 0], corners[starts[j] + e, 1]
                count = cut(first, count, -uy, ux, side + radius, second)
                count = cut(second, count, uy, -ux, radius - side, first)
                count = cut(first, count, ux, uy, start + length, second)
                count = cut(second, count, -ux, -uy, -start, first)
                q[i, s, j] = area(first, count) / wholes[j]
    return q


@kernel
def cones_pieces(
    corners: FloatArray, starts: IntArray, camera: FloatArray, cones: FloatArray, most: int, least: float
) -> tuple[FloatArray, IntArray, bool]:
    """Cut convex pieces by what one camera sees: its blobs' cones remain, and what is not in its view.

    Parameters
    ----------
    corners : (c, 2) - of the pieces [m]
    starts : (k + 1,) - piece j has the corners of [starts[j], starts[j + 1])
    camera : (6,) - row as in `sightlines`
    cones : (b, 2) - ends of the blobs in the scan line, not overlapping, in ascending order [px]
    most : pieces that may result
    least : area of a piece; smaller ones are rounding errors [m²]

    Returns
    -------
    corners, starts : of the pieces that remain
    whole : False: there were `most` or more, and the rest is not there
    """
    focal, edge = camera[4], camera[5]
    widest = 0
    for j in range(len(starts) - 1):
        widest = max(widest, starts[j + 1] - starts[j])
    # two cuts add a corner each; a sliver may gain two by rounding
    wide = widest + 6
    kept, counts, pieces = np.empty((most, wide, 2)), np.empty(most, np.int64), 0
    first, second, third = np.empty((wide, 2)), np.empty((wide, 2)), np.empty((wide, 2))
    for j in range(len(starts) - 1):
        count = starts[j + 1] - starts[j]
        first[:count] = corners[starts[j] : starts[j + 1]]
        for k in range(-2, len(cones)):
            if k == -2:  # left of the field of view
                rest = cut_by_ray(first, count, camera, edge, True, third)
            elif k == -1:  # right of it, and not left of it too, as what is behind the camera may be
                rest = cut_by_ray(first, count, camera, -edge, False, second)
                rest = cut_by_ray(second, rest, camera, edge, False, third)
            else:
                rest = cut_by_ray(first, count, camera, cones[k, 0] / focal, True, second)
                rest = cut_by_ray(second, rest, camera, cones[k, 1] / focal, False, third)
            if rest < 3 or area(third, rest) < least:
                continue
            if pieces == most:
                break
            kept[pieces, :rest] = third[:rest]
            counts[pieces] = rest
            pieces += 1
    total = 0
    for j in range(pieces):
        total += counts[j]
    result, ends, at = np.empty((total, 2)), np.zeros(pieces + 1, np.int64), 0
    for j in range(pieces):
        result[at : at + counts[j]] = kept[j, : counts[j]]
        at += counts[j]
        ends[j + 1] = at
    return result, ends, pieces < most
