"""Switching a transceiver off and on again, for MACs that let it sleep.

A radio that is switched on hears and sends nothing until its crystal runs
steadily, and draws little until then. Left out: the start of the voltage
regulator, and of the microcontroller.

References
----------
Texas Instruments, CC2420 data sheet (SWRS041): crystal oscillator start-up time.
"""

from collections.abc import Callable
from typing import TYPE_CHECKING

from wsnsim.types import Nanoseconds

if TYPE_CHECKING:
    from wsnsim.net.clock import Call, Clock
    from wsnsim.net.phy.medium import Medium, Radio

START_UP_NS: Nanoseconds = 860_000
"""Of the CC2420's crystal oscillator."""


class Napper:
    """Lets one radio sleep, and wakes it.

    Parameters
    ----------
    clock : the event clock
    medium : the channel
    radio : awake at first
    """

    def __init__(self, clock: "Clock", medium: "Medium", radio: "Radio") -> None:
        self._clock, self._medium, self._radio = clock, medium, radio
        self._starting: Call | None = None
        self.asleep = False

    @property
    def starting(self) -> bool:
        """Whether the radio has been switched on and is not ready yet."""
        return self._starting is not None

    def sleep(self) -> None:
        """Switch the radio off; it must not be sending."""
        self._cancel()
        self.asleep = True
        self._medium.unwatch(self._radio)
        self._medium.sleep(self._radio)

    def wake(self, ready: Callable[[], None], turnaround_ns: Nanoseconds | None = None) -> None:
        """Switch the radio on and call `ready` as soon as it can be used.

        Parameters
        ----------
        ready : what to do then
        turnaround_ns : None: it shall listen. Else: it shall send, and turns round for so long first [ns]
        """
        self.asleep = False
        self._medium.start(self._radio)

        def started() -> None:
            self._starting = None
            self._medium.wake(self._radio)
            if turnaround_ns is None:
                ready()
            else:
                self._medium.turn(self._radio)
                self._starting = self._clock.call(turnaround_ns, turned)

        def turned() -> None:
            self._starting = None
            ready()

        self._starting = self._clock.call(START_UP_NS, started)

    def stop(self) -> None:
        """Switch the radio off for good."""
        self._cancel()
        self._medium.unwatch(self._radio)
        self._medium.silence(self._radio)

    def _cancel(self) -> None:
        if self._starting is not None:
            self._starting.cancel()
            self._starting = None
