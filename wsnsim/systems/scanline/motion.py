"""How the object moves, as the filter sees it: modified random waypoints (Ercan et al. 2007, Sec. 4.1).

A step of the filter is one time unit, so that a speed is a length a step. Left out: walls. A particle
walks through them; the likelihood knows that no camera sees it there.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np

from wsnsim.kernels.jit import frozen
from wsnsim.kernels.waypoints import mean_directions, mean_waypoint_steps, waypoint_steps
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

    @property
    def velocities(self) -> FloatArray:
        """Velocities (m, 2) toward the targets, 0 at them [m/step]."""
        ways = self.targets - self.places
        lengths = np.hypot(ways[:, 0], ways[:, 1])
        return np.asarray(ways * (self.speeds / np.where(lengths > 0.0, lengths, 1.0))[:, np.newaxis])

    def take(self, indices: IntArray) -> Self:
        """Return the states at indices."""
        return type(self)(
            self.places[indices], self.targets[indices], self.speeds[indices], self.regimes[indices]
        )


@dataclass(frozen=True)
class WaypointWalk:
    """The paper's model; its values, but for φ and σ_ν.

    Parameters
    ----------
    room : in which the targets are
    speed : of a particle that was just placed [m/step]
    noise_sd : σ_ν on each axis [m]. Steps of a crowd of forty with noise .33 are so far off the ways to their
        waypoints: .4, as bodies go round each other. What the paper's filter takes is not printed
    memory : φ, the weight of the length just walked in the new speed. The paper's 0.7 is said to smooth; it
        hardly does, and as noise lengthens the way, the speed drifts upward
    reached : β₁, λ₁, probabilities of TOWARDS and CHANGE at the target, which is nearer than one step
    under_way : β₂, λ₂, elsewhere

    Raises
    ------
    ValueError : a parameter outside its range
    """

    room: Room
    speed: float = 1.0
    noise_sd: float = 0.4
    memory: float = 0.3
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
        draws = generator.uniform(size=count)
        # as `uniform` between the corners would, in half the time
        fresh = self.room.low + self.room.sides * generator.random((count, 2))
        noise = generator.normal(0.0, self.noise_sd, (count, 2))
        return Walkers(
            *waypoint_steps(
                *_numbers(walkers),
                frozen(draws, np.float64),
                frozen(fresh, np.float64),
                frozen(noise, np.float64),
                self.memory,
                self.reached,
                self.under_way,
            )
        )

    def expected(self, walkers: Walkers) -> Walkers:
        """Return κ = E[u(t) | u(t − 1)] (Fig. 4, line 2): the places exactly, the rest as it is."""
        low, high = _corners(self.room)
        places = mean_waypoint_steps(*_numbers(walkers), low, high, self.reached, self.under_way)
        return Walkers(places, walkers.targets, walkers.speeds, walkers.regimes)


def mean_direction(places: FloatArray, room: Room) -> FloatArray:
    """Return the mean unit vector from places (m, 2) to a place that is uniform in the room, (m, 2)."""
    return mean_directions(frozen(places, np.float64), *_corners(room))


def _numbers(walkers: Walkers) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return places, targets and speeds as the kernels take them."""
    return (
        frozen(walkers.places, np.float64),
        frozen(walkers.targets, np.float64),
        frozen(walkers.speeds, np.float64),
    )


def _corners(room: Room) -> tuple[FloatArray, FloatArray]:
    return frozen(room.low, np.float64), frozen(room.high, np.float64)
