"""The true world from its section of a scenario."""

from pathlib import Path

import numpy as np

from wsnsim.rng import RandomStreams
from wsnsim.scenario import schema_world
from wsnsim.scenario.load import LoadedScenario
from wsnsim.types import FloatArray
from wsnsim.world.bodies import Body, PatchTexture
from wsnsim.world.motion import Motion, Waypoints, jittered
from wsnsim.world.recorded import read_track_csv
from wsnsim.world.world import Target, World


def build_world(loaded: LoadedScenario, streams: RandomStreams) -> World:
    """Return the world of a run.

    Raises
    ------
    ScenarioError : a recorded track cannot be read, or ends before the run begins
    """
    world = loaded.scenario.world
    light = np.array(world.light.direction)
    return World(
        size_m=np.array(world.size_m),
        targets=tuple(
            Target(target.id, _body(target, streams), _motion(loaded, number, streams))
            for number, target in enumerate(world.targets)
        ),
        light=light / np.linalg.norm(light),
        ambient=world.light.ambient,
    )


def _body(target: schema_world.Target, streams: RandomStreams) -> Body:
    texture = target.shape.texture
    own = streams if texture.seed is None else RandomStreams(texture.seed)
    generator = own.stream("texture", target.id)
    return Body(
        _array(target.shape.semi_axes_m), PatchTexture.random(generator, texture.patches, texture.colours)
    )


def _motion(loaded: LoadedScenario, number: int, streams: RandomStreams) -> Motion:
    target = loaded.scenario.world.targets[number]
    motion = target.motion
    if isinstance(motion, schema_world.Recorded):
        track = read_track_csv(
            Path(motion.file),
            scale=motion.scale,
            offset_m=_array(motion.offset_m),
            height_m=motion.height_m,
            start_s=motion.start_s,
        )
        if track.times[-1] <= 0.0:
            end_s = track.times[-1] + motion.start_s
            message = f"must be before the end of the track at {end_s:g} s, got {motion.start_s:g} s"
            raise loaded.error(("world", "targets", number, "motion", "start_s"), message)
        return track
    points = jittered(np.array(motion.points_m), streams.stream("motion", target.id), motion.jitter_m)
    return Waypoints(points, motion.speed_mps, _array(motion.orientation))


def _array(values: tuple[float, ...]) -> FloatArray:
    return np.array(values, dtype=np.float64)
