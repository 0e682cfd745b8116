"""Motions that are drawn: random waypoint and Gauss–Markov, inside a box, whole before the run begins.

A longer run goes on where a shorter one ends: what was drawn for a time does not depend on how long the
motion is wanted. Left out: other bodies and walls. Nobody here walks round an obstacle.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from wsnsim.geometry.rotations import IDENTITY
from wsnsim.types import BoolArray, FloatArray, Seconds
from wsnsim.world.motion import Pose, TimedPath

_BLOCK = 64
"""Legs, and places to start from, that are drawn at once."""
_MOST_PARTS = 2_000_000
"""Legs or intervals of one motion at most: some 200 MB."""
_MOST_TRIES = 16 * _BLOCK
"""Starts that are drawn before giving up."""


@dataclass(frozen=True, eq=False)
class Area:
    """A box with its sides along the axes; a side may have no length.

    Parameters
    ----------
    low : (3,) - corner of the least coordinates [m]
    high : (3,) - corner of the greatest coordinates [m]

    Raises
    ------
    ValueError : a coordinate of `low` is above that of `high`
    """

    low: FloatArray
    high: FloatArray

    def __post_init__(self) -> None:
        if not (self.low <= self.high).all():
            raise ValueError(
                f"low: must be at most high, got {self.low.tolist()} and {self.high.tolist()} [m]"
            )

    def draw_clear(
        self, generator: np.random.Generator, is_clear: Callable[[FloatArray], BoolArray]
    ) -> FloatArray:
        """Return a place (3,) that is clear, uniformly distributed over all that are.

        Parameters
        ----------
        generator : source of randomness
        is_clear : tells which of the places (n, 3) are, (n,)

        Raises
        ------
        ValueError : none of many places was clear
        """
        for _ in range(_MOST_TRIES // _BLOCK):
            places = generator.uniform(self.low, self.high, (_BLOCK, 3))
            clear = is_clear(places)
            if clear.any():
                chosen: FloatArray = places[clear.argmax()]
                return chosen
        raise ValueError(f"must hold a place outside the occluders, but none of {_MOST_TRIES} was outside")


def random_waypoint(
    generator: np.random.Generator,
    area: Area,
    start: FloatArray,
    speeds_mps: tuple[float, float],
    pause_s: Seconds,
    until_s: Seconds,
    orientation: FloatArray = IDENTITY,
) -> TimedPath:
    """Draw a path whose every next point is uniformly distributed in a box, with a speed for each leg.

    Speeds are uniformly distributed; that over time is slower, as slow legs last longer: without pauses
    its mean tends to (max − min) / ln(max / min). Places tend to the middle of the box. Nothing is avoided:
    a path leads through occluders, though it should start outside of them (`Area.draw_clear`).

    Parameters
    ----------
    generator : source of randomness
    area : holds all points
    start : (3,) - place at time 0 [m]
    speeds_mps : least, above 0, and greatest [m/s]
    pause_s : at each point but the first [s]
    until_s : the path lasts so long at least [s]
    orientation : (4,) - unit quaternion, the same all the way

    Raises
    ------
    ValueError : the area is a single point, or there were millions of legs to draw

    References
    ----------
    Johnson & Maltz (1996), Dynamic source routing in ad hoc wireless networks: the model.
    Bettstetter, Hartenstein, Pérez-Costa (2004), Stochastic properties of the random waypoint mobility
    model: lengths of legs and distribution of places. Yoon, Liu, Noble (2003), Random waypoint considered
    harmful: the mean speed, and why the least must be above 0.
    """
    if (area.low == area.high).all():
        raise ValueError(f"must have an extent, got the single point {area.low.tolist()} [m]")
    times, points, end_s = [np.zeros(1)], [start[np.newaxis]], 0.0
    count = 0
    while end_s < until_s:
        count += _BLOCK
        if count > _MOST_PARTS:
            raise ValueError(f"must give less than {_MOST_PARTS} legs in {until_s:g} s: make it larger")
        targets = generator.uniform(area.low, area.high, (_BLOCK, 3))
        speeds = generator.uniform(*speeds_mps, _BLOCK)
        lengths = np.linalg.norm(np.diff(targets, axis=0, prepend=points[-1][-1:]), axis=1)
        # arrivals and departures in turn
        spans = np.stack([lengths / speeds, np.full(_BLOCK, pause_s)], axis=1).ravel()
        times.append(end_s + np.cumsum(spans))
        points.append(np.repeat(targets, 2, axis=0))
        end_s = float(times[-1][-1])
    return TimedPath(np.concatenate(times), np.concatenate(points), orientation[np.newaxis])


@dataclass(frozen=True, eq=False)
class GaussMarkov:
    """A path of straight lines between instants k · interval, thrown back by the sides of a box.

    Parameters
    ----------
    free_points : (n, 3) - where the path would be at the instants if there were no sides [m]
    interval_s : from instant to instant [s]
    area : that is never left; along a side without length the target does not move
    orientation : (4,) - unit quaternion, the same all the way
    """

    free_points: FloatArray
    interval_s: Seconds
    area: Area
    orientation: FloatArray = field(default_factory=IDENTITY.copy)

    def at(self, time: Seconds) -> Pose:
        """Return the pose at `time` [s]; before time 0 and after the last instant the target stands."""
        k = int(time / self.interval_s) if time >= 0.0 else -1
        if 0 <= k < len(self.free_points) - 1:
            free_velocity = (self.free_points[k + 1] - self.free_points[k]) / self.interval_s
            free_place = self.free_points[k] + (time - k * self.interval_s) * free_velocity
        else:
            free_velocity, free_place = np.zeros(3), self.free_points[0 if k < 0 else -1]
        low, sides = self.area.low, self.area.high - self.area.low
        fixed = sides == 0.0
        # a mirror in every side: the free path, folded, runs up and down between them
        way = np.mod(free_place - low, np.where(fixed, 1.0, 2.0 * sides))
        back = way > sides
        position = np.where(fixed, low, low + np.where(back, 2.0 * sides - way, way))
        velocity = np.where(fixed, 0.0, np.where(back, -free_velocity, free_velocity))
        return Pose(np.clip(position, low, self.area.high), velocity, self.orientation)


def gauss_markov(
    generator: np.random.Generator,
    area: Area,
    start: FloatArray,
    mean_velocity: FloatArray,
    sd_mps: FloatArray,
    memory: float,
    interval_s: Seconds,
    until_s: Seconds,
    orientation: FloatArray = IDENTITY,
) -> GaussMarkov:
    """Draw a path whose velocity is a stationary Gauss–Markov process, constant in each interval.

    v[k+1] = α v[k] + (1 − α) μ + σ √(1 − α²) w[k], with w standard normal, for each axis; v[0] has mean μ
    and standard deviation σ like all others. A side of the box turns velocity and mean round alike.

    Parameters
    ----------
    generator : source of randomness
    area : that is never left
    start : (3,) - place at time 0 [m]
    mean_velocity : (3,) - μ [m/s]
    sd_mps : (3,) - σ [m/s]
    memory : α, from 0, a new velocity in each interval, to 1, the same for ever
    interval_s : for which a velocity lasts [s]
    until_s : the path lasts so long at least [s]
    orientation : (4,) - unit quaternion, the same all the way

    Raises
    ------
    ValueError : there were millions of intervals to draw

    References
    ----------
    Liang & Haas (1999), Predictive distance-based mobility management for PCS networks, INFOCOM.
    Camp, Boleng, Davies (2002), A survey of mobility models: turned back at the edges.
    """
    if until_s / interval_s > _MOST_PARTS:
        raise ValueError(f"must give at most {_MOST_PARTS} intervals in {until_s:g} s, got {interval_s:g} s")
    count = int(np.ceil(until_s / interval_s)) + 1
    deviations = sd_mps * generator.standard_normal((count, 3))
    deviations[1:] *= np.sqrt(1.0 - memory**2)
    for k in range(1, count):
        deviations[k] += memory * deviations[k - 1]
    steps = interval_s * (mean_velocity + deviations)
    free_points = start + np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    return GaussMarkov(free_points, interval_s, area, orientation)
