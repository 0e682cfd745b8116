"""What is inside a body, and which sight lines a body blocks.

In units of its semi-axes a body is the unit ball, a cube of side 2, a unit cylinder or a prism; straight
lines stay straight there, so each question has a closed answer. The surface belongs to the body.
"""

from collections.abc import Sequence

import numpy as np

from wsnsim.geometry.rotations import quaternion_to_matrix
from wsnsim.types import BoolArray, FloatArray
from wsnsim.world.bodies import Body, Form
from wsnsim.world.motion import Pose

_BOUNDED_AXES: dict[Form, slice] = {
    "ellipsoid": slice(0, 0),
    "cylinder": slice(2, 3),
    "box": slice(0, 3),
    "prism": slice(2, 3),
}
"""Axes along which a form lies between two planes at ±1."""
_ROUND_AXES: dict[Form, slice] = {
    "ellipsoid": slice(0, 3),
    "cylinder": slice(0, 2),
    "box": slice(0, 0),
    "prism": slice(0, 0),
}
"""Axes whose squares sum to 1 at most in a form."""


def contains(body: Body, pose: Pose, points: FloatArray) -> BoolArray:
    """Tell which points are inside a body or on its surface.

    Parameters
    ----------
    body : at `pose`
    pose : of the body
    points : (n, 3) - in the world [m]

    Returns
    -------
    (n,)
    """
    units = _in_body_units(body, pose, points)
    extents = np.abs(units[:, _BOUNDED_AXES[body.form]]).max(axis=1, initial=0.0)
    squares: FloatArray = (units[:, _ROUND_AXES[body.form]] ** 2).sum(axis=1)
    inside: BoolArray = np.maximum(extents, squares) <= 1.0
    if body.form == "prism":
        inside &= _beyond_sides(body, units).max(axis=1) <= 0.0
    return inside


def blocks(body: Body, pose: Pose, origins: FloatArray, ends: FloatArray) -> BoolArray:
    """Tell which straight lines from origin to end meet a body; one that begins or ends inside does.

    Parameters
    ----------
    body : at `pose`
    pose : of the body
    origins : (n, 3) or (1, 3) - in the world [m]
    ends : (n, 3) or (1, 3) - in the world [m]

    Returns
    -------
    (n,)

    References
    ----------
    Kay & Kajiya (1986), Ray tracing complex scenes, SIGGRAPH: the part of a line between planes.
    """
    starts = _in_body_units(body, pose, origins)
    starts, steps = np.broadcast_arrays(starts, _in_body_units(body, pose, ends) - starts)
    bounded = _BOUNDED_AXES[body.form]
    first, last = _between_planes(starts[:, bounded], steps[:, bounded])
    if body.form == "prism":
        entered, left = _between_sides(body, starts, steps)
        first, last = np.maximum(first, entered), np.minimum(last, left)
    disc = _ROUND_AXES[body.form]
    start, step = starts[:, disc], steps[:, disc]
    squared = (step**2).sum(axis=1)
    # a line that stands still in the round axes is as near at any of its points
    nearest = -(start * step).sum(axis=1) / np.where(squared > 0.0, squared, 1.0)
    share = np.minimum(np.maximum(nearest, first), last)
    distance = ((start + share[:, np.newaxis] * step) ** 2).sum(axis=1)
    met: BoolArray = (first <= last) & (distance <= 1.0)
    return met


def any_blocks(
    bodies: Sequence[Body], poses: Sequence[Pose], origins: FloatArray, ends: FloatArray
) -> BoolArray:
    """Tell which straight lines from origin to end meet at least one of several bodies.

    Parameters
    ----------
    bodies : what may be in the way
    poses : of the bodies
    origins : (n, 3) or (1, 3) - in the world [m]
    ends : (n, 3) or (1, 3) - in the world [m]

    Returns
    -------
    (n,)
    """
    blocked = np.zeros(max(len(origins), len(ends)), dtype=np.bool_)
    for body, pose in zip(bodies, poses, strict=True):
        blocked |= blocks(body, pose, origins, ends)
    return blocked


def _in_body_units(body: Body, pose: Pose, points: FloatArray) -> FloatArray:
    """Return points (n, 3) along the body's own axes, in units of its semi-axes."""
    units: FloatArray = (points - pose.position) @ quaternion_to_matrix(pose.orientation) / body.semi_axes_m
    return units


def _between_planes(starts: FloatArray, steps: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the shares (n,), (n,) of lines in 0–1 between which every coordinate is in ±1.

    Where there is none, the first is greater than the second.
    """
    still = steps == 0.0
    divisors = np.where(still, 1.0, steps)
    with np.errstate(over="ignore"):  # what all but stands still reaches a plane at infinity
        one, other = (-1.0 - starts) / divisors, (1.0 - starts) / divisors
    outside = np.abs(starts) > 1.0
    entered = np.where(still, np.where(outside, np.inf, -np.inf), np.minimum(one, other))
    left = np.where(still, np.inf, np.maximum(one, other))
    return entered.max(axis=1, initial=0.0), left.min(axis=1, initial=1.0)


def _beyond_sides(body: Body, units: FloatArray) -> FloatArray:
    """Return how far points (n, 3) in units are beyond each side of a prism, (n, k); below 0 within it."""
    beyond: FloatArray = units[:, :2] @ body.side_planes[:, :2].T - body.side_planes[:, 2]
    return beyond


def _between_sides(body: Body, starts: FloatArray, steps: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the shares (n,), (n,) of lines between which they are within all sides of a prism.

    Where there is none, the first is greater than the second.

    References
    ----------
    Cyrus & Beck (1978), Generalized two- and three-dimensional clipping, Computers & Graphics 3.
    """
    beyond = _beyond_sides(body, starts)
    rates = steps[:, :2] @ body.side_planes[:, :2].T
    with np.errstate(over="ignore"):  # what all but goes along a side meets it at infinity
        shares = -beyond / np.where(rates == 0.0, 1.0, rates)
    along = np.where(beyond > 0.0, np.inf, -np.inf)
    entered = np.where(rates < 0.0, shares, np.where(rates == 0.0, along, -np.inf))
    left = np.where(rates > 0.0, shares, np.inf)
    return entered.max(axis=1), left.min(axis=1)
