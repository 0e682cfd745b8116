"""One step of a particle filter: plain, or auxiliary, which looks ahead before it draws.

The states may be anything that can be taken by index; how they move and what explains a measurement are
functions. Weights stay in the log domain; when no particle is left, the caller is told.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, Protocol, Self, TypeVar

import numpy as np

from wsnsim.types import FloatArray, IntArray


class States(Protocol):
    """The states of all particles."""

    def take(self, indices: IntArray) -> Self:
        """Return the states at indices (m,), repeated ones repeated."""


S = TypeVar("S", bound=States)


@dataclass(frozen=True, eq=False)
class Particles(Generic[S]):
    """Weighted states.

    Parameters
    ----------
    states : of m particles
    weights : (m,) sum to one
    """

    states: S
    weights: FloatArray

    @property
    def effective(self) -> float:
        """The number of equally weighted particles that would be worth as much, 1 to m (Kong et al. 1994)."""
        return 1.0 / float(self.weights @ self.weights)


class Lost(Exception):  # noqa: N818 - an event that is handled, not a fault
    """No particle has a weight above 0."""


def systematic(generator: np.random.Generator, weights: FloatArray) -> IntArray:
    """Draw as many indices (m,) as there are weights, each floor(m w) times or once more, in order.

    Parameters
    ----------
    generator : source of randomness; one uniform draw
    weights : (m,) sum to one

    References
    ----------
    Kitagawa (1996), Monte Carlo filter and smoother, appendix; Ristic, Arulampalam, Gordon (2004), Table 3.2.
    """
    count = len(weights)
    places = (np.arange(count) + generator.uniform()) / count
    # the last sum may round to below the last place
    return np.minimum(np.searchsorted(np.cumsum(weights), places, side="right"), count - 1)


def plain_step(
    generator: np.random.Generator,
    particles: Particles[S],
    propagate: Callable[[S], S],
    log_density: Callable[[S], FloatArray],
    share: float = 0.5,
) -> Particles[S]:
    """Move the particles, weight them, and resample first if few of them count.

    Parameters
    ----------
    generator : source of randomness of the resampling
    particles : posterior of the last step
    propagate : draws new states from the motion model
    log_density : log likelihood (m,) of the measurement, −inf where it is 0
    share : resample where fewer than so many of all particles are effective

    Raises
    ------
    Lost : every weight is 0

    References
    ----------
    Gordon, Salmond, Smith (1993); Ristic, Arulampalam, Gordon (2004), Tables 3.3 and 3.4.
    """
    states, weights = particles.states, particles.weights
    if particles.effective < share * len(weights):
        states = states.take(systematic(generator, weights))
        weights = np.full(len(weights), 1.0 / len(weights))
    states = propagate(states)
    return Particles(states, _posterior(_log(weights) + log_density(states)))


def auxiliary_step(
    generator: np.random.Generator,
    particles: Particles[S],
    foresee: Callable[[S], S],
    propagate: Callable[[S], S],
    log_density: Callable[[S], FloatArray],
    floor: float = 0.02,
) -> Particles[S]:
    """Resample by how well the expected next states explain the measurement, then move and weight.

    Parameters
    ----------
    generator : source of randomness of the resampling
    particles : posterior of the last step
    foresee : κ, the expected next states
    propagate : draws new states from the motion model
    log_density : log likelihood (m,) of the measurement, −inf where it is 0
    floor : least first-stage likelihood, as a share of its mean; 0 is the textbook's form, in which a
        particle whose expected state is ruled out has no descendants, wherever they might have gone

    Raises
    ------
    Lost : every weight of a stage is 0

    References
    ----------
    Pitt & Shephard (1999); Ristic, Arulampalam, Gordon (2004), Table 3.5.
    """
    first = log_density(foresee(particles.states))
    largest = first.max()
    if floor > 0.0 and largest > -np.inf:
        mean = float(particles.weights @ np.exp(first - largest))
        if mean > 0.0:
            first = np.maximum(first, largest + np.log(floor * mean))
    chosen = systematic(generator, _posterior(_log(particles.weights) + first))
    states = propagate(particles.states.take(chosen))
    return Particles(states, _posterior(log_density(states) - first[chosen]))


def _log(weights: FloatArray) -> FloatArray:
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(weights))


def _posterior(logs: FloatArray) -> FloatArray:
    largest = logs.max()
    if not np.isfinite(largest):
        raise Lost
    weights = np.exp(logs - largest)
    return np.asarray(weights / weights.sum())
