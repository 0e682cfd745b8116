"""The tracker: an auxiliary particle filter (Ercan et al. 2007, Fig. 4), and a plain one beside it.

As printed, nothing is said of what happens when all weights are 0, and with 0/1 probabilities they are
soon. Here: p(η) and the first stage have floors, and when the best particle no longer explains what the
seeing cameras say, the particles are drawn anew from the whole room; the step says so.
"""

from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np

from wsnsim.estimation.particle_filter import Lost, Particles, auxiliary_step, plain_step, systematic
from wsnsim.estimation.particles import mean_and_cov
from wsnsim.systems.scanline.likelihood import Likelihood
from wsnsim.systems.scanline.measurement import Report
from wsnsim.systems.scanline.motion import Walkers, WaypointWalk
from wsnsim.systems.scanline.occlusion import Knowledge
from wsnsim.systems.scanline.regions import Rig
from wsnsim.types import FloatArray

_TRIES = 8
"""Places drawn for each particle that is placed anew."""


@dataclass(frozen=True)
class FilterParams:
    """Which filter, and its floors.

    Parameters
    ----------
    kind : auxiliary, the mended Fig. 4; printed, without floors and bounds; plain
    particles : L
    visibility_floor : least p(η)
    first_stage_floor : least first-stage likelihood, as a share of its mean
    bounded : a particle in a wall or outside the room counts as hidden wrongly; printed is without
    lost_sd : standard deviations; when every particle misfits the report by more, all are placed anew
    """

    kind: Literal["auxiliary", "printed", "plain"] = "auxiliary"
    particles: int = 1000
    visibility_floor: float = 1e-3
    first_stage_floor: float = 0.02
    bounded: bool = True
    lost_sd: float = 6.0

    def __post_init__(self) -> None:
        if self.particles < 1:
            raise ValueError(f"particles: must be at least 1, got {self.particles}")
        if not 0.0 <= self.visibility_floor < 1.0:
            raise ValueError(f"visibility_floor: must be 0 to 1, got {self.visibility_floor}")
        if not 0.0 <= self.first_stage_floor < 1.0:
            raise ValueError(f"first_stage_floor: must be 0 to 1, got {self.first_stage_floor}")


@dataclass(frozen=True, eq=False)
class Tracked:
    """The tracker after a step.

    Parameters
    ----------
    particles : weighted states
    replaced : the particles of this step were placed anew
    """

    particles: Particles[Walkers]
    replaced: bool = False

    @property
    def mean(self) -> FloatArray:
        """The estimated place (2,) [m]."""
        return np.asarray(self.particles.weights @ self.particles.states.places)

    @property
    def cov(self) -> FloatArray:
        """The covariance (2, 2) of the place [m²]."""
        return mean_and_cov(self.particles.states.places, self.particles.weights)[1]


@dataclass(frozen=True)
class Tracker:
    """What does not change from step to step.

    Parameters
    ----------
    rig : cameras and room
    walk : motion model of the object
    params : of the filter
    """

    rig: Rig
    walk: WaypointWalk
    params: FilterParams = FilterParams()

    def start(self, generator: np.random.Generator) -> Tracked:
        """Return particles all over the room: nothing is known."""
        room = self.rig.room
        places = generator.uniform(room.low, room.high, (self.params.particles, 2))
        return Tracked(_equal(self.walk.placed(generator, places)))

    def start_about(self, generator: np.random.Generator, place: FloatArray, cov: FloatArray) -> Tracked:
        """Return particles about a place (2,) that is known with a covariance (2, 2) [m²]."""
        places = generator.multivariate_normal(place, cov, self.params.particles, method="eigh")
        return Tracked(_equal(self.walk.placed(generator, places)))

    def step(
        self, generator: np.random.Generator, last: Tracked, report: Report, knowledge: Knowledge
    ) -> Tracked:
        """Take one step of Fig. 4.

        Parameters
        ----------
        generator : source of randomness
        last : tracker after the step before
        report : what was heard of this frame
        knowledge : of the occluders at this frame
        """
        printed = self.params.kind == "printed"
        floor = 0.0 if printed else self.params.visibility_floor
        likelihood = Likelihood(self.rig, report, knowledge, floor, self.params.bounded and not printed)
        try:
            particles = self._posterior(generator, last.particles, likelihood)
        except Lost:
            return self.place_anew(generator, likelihood)
        if not printed and report.seeing:
            # the best particle seldom misfits: then no other is asked
            places, most = particles.states.places, self.params.lost_sd**2
            best = places[[particles.weights.argmax()]]
            if likelihood.misfit(best)[0] > most and likelihood.misfit(places).min() > most:
                return self.place_anew(generator, likelihood)
        return Tracked(particles)

    def place_anew(self, generator: np.random.Generator, likelihood: Likelihood) -> Tracked:
        """Draw places all over the room, and of these by their likelihood, as if the track began."""
        room, count = self.rig.room, self.params.particles
        places = generator.uniform(room.low, room.high, (_TRIES * count, 2))
        logs = likelihood.log_density(places)
        largest = logs.max()
        if np.isfinite(largest):
            weights = np.exp(logs - largest)
            # every eighth of a systematic draw is one itself
            places = places[systematic(generator, weights / weights.sum())[::_TRIES]]
        else:
            places = places[:count]
        return Tracked(_equal(self.walk.placed(generator, places)), replaced=True)

    def _posterior(
        self, generator: np.random.Generator, particles: Particles[Walkers], likelihood: Likelihood
    ) -> Particles[Walkers]:
        propagate = partial(self.walk.propagate, generator)

        def log_density(walkers: Walkers) -> FloatArray:
            return likelihood.log_density(walkers.places)

        if self.params.kind == "plain":
            return plain_step(generator, particles, propagate, log_density)
        floor = 0.0 if self.params.kind == "printed" else self.params.first_stage_floor
        return auxiliary_step(generator, particles, self.walk.expected, propagate, log_density, floor)


def _equal(walkers: Walkers) -> Particles[Walkers]:
    count = len(walkers.places)
    return Particles(walkers, np.full(count, 1.0 / count))
