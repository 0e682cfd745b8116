"""Trees to the base station that links suggest: of fewest hops, or of fewest transmissions.

References
----------
De Couto, Aguayo, Bicket, Morris, A High-Throughput Path Metric for Multi-Hop Wireless Routing (MobiCom 2003),
sec. 3: ETX.
"""

from collections.abc import Mapping

import networkx as nx
import numpy as np
from numpy.typing import ArrayLike

from wsnsim.net.channel.propagation import Propagation, distances, range_m, received_dbm
from wsnsim.net.channel.shadowing import mean_of
from wsnsim.net.config import RadioConfig, RouteConfig
from wsnsim.net.mac.base import MacFamily
from wsnsim.net.routing.linkquality import expected_transmissions, weakest_usable_dbm
from wsnsim.net.routing.tree import RoutingError, Tree, tree_from_parents
from wsnsim.types import FloatArray, IntArray, NodeId

_ETX_UNITS = 1e9
"""Parts in which a transmission is counted, so that ways are equal or not whatever the order of adding."""


def radio_tree(
    positions: Mapping[NodeId, ArrayLike],
    base: NodeId,
    propagation: Propagation,
    family: MacFamily,
    radio: RadioConfig,
    routes: RouteConfig,
) -> Tree:
    """Return the tree of fewest hops, or of lowest ETX, over links that are good enough, undisturbed.

    Good enough for fewest hops: `link_success_min` of the longest frames arrive, in
    both directions. For the ETX: so much of the frames and their acknowledgements do.

    Parameters
    ----------
    positions : where the nodes are, (x, y, z) [m]; their order breaks ties
    base : the node all routes lead to
    propagation : path loss between nodes
    family : the physical layer and the length of an acknowledgement
    radio : powers and thresholds
    routes : what a link must carry, and `etx_frame_bytes` where the ETX is wanted

    Raises
    ------
    RoutingError : nodes that cannot reach the base
    """
    power_dbm = link_powers(positions, propagation, radio)
    if routes.etx_frame_bytes is not None:
        if routes.etx_frame_bytes > family.phy.max_mpdu_bytes:
            longest = family.phy.max_mpdu_bytes
            raise ValueError(f"etx_frame_bytes: must be 1 to {longest}, got {routes.etx_frame_bytes}")
        etx = expected_transmissions(power_dbm, family.phy, radio, routes.etx_frame_bytes, family.ack_bytes)
        return etx_tree(positions, base, etx, power_dbm, 1.0 / routes.link_success_min)
    weakest_dbm = weakest_usable_dbm(family.phy, radio, routes.link_success_min)
    reach_m = range_m(mean_of(propagation), radio.tx_power_dbm - weakest_dbm)
    return min_hop_tree(positions, base, power_dbm, weakest_dbm, reach_m)


def link_powers(
    positions: Mapping[NodeId, ArrayLike], propagation: Propagation, radio: RadioConfig
) -> FloatArray:
    """Return the power (n, n) of each node at each other [dBm], in the order of `positions`."""
    places = np.array(list(positions.values()), dtype=np.float64).reshape(-1, 3)
    return received_dbm(propagation, places, radio.tx_power_dbm)


def min_hop_tree(
    positions: Mapping[NodeId, ArrayLike],
    base: NodeId,
    power_dbm: FloatArray,
    weakest_dbm: float,
    range_m: float,
) -> Tree:
    """Find the tree of fewest hops over links that are good in both directions.

    Among parents of equal depth the one with the stronger link wins (the weaker
    of its two directions counts), then the one that stands first.

    Parameters
    ----------
    positions : where the nodes are, (x, y, z) [m]; their order breaks ties
    base : the node all routes lead to
    power_dbm : (n, n) - power of node i at node j [dBm], nodes in the order of `positions`
    weakest_dbm : power below which a link is not used [dBm]
    range_m : distance that this power reaches, for the error message [m]

    Raises
    ------
    RoutingError : the base is not a node, or nodes cannot reach it
    """
    strength = np.minimum(power_dbm, power_dbm.T)
    costs = np.where(strength >= weakest_dbm, 1, 0)
    return _cheapest_tree(positions, base, costs, strength, f"of up to {range_m:.1f} m")


