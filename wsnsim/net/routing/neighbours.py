"""Who a node can speak with, and how many transmissions a frame to each takes.

The estimate of a link is a moving average of two kinds of samples. Beacons:
of every `BEACON_WINDOW` that a neighbour sent, as their sequence numbers tell,
the share that arrived enters a moving average of its own, whose inverse is a
sample. Data: of every `DATA_WINDOW` transmissions to it, as many as went to
one acknowledgement; where none was acknowledged, all since the last one.
So a link is known by its better half only until it is used, and by both ways
from then on.

Until the first window of beacons is full, the share is taken by the rule of
succession, (arrived + 1) / (sent + 2): one beacon from far away makes nobody a
good neighbour.

Left out: what the demodulator knows of a frame's quality (the estimator's
white bit), and a table of bounded size.

References
----------
Fonseca, Gnawali, Jamieson, Levis, Four-Bit Wireless Link Estimation (HotNets-VI, 2007), sec. 3. TinyOS 2.1,
`LinkEstimatorP.nc` of 4bitle: windows of 3 beacons and 5 transmissions, weight 0.9 of the old value.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from math import inf

from wsnsim.types import Nanoseconds

BEACON_WINDOW = 3
DATA_WINDOW = 5
OLD_WEIGHT = 0.9
_SEQUENCES = 256
_LONGEST_GAP = 10
"""Beacons in a row that were missed, from which a neighbour is taken for a new one (TinyOS: MAX_PKT_GAP)."""


@dataclass(slots=True, eq=False)
class Neighbour:
    """What a node knows of another in its reach."""

    address: int
    cost: float = inf
    """ETX of its way to the base station, as it said last; infinite where it has none."""
    parent: int | None = None
    """Its parent, as it said last."""
    heard_ns: Nanoseconds = 0
    """When it was last known to be there."""
    lost: bool = False
    """Whether it stopped acknowledging, and was not heard since."""
    failed_in_row: int = 0
    """Frames that were given up since the last acknowledgement."""
    etx: float | None = None
    """The estimate; None until a window is full."""
    _quality: float | None = None
    _sequence: int | None = None
    _arrived: int = 0
    _missed: int = 0
    _sent: int = 0
    _acknowledged: int = 0
    _unanswered: int = 0

    @property
    def link_etx(self) -> float:
        """Expected transmissions of a frame until it is acknowledged."""
        if self.etx is not None:
            return self.etx
        return (self._arrived + self._missed + 2.0) / (self._arrived + 1.0)

    @property
    def path_etx(self) -> float:
        """Expected transmissions on the whole way by this neighbour."""
        return self.link_etx + self.cost

    def beacon(self, sequence: int, now: Nanoseconds) -> None:
        """Count a beacon that arrived, and those that did not since the one before."""
        if self._sequence is not None:
            gap = (sequence - self._sequence) % _SEQUENCES
            if gap > _LONGEST_GAP:
                self._quality, self._arrived, self._missed = None, 0, 0
            else:
                self._missed += max(0, gap - 1)
        self._sequence = sequence
        self._arrived += 1
        self.heard_ns, self.lost = now, False
        if self._arrived + self._missed >= BEACON_WINDOW:
            share = self._arrived / (self._arrived + self._missed)
            self._quality = _average(self._quality, share)
            self._arrived = self._missed = 0
            self._sample(1.0 / self._quality)

    def sent(self, attempts: int, acknowledged: bool, now: Nanoseconds) -> None:
        """Count the transmissions of one frame to it, of which the last may have been acknowledged."""
        for attempt in range(1, attempts + 1):
            self._transmission(acknowledged and attempt == attempts)
        if acknowledged:
            self.failed_in_row, self.lost, self.heard_ns = 0, False, now
        else:
            self.failed_in_row += 1

    def give_up(self, etx: float) -> None:
        """Note that it does not answer: not a way to anywhere until it is heard, and a bad one then."""
        self.lost, self.failed_in_row, self.cost, self.parent = True, 0, inf, None
        self.etx = max(etx, self.etx or 0.0)
        self._sent = self._acknowledged = self._unanswered = 0

    def _transmission(self, acknowledged: bool) -> None:
        self._sent += 1
        self._unanswered += 1
        if acknowledged:
            self._acknowledged += 1
            self._unanswered = 0
        if self._sent == DATA_WINDOW:
            self._sample(self._sent / self._acknowledged if self._acknowledged else float(self._unanswered))
            self._sent = self._acknowledged = 0

    def _sample(self, etx: float) -> None:
        self.etx = _average(self.etx, etx)


class NeighbourTable:
    """The neighbours of one node, by address."""

    def __init__(self) -> None:
        self._entries: dict[int, Neighbour] = {}

    def __iter__(self) -> Iterator[Neighbour]:
        """Go through them in the order in which they were met."""
        return iter(self._entries.values())

    def __contains__(self, address: int) -> bool:
        """Return whether a node was ever met."""
        return address in self._entries

    def get(self, address: int | None) -> Neighbour | None:
        """Return what is known of a node, None where it was never met."""
        return None if address is None else self._entries.get(address)

    def meet(self, address: int) -> Neighbour:
        """Return what is known of a node, a new entry where it was never met."""
        entry = self._entries.get(address)
        if entry is None:
            entry = self._entries[address] = Neighbour(address)
        return entry

    def forget_before(self, instant: Nanoseconds) -> list[int]:
        """Remove those that were last heard before an instant, and return their addresses."""
        gone = [entry.address for entry in self._entries.values() if entry.heard_ns < instant]
        for address in gone:
            del self._entries[address]
        return gone


def _average(old: float | None, new: float) -> float:
    return new if old is None else OLD_WEIGHT * old + (1.0 - OLD_WEIGHT) * new
