"""What a link loses beyond its distance: log-normal shadowing, fixed while a run lasts.

Walls, plants and antennas make some links better and others worse than the
mean at their distance: a normal part in decibels for each pair of nodes, the
same in both directions, and a smaller one by which the two directions differ.
Left out: correlation between links that pass the same obstacle. What changes
in time is fading (`wsnsim.net.channel.fading`). A link's part hangs on the
names of its two nodes alone, so that adding, moving or re-ordering nodes leaves
all others as they are.

References
----------
Zuniga, Krishnamachari, Analyzing the transitional region in low power wireless
links (SECON 2004), eq. 1 (log-normal shadowing, 4 dB measured outdoors); the
same, An analysis of unreliability and asymmetry in low-power wireless links
(ACM TOSN 3(2), 2007), for links that differ by direction; Castalia 3.3,
WirelessChannel (`sigma`, `bidirectionalSigma`), for the form of the second part.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot

import numpy as np

from wsnsim.net.channel.pair_draws import pair_normals
from wsnsim.net.channel.propagation import Altered, Propagation
from wsnsim.rng import RandomStreams
from wsnsim.types import FloatArray, IntArray, NodeId

_STREAM = "net.shadowing"
_LUCK = 3.0
"""Standard deviations by which shadowing may bring a pair into reach. With 4 dB and an exponent of 3 that
leaves out one link in 700 of a large network, all of them near the floor."""


@dataclass(frozen=True, eq=False)
class Shadowed(Altered):
    """Path loss between fixed nodes: the mean at their distance and each link's own part.

    Parameters
    ----------
    mean : loss by distance alone
    nodes : names, in the order of the positions it is called with
    shadowing_sd_db : standard deviation of the part that both directions of a link share [dB]
    asymmetry_sd_db : standard deviation of the difference between them; half of the difference is added
        to one, and taken from the other [dB]
    streams : `net.shadowing` of each pair of nodes is used
    """

    mean: Propagation
    nodes: Sequence[NodeId]
    shadowing_sd_db: float
    asymmetry_sd_db: float
    streams: RandomStreams

    def loss_db(self, positions: FloatArray, senders: IntArray, receivers: IntArray) -> FloatArray:
        """Return the loss (m,) from nodes to others [dB].

        Raises
        ------
        ValueError : `positions` are not those of the nodes the shadowing is for
        """
        check_nodes(self.nodes, positions)
        return self.mean.loss_db(positions, senders, receivers) + self.extra_db(senders, receivers)

    def extra_db(self, senders: IntArray, receivers: IntArray) -> FloatArray:
        """Return what is lost beyond the mean on the way from nodes to others, (m,) [dB]."""
        shared, between = pair_normals(_STREAM, self.nodes, senders, receivers, self.streams)
        return np.asarray(self.shadowing_sd_db * shared + 0.5 * self.asymmetry_sd_db * between)

    def reach_m(self, positions: FloatArray, loss_db: float) -> float:
        """Return a distance beyond which next to no pair loses less [m]: 1 in 700, and fewer farther away."""
        sd_db = hypot(self.shadowing_sd_db, 0.5 * self.asymmetry_sd_db)
        return self.mean.reach_m(positions, loss_db + _LUCK * sd_db)


def check_nodes(nodes: Sequence[NodeId], positions: FloatArray) -> None:
    """Raise ValueError where positions (n, 3) are not as many as the nodes that something was made for."""
    if len(positions) != len(nodes):
        raise ValueError(f"positions: must be those of {len(nodes)} nodes, got {len(positions)}")
