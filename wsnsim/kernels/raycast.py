"""Ray casting of patch-textured solids over a background.

A ray goes through the point (rx, ry, 1) of the camera's axes. Bodies that move are cast
in each frame, in their own boxes of pixels; what stands still was cast once before and
is met again only where a body is in front of it or behind it.
"""

import numpy as np
from numpy.typing import NDArray

from wsnsim.kernels.jit import kernel
from wsnsim.kernels.lens import undistorted_radius
from wsnsim.kernels.solids import enter, facing, patch_at
from wsnsim.types import BoolArray, ByteArray, FloatArray, IntArray

_FINE = 4
"""Samples a side where an outline or a patch border crosses the pixel."""
_COARSE = 2
"""Samples a side where they show one surface: the corners of the fine samples."""
_FACES = 34
"""Faces of a body at most: those of a prism of 32 sides."""

NOTHING = -1
"""Owner of a pixel that shows no body."""
MIXED = -2
"""Owner of a pixel that shows more than one surface."""

Owners = NDArray[np.int16]


@kernel
def cast_bodies(
    background: ByteArray,
    standing: NDArray[np.float32],
    standing_owners: Owners,
    moving: int,
    focal_px: float,
    lens: FloatArray,
    forms: IntArray,
    to_unit: FloatArray,
    eyes: FloatArray,
    per_axes: FloatArray,
    lights: FloatArray,
    ambient: float,
    outlined: BoolArray,
    centres: FloatArray,
    shapes: FloatArray,
    cut: BoolArray,
    boxes: IntArray,
    plane_starts: IntArray,
    planes: FloatArray,
    patch_starts: IntArray,
    patch_centres: FloatArray,
    patch_colours: FloatArray,
    paint: bool,
) -> tuple[NDArray[np.float32], NDArray[np.float32], FloatArray, Owners]:
    """Cast rays from one camera at m bodies; the nearest surface hides what is behind it.

    Parameters
    ----------
    background : (h, w, 3) - RGB where no body is
    standing : (h, w, 3) - RGB of the background with the bodies that stand still
    standing_owners : (h, w) - which of them fills a pixel alone, by its number among them, or
        `NOTHING` or `MIXED`; (0, 0) where none stands
    moving : the first bodies, which move; the others stand still
    focal_px : focal length; the principal point is the middle of the image [px]
    lens : (3,) - distortion k1, k2 and the radius up to which it grows
    forms : (m,) - codes of `kernels.solids`
    to_unit : (m, 3, 3) - camera axes [m] to body coordinates
    eyes : (m, 3) - the camera in body coordinates
    per_axes : (m, 3) - 1 / semi-axes [1/m]
    lights : (m, 3) - unit vector towards the light, in body axes
    ambient : share of the light that comes from everywhere
    outlined : (m,) - True where `centres` and `shapes` hold the body's outline to the last digit
    centres, shapes : (m, 2), (m, 2, 2) - outlines in the image [px], [1/px²]
    cut : (m,) - True where the camera plane cuts the body, so that its outline may be no closed curve
    boxes : (m, 4) - x0, y0, x1, y1, pixels that the body can touch; empty where it cannot be seen
    plane_starts : (m + 1,) - sides of body b are planes plane_starts[b] to plane_starts[b + 1] - 1
    planes : (e, 3) - sides of prisms in body coordinates, inside where nx x + ny y ≤ c
    patch_starts : (m + 1,) - patches of body b are patch_starts[b] to patch_starts[b + 1] - 1
    patch_centres : (p, 3) - unit vectors
    patch_colours : (p, 3) - RGB [0–255]
    paint : False leaves the colours out, for areas only

    Returns
    -------
    image : (h, w, 3) - RGB; (0, 0, 3) without `paint`
    coverage : (h, w) - share of each pixel that shows a moving body
    areas : (m,) - of each moving body as the image shows it [px]; 0 for the others
    owners : (h, w) - the moving body that fills a pixel with one surface, `NOTHING` or `MIXED`
    """
    height, width, _ = background.shape
    image = standing.copy() if paint else np.empty((0, 0, 3), np.float32)
    coverage = np.zeros((height, width), np.float32)
    owners = np.full((height, width), np.int16(NOTHING), np.int16)
    count = len(eyes)
    areas, hits = np.zeros(count), np.zeros(count, np.int64)
    touching = np.empty(count, np.int64)
    reaches = _reaches(shapes)
    furnished = standing_owners.size > 0
    k1, k2, turning = lens[0], lens[1], lens[2]
    for mover in range(moving):
        for y in range(boxes[mover, 1], boxes[mover, 3]):
            for x in range(boxes[mover, 0], boxes[mover, 2]):
                found, side = 0, _COARSE
                for b in range(moving):
                    if x < boxes[b, 0] or x >= boxes[b, 2] or y < boxes[b, 1] or y >= boxes[b, 3]:
                        continue
                    if b < mover:  # whose turn has been, with this pixel
                        found = 0
                        break
                    if outlined[b]:
                        dx, dy = x - centres[b, 0], y - centres[b, 1]
                        radius = np.sqrt(
                            shapes[b, 0, 0] * dx * dx
                            + 2.0 * shapes[b, 0, 1] * dx * dy
                            + shapes[b, 1, 1] * dy * dy
                        )
                        if radius > 1.0 + reaches[b]:
                            continue
                        if radius > 1.0 - reaches[b]:
                            side = _FINE
                    elif cut[b] or not _holds_pixel(
                        x,
                        y,
                        width,
                        height,
                        focal_px,
                        k1,
                        k2,
                        turning,
                        b,
                        forms,
                        to_unit,
                        eyes,
                        plane_starts,
                        planes,
                    ):
                        side = _FINE
                    touching[found] = b
                    found += 1
                if found == 0:
                    continue
                if furnished:
                    owner = standing_owners[y, x]
                    if owner >= 0:
                        touching[found] = moving + owner
                        found += 1
                    elif owner == MIXED:
                        side = _FINE
                        for b in range(moving, count):
                            if boxes[b, 0] <= x < boxes[b, 2] and boxes[b, 1] <= y < boxes[b, 3]:
                                touching[found] = b
                                found += 1
                red, green, blue = 0.0, 0.0, 0.0
                sample, first, one_surface = 0, -1, True
                while sample < side * side:
                    stride = (_FINE - 1) // (side - 1)
                    column, row = sample % side * stride, sample // side * stride
                    rx, ry = _ray(x, y, column, row, width, height, focal_px, k1, k2, turning)
                    body, face, ux, uy, uz = _nearest(
                        rx, ry, touching, found, forms, to_unit, eyes, plane_starts, planes
                    )
                    surface = -1
                    if body >= 0:
                        hits[body] += 1
                        surface = body * _FACES
                        if paint:
                            patch = patch_at(
                                ux, uy, uz, patch_starts[body], patch_starts[body + 1], patch_centres
                            )
                            surface = patch * _FACES + face
                            shade = ambient + (1.0 - ambient) * facing(
                                forms[body],
                                face,
                                ux,
                                uy,
                                uz,
                                per_axes[body],
                                lights[body],
                                planes,
                                plane_starts[body],
                                plane_starts[body + 1],
                            )
                            red += shade * patch_colours[patch, 0]
                            green += shade * patch_colours[patch, 1]
                            blue += shade * patch_colours[patch, 2]
                    if sample == 0:
                        first = surface
                    sample += 1
                    if surface != first:
                        one_surface = False
                        if side == _COARSE:
                            red, green, blue = 0.0, 0.0, 0.0
                            for i in range(found):
                                hits[touching[i]] = 0
                            sample, side = 0, _FINE
                share = 1.0 / (side * side)
                covered, solid = 0.0, 0.0
                for i in range(found):
                    body = touching[i]
                    solid += hits[body] * share
                    if body < moving:
                        areas[body] += hits[body] * share
                        covered += hits[body] * share
                        if hits[body] > 0:
                            owners[y, x] = body if one_surface else MIXED
                    hits[body] = 0
                coverage[y, x] = covered
                if paint and covered > 0.0:
                    image[y, x, 0] = red * share + (1.0 - solid) * background[y, x, 0]
                    image[y, x, 1] = green * share + (1.0 - solid) * background[y, x, 1]
                    image[y, x, 2] = blue * share + (1.0 - solid) * background[y, x, 2]
    return image, coverage, areas, owners


