"""What a camera sees: textured ellipsoids in front of a photograph, with the sensor's faults.

Models mutual occlusion, anti-aliased edges, Lambert shading under one distant light,
a gain that varies from frame to frame, and pixel noise. Leaves out shadows, motion
blur, lens distortion, vignetting, demosaicing and compression. The background is a
picture, not a place: it hides nothing and does not move.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.geometry.quadrics import ellipsoid_outlines, outline_boxes
from wsnsim.geometry.rotations import quaternion_to_matrix
from wsnsim.kernels.exposure import expose
from wsnsim.kernels.jit import frozen
from wsnsim.kernels.raycast import cast_bodies
from wsnsim.rng import RandomStreams
from wsnsim.types import ByteArray, FloatArray, NodeId
from wsnsim.world.bodies import Body
from wsnsim.world.motion import Pose

NEUTRAL_GREY = (128.0, 128.0, 128.0)
"""Background of a reference picture."""

_NO_NOISE = frozen(np.empty((0, 0, 0)), np.float32)


@dataclass(frozen=True, eq=False)
class Renderer:
    """Renders the images of one camera; an image depends on seed, camera, step and world only.

    Parameters
    ----------
    camera : that looks
    camera_id : name of its random stream
    background : (h, w, 3) - photograph in the camera's resolution
    noise_sd : standard deviation of the pixel noise, the same in all channels [grey levels]
    gain_jitter : standard deviation of a frame's gain, about 1
    light : (3,) - unit vector towards the light
    ambient : share of the light that comes from everywhere [0–1]
    streams : the run's randomness

    Raises
    ------
    ValueError : the background has not the camera's resolution
    """

    camera: PinholeCamera
    camera_id: NodeId
    background: ByteArray
    noise_sd: float
    gain_jitter: float
    light: FloatArray
    ambient: float
    streams: RandomStreams

    def __post_init__(self) -> None:
        width, height = self.camera.resolution_px
        if self.background.shape != (height, width, 3):
            found = self.background.shape
            raise ValueError(f"background: must have the camera's shape {(height, width, 3)}, got {found}")

    def render(self, step: int, bodies: Sequence[Body], poses: Sequence[Pose]) -> ByteArray:
        """Return the (h, w, 3) RGB image of tracking step `step`, with a body at each pose."""
        clean, _, _ = _cast(self.camera, self.background, bodies, poses, self.light, self.ambient)
        generator = self.streams.stream("image", self.camera_id, step)
        gain = 1.0 + self.gain_jitter * generator.standard_normal()
        noise = _NO_NOISE
        if self.noise_sd > 0.0:
            noise = frozen(generator.standard_normal(clean.shape, dtype=np.float32), np.float32)
        return expose(clean, gain, noise, self.noise_sd)

    def visible_pixels(self, bodies: Sequence[Body], poses: Sequence[Pose]) -> FloatArray:
        """Return the area of each body (n,) as the image shows it, less what others hide [px]."""
        _, _, areas = _cast(
            self.camera, self.background, bodies, poses, self.light, self.ambient, paint=False
        )
        return areas


def look(
    body: Body,
    orientation: FloatArray,
    camera: PinholeCamera,
    light: FloatArray,
    ambient: float,
    background_rgb: tuple[float, float, float] = NEUTRAL_GREY,
) -> tuple[ByteArray, NDArray[np.float32]]:
    """Take a picture without noise of one body at the world's origin, alone, from which to learn it.

    Parameters
    ----------
    body : at the origin
    orientation : (4,) - unit quaternion of the body (w, x, y, z)
    camera : that looks
    light : (3,) - unit vector towards the light
    ambient : share of the light that comes from everywhere [0–1]
    background_rgb : colour where the body is not [0–255]

    Returns
    -------
    image : (h, w, 3) - RGB
    coverage : (h, w) - share of each pixel that shows the body [0–1]
    """
    width, height = camera.resolution_px
    background = np.full((height, width, 3), background_rgb, dtype=np.uint8)
    pose = Pose(np.zeros(3), np.zeros(3), orientation)
    clean, coverage, _ = _cast(camera, background, (body,), (pose,), light, ambient)
    return expose(clean, 1.0, _NO_NOISE, 0.0), coverage


def _cast(
    camera: PinholeCamera,
    background: ByteArray,
    bodies: Sequence[Body],
    poses: Sequence[Pose],
    light: FloatArray,
    ambient: float,
    *,
    paint: bool = True,
) -> tuple[NDArray[np.float32], NDArray[np.float32], FloatArray]:
    """Turn bodies and poses into the arrays of `cast_bodies` and run it."""
    count = len(bodies)
    width, height = camera.resolution_px
    to_unit, eyes = np.empty((count, 3, 3)), np.empty((count, 3))
    per_axes, lights = np.empty((count, 3)), np.empty((count, 3))
    centres, shapes = np.zeros((count, 2)), np.zeros((count, 2, 2))
    visible, boxes = np.zeros(count, dtype=np.bool_), np.zeros((count, 4), dtype=np.int64)
    for i, (body, pose) in enumerate(zip(bodies, poses, strict=True)):
        rotation = quaternion_to_matrix(pose.orientation)
        per_axes[i] = 1.0 / body.semi_axes_m
        world_to_unit = per_axes[i][:, None] * rotation.T
        to_unit[i] = world_to_unit @ camera.rotation.T
        eyes[i] = world_to_unit @ (camera.position - pose.position)
        lights[i] = rotation.T @ light
        outline = ellipsoid_outlines(camera, pose.position[None], pose.orientation, body.semi_axes_m)
        centres[i], shapes[i], visible[i] = outline.centres[0], outline.shapes[0], outline.visible[0]
        if visible[i]:
            boxes[i] = outline_boxes(outline, width, height, margin_px=0.5)[0]
        else:
            nearest = camera.rotation[2] @ (pose.position - camera.position)
            half_depth = np.linalg.norm(body.semi_axes_m * (rotation.T @ camera.rotation[2]))
            if nearest + half_depth > 0.0:  # cut by the camera plane: it may be anywhere
                boxes[i] = 0, 0, width, height
    patches = [len(body.texture.centres) for body in bodies]
    return cast_bodies(
        frozen(background, np.uint8),
        camera.focal_px,
        to_unit,
        eyes,
        per_axes,
        lights,
        float(ambient),
        centres,
        shapes,
        visible,
        boxes,
        np.concatenate(([0], np.cumsum(patches, dtype=np.int64))),
        np.concatenate([body.texture.centres for body in bodies] or [np.empty((0, 3))]),
        np.concatenate([body.texture.colours for body in bodies] or [np.empty((0, 3))]),
        paint,
    )
