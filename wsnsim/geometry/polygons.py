"""Convex polygons on a floor plan: their half-planes, moments and least width."""

from collections.abc import Sequence

import numpy as np

from wsnsim.types import FloatArray, IntArray


def is_convex(polygon: FloatArray) -> bool:
    """Tell whether corners (k, 2) make a convex polygon with an area, in either order, no corner straight."""
    if polygon.ndim != 2 or polygon.shape[1] != 2 or len(polygon) < 3 or not np.isfinite(polygon).all():
        return False
    turns = _turns(polygon)
    if not ((turns > 0.0).all() or (turns < 0.0).all()):
        return False
    # a star turns the same way at every corner too, but more than once round
    sides = np.roll(polygon, -1, axis=0) - polygon
    headings = np.arctan2(sides[:, 1], sides[:, 0])
    changes = np.mod(np.roll(headings, -1) - headings + np.pi, 2.0 * np.pi) - np.pi
    return bool(abs(abs(changes.sum()) - 2.0 * np.pi) < 1e-6)


def half_planes(polygons: Sequence[FloatArray]) -> tuple[FloatArray, IntArray]:
    """Return the half-planes whose common part each polygon is.

    Parameters
    ----------
    polygons : convex, each (k, 2), in either order [m]

    Returns
    -------
    half_planes : (e, 3) - unit normal nx, ny and c: inside where nx x + ny y ≤ c
    starts : (p + 1,) - polygon i has the half-planes of [starts[i], starts[i + 1])
    """
    rows, starts = [np.empty((0, 3))], [0]
    for polygon in polygons:
        corners = polygon if _turns(polygon)[0] > 0.0 else polygon[::-1]
        sides = np.roll(corners, -1, axis=0) - corners
        normals = np.stack([sides[:, 1], -sides[:, 0]], axis=1)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        rows.append(np.column_stack([normals, (normals * corners).sum(axis=1)]))
        starts.append(starts[-1] + len(polygon))
    return np.concatenate(rows), np.array(starts, dtype=np.int64)


def polygon_moments(polygon: FloatArray) -> tuple[float, FloatArray, FloatArray]:
    """Return area [m²], mean (2,) [m] and covariance (2, 2) [m²] of a uniform distribution.

    By its triangles from the first corner: the second moment of a triangle about that corner is the sum of
    a aᵀ, b bᵀ and (a + b)(a + b)ᵀ, over 12, for its sides a and b.

    Parameters
    ----------
    polygon : (k, 2) - convex, in either order [m]
    """
    origin = polygon[0]
    first, second = polygon[1:-1] - origin, polygon[2:] - origin
    areas = 0.5 * (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])
    total = float(areas.sum())
    if total == 0.0:
        return 0.0, polygon.mean(axis=0), np.zeros((2, 2))
    sums = first + second
    mean = areas @ sums / (3.0 * total)
    squares = sum((way * areas[:, np.newaxis]).T @ way for way in (first, second, sums))
    return abs(total), origin + mean, squares / (12.0 * total) - np.outer(mean, mean)


def least_width(polygon: FloatArray) -> float:
    """Return the least distance of two parallels that hold a convex polygon (k, 2) between them [m].

    One of them lies along a side (Houle & Toussaint 1988, Computing the width of a set).
    """
    sides = np.roll(polygon, -1, axis=0) - polygon
    lengths = np.hypot(sides[:, 0], sides[:, 1])
    sides, feet, lengths = sides[lengths > 0.0], polygon[lengths > 0.0], lengths[lengths > 0.0]
    normals = np.stack([-sides[:, 1], sides[:, 0]], axis=1) / lengths[:, np.newaxis]
    across = np.abs(((polygon - feet[:, np.newaxis]) * normals[:, np.newaxis]).sum(axis=2))
    return float(across.max(axis=1).min())


def _turns(polygon: FloatArray) -> FloatArray:
    """Return the cross products of each side and the next (k,)."""
    first = np.roll(polygon, -1, axis=0) - polygon
    second = np.roll(first, -1, axis=0)
    return np.asarray(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])
