"""Floor plans of what stands about: the convex polygon that each thing covers, seen from above."""

from collections.abc import Iterable

import numpy as np

from wsnsim.geometry.rotations import quaternion_to_matrix
from wsnsim.types import FloatArray
from wsnsim.world.world import Placed

_ROUND_CORNERS = 24
"""Of the polygon about a circle, which is larger than it by 0.86 % at its corners and 0.57 % in area."""
_SQUARE = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])


def footprint(placed: Placed) -> FloatArray:
    """Return the convex polygon (k, 2) that an upright thing covers on the floor plan, in either order [m].

    A wall or a box covers a rectangle, a prism the polygon that it stands on. A round thing covers an
    ellipse; its polygon is that of 24 corners about it, which touches it at the middles of its sides.

    Parameters
    ----------
    placed : an occluder, turned about the vertical only
    """
    body, pose = placed.body, placed.pose
    if body.form == "prism":
        corners = body.corners_m
    else:
        corners = body.semi_axes_m[:2] * (_SQUARE if body.form == "box" else _about_the_circle())
    turned = corners @ quaternion_to_matrix(pose.orientation)[:2, :2].T
    return np.asarray(turned + pose.position[:2])


def footprints(
    scenery: Iterable[Placed], height_m: float, up_to_m: float | None = None
) -> tuple[FloatArray, ...]:
    """Return the footprints of what reaches a height, or any height of a range.

    A thing reaches from its lower edge up to, not including, its upper one.

    Parameters
    ----------
    scenery : upright occluders
    height_m : that must be reached [m]
    up_to_m : upper end of the range [m]; None: `height_m` alone
    """
    top = height_m if up_to_m is None else up_to_m
    kept = []
    for placed in scenery:
        middle, half = placed.pose.position[2], placed.body.semi_axes_m[2]
        if middle - half <= top and middle + half > height_m:
            kept.append(footprint(placed))
    return tuple(kept)


def _about_the_circle() -> FloatArray:
    angles = 2.0 * np.pi * (np.arange(_ROUND_CORNERS) + 0.5) / _ROUND_CORNERS
    return np.asarray(np.stack([np.cos(angles), np.sin(angles)], axis=1) / np.cos(np.pi / _ROUND_CORNERS))
