"""Nodes that are better or worse than their data sheet: transmit power and receiver, fixed for each node.

A node's offsets weigh on all its links alike, and make those between a good and a bad
one asymmetric. A receiver's is a gain in front of it, so that it weakens interference as much as
signals: to signal over noise it is what a noise floor that is higher by so much would be, and
carrier sense is as much deafer.

References
----------
Zuniga, Krishnamachari, An analysis of unreliability and asymmetry in low-power wireless links (ACM TOSN
3(2), 2007), sec. 5 (hardware variance: output power and noise floor of a node jointly normal); their
link layer model for TOSSIM gives for the MICA2 variances of 6.0 (power) and 3.7 (noise floor) dB² and a
covariance of -3.3, and 1.2, 0.9 and -0.7 for hardware that varies less.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np

from wsnsim.net.channel.propagation import Altered, Propagation
from wsnsim.rng import RandomStreams
from wsnsim.types import FloatArray, IntArray, NodeId

_STREAM = "net.offsets"


@dataclass(frozen=True, eq=False)
class Offset(Altered):
    """Path loss between nodes of unequal hardware.

    Parameters
    ----------
    mean : loss between nodes as the data sheet has them
    tx_db : (n,) - what each node sends beyond its nominal power [dB]
    rx_db : (n,) - what each node hears beyond a nominal one [dB]
    """

    mean: Propagation
    tx_db: FloatArray
    rx_db: FloatArray

    def loss_db(self, positions: FloatArray, senders: IntArray, receivers: IntArray) -> FloatArray:
        """Return the loss (m,) from nodes to others [dB].

        Raises
        ------
        ValueError : `positions` are not those of the nodes the offsets are for
        """
        if len(positions) != len(self.tx_db):
            raise ValueError(f"positions: must be those of {len(self.tx_db)} nodes, got {len(positions)}")
        return self.mean.loss_db(positions, senders, receivers) - self.tx_db[senders] - self.rx_db[receivers]

    def reach_m(self, positions: FloatArray, loss_db: float) -> float:
        """Return a distance beyond which no pair loses less [m]."""
        best_db = float(self.tx_db.max(initial=0.0) + self.rx_db.max(initial=0.0))
        return self.mean.reach_m(positions, loss_db + best_db)


def node_offsets(
    nodes: Sequence[NodeId], tx_sd_db: float, rx_sd_db: float, correlation: float, streams: RandomStreams
) -> tuple[FloatArray, FloatArray]:
    """Draw the offsets of all nodes.

    Parameters
    ----------
    nodes : names
    tx_sd_db, rx_sd_db : standard deviations of transmit power and receiver [dB]
    correlation : between the two, -1 to 1; positive where good transmitters are good receivers [-]
    streams : `net.offsets` of each node is used

    Returns
    -------
    tx_db, rx_db : (n,), (n,) - [dB]
    """
    draws = np.array([streams.stream(_STREAM, node).standard_normal(2) for node in nodes]).reshape(-1, 2)
    own = sqrt(1.0 - correlation**2)
    return tx_sd_db * draws[:, 0], rx_sd_db * (correlation * draws[:, 0] + own * draws[:, 1])
