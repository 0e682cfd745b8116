"""The true world from its section of a scenario."""

from collections.abc import Iterator

import numpy as np

from wsnsim.errors import Problem, ScenarioError
from wsnsim.rng import RandomStreams
from wsnsim.scenario import schema_world
from wsnsim.scenario.faults import KeyPath
from wsnsim.scenario.load import LoadedScenario
from wsnsim.scenario.schema_motion import CrowdWalk, Motion
from wsnsim.sim.crowds import crowd_motions
from wsnsim.sim.motions import MotionBuilder
from wsnsim.sim.world_checks import containing, world_faults
from wsnsim.world import occluders
from wsnsim.world.bodies import Body, PatchTexture
from wsnsim.world.motion import TimedPath
from wsnsim.world.world import Placed, Target, World


def build_world(loaded: LoadedScenario, streams: RandomStreams) -> World:
    """Return the world of a run.

    Raises
    ------
    ScenarioError : a recorded track cannot be read or ends before the run begins, an area is of no use,
        something is inside an occluder, a crowd has no room, or somebody leaves the world; all at once
    """
    world = loaded.scenario.true_world
    scenery = scenery_of(world, streams)
    builder = MotionBuilder(loaded, streams, lambda places: containing(scenery, places) < 0)
    movers: list[tuple[KeyPath, Motion, Target]] = []
    problems: list[Problem] = []
    bodies = {name: _body(name, section.shape, streams) for _, name, section in _movers(world)}
    walking = {
        name: bodies[name] for _, name, section in _movers(world) if isinstance(section.motion, CrowdWalk)
    }
    walks: dict[str, TimedPath] = {}
    try:
        walks = crowd_motions(loaded, streams, scenery, walking)
    except ScenarioError as error:
        problems += error.problems
    for path, name, section in _movers(world):
        body = bodies[name]
        if isinstance(section.motion, CrowdWalk):
            if name in walks:
                movers.append((path, section.motion, Target(name, body, walks[name])))
            continue
        try:
            motion = builder.motion(path, name, body, section.motion)
        except ScenarioError as error:
            problems += error.problems
        else:
            movers.append((path, section.motion, Target(name, body, motion)))
    light = np.array(world.light.direction)
    built = World(
        size_m=np.array(world.size_m),
        targets=tuple(mover for path, _, mover in movers if path[1] == "targets"),
        light=light / np.linalg.norm(light),
        ambient=world.light.ambient,
        scenery=scenery,
        people=tuple(mover for path, _, mover in movers if path[1] == "people"),
    )
    problems += [loaded.marks.problem(fault) for fault in world_faults(loaded, built, movers)]
    if problems:
        # members of one crowd fail alike
        raise ScenarioError(list(dict.fromkeys(problems)))
    return built


def scenery_of(world: schema_world.World, streams: RandomStreams) -> tuple[Placed, ...]:
    """Return what stands about, in the scenario's order."""
    return tuple(_placed(occluder, streams) for occluder in world.occluders)


def _movers(
    world: schema_world.World,
) -> Iterator[tuple[KeyPath, str, schema_world.Target | schema_world.Person]]:
    """Yield the path of the motion, the name and the section of all targets, then of all people."""
    for number, target in enumerate(world.targets):
        yield ("world", "targets", number, "motion"), target.id, target
    for number, person in enumerate(world.people):
        for name in person.names:
            yield ("world", "people", number, "motion"), name, person


def _placed(occluder: schema_world.Occluder, streams: RandomStreams) -> Placed:
    texture = _texture(occluder.id, occluder.texture, streams)
    if isinstance(occluder, schema_world.Wall):
        body, pose = occluders.wall(
            np.array(occluder.from_m),
            np.array(occluder.to_m),
            occluder.thickness_m,
            occluder.height_m,
            occluder.base_m,
            texture,
        )
    elif isinstance(occluder, schema_world.Box):
        body, pose = occluders.box(
            np.array(occluder.centre_m), np.array(occluder.size_m), np.radians(occluder.yaw_deg), texture
        )
    elif isinstance(occluder, schema_world.Prism):
        body, pose = occluders.prism(
            np.array(occluder.corners_m), occluder.height_m, occluder.base_m, texture
        )
    else:
        body, pose = occluders.pillar(
            np.array(occluder.centre_m), occluder.radius_m, occluder.height_m, occluder.base_m, texture
        )
    return Placed(occluder.id, body, pose)


def _body(name: str, shape: schema_world.Shape, streams: RandomStreams) -> Body:
    return Body(np.array(shape.semi_axes_m), _texture(name, shape.texture, streams), shape.kind)


def _texture(
    name: str, texture: schema_world.PatchTexture | schema_world.PlainTexture, streams: RandomStreams
) -> PatchTexture:
    if isinstance(texture, schema_world.PlainTexture):
        return PatchTexture.plain(texture.colour)
    own = streams if texture.seed is None else RandomStreams(texture.seed)
    return PatchTexture.random(own.stream("texture", name), texture.patches, texture.colours)
