"""The ground truth of a run: a room, its light, the targets in it and what may hide them."""

from dataclasses import dataclass

from wsnsim.types import FloatArray, Seconds
from wsnsim.world.bodies import Body
from wsnsim.world.motion import Motion, Pose


@dataclass(frozen=True, eq=False)
class Target:
    """Something that moves: to be tracked, or in the way.

    Parameters
    ----------
    id : name in scenario and records
    body : shape and surface
    motion : its poses
    """

    id: str
    body: Body
    motion: Motion


@dataclass(frozen=True, eq=False)
class Placed:
    """A part of the room that never moves: a wall, a box, a pillar.

    Parameters
    ----------
    id : name in the scenario
    body : shape and surface
    pose : where it stands
    """

    id: str
    body: Body
    pose: Pose


@dataclass(frozen=True, eq=False)
class World:
    """Everything that is true.

    Parameters
    ----------
    size_m : (3,) - extent of the floor plan and height, from the origin [m]
    targets : in the order of the scenario
    scenery : what stands about and hides what is behind it
    people : what moves about, hides, and is not tracked
    light : (3,) - unit vector towards the light
    ambient : share of the light that comes from everywhere [0–1]
    """

    size_m: FloatArray
    targets: tuple[Target, ...]
    light: FloatArray
    ambient: float
    scenery: tuple[Placed, ...] = ()
    people: tuple[Target, ...] = ()

    def at(self, time: Seconds) -> tuple[Pose, ...]:
        """Return the pose of every target at `time` [s], in the order of `targets`."""
        return tuple(target.motion.at(time) for target in self.targets)

    @property
    def moving_bodies(self) -> tuple[Body, ...]:
        """Bodies of all targets, then of all people."""
        return tuple(mover.body for mover in (*self.targets, *self.people))

    def moving_at(self, time: Seconds) -> tuple[Pose, ...]:
        """Return the poses of `moving_bodies` at `time` [s]."""
        return tuple(mover.motion.at(time) for mover in (*self.targets, *self.people))