@kernel
def _holds_pixel(
    x: int,
    y: int,
    width: int,
    height: int,
    focal_px: float,
    k1: float,
    k2: float,
    turning: float,
    b: int,
    forms: IntArray,
    to_unit: FloatArray,
    eyes: FloatArray,
    plane_starts: IntArray,
    planes: FloatArray,
) -> bool:
    """Tell whether all samples of a pixel meet body b, seen alone.

    A convex body's outline is convex: if it holds the corners, it holds what lies between them.
    """
    for corner in range(4):
        column, row = corner % 2 * (_FINE - 1), corner // 2 * (_FINE - 1)
        rx, ry = _ray(x, y, column, row, width, height, focal_px, k1, k2, turning)
        vx = to_unit[b, 0, 0] * rx + to_unit[b, 0, 1] * ry + to_unit[b, 0, 2]
        vy = to_unit[b, 1, 0] * rx + to_unit[b, 1, 1] * ry + to_unit[b, 1, 2]
        vz = to_unit[b, 2, 0] * rx + to_unit[b, 2, 1] * ry + to_unit[b, 2, 2]
        t, _ = enter(
            forms[b],
            eyes[b, 0],
            eyes[b, 1],
            eyes[b, 2],
            vx,
            vy,
            vz,
            planes,
            plane_starts[b],
            plane_starts[b + 1],
        )
        if not t < np.inf:
            return False
    return True


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
def _ray(
    x: int,
    y: int,
    column: int,
    row: int,
    width: int,
    height: int,
    focal_px: float,
    k1: float,
    k2: float,
    turning: float,
) -> tuple[float, float]:
    """Return the ray that the lens sends to a sample of a pixel."""
    rx = (x + (column + 0.5) / _FINE - 0.5 - 0.5 * (width - 1)) / focal_px
    ry = (y + (row + 0.5) / _FINE - 0.5 - 0.5 * (height - 1)) / focal_px
    if k1 != 0.0 or k2 != 0.0:
        distorted = np.sqrt(rx * rx + ry * ry)
        if distorted > 0.0:
            scale = undistorted_radius(distorted, k1, k2, turning) / distorted
            rx, ry = scale * rx, scale * ry
    return rx, ry


