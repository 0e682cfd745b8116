"""Radial distortion of a lens, in coordinates over the focal length.

Brown and Conrady's model with two coefficients, as OpenCV has it: a ray at
(x, y, 1) comes out at (x, y) (1 + k1 r² + k2 r⁴), r² = x² + y². Its decentring
and higher terms are left out. A negative k1 gives a barrel, a positive one a
pincushion. Where the polynomial stops growing the model means nothing: what lies
farther out would be folded back into the image.

References
----------
Brown (1971), Close-range camera calibration, Photogrammetric Engineering 37(8).
Conrady (1919), Decentred lens-systems, Monthly Notices of the RAS 79(5).
"""

import math

import numpy as np

from wsnsim.kernels.lens import undistort as _undistort
from wsnsim.types import FloatArray

Distortion = tuple[float, float]
"""The coefficients (k1, k2) of a lens [-]."""

NONE: Distortion = (0.0, 0.0)
"""A lens that bends no line."""


def turning_radius(distortion: Distortion) -> float:
    """Return the radius up to which the distorted radius grows; infinity where it always does.

    There the derivative 1 + 3 k1 r² + 5 k2 r⁴ is 0 for the first time.
    """
    k1, k2 = distortion
    discriminant = 9.0 * k1 * k1 - 20.0 * k2
    if discriminant < 0.0:
        return math.inf
    root = math.sqrt(discriminant)
    # 2 / (-b ± √(b² - 4a)): the form that has no need of a being other than 0
    squares = [2.0 / below for below in (-3.0 * k1 + root, -3.0 * k1 - root) if below > 0.0]
    return math.sqrt(min(squares, default=math.inf))


def farthest_image(distortion: Distortion) -> float:
    """Return the distorted radius from which on no ray comes out; infinity where there is none."""
    k1, k2 = distortion
    r = turning_radius(distortion)
    return r if math.isinf(r) else r * (1.0 + r**2 * (k1 + k2 * r**2))


def distort(points: FloatArray, distortion: Distortion) -> FloatArray:
    """Return where rays (n, 2) come out of the lens (n, 2); NaN beyond the turning radius."""
    k1, k2 = distortion
    squares = (points**2).sum(axis=1)
    within = squares <= turning_radius(distortion) ** 2
    growth = np.where(within, 1.0 + squares * (k1 + k2 * squares), np.nan)
    return np.asarray(growth[:, None] * points, dtype=np.float64)


def distortion_jacobians(points: FloatArray, distortion: Distortion) -> FloatArray:
    """Return the derivatives (n, 2, 2) of `distort` at rays (n, 2)."""
    k1, k2 = distortion
    squares = (points**2).sum(axis=1)[:, None, None]
    outer = points[:, :, None] * points[:, None, :]
    growth = 1.0 + squares * (k1 + k2 * squares)
    return np.asarray(growth * np.eye(2) + 2.0 * (k1 + 2.0 * k2 * squares) * outer, dtype=np.float64)


def undistort(points: FloatArray, distortion: Distortion) -> FloatArray:
    """Return the rays (n, 2) that come out of the lens at `points` (n, 2); NaN where none does."""
    points = np.ascontiguousarray(points, dtype=np.float64)
    return _undistort(points, *distortion, turning_radius(distortion))
