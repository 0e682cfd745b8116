"""A mote's clock: a crystal that runs a little fast or slow, and can be set.

The deviation is constant while a run lasts. Left out: jitter, temperature and
ageing. Arithmetic is in whole nanoseconds, so that nothing adds up by rounding.

References
----------
IEEE Std 802.15.4-2006, sec. 6.9.4: ±40 ppm at most, for the carrier and with it the symbols.
"""

from wsnsim.types import Nanoseconds

_PARTS = 10**12


class DriftingClock:
    """Shows a time of its own.

    Parameters
    ----------
    drift_ppm : by how much it runs fast, or slow where negative [parts per million]
    """

    def __init__(self, drift_ppm: float) -> None:
        self._gain = round(drift_ppm * _PARTS / 1_000_000)
        self._set_at: Nanoseconds = 0
        self._set_to: Nanoseconds = 0

    def shown_ns(self, true_ns: Nanoseconds) -> Nanoseconds:
        """Return what it shows at a true time [ns]."""
        elapsed = true_ns - self._set_at
        return self._set_to + elapsed + elapsed * self._gain // _PARTS

    def true_ns(self, shown_ns: Nanoseconds) -> Nanoseconds:
        """Return the first true time at which it shows a time, if nobody sets it meanwhile [ns]."""
        return self._set_at - -((shown_ns - self._set_to) * _PARTS) // (_PARTS + self._gain)

    def set(self, true_ns: Nanoseconds, shown_ns: Nanoseconds) -> None:
        """Make it show a time from a true time on [ns]."""
        self._set_at, self._set_to = true_ns, shown_ns
