"""Who arrives where, and how loud: the links of a network, by sender, with the hopeless ones left out.

A network of n nodes has n² pairs, but a node hears a number of others that
hangs on the density alone. Links that arrive far below the noise are left out,
so that memory and the work for a frame do not grow with the network.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from math import inf, isinf

import numpy as np

from wsnsim.errors import WsnsimError
from wsnsim.net.channel.propagation import Propagation, every_pair
from wsnsim.types import FloatArray, IntArray

MARGIN_DB = 10.0
"""How far below the noise a link may arrive and still count [dB]. One frame that is left out would raise
noise and interference by less than a tenth, 0.4 dB; k of them at once by less than k tenths. With an
exponent of 3 all nodes beyond, if all sent at once, would bring 0.2 of the noise for each node within."""
SMALL_NODES = 300
"""Networks up to this size keep all their links."""
_MOST_LINKS = 20_000_000
"""More would take gigabytes."""
_PAIRS_AT_ONCE = 500_000


class LinksError(WsnsimError):
    """A network whose links cannot be made."""


@dataclass(frozen=True, eq=False)
class Links:
    """Links of n nodes, in rows by sender; within a row receivers ascend.

    Parameters
    ----------
    starts : (n + 1,) - row i is the links from starts[i] to starts[i + 1], the latter excluded
    receivers : (m,) - where each link ends
    power_dbm : (m,) - what arrives there [dBm]
    delivery : (m,) - share of frames that get through over a long time, apart from what noise and other
        frames do, for who looks for routes [-]; None: all. A channel whose links are not perfect
        has `Losses` that say when frames are lost.
    """

    starts: IntArray
    receivers: IntArray
    power_dbm: FloatArray
    delivery: FloatArray | None = None

    @property
    def nodes(self) -> int:
        """Number of nodes."""
        return len(self.starts) - 1

    @cached_property
    def senders(self) -> IntArray:
        """(m,) - where each link begins."""
        return np.repeat(np.arange(self.nodes), np.diff(self.starts))

    @cached_property
    def power_mw(self) -> FloatArray:
        """(m,) - what arrives at the end of each link [mW]."""
        return np.asarray(10.0 ** (self.power_dbm / 10.0))

    @cached_property
    def reverse(self) -> IntArray:
        """(m,) - which link leads back from the end of each to its begin; -1 where none does."""
        keys = self.senders * self.nodes + self.receivers
        wanted = self.receivers * self.nodes + self.senders
        at = np.searchsorted(keys, wanted)
        found = keys[np.minimum(at, len(keys) - 1)] == wanted
        return np.where(found, at, -1)

    @cached_property
    def strength_dbm(self) -> FloatArray:
        """(m,) - power of the weaker direction [dBm]; minus infinity where no link leads back."""
        back_dbm = np.where(self.reverse >= 0, self.power_dbm[self.reverse], -inf)
        return np.minimum(self.power_dbm, back_dbm)

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

    def above(self, floor_dbm: float) -> "Links":
        """Return the links that arrive with that power or more."""
        kept = self.power_dbm >= floor_dbm
        starts = np.concatenate(([0], np.cumsum(kept)))[self.starts]
        delivery = None if self.delivery is None else self.delivery[kept]
        return Links(starts, self.receivers[kept], self.power_dbm[kept], delivery)

    def matrix(self, values: FloatArray, missing: float) -> FloatArray:
        """Return one value of each link (m,) as a matrix (n, n), from node i to node j."""
        full = np.full((self.nodes, self.nodes), missing)
        full[self.senders, self.receivers] = values
        return full

    @classmethod
    def from_matrix(cls, power_dbm: FloatArray, floor_dbm: float = -inf) -> "Links":
        """Return the links above `floor_dbm` of a matrix (n, n), from node i to node j [dBm]."""
        wanted = power_dbm > floor_dbm
        np.fill_diagonal(wanted, False)
        senders, receivers = np.nonzero(wanted)
        return cls.from_pairs(len(power_dbm), senders, receivers, power_dbm[senders, receivers])

    @classmethod
    def from_pairs(
        cls,
        nodes: int,
        senders: IntArray,
        receivers: IntArray,
        power_dbm: FloatArray,
        delivery: FloatArray | None = None,
    ) -> "Links":
        """Return the links (m,) that lead from senders to receivers, each pair once, in any order."""
        order = np.lexsort((receivers, senders))
        starts = np.searchsorted(senders[order], np.arange(nodes + 1))
        return cls(
            starts.astype(np.int64),
            receivers[order].astype(np.int64),
            power_dbm[order],
            None if delivery is None else delivery[order],
        )


def links_between(
    positions: FloatArray, propagation: Propagation, tx_power_dbm: float, floor_dbm: float = -inf
) -> Links:
    """Return the links that arrive above a floor.

    Parameters
    ----------
    positions : (n, 3) - where the nodes are [m]
    propagation : the path loss
    tx_power_dbm : what every node sends [dBm]
    floor_dbm : power at which a link is left out [dBm]

    Raises
    ------
    LinksError : too many links
    """
    found, count = [], 0
    for senders, receivers in _pairs(positions, propagation.reach_m(positions, tx_power_dbm - floor_dbm)):
        power_dbm = tx_power_dbm - propagation.loss_db(positions, senders, receivers)
        kept = power_dbm > floor_dbm
        found.append((senders[kept], receivers[kept], power_dbm[kept]))
        count += len(found[-1][0])
        if count > _MOST_LINKS:
            raise LinksError(
                f"links: at most {_MOST_LINKS} may arrive above {floor_dbm:.1f} dBm, got more between "
                f"{len(positions)} nodes; lower the transmit power, or choose a path loss that grows faster"
            )
    return Links.from_pairs(len(positions), *(np.concatenate(column) for column in zip(*found, strict=True)))


def floor_of(nodes: int, noise_dbm: float, margin_db: float = MARGIN_DB) -> float:
    """Return the power at which links of a network are left out [dBm]: none up to `SMALL_NODES`."""
    return -inf if nodes <= SMALL_NODES else noise_dbm - margin_db


def _pairs(positions: FloatArray, reach_m: float) -> Iterator[tuple[IntArray, IntArray]]:
    """Yield the ordered pairs of nodes no farther apart than that, some at a time."""
    nodes = len(positions)
    if nodes <= SMALL_NODES and isinf(reach_m):
        yield every_pair(nodes)
        return
    from scipy.spatial import cKDTree

    tree = cKDTree(positions)
    # a tree takes no infinite distance
    near_m = min(reach_m, 1.0 + 2.0 * float(np.linalg.norm(np.ptp(positions, axis=0))))
    some = max(1, _PAIRS_AT_ONCE * nodes // max(1, int(tree.count_neighbors(tree, near_m))))
    for begin in range(0, nodes, some):
        near = cKDTree(positions[begin : begin + some]).sparse_distance_matrix(
            tree, near_m, output_type="ndarray"
        )
        # each pair once, then both ways
        ones, others = near["i"] + begin, near["j"]
        once = ones < others
        ones, others = ones[once], others[once]
        yield np.concatenate((ones, others)), np.concatenate((others, ones))
