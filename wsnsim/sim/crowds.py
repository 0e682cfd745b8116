"""The joint walk of all whose motion is `crowd`, from its section of a scenario."""

from collections.abc import Mapping

import numpy as np

from wsnsim.rng import RandomStreams
from wsnsim.scenario import schema_world
from wsnsim.scenario.load import LoadedScenario
from wsnsim.types import FloatArray
from wsnsim.world.bodies import Body
from wsnsim.world.crowd import Crowd
from wsnsim.world.footprints import footprints
from wsnsim.world.motion import TimedPath
from wsnsim.world.world import Placed

_CAMERA_HALF_M = 1e-3
"""Half the side of the square that a camera takes on the floor plan."""


def crowd_motions(
    loaded: LoadedScenario, streams: RandomStreams, scenery: tuple[Placed, ...], bodies: Mapping[str, Body]
) -> dict[str, TimedPath]:
    """Return the motion of each who walks with the crowd, by name.

    What stands about is in the way if it reaches a height at which there are bodies, and so is a camera
    inside the area at such a height. Bodies stand on the floor.

    Parameters
    ----------
    loaded : the scenario
    streams : the run's randomness
    scenery : what stands about
    bodies : of the crowd by name, in the order in which they take their turns

    Raises
    ------
    ScenarioError : there is no room for all of them, or too much to walk
    """
    section = loaded.scenario.true_world.crowd
    if section is None or not bodies:
        return {}
    axes = np.array([body.semi_axes_m for body in bodies.values()])
    top = 2.0 * float(axes[:, 2].max())
    low, high = _area(loaded, section)
    stands = _cameras(loaded, low, high, top)
    try:
        crowd = Crowd(
            count=len(bodies),
            diameter_m=2.0 * float(axes[:, :2].max()),
            low=low,
            high=high,
            speed_mps=section.speed_mps,
            noise_sd_m=section.noise_sd_m,
            step_s=_step_s(loaded, section),
            walls=(*footprints(scenery, 0.0, top), *stands),
        )
        motions = crowd.motions(streams.stream("crowd"), loaded.scenario.duration_s, axes[:, 2])
    except ValueError as error:
        raise loaded.error(("world", "crowd"), str(error)) from error
    return dict(zip(bodies, motions, strict=True))


def _step_s(loaded: LoadedScenario, section: schema_world.Crowd) -> float:
    return 1.0 / loaded.scenario.cameras[0].rate_hz if section.step_s is None else section.step_s


def _area(loaded: LoadedScenario, section: schema_world.Crowd) -> tuple[FloatArray, FloatArray]:
    world = loaded.scenario.true_world
    size = np.array(world.size_m[:2])
    if section.area_m is None:
        return np.zeros(2), size
    corners = np.array(section.area_m)
    low, high = corners.min(axis=0), corners.max(axis=0)
    if world.leaving == "error" and ((low < 0.0) | (high > size)).any():
        must = f"must lie inside the world's size_m {list(world.size_m)}"
        message = f"{must}, got {corners.tolist()}; or set world.leaving: allow"
        raise loaded.error(("world", "crowd", "area_m"), message)
    return low, high


def _cameras(
    loaded: LoadedScenario, low: FloatArray, high: FloatArray, top_m: float
) -> tuple[FloatArray, ...]:
    """Return squares around the cameras that somebody might walk over; nobody comes so near at a side."""
    square = _CAMERA_HALF_M * np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
    places = [np.array(camera.position_m) for camera in loaded.scenario.cameras]
    return tuple(
        place[:2] + square
        for place in places
        if 0.0 <= place[2] <= top_m and (low < place[:2]).all() and (place[:2] < high).all()
    )
