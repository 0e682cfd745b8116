"""From bodies and poses to the arrays of the ray caster, and one call of it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.geometry.extents import box_of_points, box_of_rays, whole_image
from wsnsim.geometry.lens import NONE, turning_radius
from wsnsim.geometry.quadrics import Box, ellipsoid_outlines, outline_boxes
from wsnsim.geometry.rotations import quaternion_to_matrix
from wsnsim.kernels.jit import frozen
from wsnsim.kernels.raycast import Owners, cast_bodies
from wsnsim.kernels.solids import BALL, CUBE, CYLINDER, PRISM
from wsnsim.types import BoolArray, ByteArray, FloatArray, IntArray
from wsnsim.world.bodies import Body
from wsnsim.world.motion import Pose

_FORMS = {"ellipsoid": BALL, "box": CUBE, "cylinder": CYLINDER, "prism": PRISM}
_CORNERS = np.stack(np.meshgrid(*[(-1.0, 1.0)] * 3), axis=-1).reshape(-1, 3)

FloatImage = NDArray[np.float32]

NO_IMAGE: FloatImage = frozen(np.empty((0, 0, 3)), np.float32)
NO_OWNERS: Owners = frozen(np.empty((0, 0)), np.int16)


@dataclass(frozen=True, eq=False)
class Cast:
    """Bodies as `cast_bodies` takes them, seen from one camera; fields as there."""

    forms: IntArray
    to_unit: FloatArray
    eyes: FloatArray
    per_axes: FloatArray
    lights: FloatArray
    outlined: BoolArray
    centres: FloatArray
    shapes: FloatArray
    cut: BoolArray
    boxes: IntArray
    sides: IntArray
    """(m,) - number of planes of each body"""
    planes: FloatArray
    patches: IntArray
    """(m,) - number of patches of each body"""
    patch_centres: FloatArray
    patch_colours: FloatArray

    def __len__(self) -> int:
        """Return the number of bodies."""
        return len(self.forms)

    def __add__(self, other: "Cast") -> "Cast":
        """Return the bodies of both."""
        if not len(other):
            return self
        pairs = zip(vars(self).values(), vars(other).values(), strict=True)
        return Cast(*(np.concatenate(pair) for pair in pairs))


@dataclass(frozen=True, eq=False)
class Standing:
    """What never moves, cast once.

    Parameters
    ----------
    cast : the bodies
    colour : (h, w, 3) - RGB times coverage
    coverage : (h, w) - share of each pixel that shows one of them
    owners : (h, w) - as `cast_bodies` returns them; (0, 0) where nothing stands
    """

    cast: Cast
    colour: FloatImage
    coverage: FloatImage
    owners: Owners

    def before(self, background: ByteArray) -> FloatImage:
        """Return the bodies in front of a background (h, w, 3)."""
        if not self.owners.size:
            return background.astype(np.float32)
        return self.colour + (1.0 - self.coverage)[:, :, None] * background


def prepare(camera: PinholeCamera, bodies: Sequence[Body], poses: Sequence[Pose], light: FloatArray) -> Cast:
    """Turn bodies and poses into arrays.

    Parameters
    ----------
    camera : that looks
    bodies, poses : one pose for each body
    light : (3,) - unit vector towards the light
    """
    rotations = [quaternion_to_matrix(pose.orientation) for pose in poses]
    per_axes = [1.0 / body.semi_axes_m for body in bodies]
    turns = [per_axis[:, None] * rotation.T for per_axis, rotation in zip(per_axes, rotations, strict=True)]
    eyes = [turn @ (camera.position - pose.position) for turn, pose in zip(turns, poses, strict=True)]
    views = [_view(camera, *parts) for parts in zip(bodies, poses, rotations, eyes, strict=True)]
    return Cast(
        forms=np.array([_FORMS[body.form] for body in bodies], dtype=np.int64),
        to_unit=_stacked([turn @ camera.rotation.T for turn in turns], 3, 3),
        eyes=_stacked(eyes, 3),
        per_axes=_stacked(per_axes, 3),
        lights=_stacked([rotation.T @ light for rotation in rotations], 3),
        outlined=np.array([view.outlined for view in views], dtype=np.bool_),
        centres=_stacked([view.centre for view in views], 2),
        shapes=_stacked([view.shape for view in views], 2, 2),
        cut=np.array([view.cut for view in views], dtype=np.bool_),
        boxes=np.array([view.box for view in views], dtype=np.int64).reshape(-1, 4),
        sides=np.array([len(body.side_planes) for body in bodies], dtype=np.int64),
        planes=np.concatenate([np.empty((0, 3)), *(body.side_planes for body in bodies)]),
        patches=np.array([len(body.texture.centres) for body in bodies], dtype=np.int64),
        patch_centres=np.concatenate([np.empty((0, 3)), *(body.texture.centres for body in bodies)]),
        patch_colours=np.concatenate([np.empty((0, 3)), *(body.texture.colours for body in bodies)]),
    )


def _stacked(parts: Sequence[FloatArray], *shape: int) -> FloatArray:
    """Return (m, ...) of m arrays of one shape, also of none."""
    return np.array(parts, dtype=np.float64).reshape(-1, *shape)


class _View(NamedTuple):
    """Where a body may show: fields as in `Cast`."""

    box: Box = Box(0, 0, 0, 0)
    cut: bool = False
    outlined: bool = False
    centre: FloatArray = np.zeros(2)
    shape: FloatArray = np.zeros((2, 2))


def _view(camera: PinholeCamera, body: Body, pose: Pose, rotation: FloatArray, eye: FloatArray) -> _View:
    """Find the pixels that a body can touch; none where it holds the camera, `eye` in its coordinates."""
    if _holds(body, eye):
        return _View()
    if body.form == "ellipsoid":
        return _view_of_ellipsoid(camera, body, pose, rotation)
    units = _CORNERS
    if body.form == "prism":
        flat = body.corners_m / body.semi_axes_m[:2]
        units = np.vstack([np.column_stack([flat, np.full(len(flat), z)]) for z in (-1.0, 1.0)])
    return _View(box_of_points(camera, pose.position + (body.semi_axes_m * units) @ rotation.T))


def _holds(body: Body, eye: FloatArray) -> bool:
    if body.form == "ellipsoid":
        return bool(eye @ eye <= 1.0)
    if body.form == "box":
        return bool(abs(eye).max() <= 1.0)
    if body.form == "prism":
        beyond = body.side_planes[:, :2] @ eye[:2] - body.side_planes[:, 2]
        return bool(beyond.max() <= 0.0 and abs(eye[2]) <= 1.0)
    return bool(eye[:2] @ eye[:2] <= 1.0 and abs(eye[2]) <= 1.0)


def _view_of_ellipsoid(camera: PinholeCamera, body: Body, pose: Pose, rotation: FloatArray) -> _View:
    straight = camera if camera.distortion == NONE else replace(camera, distortion=NONE)
    outline = ellipsoid_outlines(straight, pose.position[None], pose.orientation, body.semi_axes_m)
    centre, shape = outline.centres[0], outline.shapes[0]
    if not outline.visible[0]:
        nearest = camera.rotation[2] @ (pose.position - camera.position)
        half_depth = np.linalg.norm(body.semi_axes_m * (rotation.T @ camera.rotation[2]))
        # cut by the camera plane it may be anywhere
        return _View(whole_image(camera), cut=True) if nearest + half_depth > 0.0 else _View()
    if camera.distortion == NONE:
        x0, y0, x1, y1 = outline_boxes(outline, *camera.resolution_px, margin_px=0.5)[0].tolist()
        return _View(Box(x0, y0, x1, y1), False, True, centre, shape)
    half = np.sqrt(np.diag(np.linalg.inv(shape))) / camera.focal_px
    middle = (centre - np.array(camera.principal_point)) / camera.focal_px
    return _View(box_of_rays(camera, middle - half, middle + half))


def shoot(
    camera: PinholeCamera,
    background: ByteArray,
    stage: FloatImage,
    moving: Cast,
    standing: Cast | None,
    owners: Owners,
    ambient: float,
    *,
    paint: bool = True,
) -> tuple[FloatImage, FloatImage, FloatArray, Owners]:
    """Cast bodies over a background.

    Parameters
    ----------
    camera : that looks
    background : (h, w, 3) - RGB where no body is
    stage : (h, w, 3) - the background with what stands still; any where `paint` is False
    moving : bodies to cast
    standing : bodies that `stage` shows, if any, and may hide others
    owners : (h, w) - which of those fills each pixel, see `cast_bodies`
    ambient : share of the light that comes from everywhere
    paint : False leaves the colours out

    Returns
    -------
    image, coverage, areas (n,) of the moving bodies, owners: as `cast_bodies` has them
    """
    count = len(moving)
    k1, k2 = camera.distortion
    cast = moving if standing is None else moving + standing
    image, coverage, areas, found = cast_bodies(
        frozen(background, np.uint8),
        frozen(stage, np.float32),
        frozen(owners, np.int16),
        count,
        float(camera.focal_px),
        np.array([k1, k2, turning_radius(camera.distortion)]),
        cast.forms,
        cast.to_unit,
        cast.eyes,
        cast.per_axes,
        cast.lights,
        float(ambient),
        cast.outlined,
        cast.centres,
        cast.shapes,
        cast.cut,
        cast.boxes,
        np.concatenate(([0], np.cumsum(cast.sides, dtype=np.int64))),
        cast.planes,
        np.concatenate(([0], np.cumsum(cast.patches, dtype=np.int64))),
        cast.patch_centres,
        cast.patch_colours,
        paint,
    )
    return image, coverage, areas[:count], found


def set_up(
    camera: PinholeCamera,
    bodies: Sequence[Body],
    poses: Sequence[Pose],
    light: FloatArray,
    ambient: float,
) -> Standing:
    """Cast what stands still, once, over black."""
    cast = prepare(camera, bodies, poses, light)
    if not bodies:
        return Standing(cast, NO_IMAGE, frozen(np.empty((0, 0)), np.float32), NO_OWNERS)
    width, height = camera.resolution_px
    black = np.zeros((height, width, 3), dtype=np.uint8)
    colour, coverage, _, owners = shoot(
        camera, black, black.astype(np.float32), cast, None, NO_OWNERS, ambient
    )
    return Standing(cast, colour, coverage, owners)
