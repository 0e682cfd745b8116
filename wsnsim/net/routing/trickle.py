"""The Trickle timer: talk often while things change, and ever less while they do not.

An interval has a random instant in its second half at which the node talks,
unless it has heard enough others say the same. Each interval is twice as long
as the last, up to a longest; news makes it the shortest again.

References
----------
Levis, Clausen, Hui, Gnawali, Ko, The Trickle Algorithm, RFC 6206 (2011), sec. 4.2 (rules 1 to 6) and 6.5
(no suppression). Levis, Patel, Culler, Shenker, Trickle (NSDI 2004).
"""

from collections.abc import Callable

import numpy as np

from wsnsim.net.clock import Call, Clock
from wsnsim.types import Nanoseconds
from wsnsim.units import to_ns


class Trickle:
    """The timer of one node.

    Parameters
    ----------
    clock : the event clock
    shortest_s : Imin [s]
    doublings : the longest interval is Imin times 2 to this power
    redundancy : k; 0: never silent
    rng : draws the instants
    talk : called when the node should talk
    """

    def __init__(
        self,
        clock: Clock,
        shortest_s: float,
        doublings: int,
        redundancy: int,
        rng: np.random.Generator,
        talk: Callable[[], None],
    ) -> None:
        self._clock, self._rng, self._talk = clock, rng, talk
        self._shortest_ns: Nanoseconds = to_ns(shortest_s)
        self._longest_ns: Nanoseconds = self._shortest_ns << doublings
        self._redundancy = redundancy
        self._interval_ns = self._shortest_ns
        self._heard = 0
        self._calls: list[Call] = []

    @property
    def interval_ns(self) -> Nanoseconds:
        """Length of the interval that runs [ns]."""
        return self._interval_ns

    def start(self) -> None:
        """Begin with the shortest interval (rule 1; RFC 6206 leaves the first one free)."""
        self._interval_ns = self._shortest_ns
        self._begin()

    def consistent(self) -> None:
        """Note that somebody said what this node would say (rule 3)."""
        self._heard += 1

    def reset(self) -> None:
        """Begin anew with the shortest interval, unless it is running (rule 6)."""
        if self._interval_ns > self._shortest_ns:
            self.start()

    def stop(self) -> None:
        """Be silent for good."""
        for call in self._calls:
            call.cancel()

    def _begin(self) -> None:
        self.stop()
        self._heard = 0
        half = self._interval_ns // 2
        at = half + int(self._rng.random() * (self._interval_ns - half))
        self._calls = [self._clock.call(at, self._speak), self._clock.call(self._interval_ns, self._end)]

    def _speak(self) -> None:
        if self._redundancy == 0 or self._heard < self._redundancy:
            self._talk()

    def _end(self) -> None:
        self._interval_ns = min(2 * self._interval_ns, self._longest_ns)
        self._begin()
