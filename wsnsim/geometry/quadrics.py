"""Outlines of ellipsoids in pinhole images.

The outline of an ellipsoid is the conic C* = P Q* Pᵀ of its dual quadric Q*
(Hartley, Zisserman 2004, eq. 8.5). Its centre is not the projection of the
ellipsoid's centre. An ellipsoid that the camera plane cuts has no elliptic outline;
it counts as not visible here.

A lens with distortion bends the ellipse. What is returned for it is the ellipse to
first order: the centre is distorted, and the shape is transformed by the distortion's
derivative there.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.geometry.lens import NONE, distort, distortion_jacobians
from wsnsim.geometry.rotations import quaternion_to_matrix
from wsnsim.types import BoolArray, FloatArray, IntArray

_NEAREST = 1e-3
"""Surface depth, in half depths of the ellipsoid, below which it counts as cut by the camera plane."""


class Box(NamedTuple):
    """Pixels x0 ≤ x < x1, y0 ≤ y < y1 of an image."""

    x0: int
    y0: int
    x1: int
    y1: int


@dataclass(frozen=True, eq=False)
class Outlines:
    """Ellipses in an image, one for each of m ellipsoids.

    Parameters
    ----------
    centres : (m, 2) - (x, y) of the ellipse [px]
    shapes : (m, 2, 2) - B with (y - c)ᵀ B (y - c) ≤ 1 inside [1/px²]
    visible : (m,) - False where there is no ellipse: centre 0 and unit shape stand in
    """

    centres: FloatArray
    shapes: FloatArray
    visible: BoolArray


def ellipsoid_outlines(
    camera: PinholeCamera, positions: FloatArray, orientation: FloatArray, semi_axes: FloatArray
) -> Outlines:
    """Project one ellipsoid at m places.

    Parameters
    ----------
    camera : that looks
    positions : (m, 3) - centres [m]
    orientation : (4,) - unit quaternion (w, x, y, z) of all
    semi_axes : (3,) - of all [m]

    Returns
    -------
    m outlines; not visible where the ellipsoid is behind the camera plane or cut by
    it, where a position is not finite, or where the lens has no image of the centre

    References
    ----------
    Hartley, Zisserman (2004), Multiple View Geometry, eq. 8.5 (C* = P Q* Pᵀ).
    """
    axes = camera.rotation @ quaternion_to_matrix(orientation) * semi_axes
    # In camera axes at centre t the dual quadric's image is C* = S - t tᵀ; B⁻¹ and the
    # centre are read off it before the focal length scales them, to keep the digits.
    S = axes @ axes.T
    finite = np.asarray(np.isfinite(positions).all(axis=1), dtype=np.bool_)
    t = camera.to_camera_axes(np.where(finite[:, None], positions, camera.position))
    half_depth = float(np.sqrt(S[2, 2]))
    visible = np.asarray(t[:, 2] > (1.0 + _NEAREST) * half_depth, dtype=np.bool_)
    t = np.where(visible[:, None], t, np.array([0.0, 0.0, 2.0 * half_depth]))
    scale = 1.0 / (t[:, 2] ** 2 - S[2, 2])
    centre = (t[:, 2:] * t[:, :2] - S[:2, 2]) * scale[:, None]
    spread = (S[:2, :2] - t[:, :2, None] * t[:, None, :2]) * scale[:, None, None]
    spread += centre[:, :, None] * centre[:, None, :]
    if camera.distortion != NONE:
        bent = distort(centre, camera.distortion)
        bend = distortion_jacobians(np.where(np.isfinite(bent), centre, np.nan), camera.distortion)
        centre, spread = bent, bend @ spread @ bend.transpose(0, 2, 1)
    focal = camera.focal_px
    centres = np.where(visible[:, None], focal * centre + np.array(camera.principal_point), 0.0)
    shapes = np.where(visible[:, None, None], _inverse_2x2(focal**2 * spread), np.eye(2))
    sound = np.isfinite(centres).all(axis=1) & np.isfinite(shapes).all(axis=(1, 2))
    visible &= sound & (shapes[:, 0, 0] * shapes[:, 1, 1] > shapes[:, 0, 1] ** 2)
    centres = np.where(visible[:, None], centres, 0.0)
    shapes = np.where(visible[:, None, None], shapes, np.eye(2))
    return Outlines(centres, shapes, visible)


def outline_box(outlines: Outlines, width: int, height: int) -> Box:
    """Return the smallest box of an image's pixels that holds all visible ellipses.

    Parameters
    ----------
    outlines : m ellipses
    width, height : of the image [px]

    Returns
    -------
    the box; empty, all 0, where no visible ellipse reaches into the image
    """
    boxes = outline_boxes(outlines, width, height)
    boxes = boxes[boxes[:, 2] > boxes[:, 0]]
    if not len(boxes):
        return Box(0, 0, 0, 0)
    x0, y0 = boxes[:, :2].min(axis=0)
    x1, y1 = boxes[:, 2:].max(axis=0)
    return Box(int(x0), int(y0), int(x1), int(y1))


def outline_boxes(outlines: Outlines, width: int, height: int, margin_px: float = 0.0) -> IntArray:
    """Return the box of pixels of each ellipse within an image.

    Parameters
    ----------
    outlines : m ellipses
    width, height : of the image [px]
    margin_px : added to the ellipse on each side [px]

    Returns
    -------
    (m, 4) - x0, y0, x1, y1 as in `Box`; all 0 where nothing is visible in the image
    """
    spread = _inverse_2x2(outlines.shapes)
    half = np.sqrt(np.stack((spread[:, 0, 0], spread[:, 1, 1]), axis=1)) + margin_px
    size = np.array([width, height], dtype=np.float64)
    low = np.clip(np.ceil(outlines.centres - half), 0.0, size)
    high = np.clip(np.floor(outlines.centres + half) + 1.0, 0.0, size)
    shown = outlines.visible & (high > low).all(axis=1)
    return np.where(shown[:, None], np.concatenate((low, high), axis=1), 0.0).astype(np.int64)


def _inverse_2x2(matrices: FloatArray) -> FloatArray:
    """Invert symmetric positive definite matrices (m, 2, 2)."""
    a, b, c = matrices[:, 0, 0], matrices[:, 0, 1], matrices[:, 1, 1]
    determinant = a * c - b * b
    inverse = np.stack((np.stack((c, -b), axis=1), np.stack((-b, a), axis=1)), axis=1)
    return np.asarray(inverse / determinant[:, None, None], dtype=np.float64)
