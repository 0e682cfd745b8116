"""The ground truth of a run: a room, its light, and the targets in it."""

from dataclasses import dataclass

from wsnsim.types import FloatArray, Seconds
from wsnsim.world.motion import Motion, Pose
from wsnsim.world.targets import TargetBody


@dataclass(frozen=True, eq=False)
class Target:
    """Something that moves and is to be tracked.

    Parameters
    ----------
    id : name in scenario and records
    body : shape and surface
    motion : its poses
    """

    id: str
    body: TargetBody
    motion: Motion


@dataclass(frozen=True, eq=False)
class World:
    """Everything that is true.

    Parameters
    ----------
    size_m : (3,) - extent of the floor plan and height, from the origin [m]
    targets : in the order of the scenario
    light : (3,) - unit vector towards the light
    ambient : share of the light that comes from everywhere [0–1]
    """

    size_m: FloatArray
    targets: tuple[Target, ...]
    light: FloatArray
    ambient: float

    def at(self, time: Seconds) -> tuple[Pose, ...]:
        """Return the pose of every target at `time` [s], in the order of `targets`."""
        return tuple(target.motion.at(time) for target in self.targets)