@kernel
def _nearest(
    rx: float,
    ry: float,
    touching: IntArray,
    found: int,
    forms: IntArray,
    to_unit: FloatArray,
    eyes: FloatArray,
    plane_starts: IntArray,
    planes: FloatArray,
) -> tuple[int, int, float, float, float]:
    """Return the first body that a ray meets, or -1, its face, and the point in the body's coordinates."""
    depth, body, side = np.inf, -1, 0
    ux, uy, uz = 0.0, 0.0, 0.0
    for i in range(found):
        b = touching[i]
        ox, oy, oz = eyes[b, 0], eyes[b, 1], eyes[b, 2]
        vx = to_unit[b, 0, 0] * rx + to_unit[b, 0, 1] * ry + to_unit[b, 0, 2]
        vy = to_unit[b, 1, 0] * rx + to_unit[b, 1, 1] * ry + to_unit[b, 1, 2]
        vz = to_unit[b, 2, 0] * rx + to_unit[b, 2, 1] * ry + to_unit[b, 2, 2]
        # t is the depth along the optical axis
        t, face = enter(forms[b], ox, oy, oz, vx, vy, vz, planes, plane_starts[b], plane_starts[b + 1])
        if t < depth:
            depth, body, side = t, b, face
            ux, uy, uz = ox + t * vx, oy + t * vy, oz + t * vz
    return body, side, ux, uy, uz
