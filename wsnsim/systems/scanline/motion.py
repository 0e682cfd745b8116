"""How the object moves, as the filter sees it: modified random waypoints (Ercan et al. 2007, Sec. 4.1).

A step of the filter is one time unit, so that a speed is a length a step. Left out: walls. A particle
walks through them; the likelihood knows that no camera sees it there.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np

from wsnsim.systems.scanline.regions import Room
from wsnsim.types import FloatArray, IntArray

TOWARDS, CHANGE, WAIT = 0, 1, 2
"""The regimes: move toward the target; choose a new target and do so; do nothing."""


@dataclass(frozen=True, eq=False)
class Walkers:
    """The four-part states of m particles.

    Parameters
    ----------
    places : (m, 2) - x [m]
    targets : (m, 2) - τ, the waypoints [m]
    speeds : (m,) - s [m/step]
    regimes : (m,) - r of the last step
    """

    places: FloatArray
    targets: FloatArray
    speeds: FloatArray
    regimes: IntArray

    def take(self, indices: IntArray) -> Self:
        """Return the states at indices."""
        return type(self)(
            self.places[indices], self.targets[indices], self.speeds[indices], self.regimes[indices]
        )


@dataclass(frozen=True)
class WaypointWalk:
    """The paper's model and values.

    Parameters
    ----------
    room : in which the targets are
    speed : of a particle that was just placed [m/step]
    noise_sd : σ_ν on each axis [m]
    memory : φ, the weight of the length just walked in the new speed. The paper's 0.7 is said to smooth;
        it hardly does, and as noise lengthens the way, the speed drifts upward: 0.3 or less is better
    reached : β₁, λ₁, probabilities of TOWARDS and CHANGE at the target, which is nearer than one step
    under_way : β₂, λ₂, elsewhere

    Raises
    ------
    ValueError : a parameter outside its range
    """

    room: Room
    speed: float = 1.0
    noise_sd: float = 0.33
    memory: float = 0.7
    reached: tuple[float, float] = (0.05, 0.9)
    under_way: tuple[float, float] = (0.9, 0.05)

    def __post_init__(self) -> None:
        if not (self.speed > 0.0 and self.noise_sd > 0.0):
            raise ValueError(f"speed, noise_sd: must be above 0, got {self.speed}, {self.noise_sd}")
        if not 0.0 <= self.memory <= 1.0:
            raise ValueError(f"memory: must be 0 to 1, got {self.memory}")
        for pair in (self.reached, self.under_way):
            if min(pair) < 0.0 or sum(pair) > 1.0:
                raise ValueError(f"reached, under_way: must be probabilities of sum at most 1, got {pair}")

    def placed(self, generator: np.random.Generator, places: FloatArray) -> Walkers:
        """Return particles at places (m, 2) of which nothing else is known."""
        count = len(places)
        targets = generator.uniform(self.room.low, self.room.high, (count, 2))
        return Walkers(places, targets, np.full(count, self.speed), np.full(count, CHANGE))

    def propagate(self, generator: np.random.Generator, walkers: Walkers) -> Walkers:
        """Draw the next states from f(u(t) | u(t − 1))."""
        count = len(walkers.places)
        towards, change = self._chances(walkers)
        draws = generator.uniform(size=count)
        regimes = np.where(draws < towards, TOWARDS, np.where(draws < towards + change, CHANGE, WAIT))
        drawn = generator.uniform(self.room.low, self.room.high, (count, 2))
        targets = np.where((regimes == CHANGE)[:, np.newaxis], drawn, walkers.targets)
        steps = walkers.speeds[:, np.newaxis] * directions(targets - walkers.places)
        steps += generator.normal(0.0, self.noise_sd, (count, 2))
        moves = regimes != WAIT
        steps[~moves] = 0.0
        lengths = np.hypot(steps[:, 0], steps[:, 1])
        speeds = (1.0 - self.memory) * walkers.speeds + self.memory * lengths
        return Walkers(walkers.places + steps, targets, np.where(moves, speeds, walkers.speeds), regimes)

    def expected(self, walkers: Walkers) -> Walkers:
        """Return κ = E[u(t) | u(t − 1)] (Fig. 4, line 2): the places exactly, the rest as it is."""
        towards, change = self._chances(walkers)
        step = towards[:, np.newaxis] * directions(walkers.targets - walkers.places)
        step += change[:, np.newaxis] * mean_direction(walkers.places, self.room)
        places = walkers.places + walkers.speeds[:, np.newaxis] * step
        return Walkers(places, walkers.targets, walkers.speeds, walkers.regimes)

    def _chances(self, walkers: Walkers) -> tuple[FloatArray, FloatArray]:
        ways = walkers.targets - walkers.places
        there = np.hypot(ways[:, 0], ways[:, 1]) < walkers.speeds
        return (
            np.where(there, self.reached[0], self.under_way[0]),
            np.where(there, self.reached[1], self.under_way[1]),
        )


def mean_direction(places: FloatArray, room: Room) -> FloatArray:
    """Return the mean unit vector from places (m, 2) to a place that is uniform in the room, (m, 2).

    The integral of x / √(x² + y²) over a rectangle is that of √(x² + y²) over its right side, less over its
    left.
    """
    left, below = (room.low - places).T
    right, above = (room.high - places).T
    across = _root(right, above) - _root(right, below) - _root(left, above) + _root(left, below)
    up = _root(above, right) - _root(above, left) - _root(below, right) + _root(below, left)
    return np.stack([across, up], axis=1) / float(np.prod(room.sides))


def _root(at: FloatArray, to: FloatArray) -> FloatArray:
    """Return the integral of √(at² + y²) for y from 0 to `to`."""
    length = np.hypot(at, to)
    share = np.divide(to, np.abs(at), out=np.zeros_like(to), where=at != 0.0)
    return np.asarray(0.5 * (to * length + at * at * np.arcsinh(share)))


def directions(ways: FloatArray) -> FloatArray:
    """Return unit vectors (m, 2), or 0 where there is no way left."""
    lengths = np.hypot(ways[:, 0], ways[:, 1])
    return np.asarray(ways / np.where(lengths > 0.0, lengths, 1.0)[:, np.newaxis])
