"""What must hold in a world before anything moves: nobody in a wall, nobody outside the room."""

from collections.abc import Iterator

import numpy as np

from wsnsim.scenario.faults import Fault, KeyPath, path_text, quoted
from wsnsim.scenario.load import LoadedScenario
from wsnsim.scenario.schema_motion import Motion, Waypoints
from wsnsim.types import BoolArray, FloatArray, IntArray, Seconds
from wsnsim.world.motion import Motion as PathMotion
from wsnsim.world.motion import Spinning, TimedPath
from wsnsim.world.motion import Waypoints as WaypointPath
from wsnsim.world.solids import contains
from wsnsim.world.world import Placed, Target, World

_ROUNDING_M = 1e-9
"""A target on the boundary is inside."""
_STAYS = frozenset({"random_waypoint", "gauss_markov", "crowd"})
"""Motions that cannot leave their area, which is inside the world."""


def containing(scenery: tuple[Placed, ...], points: FloatArray) -> IntArray:
    """Return which occluder each point (n, 3) is inside (n,), the first of several, or -1."""
    which = np.full(len(points), -1)
    for number, placed in reversed(list(enumerate(scenery))):
        which[contains(placed.body, placed.pose, points)] = number
    return which


def world_faults(
    loaded: LoadedScenario, world: World, movers: list[tuple[KeyPath, Motion, Target]]
) -> list[Fault]:
    """Find nodes and movers that are where they cannot be.

    Cameras, relays and base station must be outside the occluders, and so must targets and people at the
    start; where the scenario does not allow leaving, these must be inside the world at every image.

    Parameters
    ----------
    loaded : the scenario
    world : made of it
    movers : targets and people, each with the path and the section of its motion
    """
    faults = [*_buried_nodes(loaded, world)]
    for path, motion, mover in movers:
        faults += _buried_start(world, path, mover)
        if not loaded.scenario.cameras:
            # nobody looks: it does not matter who is where
            continue
        faults += _swallowed_cameras(loaded, path, mover)
        if loaded.scenario.true_world.leaving == "error" and motion.kind not in _STAYS:
            faults += _leaving(loaded, path, motion, mover)
    return faults


def _buried_nodes(loaded: LoadedScenario, world: World) -> Iterator[Fault]:
    scenario = loaded.scenario
    places: dict[KeyPath, tuple[float, float, float]] = {
        ("cameras", number, "position_m"): camera.position_m for number, camera in enumerate(scenario.cameras)
    }
    for number, entry in enumerate(scenario.motes.nodes):
        if entry.position_m is not None:
            places["motes", "nodes", number, "position_m"] = entry.position_m
    places["motes", "base", "position_m"] = scenario.motes.base.position_m
    which = containing(world.scenery, np.array(list(places.values())))
    for (path, place), number in zip(places.items(), which, strict=True):
        if number >= 0:
            yield Fault(path, f"must be outside the occluders, got {list(place)}, {_inside(world, number)}")


def _buried_start(world: World, path: KeyPath, mover: Target) -> Iterator[Fault]:
    place = mover.motion.at(0.0).position
    (number,) = containing(world.scenery, place[np.newaxis])
    if number >= 0:
        yield Fault(
            path, f"must start outside the occluders, got {_written(place)}, {_inside(world, number)}"
        )


def _swallowed_cameras(loaded: LoadedScenario, path: KeyPath, mover: Target) -> Iterator[Fault]:
    """Find cameras inside a mover at the start: they would look through it."""
    cameras = loaded.scenario.cameras
    swallowed = contains(
        mover.body, mover.motion.at(0.0), np.array([camera.position_m for camera in cameras])
    )
    for camera, inside in zip(cameras, swallowed, strict=True):
        if inside:
            place = _written(np.array(camera.position_m))
            yield Fault(path, f"must start away from the cameras, got {quoted(camera.id)} inside, at {place}")


def _leaving(loaded: LoadedScenario, path: KeyPath, motion: Motion, mover: Target) -> Iterator[Fault]:
    """Find the first image at whose instant the mover is outside."""
    scenario = loaded.scenario
    size = np.array(scenario.true_world.size_m)
    rate_hz = scenario.cameras[0].rate_hz
    steps = scenario.steps
    # a room is convex: who goes straight from one place inside to the next stays inside
    if not _outside(_corners(mover.motion, steps / rate_hz), size).any():
        return
    for step in range(steps + 1):
        place = mover.motion.at(step / rate_hz).position
        if _outside(place[np.newaxis], size).any():
            drawn = isinstance(motion, Waypoints) and motion.jitter_m > 0.0
            by = f" with seed {scenario.seed}" if drawn else ""
            must = f"must stay inside the world's size_m {list(scenario.true_world.size_m)}"
            found = f"is at {_written(place)} after {step / rate_hz:g} s{by}"
            hint = "change motion or size_m, or set world.leaving: allow"
            yield Fault(path, f"{must}, but {found}; {hint}")
            return


def _corners(motion: PathMotion, end: Seconds) -> FloatArray:
    """Return places (n, 3) between which a mover goes straight until `end` [s]."""
    if isinstance(motion, Spinning):
        return _corners(motion.motion, end)
    if isinstance(motion, WaypointPath | TimedPath):
        return motion.points
    return np.array([motion.at(0.0).position, motion.at(end).position])


def _outside(places: FloatArray, size: FloatArray) -> BoolArray:
    """Tell which coordinates of places (n, 3) are outside a room, (n, 3)."""
    return np.asarray((places < -_ROUNDING_M) | (places > size + _ROUNDING_M), dtype=np.bool_)


def _inside(world: World, number: int) -> str:
    return f"inside {path_text(('world', 'occluders', int(number)))} ({quoted(world.scenery[number].id)})"


def _written(place: FloatArray) -> str:
    return f"[{', '.join(f'{coordinate:.6g}' for coordinate in place)}] m"
