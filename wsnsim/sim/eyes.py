"""The cameras of a run: what is behind the scene, what their sensors do, and the motes that carry them."""

import math
from collections.abc import Callable, Mapping

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.hardware.profiles import IMAGERS
from wsnsim.net.clock import Clock
from wsnsim.rng import RandomStreams
from wsnsim.scenario.faults import KeyPath
from wsnsim.scenario.load import LoadedScenario
from wsnsim.scenario.schema import Scenario
from wsnsim.scenario.schema_cameras import (
    Camera,
    PictureBackground,
    SinusoidalDrift,
)
from wsnsim.sim.cameras import MoteCamera
from wsnsim.sim.node import Node
from wsnsim.sim.recording import ImageRecorder
from wsnsim.systems.base import Sensor
from wsnsim.types import NodeId
from wsnsim.vision import drift
from wsnsim.vision.clutter import with_decoys
from wsnsim.vision.film import Film
from wsnsim.vision.photos import load_background
from wsnsim.vision.renderer import Background, Renderer
from wsnsim.world.world import World

IMAGER = "cmos"
"""The imager of every camera."""


def open_background(loaded: LoadedScenario, number: int, last_step: int) -> Background:
    """Read the picture, or open the film, behind one camera's scene.

    Parameters
    ----------
    loaded : the scenario
    number : of the camera in it
    last_step : number of the run's last image

    Raises
    ------
    ScenarioError : it is missing, damaged, of the wrong kind, or a film that is too short
    """
    camera = loaded.scenario.cameras[number]
    source, size = camera.background, camera.resolution_px
    path: KeyPath = ("cameras", number, "background")
    try:
        if isinstance(source, str):
            return load_background(source, size)
        if isinstance(source, PictureBackground):
            path = (*path, "source")
            return load_background(source.source, size)
        path = (*path, "file")
        film = Film(source.file, size, camera.rate_hz, source.start_s, source.loop)
        film.check_length(last_step)
        return film
    except ValueError as error:
        raise loaded.error(path, str(error)) from error


def mote_cameras(
    clock: Clock,
    scenario: Scenario,
    nodes: Mapping[NodeId, Node],
    renderers: Mapping[NodeId, Renderer],
    world: World,
    recorder: ImageRecorder,
    sensors: Mapping[NodeId, Sensor],
) -> tuple[MoteCamera, ...]:
    """Give every camera of a scenario its mote."""
    return tuple(
        MoteCamera(
            clock,
            nodes[camera.id],
            renderers[camera.id],
            IMAGERS[IMAGER],
            world,
            recorder,
            sensors.get(camera.id),
        )
        for camera in scenario.cameras
    )


def camera_renderers(
    scenario: Scenario,
    cameras: Mapping[NodeId, PinholeCamera],
    backgrounds: Mapping[NodeId, Background],
    world: World,
    streams: RandomStreams,
) -> dict[NodeId, Renderer]:
    """Return what makes the images of every camera of a scenario."""
    return {
        camera.id: Renderer(
            cameras[camera.id],
            camera.id,
            _cluttered(backgrounds[camera.id], camera, cameras[camera.id], world, streams),
            camera.noise_sd,
            camera.gain_jitter,
            world.light,
            world.ambient,
            streams,
            world.scenery,
            _drift(camera, streams),
        )
        for camera in scenario.cameras
    }


def _cluttered(
    background: Background, camera: Camera, lens: PinholeCamera, world: World, streams: RandomStreams
) -> Background:
    """Return a background with the decoys that the scenario asks for."""
    clutter = camera.background.clutter if isinstance(camera.background, PictureBackground) else None
    if clutter is None or callable(background):
        return background
    source = streams if clutter.seed is None else RandomStreams(clutter.seed)
    return with_decoys(
        background,
        lens,
        [target.body.texture for target in world.targets],
        clutter.decoys,
        clutter.radius_px,
        world.light,
        world.ambient,
        source.stream("clutter", camera.id),
    )


def _drift(camera: Camera, streams: RandomStreams) -> Callable[[int], float] | None:
    """Return how the light changes from step to step, None where it does not."""
    asked = camera.illumination_drift
    if asked is None:
        return None
    generator = streams.stream("illumination", camera.id)
    if isinstance(asked, SinusoidalDrift):
        phase_deg = generator.uniform(0.0, 360.0) if asked.phase_deg is None else asked.phase_deg
        return drift.SinusoidalDrift(asked.amplitude, asked.period_s, math.radians(phase_deg), camera.rate_hz)
    return drift.RandomDrift(asked.sd, asked.correlation_s, camera.rate_hz, generator)
