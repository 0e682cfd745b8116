"""What overlapping frames do to each other, and what a carrier sense makes of them.

Each model is one small function; the medium asks it and knows no more.
"""

from collections.abc import Callable, Sequence
from math import inf
from typing import TypeAlias

from wsnsim.net.config import CcaModel, CollisionModel
from wsnsim.net.phy.base import Phy
from wsnsim.types import Nanoseconds

Stretch: TypeAlias = tuple[Nanoseconds, Nanoseconds, int]
"""Begin and end of a part of a frame, from the frame's begin on [ns], and the frame's bit rate."""

Survival: TypeAlias = Callable[[float, Sequence[float], Stretch], float]
"""Power of the wanted frame [mW], powers of the frames over it [mW], the stretch → log of the probability
of success."""

Span: TypeAlias = tuple[Nanoseconds, Nanoseconds, float]
"""Begin and end of a frame [ns], and its power where one listens [mW]."""

PeakPower: TypeAlias = Callable[[Sequence[Span], Nanoseconds, Nanoseconds], float]
"""Frames that overlap a window, its begin and end → the power that counts [mW]."""


def survival(model: CollisionModel, phy: Phy, noise_mw: float, sensitivity_mw: float) -> Survival:
    """Return how a stretch of a frame survives what overlaps it.

    Parameters
    ----------
    model : `sinr`, where all other power is noise to the decoder; or `destructive`, where any
        frame that a receiver would notice by itself destroys what it overlaps
    phy : what noise does to bits
    noise_mw : noise in the receiver [mW]
    sensitivity_mw : weakest frame that a receiver notices [mW]
    """

    def by_sinr(wanted_mw: float, others_mw: Sequence[float], stretch: Stretch) -> float:
        return phy.log_success(wanted_mw / (noise_mw + sum(others_mw)), *stretch)

    def destroyed(wanted_mw: float, others_mw: Sequence[float], stretch: Stretch) -> float:
        if any(power >= sensitivity_mw for power in others_mw):
            return -inf
        return by_sinr(wanted_mw, others_mw, stretch)

    return {"sinr": by_sinr, "destructive": destroyed}[model]


def peak_power(model: CcaModel) -> PeakPower:
    """Return what clear channel assessment measures.

    Parameters
    ----------
    model : `whole_window`, the largest power at any time of it; or `end_of_window`, the power
        just before its end or at the beginning of a frame inside it
    """

    def whole_window(spans: Sequence[Span], since: Nanoseconds, until: Nanoseconds) -> float:
        return _largest(spans, [since, *(begin for begin, _, _ in spans if begin > since)])

    def end_of_window(spans: Sequence[Span], since: Nanoseconds, until: Nanoseconds) -> float:
        return _largest(spans, [until - 1, *(begin for begin, _, _ in spans if begin >= since)])

    return {"whole_window": whole_window, "end_of_window": end_of_window}[model]


def _largest(spans: Sequence[Span], instants: Sequence[Nanoseconds]) -> float:
    """Return the largest total power at any of the instants; power grows only where a frame begins."""
    return max(sum(power for begin, end, power in spans if begin <= instant < end) for instant in instants)
