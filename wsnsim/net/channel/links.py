"""Who arrives where, and how loud: the links of a network, by sender, with the hopeless ones left out.

A network of n nodes has n² pairs, but a node hears a number of others that
hangs on the density alone. Links that arrive far below the noise are left out,
so that memory and the work for a frame do not grow with the network.
"""

from dataclasses import dataclass
from functools import cached_property
from math import inf

import numpy as np

from wsnsim.types import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Links:
    """Links of n nodes, in rows by sender; within a row receivers ascend.

    Parameters
    ----------
    starts : (n + 1,) - row i is the links from starts[i] to starts[i + 1], the latter excluded
    receivers : (m,) - where each link ends
    power_dbm : (m,) - what arrives there [dBm]
    """

    starts: IntArray
    receivers: IntArray
    power_dbm: FloatArray

    @property
    def nodes(self) -> int:
        """Number of nodes."""
        return len(self.starts) - 1

    @cached_property
    def power_mw(self) -> FloatArray:
        """(m,) - what arrives at the end of each link [mW]."""
        return np.asarray(10.0 ** (self.power_dbm / 10.0))

    def row(self, sender: int) -> slice:
        """Return which links are those of a sender."""
        return slice(int(self.starts[sender]), int(self.starts[sender + 1]))

    def arriving_dbm(self, sender: int, receiver: int) -> float:
        """Return the power of one node at another [dBm]; minus infinity where there is no link."""
        row = self.row(sender)
        at = int(np.searchsorted(self.receivers[row], receiver))
        if at == row.stop - row.start or self.receivers[row.start + at] != receiver:
            return -inf
        return float(self.power_dbm[row.start + at])

    @classmethod
    def from_matrix(cls, power_dbm: FloatArray, floor_dbm: float = -inf) -> "Links":
        """Return the links above `floor_dbm` of a matrix (n, n), from node i to node j [dBm]."""
        wanted = power_dbm > floor_dbm
        np.fill_diagonal(wanted, False)
        senders, receivers = np.nonzero(wanted)
        starts = np.searchsorted(senders, np.arange(len(power_dbm) + 1))
        return cls(starts.astype(np.int64), receivers.astype(np.int64), power_dbm[senders, receivers])
