"""Ray casting of patch-textured ellipsoids over a background.

Each body has coordinates of its own, in which it is the unit sphere. A ray goes through
the point (rx, ry, 1) of the camera's axes.
"""

import numpy as np
from numpy.typing import NDArray

from wsnsim.kernels.jit import kernel
from wsnsim.types import BoolArray, ByteArray, FloatArray, IntArray

_FINE = 4
"""Samples a side where an outline or a patch border crosses the pixel."""
_COARSE = 2
"""Samples a side where they show one surface: the corners of the fine samples."""


@kernel
def cast_bodies(
    background: ByteArray,
    focal_px: float,
    to_unit: FloatArray,
    eyes: FloatArray,
    per_axes: FloatArray,
    lights: FloatArray,
    ambient: float,
    centres: FloatArray,
    shapes: FloatArray,
    visible: BoolArray,
    boxes: IntArray,
    patch_starts: IntArray,
    patch_centres: FloatArray,
    patch_colours: FloatArray,
    paint: bool,
) -> tuple[NDArray[np.float32], NDArray[np.float32], FloatArray]:
    """Cast rays from one camera at m ellipsoids; the nearest surface hides what is behind it.

    Parameters
    ----------
    background : (h, w, 3) - RGB where no body is
    focal_px : focal length; the principal point is the middle of the image [px]
    to_unit : (m, 3, 3) - camera axes [m] to body coordinates
    eyes : (m, 3) - the camera in body coordinates
    per_axes : (m, 3) - 1 / semi-axes [1/m]
    lights : (m, 3) - unit vector towards the light, in body axes
    ambient : share of the light that comes from everywhere
    centres, shapes : (m, 2), (m, 2, 2) - outlines in the image [px], [1/px²]
    visible : (m,) - False where there is no outline: it may cross every pixel of the box
    boxes : (m, 4) - x0, y0, x1, y1, pixels that the body can touch; empty where it cannot be seen
    patch_starts : (m + 1,) - patches of body b are patch_starts[b] to patch_starts[b + 1] - 1
    patch_centres : (p, 3) - unit vectors
    patch_colours : (p, 3) - RGB [0–255]
    paint : False leaves the colours out, for areas only

    Returns
    -------
    image : (h, w, 3) - RGB; (0, 0, 3) without `paint`
    coverage : (h, w) - share of each pixel that shows a body
    areas : (m,) - of each body as the image shows it [px]
    """
    height, width, _ = background.shape
    image = background.astype(np.float32) if paint else np.empty((0, 0, 3), np.float32)
    coverage = np.zeros((height, width), np.float32)
    count = len(eyes)
    areas, hits = np.zeros(count), np.zeros(count, np.int64)
    touching = np.empty(count, np.int64)
    reaches = _reaches(shapes)
    cx, cy = 0.5 * (width - 1), 0.5 * (height - 1)
    for owner in range(count):
        for y in range(boxes[owner, 1], boxes[owner, 3]):
            for x in range(boxes[owner, 0], boxes[owner, 2]):
                found, side = _bodies_at(x, y, owner, centres, shapes, reaches, visible, boxes, touching)
                if found == 0:
                    continue
                red, green, blue = 0.0, 0.0, 0.0
                sample, first = 0, -1
                while sample < side * side:
                    stride = (_FINE - 1) // (side - 1)
                    rx = (x + (sample % side * stride + 0.5) / _FINE - 0.5 - cx) / focal_px
                    ry = (y + (sample // side * stride + 0.5) / _FINE - 0.5 - cy) / focal_px
                    body, ux, uy, uz = _nearest(rx, ry, touching, found, to_unit, eyes)
                    surface = body
                    if body >= 0:
                        hits[body] += 1
                        if paint:
                            surface = _patch(
                                ux, uy, uz, patch_starts[body], patch_starts[body + 1], patch_centres
                            )
                            shade = ambient + (1.0 - ambient) * _facing(
                                ux, uy, uz, per_axes[body], lights[body]
                            )
                            red += shade * patch_colours[surface, 0]
                            green += shade * patch_colours[surface, 1]
                            blue += shade * patch_colours[surface, 2]
                    if sample == 0:
                        first = surface
                    sample += 1
                    if side == _COARSE and surface != first:
                        red, green, blue = 0.0, 0.0, 0.0
                        for i in range(found):
                            hits[touching[i]] = 0
                        sample, side = 0, _FINE
                share = 1.0 / (side * side)
                covered = 0.0
                for i in range(found):
                    body = touching[i]
                    areas[body] += hits[body] * share
                    covered += hits[body] * share
                    hits[body] = 0
                coverage[y, x] = covered
                if paint:
                    image[y, x, 0] = red * share + (1.0 - covered) * background[y, x, 0]
                    image[y, x, 1] = green * share + (1.0 - covered) * background[y, x, 1]
                    image[y, x, 2] = blue * share + (1.0 - covered) * background[y, x, 2]
    return image, coverage, areas


@kernel
def _reaches(shapes: FloatArray) -> FloatArray:
    """Return half a pixel's diagonal in units of each outline's radius, at most: √(λ_max / 2)."""
    reaches = np.empty(len(shapes))
    for b in range(len(shapes)):
        mean = 0.5 * (shapes[b, 0, 0] + shapes[b, 1, 1])
        gap = 0.5 * (shapes[b, 0, 0] - shapes[b, 1, 1])
        reaches[b] = np.sqrt(0.5 * (mean + np.sqrt(gap * gap + shapes[b, 0, 1] ** 2)))
    return reaches


@kernel
def _bodies_at(
    x: int,
    y: int,
    owner: int,
    centres: FloatArray,
    shapes: FloatArray,
    reaches: FloatArray,
    visible: BoolArray,
    boxes: IntArray,
    touching: IntArray,
) -> tuple[int, int]:
    """Write the bodies that may show in a pixel into `touching`.

    Returns their number and the samples a side that the pixel needs; 0 bodies where the
    pixel lies in the box of a body before `owner`, whose turn has been.
    """
    found = 0
    side = _COARSE
    for b in range(len(centres)):
        if x < boxes[b, 0] or x >= boxes[b, 2] or y < boxes[b, 1] or y >= boxes[b, 3]:
            continue
        if b < owner:
            return 0, side
        if visible[b]:
            dx, dy = x - centres[b, 0], y - centres[b, 1]
            d = shapes[b, 0, 0] * dx * dx + 2.0 * shapes[b, 0, 1] * dx * dy + shapes[b, 1, 1] * dy * dy
            radius = np.sqrt(d)
            if radius > 1.0 + reaches[b]:
                continue
            if radius > 1.0 - reaches[b]:
                side = _FINE
        else:
            side = _FINE
        touching[found] = b
        found += 1
    return found, side


@kernel
def _nearest(
    rx: float, ry: float, touching: IntArray, found: int, to_unit: FloatArray, eyes: FloatArray
) -> tuple[int, float, float, float]:
    """Return the first body that a ray meets, or -1, and the point in the body's coordinates.

    A body that holds the camera is not seen from inside.
    """
    depth, body = np.inf, -1
    ux, uy, uz = 0.0, 0.0, 0.0
    for i in range(found):
        b = touching[i]
        ox, oy, oz = eyes[b, 0], eyes[b, 1], eyes[b, 2]
        vx = to_unit[b, 0, 0] * rx + to_unit[b, 0, 1] * ry + to_unit[b, 0, 2]
        vy = to_unit[b, 1, 0] * rx + to_unit[b, 1, 1] * ry + to_unit[b, 1, 2]
        vz = to_unit[b, 2, 0] * rx + to_unit[b, 2, 1] * ry + to_unit[b, 2, 2]
        # The nearer root t of |o + t v|² = 1; t is the depth along the optical axis.
        vv = vx * vx + vy * vy + vz * vz
        ov = ox * vx + oy * vy + oz * vz
        outside = ox * ox + oy * oy + oz * oz - 1.0
        chord = ov * ov - vv * outside
        if chord < 0.0 or ov >= 0.0 or outside <= 0.0:
            continue
        t = (-ov - np.sqrt(chord)) / vv
        if t < depth:
            depth, body = t, b
            ux, uy, uz = ox + t * vx, oy + t * vy, oz + t * vz
    return body, ux, uy, uz


@kernel
def _patch(ux: float, uy: float, uz: float, start: int, end: int, patch_centres: FloatArray) -> int:
    """Return the patch whose centre is nearest to a point of the unit sphere."""
    best, patch = -np.inf, start
    for p in range(start, end):
        cosine = patch_centres[p, 0] * ux + patch_centres[p, 1] * uy + patch_centres[p, 2] * uz
        if cosine > best:
            best, patch = cosine, p
    return patch


@kernel
def _facing(ux: float, uy: float, uz: float, per_axis: FloatArray, light: FloatArray) -> float:
    """Return max(0, n·l) of the ellipsoid's normal n at a point of the unit sphere (Lambert's law)."""
    nx, ny, nz = per_axis[0] * ux, per_axis[1] * uy, per_axis[2] * uz
    cosine = (nx * light[0] + ny * light[1] + nz * light[2]) / np.sqrt(nx * nx + ny * ny + nz * nz)
    return float(max(cosine, 0.0))
