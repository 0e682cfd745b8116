"""The way back through a lens: from a distorted radius to the one before the lens."""

import numpy as np

from wsnsim.kernels.jit import kernel
from wsnsim.types import FloatArray

_ROUNDS = 100
"""Halvings and Newton steps at most: a bisection alone needs 60 or so to the last digit."""


@kernel
def undistorted_radius(distorted: float, k1: float, k2: float, turning: float) -> float:
    """Solve r (1 + k1 r² + k2 r⁴) = `distorted` for r by Newton's method inside a bracket.

    Parameters
    ----------
    distorted : radius in the image, over the focal length
    k1, k2 : Brown–Conrady coefficients
    turning : radius up to which the polynomial grows, or infinity

    Returns
    -------
    the radius before the lens, over the focal length; NaN where no ray comes out at `distorted`
    """
    low, high = 0.0, turning
    if not np.isfinite(high):
        high = distorted
        while high * (1.0 + high * high * (k1 + k2 * high * high)) < distorted:
            high *= 2.0
    elif not high * (1.0 + high * high * (k1 + k2 * high * high)) >= distorted:
        return np.nan
    r = min(distorted, high)
    for _ in range(_ROUNDS):
        s = r * r
        beyond = r * (1.0 + s * (k1 + k2 * s)) - distorted
        if beyond == 0.0:
            break
        if beyond > 0.0:
            high = r
        else:
            low = r
        slope = 1.0 + s * (3.0 * k1 + 5.0 * k2 * s)
        after = r - beyond / slope if slope > 0.0 else np.inf
        if not low < after < high:
            after = 0.5 * (low + high)
        if after in (r, low, high):
            break
        r = after
    return r


@kernel
def undistort(points: FloatArray, k1: float, k2: float, turning: float) -> FloatArray:
    """Return points (n, 2) of the distorted image plane as they were before the lens; NaN without a ray."""
    straight = np.empty_like(points)
    for i in range(len(points)):
        distorted = np.hypot(points[i, 0], points[i, 1])
        scale = 1.0
        if not np.isfinite(distorted):
            scale = np.nan
        elif distorted > 0.0:
            scale = undistorted_radius(distorted, k1, k2, turning) / distorted
        straight[i, 0] = scale * points[i, 0]
        straight[i, 1] = scale * points[i, 1]
    return straight
