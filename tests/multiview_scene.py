"""A target, four cameras round it and what they see: what the multi-view trackers' tests look at."""

from functools import cache

import numpy as np

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.messages.base import Payload, decode_any
from wsnsim.rng import RandomStreams
from wsnsim.systems.base import Belief, Context, Program, Received, Site, Step, TrackedTarget
from wsnsim.systems.multiview.params import MultiviewParams
from wsnsim.systems.multiview.reference_model import ReferenceModel, learn
from wsnsim.systems.multiview.system import SYSTEM
from wsnsim.vision.features import FeatureSpace
from wsnsim.vision.frame import Frame
from wsnsim.vision.photos import load_background
from wsnsim.vision.portrait import Studio
from wsnsim.vision.renderer import Renderer
from wsnsim.world.bodies import Body, PatchTexture
from wsnsim.world.motion import Pose

RATE_HZ = 4.0
UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])
CENTRE = np.array([3.5, 3.5, 1.1])
LIGHT = np.array([0.0, 0.0, 1.0])
SIZE = (320, 240)
GREY = np.full((240, 320, 3), 128, np.uint8)


def camera(*position: float, towards: np.ndarray = CENTRE) -> PinholeCamera:
    """Return a camera of the published setups, QVGA with f = 300 px."""
    return PinholeCamera.look_at(position, towards, 300.0, SIZE)


CAMERAS = {
    "c1": camera(0.3, 0.6, 2.4),
    "c2": camera(6.7, 0.6, 2.4),
    "c3": camera(6.7, 6.4, 2.4),
    "c4": camera(0.3, 6.4, 2.4),
}
PAIR = {name: CAMERAS[name] for name in ("c1", "c2")}
AWAY = camera(0.3, 0.6, 2.4, towards=np.array([-5.0, -5.0, 1.0]))
PHOTOS = {"c1": "photo/coffee", "c2": "photo/flower", "c3": "photo/china", "c4": "photo/gravel"}


class Scene:
    """One target of random texture, and the images that cameras take of it.

    Parameters
    ----------
    seed : of texture and noise
    """

    def __init__(self, seed: int) -> None:
        self.streams = RandomStreams(seed)
        texture = PatchTexture.random(self.streams.stream("texture"), 18, 9)
        self.body = Body(np.array([0.40, 0.28, 0.34]), texture)
        studio = Studio(self.body, UPRIGHT, LIGHT, 0.6, 300.0, SIZE, 4.0, 5.0, self.streams, "box")
        start = Belief(CENTRE, np.zeros(3), UPRIGHT)
        self.target = TrackedTarget("box", self.body.semi_axes_m, start, studio.portrait)

    @cache  # noqa: B019 - a scene lives as long as its test
    def models(self, colour_space: str = "hsv") -> tuple[ReferenceModel, ...]:
        """Return what the cameras know of the target."""
        return (learn(self.target, FeatureSpace(colour_space)),)  # type: ignore[arg-type]

    def site(self, cameras: dict[str, PinholeCamera] | None = None, steps: int = 3) -> Site:
        """Return the deployment; the pair of cameras where no others are named."""
        return Site(cameras or PAIR, (self.target,), RATE_HZ, steps, self.streams)

    def image(
        self,
        node: str,
        step: int = 1,
        place: np.ndarray | None = CENTRE,
        orientation: np.ndarray = UPRIGHT,
        photo: bool = False,
    ) -> np.ndarray:
        """Return what a camera sees, the target at `place` or nowhere, before grey or a photograph."""
        background = load_background(PHOTOS[node], SIZE) if photo else GREY
        renderer = Renderer(CAMERAS[node], node, background, 5.0, 0.02, LIGHT, 0.6, self.streams)
        if place is None:
            return renderer.render(step, [], [])
        return renderer.render(step, [self.body], [Pose(place, np.zeros(3), orientation)])

    def frame(self, node: str, step: int, place: np.ndarray | None = CENTRE, photo: bool = False) -> Frame:
        """Return the frame of a step."""
        return Frame(step, step / RATE_HZ, node, lambda: self.image(node, step, place, photo=photo))


def params(**changes: object) -> MultiviewParams:
    """Return parameters with 200 particles."""
    return MultiviewParams.model_validate({"kind": "multiview", "particles": 200, **changes})


def at(now: float) -> Context:
    """Return what a node on mains knows at a time."""
    return Context("n", now, np.inf)


def give(program: Program, source: str, payload: Payload, now: float) -> Step:
    """Hand a program a message as it arrives: encoded and decoded."""
    return program.on_payload(at(now), Received(source, decode_any(payload.encode(), SYSTEM.payloads)))
