"""How targets move: a pose for every time, exact, with nothing accumulated.

Left out: inertia. A target on waypoints changes its direction at once.
"""

from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from wsnsim.geometry.rotations import IDENTITY, quaternion_from_axis_angle, quaternion_multiply
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


@dataclass(frozen=True, eq=False)
class ConstantVelocity:
    """A straight line without beginning or end.

    Parameters
    ----------
    start : (3,) - place at time 0 [m]
    velocity : (3,) - [m/s]
    orientation : (4,) - unit quaternion, the same all the way
    """

    start: FloatArray
    velocity: FloatArray
    orientation: FloatArray = field(default_factory=IDENTITY.copy)

    def at(self, time: Seconds) -> Pose:
        """Return the pose at `time` [s]."""
        return Pose(self.start + time * self.velocity, self.velocity, self.orientation)


@dataclass(frozen=True, eq=False)
class TimedPath:
    """Straight lines between places that are reached at given times; outside them the target stands.

    Between orientations the target turns at a constant rate, the shorter way.

    Parameters
    ----------
    times : (n,) - not decreasing [s]
    points : (n, 3) - [m]
    orientations : (n, 4) or (1, 4) - unit quaternions at the times, or the same all the way

    Raises
    ------
    ValueError : the shapes do not match
    """

    times: FloatArray
    points: FloatArray
    orientations: FloatArray = field(default_factory=lambda: IDENTITY[np.newaxis].copy())

    def __post_init__(self) -> None:
        count = len(self.times)
        if count < 1 or self.points.shape != (count, 3):
            raise ValueError(f"points: must have shape {(max(count, 1), 3)}, got {self.points.shape}")
        if self.orientations.shape not in {(count, 4), (1, 4)}:
            found = self.orientations.shape
            raise ValueError(f"orientations: must have shape {(count, 4)} or (1, 4), got {found}")

    def at(self, time: Seconds) -> Pose:
        """Return the pose at `time` [s]."""
        pose = interpolate(self.times, self.points, time, self.orientations[0])
        if len(self.orientations) == 1:
            return pose
        after = int(self.times.searchsorted(time, side="right"))
        if after == 0:
            return pose
        if after == len(self.times):
            return replace(pose, orientation=self.orientations[-1])
        start, end = self.times[after - 1], self.times[after]
        between = slerp(
            self.orientations[after - 1], self.orientations[after], (time - start) / (end - start)
        )
        return replace(pose, orientation=between)


@dataclass(frozen=True, eq=False)
class Spinning:
    """A motion whose body turns besides, at a constant rate about an axis of the world.

    Parameters
    ----------
    motion : gives place and velocity, and the orientation that is turned
    axis : (3,) - in the world, of any length but 0
    rate_radps : right-handed about the axis [rad/s]
    """

    motion: Motion
    axis: FloatArray
    rate_radps: float

    def at(self, time: Seconds) -> Pose:
        """Return the pose at `time` [s]; at time 0 the orientation is that of the motion."""
        pose = self.motion.at(time)
        turn = quaternion_from_axis_angle(self.axis, self.rate_radps * time)
        return replace(pose, orientation=quaternion_multiply(turn, pose.orientation))


def interpolate(times: FloatArray, points: FloatArray, time: Seconds, orientation: FloatArray) -> Pose:
    """Return the pose at `time` on straight lines between timed points.

    Parameters
    ----------
    times : (n,) - not decreasing [s]
    points : (n, 3) - [m]
    time : [s]; outside `times` the target stands at the nearer end
    orientation : (4,) - of the pose that is returned
    """
    after = int(times.searchsorted(time, side="right"))
    if after == 0:
        return Pose(points[0].copy(), np.zeros(3), orientation)
    if after == len(times):
        return Pose(points[-1].copy(), np.zeros(3), orientation)
    start, end = times[after - 1], times[after]
    velocity = (points[after] - points[after - 1]) / (end - start)
    return Pose(points[after - 1] + (time - start) * velocity, velocity, orientation)


def slerp(first: FloatArray, second: FloatArray, share: float) -> FloatArray:
    """Return the orientation at a share of the way from one to another, the shorter way round.

    Parameters
    ----------
    first : (4,) - unit quaternion
    second : (4,) - unit quaternion
    share : of the way [0–1]

    References
    ----------
    Shoemake (1985), Animating rotation with quaternion curves, SIGGRAPH.
    """
    cosine = float(first @ second)
    near = second if cosine >= 0.0 else -second  # q and -q are the same orientation
    angle = float(np.arctan2(np.linalg.norm(near - first), np.linalg.norm(near + first))) * 2.0
    if np.sin(angle) == 0.0:
        return first.copy()
    between: FloatArray = (np.sin((1.0 - share) * angle) * first + np.sin(share * angle) * near) / np.sin(
        angle
    )
    return between


def jittered(points: FloatArray, generator: np.random.Generator, sd_m: float) -> FloatArray:
    """Return a copy of points (n, d) with normal noise of `sd_m` [m] on every coordinate."""
    return points + generator.normal(0.0, sd_m, points.shape)
