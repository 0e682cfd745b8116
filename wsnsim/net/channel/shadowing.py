"""What a link loses beyond its distance: log-normal shadowing, fixed while a run lasts.

Walls, plants and antennas make some links better and others worse than the
mean at their distance: a normal part in decibels for each pair of nodes, the
same in both directions, and a smaller one by which the two directions differ.
Left out: correlation between links that pass the same obstacle, and fading in
time. A link's part hangs on the names of its two nodes alone, so that adding,
moving or re-ordering nodes leaves all others as they are.

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

import numpy as np

from wsnsim.net.channel.propagation import Propagation
from wsnsim.rng import RandomStreams
from wsnsim.types import FloatArray, NodeId

_STREAM = "net.shadowing"


@dataclass(frozen=True, eq=False)
class Shadowed:
    """Path loss between fixed nodes: the mean at their distance and each link's own part.

    Parameters
    ----------
    mean : loss by distance alone
    extra_db : (n, n) - what is lost beyond that from node i to node j, in the order of the positions it is
        called with [dB]
    """

    mean: Propagation
    extra_db: FloatArray

    def __call__(self, positions: FloatArray) -> FloatArray:
        """Return the loss (n, n) between the nodes [dB].

        Raises
        ------
        ValueError : `positions` are not those of the nodes the shadowing was drawn for
        """
        if len(positions) != len(self.extra_db):
            raise ValueError(f"positions: must be those of {len(self.extra_db)} nodes, got {len(positions)}")
        return self.mean(positions) + self.extra_db


def mean_of(propagation: Propagation) -> Propagation:
    """Return the path loss by distance alone, which holds at any place."""
    return propagation.mean if isinstance(propagation, Shadowed) else propagation


def shadowing_db(
    nodes: Sequence[NodeId], shadowing_sd_db: float, asymmetry_sd_db: float, streams: RandomStreams
) -> FloatArray:
    """Draw the shadowing of all links.

    Parameters
    ----------
    nodes : names
    shadowing_sd_db : standard deviation of the part that both directions of a link share [dB]
    asymmetry_sd_db : standard deviation of the difference between them; half of the difference is added
        to one, and taken from the other [dB]
    streams : `net.shadowing` of each pair of nodes is used

    Returns
    -------
    (n, n) - loss beyond the mean from node i to node j [dB], 0 on the diagonal
    """
    extra = np.zeros((len(nodes), len(nodes)))
    if shadowing_sd_db == 0.0 and asymmetry_sd_db == 0.0:
        return extra
    order = sorted(range(len(nodes)), key=lambda at: nodes[at])
    for number, one in enumerate(order):
        for other in order[number + 1 :]:
            shared, between = streams.stream(_STREAM, nodes[one], nodes[other]).standard_normal(2)
            extra[one, other] = shadowing_sd_db * shared + 0.5 * asymmetry_sd_db * between
            extra[other, one] = shadowing_sd_db * shared - 0.5 * asymmetry_sd_db * between
    return extra
