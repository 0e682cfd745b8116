"""Broadcasts that are to be repeated: each waits for a random while, and is then sent like a new one."""

from collections.abc import Callable

import numpy as np

from wsnsim.net.clock import Clock
from wsnsim.net.parcel import Parcel
from wsnsim.types import Seconds
from wsnsim.units import to_ns


class Repeats:
    """What waits at one node to be broadcast again.

    Parameters
    ----------
    clock : the event clock
    rng : draws the pauses
    pause_s : longest pause [s]
    send : takes a frame when its pause is over
    """

    def __init__(
        self, clock: Clock, rng: np.random.Generator, pause_s: Seconds, send: Callable[[Parcel], None]
    ) -> None:
        self._clock, self._rng, self._pause_s, self._send = clock, rng, pause_s, send
        self._pausing: dict[Parcel, None] = {}

    def __len__(self) -> int:
        return len(self._pausing)

    def add(self, parcel: Parcel) -> None:
        """Broadcast a frame that has just been sent again, after a while; one time less is left then."""
        load = parcel.load
        assert load is not None
        load.copies += 1
        again = Parcel(
            parcel.flight,
            parcel.header,
            parcel.body,
            False,
            load=load,
            sequence=parcel.sequence,
            repeats=parcel.repeats - 1,
        )
        self._pausing[again] = None

        def resume() -> None:
            if again in self._pausing:
                del self._pausing[again]
                self._send(again)

        self._clock.call(to_ns(self._rng.random() * self._pause_s), resume)

    def drain(self) -> tuple[Parcel, ...]:
        """Take everything out and return it."""
        pausing, self._pausing = self._pausing, {}
        return tuple(pausing)