def etx_tree(
    positions: Mapping[NodeId, ArrayLike],
    base: NodeId,
    etx: FloatArray,
    power_dbm: FloatArray,
    most_etx: float,
) -> Tree:
    """Find the tree on whose ways to the base a frame is sent least often.

    The cost of a way is the sum of its links' ETX. Of ways that cost the same (to
    1e-9 transmissions) the one with fewer hops wins, then the stronger link (the
    weaker of its two directions counts), then the parent that stands first.

    Parameters
    ----------
    positions : where the nodes are, (x, y, z) [m]; their order breaks ties
    base : the node all routes lead to
    etx : (n, n) - expected transmissions of a frame from node i to node j until its acknowledgement is
        heard, infinite where none is, nodes in the order of `positions` [-]
    power_dbm : (n, n) - power of node i at node j [dBm]
    most_etx : ETX above which a link is not used [-]

    Raises
    ------
    RoutingError : the base is not a node, or nodes cannot reach it

    References
    ----------
    De Couto et al. (2003), sec. 3.
    """
    usable = etx <= most_etx
    # whole numbers, so that sums do not depend on their order
    costs = np.where(usable, np.round(np.where(usable, etx, 1.0) * _ETX_UNITS), 0.0).astype(np.int64)
    strength = np.minimum(power_dbm, power_dbm.T)
    return _cheapest_tree(positions, base, costs, strength, f"with an ETX of at most {most_etx:g}")


def _cheapest_tree(
    positions: Mapping[NodeId, ArrayLike], base: NodeId, costs: IntArray, strength: FloatArray, links: str
) -> Tree:
    """Find the tree of cheapest ways to the base (Dijkstra).

    Parameters
    ----------
    positions, base : as above
    costs : (n, n) - of the link from node i to node j, 0 where there is none
    strength : (n, n) - breaks ties between links [dBm]
    links : what links must be like, for the error message
    """
    nodes = list(positions)
    if base not in positions:
        raise RoutingError(f"base: must be one of the nodes {nodes}, got {base!r}")
    # one number for cost, then hops: no way has as many hops as there are nodes
    steps = np.where(costs > 0, costs * len(nodes) + 1, 0)
    ways: nx.DiGraph[int] = nx.DiGraph()
    ways.add_nodes_from(range(len(nodes)))
    senders, receivers = np.nonzero(steps)
    ways.add_weighted_edges_from(
        zip(receivers.tolist(), senders.tolist(), steps[senders, receivers].tolist(), strict=True)
    )
    lengths = nx.single_source_dijkstra_path_length(ways, nodes.index(base))
    if len(lengths) < len(nodes):
        raise RoutingError(_unreached(positions, base, {nodes[at] for at in lengths}, links))
    parents: dict[NodeId, NodeId | None] = {}
    for at, node in enumerate(nodes):
        onward = np.flatnonzero(steps[at]).tolist()
        cheapest = [other for other in onward if lengths[other] + steps[at, other] == lengths[at]]
        parents[node] = nodes[max(cheapest, key=lambda other: strength[at, other])] if cheapest else None
    return tree_from_parents(parents)


def _unreached(positions: Mapping[NodeId, ArrayLike], base: NodeId, reached: set[NodeId], links: str) -> str:
    nodes = list(positions)
    apart = distances(np.array([positions[node] for node in nodes], dtype=np.float64))
    apart[:, [node not in reached for node in nodes]] = np.inf
    lines = [f"routing: every node must reach the base {base!r} over links {links}"]
    for at, node in enumerate(nodes):
        if node not in reached:
            nearest = int(np.argmin(apart[at]))
            lines.append(
                f"  node {node!r} cannot: the nearest node that does is {nodes[nearest]!r}, "
                f"{apart[at, nearest]:.1f} m away"
            )
    lines.append("move these nodes, add relays, or raise the transmit power")
    return "\n".join(lines)
