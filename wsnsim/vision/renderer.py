"""What a camera sees: textured bodies before a background, with the sensor's faults.

Models mutual occlusion, anti-aliased edges, Lambert shading under one distant light,
the lens's distortion, a gain that varies from frame to frame, light that changes
slowly, and pixel noise. Leaves out shadows, motion blur, vignetting, demosaicing and
compression. The background is a picture or a film, not a place: it hides nothing. What
stands in the world and never moves is cast once for each camera.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.kernels.exposure import expose
from wsnsim.kernels.jit import frozen
from wsnsim.rng import RandomStreams
from wsnsim.types import ByteArray, FloatArray, NodeId
from wsnsim.vision.casting import NO_IMAGE, NO_OWNERS, FloatImage, Standing, prepare, set_up, shoot
from wsnsim.world.bodies import Body
from wsnsim.world.motion import Pose
from wsnsim.world.world import Placed

Background: TypeAlias = ByteArray | Callable[[int], ByteArray]
"""A picture (h, w, 3), or what gives the one of each step."""

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
    background : picture in the camera's resolution, or what gives that of a step
    noise_sd : standard deviation of the pixel noise, the same in all channels [grey levels]
    gain_jitter : standard deviation of a frame's gain, about 1
    light : (3,) - unit vector towards the light
    ambient : share of the light that comes from everywhere [0–1]
    streams : the run's randomness
    scenery : what stands in the world and never moves
    drift : brightness at each step, a factor on the whole image; None: 1

    Raises
    ------
    ValueError : the background has not the camera's resolution
    """

    camera: PinholeCamera
    camera_id: NodeId
    background: Background
    noise_sd: float
    gain_jitter: float
    light: FloatArray
    ambient: float
    streams: RandomStreams
    scenery: Sequence[Placed] = ()
    drift: Callable[[int], float] | None = None

    def __post_init__(self) -> None:
        if not callable(self.background):
            self._fitting(self.background)

    def render(self, step: int, bodies: Sequence[Body], poses: Sequence[Pose]) -> ByteArray:
        """Return the (h, w, 3) RGB image of tracking step `step`, with a body at each pose."""
        moving = prepare(self.camera, bodies, poses, self.light)
        standing = self._standing
        if callable(self.background):
            background = self._fitting(self.background(step))
            stage = standing.before(background)
        else:
            background, stage = self.background, self._stage
        clean, _, _, _ = shoot(
            self.camera, background, stage, moving, standing.cast, standing.owners, self.ambient
        )
        generator = self.streams.stream("image", self.camera_id, step)
        gain = 1.0 + self.gain_jitter * generator.standard_normal()
        if self.drift is not None:
            gain *= self.drift(step)
        noise = _NO_NOISE
        if self.noise_sd > 0.0:
            noise = frozen(generator.standard_normal(clean.shape, dtype=np.float32), np.float32)
        return expose(clean, gain, noise, self.noise_sd)

    def visible_pixels(self, bodies: Sequence[Body], poses: Sequence[Pose]) -> FloatArray:
        """Return the area of each body (n,) as the image shows it, less what others hide [px]."""
        moving, standing = prepare(self.camera, bodies, poses, self.light), self._standing
        _, _, areas, _ = shoot(
            self.camera,
            self._picture,
            NO_IMAGE,
            moving,
            standing.cast,
            standing.owners,
            self.ambient,
            paint=False,
        )
        return areas

    def _fitting(self, background: ByteArray) -> ByteArray:
        width, height = self.camera.resolution_px
        if background.shape != (height, width, 3):
            found = background.shape
            raise ValueError(f"background: must have the camera's shape {(height, width, 3)}, got {found}")
        return background

    @cached_property
    def _standing(self) -> Standing:
        """What never moves, cast when it is first needed."""
        bodies, poses = [each.body for each in self.scenery], [each.pose for each in self.scenery]
        return set_up(self.camera, bodies, poses, self.light, self.ambient)

    @cached_property
    def _stage(self) -> FloatImage:
        """(h, w, 3) - what never moves, in front of a background that never changes."""
        return self._standing.before(self._picture)

    @cached_property
    def _picture(self) -> ByteArray:
        """(h, w, 3) - the background where it never changes; black where it does, for its size."""
        if not callable(self.background):
            return self.background
        width, height = self.camera.resolution_px
        return np.zeros((height, width, 3), dtype=np.uint8)


def look(
    body: Body,
    orientation: FloatArray,
    camera: PinholeCamera,
    light: FloatArray,
    ambient: float,
    background_rgb: tuple[float, float, float] = NEUTRAL_GREY,
) -> tuple[ByteArray, FloatImage]:
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
    cast, stage = prepare(camera, (body,), (pose,), light), background.astype(np.float32)
    clean, coverage, _, _ = shoot(camera, background, stage, cast, None, NO_OWNERS, ambient)
    return expose(clean, 1.0, _NO_NOISE, 0.0), coverage
