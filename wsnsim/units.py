"""Conversions between the event clock (integer nanoseconds) and SI numbers."""

from wsnsim.types import Nanoseconds, Seconds

NS_PER_S = 1_000_000_000


def to_ns(seconds: Seconds) -> Nanoseconds:
    """Round a time [s] to the event clock's nanoseconds."""
    return round(seconds * NS_PER_S)


def to_s(nanoseconds: Nanoseconds) -> Seconds:
    """Turn event-clock nanoseconds into seconds."""
    return nanoseconds / NS_PER_S


def instant_ns(start_s: Seconds, index: int, rate_hz: float) -> Nanoseconds:
    """Return the `index`-th instant of a periodic series, never accumulated.

    Parameters
    ----------
    start_s : time of instant 0 [s]
    index : number of the instant
    rate_hz : instants a second [Hz]
    """
    return round((start_s + index / rate_hz) * NS_PER_S)
