"""How targets move: a pose for every time, exact, with nothing accumulated.

Left out: inertia. A target on waypoints changes its direction at once.
"""

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from wsnsim.geometry.rotations import IDENTITY
from wsnsim.types import FloatArray, Seconds


@dataclass(frozen=True, eq=False)
class Pose:
    """Where a target is and how it stands.

    Parameters
    ----------
    position : (3,) - [m]
    velocity : (3,) - [m/s]
    orientation : (4,) - unit quaternion (w, x, y, z), body axes to world axes
    """

    position: FloatArray
    velocity: FloatArray
    orientation: FloatArray


class Motion(Protocol):
    """Tells the pose at any time."""

    def at(self, time: Seconds) -> Pose:
        """Return the pose at `time` [s]."""


@dataclass(frozen=True, eq=False)
class Waypoints:
    """Straight legs at constant speed, from the first point at time 0 to the last, where the target stays.

    Parameters
    ----------
    points : (n, 3) - [m]; a single point is a target that stands
    speed_mps : along the path [m/s]
    orientation : (4,) - unit quaternion, the same all the way

    Raises
    ------
    ValueError : no point, a point that is not finite, or a speed that is not above 0
    """

    points: FloatArray
    speed_mps: float
    orientation: FloatArray = field(default_factory=IDENTITY.copy)

    def __post_init__(self) -> None:
        if self.points.ndim != 2 or self.points.shape[1] != 3 or len(self.points) < 1:
            raise ValueError(f"points: must have shape (n, 3) with n at least 1, got {self.points.shape}")
        if not np.isfinite(self.points).all():
            raise ValueError("points: must be finite [m]")
        if not (np.isfinite(self.speed_mps) and self.speed_mps > 0.0):
            raise ValueError(f"speed_mps: must be above 0, got {self.speed_mps} [m/s]")

    @property
    def length_m(self) -> float:
        """Length of the whole path [m]."""
        return float(np.linalg.norm(np.diff(self.points, axis=0), axis=1).sum())

    def at(self, time: Seconds) -> Pose:
        """Return the pose at `time` [s]; before time 0 the target stands at the first point."""
        lengths = np.linalg.norm(np.diff(self.points, axis=0), axis=1)
        reached = np.concatenate(([0.0], np.cumsum(lengths)))
        return interpolate(reached / self.speed_mps, self.points, time, self.orientation)


def interpolate(times: FloatArray, points: FloatArray, time: Seconds, orientation: FloatArray) -> Pose:
    """Return the pose at `time` on straight lines between timed points.

    Parameters
    ----------
    times : (n,) - not decreasing [s]
    points : (n, 3) - [m]
    time : [s]; outside `times` the target stands at the nearer end
    orientation : (4,) - of the pose that is returned
    """
    after = int(np.searchsorted(times, time, side="right"))
    if after == 0:
        return Pose(points[0].copy(), np.zeros(3), orientation)
    if after == len(times):
        return Pose(points[-1].copy(), np.zeros(3), orientation)
    start, end = times[after - 1], times[after]
    velocity = (points[after] - points[after - 1]) / (end - start)
    return Pose(points[after - 1] + (time - start) * velocity, velocity, orientation)


def jittered(points: FloatArray, generator: np.random.Generator, sd_m: float) -> FloatArray:
    """Return a copy of points (n, d) with normal noise of `sd_m` [m] on every coordinate."""
    return points + generator.normal(0.0, sd_m, points.shape)
