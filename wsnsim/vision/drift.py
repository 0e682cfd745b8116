"""Light that changes slowly: a factor on the brightness of a whole image, step by step.

Stands for clouds, dusk, lamps that warm up and the camera's slow exposure control. All
pixels change alike, whatever they show; colours keep their hue until they are clipped.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from wsnsim.types import Seconds

_BLOCK = 256
"""Steps drawn at once."""


@dataclass(frozen=True)
class SinusoidalDrift:
    """1 + amplitude · sin(2π t / period + phase).

    Parameters
    ----------
    amplitude : share by which brightness rises and falls, below 1
    period_s : [s]
    phase_rad : at time 0 [rad]
    rate_hz : steps a second [Hz]
    """

    amplitude: float
    period_s: Seconds
    phase_rad: float
    rate_hz: float

    def __call__(self, step: int) -> float:
        """Return the factor at a step."""
        turns = step / self.rate_hz / self.period_s
        return 1.0 + self.amplitude * math.sin(2.0 * math.pi * turns + self.phase_rad)


@dataclass(eq=False)
class RandomDrift:
    """exp(x) of a stationary Ornstein–Uhlenbeck process x: median 1, correlation e^(-Δt/τ).

    The factor of a step does not depend on which steps were asked for before.

    Parameters
    ----------
    sd : standard deviation of x
    correlation_s : τ [s]
    rate_hz : steps a second [Hz]
    generator : of its own; drawn from in the order of the steps

    References
    ----------
    Gillespie (1996), Exact numerical simulation of the Ornstein–Uhlenbeck process, Phys. Rev. E 54, eq. 3.2.
    """

    sd: float
    correlation_s: Seconds
    rate_hz: float
    generator: np.random.Generator
    _logarithms: list[float] = field(default_factory=list, init=False, repr=False)

    def __call__(self, step: int) -> float:
        """Return the factor at a step."""
        while len(self._logarithms) <= step:
            self._draw()
        return math.exp(self._logarithms[step])

    def _draw(self) -> None:
        """Draw the next block of steps."""
        kept = math.exp(-1.0 / (self.rate_hz * self.correlation_s))
        fresh = self.sd * math.sqrt(1.0 - kept * kept)
        for normal in self.generator.standard_normal(_BLOCK):
            if self._logarithms:
                self._logarithms.append(kept * self._logarithms[-1] + fresh * float(normal))
            else:
                self._logarithms.append(self.sd * float(normal))
