"""The links as frames travel on them: rows of receivers with whole numbers of a tiny unit of power.

Sums of such numbers have no rounding: a frame that ends takes away what it
added when it began, to the last digit. The unit is as small as 61 bits for all
that can ever arrive at one node allow: 184 dB below it, 154 dB where links
fade.
"""

from bisect import bisect_left
from itertools import pairwise
from math import frexp

import numpy as np

from wsnsim.net.channel.channel import Fading
from wsnsim.net.channel.links import Links
from wsnsim.net.clock import Call
from wsnsim.net.phy.base import Transmission
from wsnsim.net.phy.radios import Radio, view
from wsnsim.net.phy.receptions import Reception
from wsnsim.types import FloatArray, IntArray, Nanoseconds

_MOST_BITS = 61
"""Of the power at a node, so that noise can be added to it in 64 bits with a sign."""
_HEADROOM = 1024
"""How far a link that fades may rise over its mean [-]; 30 dB. Rayleigh fading passes it once in e^1024."""


class Row:
    """The links of one sender, and the frame that it has on the air."""

    __slots__ = (
        "ending",
        "first",
        "frame",
        "power_mw",
        "powers",
        "radio",
        "receptions",
        "start",
        "stop",
        "weak",
    )

    def __init__(
        self,
        radio: Radio,
        start: int,
        weak: int,
        stop: int,
        powers: IntArray,
        power_mw: "FloatArray | memoryview[float]",
    ) -> None:
        self.radio = radio
        self.start, self.weak, self.stop = start, weak, stop
        """The first of the links that never reach the sensitivity is `weak`; those before it and from it on
        are in the order of their receivers."""
        self.first = 0
        """The link of the first of the powers."""
        self.powers, self.power_mw = powers, power_mw
        self.frame: Transmission | None = None
        self.receptions: list[Reception] = []
        self.ending: Call | None = None


class Rows:
    """All links.

    Parameters
    ----------
    links : who arrives where
    noise_mw : noise in the receivers [mW]
    sensitivity_mw : weakest frame that a receiver notices [mW]
    fading : how links differ from their means, or None
    """

    def __init__(self, links: Links, noise_mw: float, sensitivity_mw: float, fading: Fading | None) -> None:
        at_nodes = np.bincount(links.receivers, links.power_mw, links.nodes)
        most_mw = float(max(at_nodes.max(initial=0.0), noise_mw)) * (1 if fading is None else _HEADROOM)
        self.unit_mw = 2.0 ** (frexp(most_mw)[1] - _MOST_BITS)
        """One unit [mW]."""
        self.sensitivity = self.count(sensitivity_mw)
        """The sensitivity [unit]."""
        self.receivers: IntArray = np.array(links.receivers, dtype=np.int32)
        self.receiver_of: memoryview[int] = view(self.receivers)
        self._fading = fading
        self._starts: list[int] = links.starts.tolist()
        self._mean_mw: FloatArray = np.array(links.power_mw, dtype=np.float64)
        self._mean = self._count_all(self._mean_mw)
        self._mean_of: memoryview[float] = view(self._mean_mw)
        # Links that fade may rise to the sensitivity, or fall below it.
        self._weak = self._bring_the_weak_last() if fading is None else self._starts[1:]

    def count(self, power_mw: float) -> int:
        """Return a power in units; more than can ever arrive for one that is larger than that."""
        return min(round(power_mw / self.unit_mw), 1 << _MOST_BITS)

    def of(self, radio: Radio) -> Row:
        """Return a node's row."""
        at = radio.index
        return Row(radio, self._starts[at], self._weak[at], self._starts[at + 1], self._mean, self._mean_of)

    def fade(self, row: Row, now_ns: Nanoseconds) -> None:
        """Let the links of a row be what they are now."""
        if self._fading is None:
            return
        links = slice(row.start, row.stop)
        gains = self._fading.gains(row.radio.index, self.receivers[links], now_ns)
        row.power_mw = self._mean_mw[links] * np.minimum(gains, _HEADROOM)
        row.powers, row.first = self._count_all(row.power_mw), row.start

    def arriving(self, row: Row, at: int) -> tuple[float, int]:
        """Return the power of a sender at a node, in milliwatts and in units; 0 where there is no link."""
        for start, stop in ((row.start, row.weak), (row.weak, row.stop)):
            link = bisect_left(self.receiver_of, at, start, stop)
            if link < stop and self.receiver_of[link] == at:
                return float(row.power_mw[link - row.first]), int(row.powers[link - row.first])
        return 0.0, 0

    def _bring_the_weak_last(self) -> list[int]:
        """Bring each node's links into the order that the kernels ask for; return where weak ones begin."""
        weak = []
        for start, stop in pairwise(self._starts):
            links = slice(start, stop)
            too_weak = self._mean[links] < self.sensitivity
            order = np.argsort(too_weak, kind="stable")
            for each in (self.receivers, self._mean, self._mean_mw):
                each[links] = each[links][order]
            weak.append(stop - int(np.count_nonzero(too_weak)))
        return weak

    def _count_all(self, power_mw: FloatArray) -> IntArray:
        return np.asarray(np.rint(power_mw / self.unit_mw), dtype=np.int64)
