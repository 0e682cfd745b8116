"""Which pixels a part of space can touch: boxes that are never too small."""

import numpy as np

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.geometry.lens import NONE
from wsnsim.geometry.quadrics import Box
from wsnsim.types import FloatArray

_NOWHERE = Box(0, 0, 0, 0)


def whole_image(camera: PinholeCamera) -> Box:
    """Return the box of all pixels."""
    return Box(0, 0, *camera.resolution_px)


def box_of_points(camera: PinholeCamera, points: FloatArray) -> Box:
    """Return a box of pixels that holds every pixel which the hull of some points can touch.

    Parameters
    ----------
    camera : that looks
    points : (n, 3) - of the world [m]

    Returns
    -------
    the box; empty, all 0, where all points are behind the camera plane or beside the
    image, the whole image where the plane separates them
    """
    seen = camera.to_camera_axes(points)
    depths = seen[:, 2]
    if depths.max() <= 0.0:
        return _NOWHERE
    if depths.min() <= 0.0:
        return whole_image(camera)
    rays = seen[:, :2] / depths[:, None]
    return box_of_rays(camera, rays.min(axis=0), rays.max(axis=0))


def box_of_rays(camera: PinholeCamera, low: FloatArray, high: FloatArray) -> Box:
    """Return a box of pixels that holds every pixel which rays between two bounds can touch.

    Parameters
    ----------
    camera : that looks
    low, high : (2,) - bounds of the rays (x, y, 1) in camera axes, before the lens
    """
    growth = (1.0, 1.0)
    if camera.distortion != NONE:
        corner = float(np.linalg.norm(camera.rays(np.array([[-0.5, -0.5]]))[0, :2]))
        low, high = np.maximum(low, -corner), np.minimum(high, corner)
        if (low > high).any():
            return _NOWHERE
        growth = _growth(camera.distortion, low, high, corner)
    ends = np.stack((low * growth[0], low * growth[1], high * growth[0], high * growth[1]))
    middle, size = np.array(camera.principal_point), np.array(camera.resolution_px)
    # Half a pixel more on each side: pixels have an extent.
    first = np.clip(np.ceil(camera.focal_px * ends.min(axis=0) + middle - 0.5), 0, size)
    last = np.clip(np.floor(camera.focal_px * ends.max(axis=0) + middle + 0.5) + 1.0, 0, size)
    if (last <= first).any():
        return _NOWHERE
    return Box(int(first[0]), int(first[1]), int(last[0]), int(last[1]))


def _growth(
    distortion: tuple[float, float], low: FloatArray, high: FloatArray, corner: float
) -> tuple[float, float]:
    """Return the smallest and the largest 1 + k1 r² + k2 r⁴ of the rays in a rectangle and in the image."""
    k1, k2 = distortion
    nearest = np.where((low <= 0.0) & (high >= 0.0), 0.0, np.minimum(abs(low), abs(high)))
    farthest = np.maximum(abs(low), abs(high))
    start = min(float(nearest @ nearest), corner**2)
    end = min(float(farthest @ farthest), corner**2)
    squares = [start, end]
    if k2 != 0.0 and start < -0.5 * k1 / k2 < end:
        squares.append(-0.5 * k1 / k2)
    values = [1.0 + s * (k1 + k2 * s) for s in squares]
    return min(values), max(values)
