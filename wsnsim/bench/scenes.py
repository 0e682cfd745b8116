"""The images and particles that the kernels are timed on.

One camera of QVGA and a focal length of 300 px looks at the published target in
front of a photograph. In setup A it fills about 2.1 % of the pixels, in setup B
about 0.57 % (Kushwaha & Koutsoukos 2013, Sec. 6.1); the particles spread as there.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import pi
from types import MappingProxyType

import numpy as np

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.geometry.quadrics import Outlines, ellipsoid_outlines, outline_box
from wsnsim.kernels.histograms import kernel_histogram
from wsnsim.rng import RandomStreams
from wsnsim.types import ByteArray, FloatArray
from wsnsim.vision.features import BinnedRegion, FeatureSpace
from wsnsim.vision.photos import load_background
from wsnsim.vision.renderer import Renderer, look
from wsnsim.world.bodies import Body, PatchTexture
from wsnsim.world.motion import Pose

FEATURES = FeatureSpace()
_RESOLUTION_PX = (320, 240)
_FOCAL_PX = 300.0
_SEMI_AXES_M = (0.40, 0.28, 0.34)
_HEIGHT_M = 1.0
"""Of the camera above the target."""
_LIGHT = np.array([0.3, 0.2, 0.93]) / np.linalg.norm([0.3, 0.2, 0.93])
_AMBIENT = 0.5
_NOISE_SD, _GAIN_JITTER = 5.0, 0.02


@dataclass(frozen=True)
class Setup:
    """How far the target is and how far the particles spread.

    Parameters
    ----------
    distance_m : camera to target, on the floor plan [m]
    particle_sd_m : of the particles about the target, each axis [m]
    photo : background
    """

    distance_m: float
    particle_sd_m: float
    photo: str


SETUPS: Mapping[str, Setup] = MappingProxyType(
    {"A": Setup(4.7, 0.22, "photo/coffee"), "B": Setup(9.2, 0.35, "photo/flower")}
)


@dataclass(frozen=True, eq=False)
class Scene:
    """One frame, ready to be compared with a reference.

    Parameters
    ----------
    image : (h, w, 3) - RGB
    outlines : of the particles
    region : bins of the pixels that hold the outlines
    colour, texture : (c,), (t,) - the target's histograms from this side
    pixel_share : share of the image's pixels that the target's outline holds
    renderer, body, pose : what the image was made with
    """

    image: ByteArray
    outlines: Outlines
    region: BinnedRegion
    colour: FloatArray
    texture: FloatArray
    pixel_share: float
    renderer: Renderer
    body: Body
    pose: Pose

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height of the image [px]."""
        return self.renderer.camera.resolution_px

    def whole_image(self) -> "Scene":
        """Return the scene with the bins of all pixels."""
        width, height = self.size_px
        return replace(self, region=FEATURES.bin_region(self.image, (0, 0, width, height)))


def build_scene(setup: Setup, particles: int, seed: int = 0) -> Scene:
    """Render the frame of a setup and draw particles about the target.

    Parameters
    ----------
    setup : one of `SETUPS`, or another
    particles : number of them
    seed : of the target's texture, the pixel noise and the particles
    """
    streams = RandomStreams(seed)
    body = Body(np.array(_SEMI_AXES_M), PatchTexture.random(streams.stream("bench_texture")))
    pose = Pose(np.zeros(3), np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))
    eye = np.array([0.0, -setup.distance_m, _HEIGHT_M])
    camera = PinholeCamera.look_at(eye, np.zeros(3), _FOCAL_PX, _RESOLUTION_PX)
    photo = load_background(setup.photo, _RESOLUTION_PX)
    renderer = Renderer(camera, "bench", photo, _NOISE_SD, _GAIN_JITTER, _LIGHT, _AMBIENT, streams)
    image = renderer.render(1, (body,), (pose,))
    draws = streams.stream("bench_particles").standard_normal((particles, 3))
    outlines = ellipsoid_outlines(camera, setup.particle_sd_m * draws, pose.orientation, body.semi_axes_m)
    width, height = _RESOLUTION_PX
    own = ellipsoid_outlines(camera, np.zeros((1, 3)), pose.orientation, body.semi_axes_m)
    portrait, _ = look(body, pose.orientation, camera, _LIGHT, _AMBIENT)
    seen = FEATURES.bin_region(portrait, outline_box(own, width, height))
    colour, texture = kernel_histogram(
        seen.colour,
        seen.texture,
        seen.x0,
        seen.y0,
        own.centres[0],
        own.shapes[0],
        FEATURES.colour_bins,
        FEATURES.texture_bins,
    )
    return Scene(
        image,
        outlines,
        FEATURES.bin_region(image, outline_box(outlines, width, height)),
        colour,
        texture,
        pi / float(np.sqrt(np.linalg.det(own.shapes[0]))) / (width * height),
        renderer,
        body,
        pose,
    )
