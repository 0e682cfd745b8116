"""Footprints: what stands about in the world, as its shadow under a light from straight above."""

import numpy as np

from wsnsim.geometry.rotations import quaternion_to_matrix
from wsnsim.types import FloatArray
from wsnsim.world.bodies import Body
from wsnsim.world.motion import Pose

_CORNERS = 48
"""Corners of the polygon that stands for a round outline."""
_SQUARE = ((-1, -1), (-1, 1), (1, -1), (1, 1))


def footprint(body: Body, pose: Pose) -> FloatArray:
    """Return the outline of a body from above.

    Parameters
    ----------
    body : at `pose`
    pose : of the body

    Returns
    -------
    (n, 2) - corners of a closed convex polygon, the first again at the end [m]
    """
    axes = quaternion_to_matrix(pose.orientation) * body.semi_axes_m
    flat = axes[:2]
    if body.form == "ellipsoid":
        # the shadow of A·(unit ball) is the flat A's image of the unit ball: an ellipse with matrix A Aᵀ
        spread = np.linalg.cholesky(flat @ flat.T)
        outline = _circle() @ spread.T
    elif body.form == "cylinder":
        rim = _circle() @ flat[:, :2].T
        outline = _hull(np.vstack([rim + flat[:, 2], rim - flat[:, 2]]))
    else:
        base = body.corners_m / body.semi_axes_m[:2] if body.form == "prism" else _SQUARE
        units = np.array([(x, y, z) for x, y in base for z in (-1, 1)])
        outline = _hull(units @ flat.T)
    closed = np.vstack([outline, outline[:1]])
    return np.asarray(closed + pose.position[:2], dtype=np.float64)


def _circle() -> FloatArray:
    angles = np.linspace(0.0, 2.0 * np.pi, _CORNERS, endpoint=False)
    return np.column_stack((np.cos(angles), np.sin(angles)))


def _hull(points: FloatArray) -> FloatArray:
    """Return the corners of the convex hull, counter-clockwise.

    References
    ----------
    Andrew (1979), Information Processing Letters 9(5): the monotone chain.
    """
    ordered = sorted({(float(x), float(y)) for x, y in points})
    return np.array(_chain(ordered) + _chain(ordered[::-1]))


def _chain(ordered: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Return one side of the hull, without its last corner."""
    side: list[tuple[float, float]] = []
    for x, y in ordered:
        while len(side) > 1:
            (ax, ay), (bx, by) = side[-2:]
            if (bx - ax) * (y - ay) - (by - ay) * (x - ax) > 1e-12:
                break
            side.pop()
        side.append((x, y))
    return side[:-1]
