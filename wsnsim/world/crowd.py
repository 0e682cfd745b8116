"""A crowd on a floor plan: cylinders on random waypoints that go round each other and never enter walls.

The model of the object and its occluders in Ercan, El Gamal & Guibas 2007, Sec. 5: toward a target at a
constant speed plus noise; a new target when it is reached or the way leads into a wall or out of the room.
How they go round each other is not said there: here a step that would meet somebody is turned until it
does not, and where it never does the body stands. Left out: groups, and whatever else makes people walk
alike. Between steps the bodies go straight; two may then come nearer than they are at the steps.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from wsnsim.geometry.polygons import half_planes, is_convex
from wsnsim.geometry.rotations import IDENTITY
from wsnsim.kernels.crowd import is_clear, is_free, walk
from wsnsim.kernels.jit import frozen
from wsnsim.types import FloatArray, IntArray, Seconds
from wsnsim.world.motion import TimedPath

_BLOCK = 64
"""Steps that are drawn at once."""
_MOST_TRIES = 10_000
"""Places that are drawn for one body before giving up."""
_MOST_PLACES = 10_000_000
"""Of all bodies together in one walk: some 400 MB."""


@dataclass(frozen=True, eq=False)
class Crowd:
    """The bodies and their floor plan.

    Parameters
    ----------
    count : of bodies
    diameter_m : of each [m]
    low, high : (2,) - corners of the room [m]
    speed_mps : of all bodies, without noise [m/s]
    noise_sd_m : added to each step on each axis [m]
    step_s : time of a step [s]
    walls : convex polygons (k, 2) on the floor plan [m]

    Raises
    ------
    ValueError : a room without space for a single body, a wall that is not convex, or a number outside its
        range
    """

    count: int
    diameter_m: float
    low: FloatArray
    high: FloatArray
    speed_mps: float
    noise_sd_m: float
    step_s: Seconds
    walls: tuple[FloatArray, ...] = ()

    def __post_init__(self) -> None:
        if self.count < 1:
            raise ValueError(f"count: must be at least 1, got {self.count}")
        if not (self.diameter_m >= 0.0 and self.noise_sd_m >= 0.0):
            raise ValueError(
                f"diameter_m, noise_sd_m: must be at least 0, got {self.diameter_m}, {self.noise_sd_m} [m]"
            )
        if not (self.speed_mps > 0.0 and self.step_s > 0.0):
            raise ValueError(
                f"speed_mps, step_s: must be above 0, got {self.speed_mps} [m/s], {self.step_s} [s]"
            )
        for number, polygon in enumerate(self.walls):
            if not is_convex(polygon):
                raise ValueError(
                    f"walls[{number}]: must be convex with an area and no straight corner, "
                    f"got {polygon.tolist()} [m]; divide it or leave the corner out"
                )
        if not (self.high - self.low > self.diameter_m).all():
            sides = (self.high - self.low).tolist()
            raise ValueError(
                f"low, high: must leave room for a body of {self.diameter_m:g} m, got sides of {sides} [m]"
            )

    def placed(self, generator: np.random.Generator) -> FloatArray:
        """Draw places (n, 2) for the bodies, uniformly where nothing is in the way [m].

        Raises
        ------
        ValueError : there is no place left
        """
        margin = 0.5 * self.diameter_m
        low, high = self.low + margin, self.high - margin
        places = np.empty((self.count, 2))
        for body in range(self.count):
            for _ in range(_MOST_TRIES):
                x, y = low + (high - low) * generator.random(2)
                if self._is_free(x, y) and is_clear(x, y, places[:body], -1, self.diameter_m):
                    places[body] = x, y
                    break
            else:
                raise ValueError(
                    f"room: must hold {self.count} bodies of {self.diameter_m:g} m beside its walls, "
                    f"found no place for body {body} in {_MOST_TRIES} tries; take fewer or smaller ones"
                )
        return places

    def paths(self, generator: np.random.Generator, steps: int) -> FloatArray:
        """Draw the places (steps + 1, n, 2) at the instants 0, step_s, 2 step_s, ... [m].

        A longer walk goes on where a shorter one ends.

        Parameters
        ----------
        generator : source of randomness
        steps : to walk
        """
        places = self.placed(generator)
        parts, targets = [places[np.newaxis]], places
        for _ in range(0, steps, _BLOCK):
            shape = (_BLOCK, self.count, 2)
            fresh = generator.uniform(self.low, self.high, shape)
            noise = generator.normal(0.0, self.noise_sd_m, shape)
            walked, targets = walk(
                frozen(parts[-1][-1], np.float64),
                frozen(targets, np.float64),
                frozen(fresh, np.float64),
                frozen(noise, np.float64),
                self.speed_mps * self.step_s,
                self.diameter_m,
                frozen(self.low, np.float64),
                frozen(self.high, np.float64),
                *self._walls,
            )
            parts.append(walked)
        return np.concatenate(parts)[: steps + 1]

    def motions(
        self, generator: np.random.Generator, until_s: Seconds, height_m: float | FloatArray
    ) -> tuple[TimedPath, ...]:
        """Draw one motion for each body, its middle at a constant height.

        Parameters
        ----------
        generator : source of randomness
        until_s : the walk lasts so long at least [s]
        height_m : of the bodies' middles, (n,) or the same for all [m]

        Raises
        ------
        ValueError : there is no place left for a body, or there were millions of places to walk to
        """
        steps = int(np.ceil(until_s / self.step_s))
        if steps * self.count > _MOST_PLACES:
            raise ValueError(
                f"step_s: must give at most {_MOST_PLACES} steps of all bodies in {until_s:g} s, "
                f"got {self.step_s:g} s for {self.count} bodies; take a longer step or a shorter run"
            )
        paths = self.paths(generator, steps)
        times = self.step_s * np.arange(steps + 1, dtype=np.float64)
        heights = np.broadcast_to(height_m, self.count)
        return tuple(
            TimedPath(
                times,
                np.column_stack([paths[:, body], np.full(steps + 1, heights[body])]),
                IDENTITY[np.newaxis],
            )
            for body in range(self.count)
        )

    @cached_property
    def _walls(self) -> tuple[FloatArray, IntArray]:
        planes, starts = half_planes(self.walls)
        return frozen(planes, np.float64), frozen(starts, np.int64)

    def _is_free(self, x: float, y: float) -> bool:
        low, high = frozen(self.low, np.float64), frozen(self.high, np.float64)
        return is_free(x, y, 0.5 * self.diameter_m, low, high, *self._walls)
