"""Parts of the room that stand about: walls, boxes, pillars and prisms, as bodies in their places.

Left out: doors and windows. A wall with a door is two walls. The ends of a wall are square: at a corner,
one of the two walls must reach to the other's outside to close it.
"""

import numpy as np

from wsnsim.geometry.polygons import polygon_moments
from wsnsim.geometry.rotations import IDENTITY, quaternion_from_axis_angle
from wsnsim.types import FloatArray
from wsnsim.world.bodies import Body, PatchTexture
from wsnsim.world.motion import Pose

_UP = (0.0, 0.0, 1.0)


def wall(
    start: FloatArray,
    end: FloatArray,
    thickness_m: float,
    height_m: float,
    base_m: float,
    texture: PatchTexture,
) -> tuple[Body, Pose]:
    """Return a wall along a line on the floor plan.

    Parameters
    ----------
    start : (2,) - where its middle line begins [m]
    end : (2,) - where its middle line ends [m]
    thickness_m : across the line, half of it on either side [m]
    height_m : from its lower to its upper edge [m]
    base_m : height of its lower edge [m]
    texture : painted on it
    """
    along = end - start
    half = 0.5 * np.array([float(np.hypot(*along)), thickness_m, height_m])
    middle = np.array([*(0.5 * (start + end)), base_m + half[2]])
    return Body(half, texture, "box"), _standing(middle, float(np.arctan2(along[1], along[0])))


def box(centre: FloatArray, size_m: FloatArray, yaw_rad: float, texture: PatchTexture) -> tuple[Body, Pose]:
    """Return a box that stands upright.

    Parameters
    ----------
    centre : (3,) - [m]
    size_m : (3,) - along its own x, y and z [m]
    yaw_rad : of its x axis from the world's, towards y [rad]
    texture : painted on it
    """
    return Body(0.5 * size_m, texture, "box"), _standing(centre, yaw_rad)


def pillar(
    centre: FloatArray, radius_m: float, height_m: float, base_m: float, texture: PatchTexture
) -> tuple[Body, Pose]:
    """Return an upright cylinder.

    Parameters
    ----------
    centre : (2,) - of its circle on the floor plan [m]
    radius_m : of the circle [m]
    height_m : from its lower to its upper end [m]
    base_m : height of its lower end [m]
    texture : painted on it
    """
    half = np.array([radius_m, radius_m, 0.5 * height_m])
    return Body(half, texture, "cylinder"), _standing(np.array([*centre, base_m + half[2]]), 0.0)


def prism(corners: FloatArray, height_m: float, base_m: float, texture: PatchTexture) -> tuple[Body, Pose]:
    """Return what stands upright on a convex polygon, its middle above the polygon's centre of area.

    Parameters
    ----------
    corners : (k, 2) - of the polygon on the floor plan, in either order [m]
    height_m : from its lower to its upper end [m]
    base_m : height of its lower end [m]
    texture : painted on it

    Raises
    ------
    ValueError : the polygon is not convex, or has a straight corner or no area
    """
    _, middle, _ = polygon_moments(corners)
    own = corners - middle
    half = np.array([*abs(own).max(axis=0), 0.5 * height_m])
    return Body(half, texture, "prism", own), _standing(np.array([*middle, base_m + half[2]]), 0.0)


def _standing(centre: FloatArray, yaw_rad: float) -> Pose:
    orientation = IDENTITY if yaw_rad == 0.0 else quaternion_from_axis_angle(_UP, yaw_rad)
    return Pose(centre, np.zeros(3), orientation)
