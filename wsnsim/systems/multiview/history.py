"""The N-scan smoothed history of a track: an output of its own, some steps late.

Kushwaha & Koutsoukos 2013, Sec. 4.2.1 smooth the position estimate over N scans; what
came later cannot change the current estimate, but it improves those before.
"""

from dataclasses import dataclass
from typing import Self

from wsnsim.estimation.kalman import Gaussian, constant_velocity
from wsnsim.estimation.smoothing import smoothed
from wsnsim.types import Seconds


@dataclass(frozen=True)
class History:
    """Filtered beliefs of the last steps, oldest first, none of them smoothed yet.

    Parameters
    ----------
    lag : N, steps that a smoothed belief waits for; 0: nothing is kept
    beliefs : step number and belief (6,) at it, of consecutive steps
    """

    lag: int
    beliefs: tuple[tuple[int, Gaussian], ...] = ()

    def followed_by(self, step: int, belief: Gaussian) -> Self:
        """Return the history with one step more."""
        if self.lag == 0:
            return self
        return type(self)(self.lag, (*self.beliefs, (step, belief)))

    def ripe(self, dt: Seconds, acceleration_sd: float) -> tuple[tuple[tuple[int, Gaussian], ...], Self]:
        """Return step and smoothed belief of all that are N steps old, and the history without them."""
        count = max(0, len(self.beliefs) - self.lag)
        return self._smoothed(dt, acceleration_sd)[:count], type(self)(self.lag, self.beliefs[count:])

    def rest(self, dt: Seconds, acceleration_sd: float) -> tuple[tuple[int, Gaussian], ...]:
        """Return step and smoothed belief of all steps: nothing more will come."""
        return self._smoothed(dt, acceleration_sd)

    def _smoothed(self, dt: Seconds, acceleration_sd: float) -> tuple[tuple[int, Gaussian], ...]:
        if not self.beliefs:
            return ()
        steps, filtered = zip(*self.beliefs, strict=True)
        return tuple(zip(steps, smoothed(filtered, *constant_velocity(dt, acceleration_sd)), strict=True))
