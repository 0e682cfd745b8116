"""Who sends to whom: a tree of fewest hops or transmissions to the base station, or one given by hand.

Left out: routes that change while a run lasts; links are what propagation makes of them, not estimates.

References
----------
De Couto, Aguayo, Bicket, Morris, A High-Throughput Path Metric for Multi-Hop Wireless Routing (MobiCom 2003),
sec. 3: ETX.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import networkx as nx
import numpy as np
from numpy.typing import ArrayLike

from wsnsim.errors import WsnsimError
from wsnsim.net.interface import Datagram
from wsnsim.net.propagation import distances
from wsnsim.types import FloatArray, IntArray, NodeId

_ETX_UNITS = 1e9
"""Parts in which a transmission is counted, so that ways are equal or not whatever the order of adding."""


class RoutingError(WsnsimError):
    """No tree over these nodes, or no way in it to where a datagram shall go."""


@dataclass(frozen=True)
class Tree:
    """Routes of all nodes; the root is the base station.

    Parameters
    ----------
    parent : node one hop nearer to the base, None at the base itself
    depth : hops to the base
    children : nodes one hop farther, in the order of the nodes
    """

    parent: Mapping[NodeId, NodeId | None]
    depth: Mapping[NodeId, int]
    children: Mapping[NodeId, tuple[NodeId, ...]]

    @cached_property
    def root(self) -> NodeId:
        """The base station."""
        return next(node for node, parent in self.parent.items() if parent is None)

    @cached_property
    def height(self) -> int:
        """Hops from the base to the node farthest from it."""
        return max(self.depth.values())

    def descendants(self, node: NodeId) -> tuple[NodeId, ...]:
        """Return all nodes below `node`, nearest first."""
        found = list(self.children[node])
        for child in found:
            found.extend(self.children[child])
        return tuple(found)

    def path(self, source: NodeId, destination: NodeId) -> tuple[NodeId, ...]:
        """Return the nodes from `source` to `destination`, both included: up, then down."""
        up, down = [source], [destination]
        while up[-1] != down[-1]:
            higher = down if self.depth[down[-1]] > self.depth[up[-1]] else up
            parent = self.parent[higher[-1]]
            if parent is None:
                raise RoutingError(f"tree: {source!r} and {destination!r} have no way to each other")
            higher.append(parent)
        return (*up, *reversed(down[:-1]))


def tree_from_parents(parents: Mapping[NodeId, NodeId | None]) -> Tree:
    """Make a tree from each node's parent, None for the base station.

    Raises
    ------
    RoutingError : not exactly one base, an unknown parent, or nodes in a circle
    """
    roots = [node for node, parent in parents.items() if parent is None]
    if len(roots) != 1:
        raise RoutingError(f"tree: exactly one node must have no parent, got {roots or 'none'}")
    children: dict[NodeId, list[NodeId]] = {node: [] for node in parents}
    for node, parent in parents.items():
        if parent is None:
            continue
        if parent not in children:
            raise RoutingError(f"tree: the parent of {node!r} must be a node, got {parent!r}")
        children[parent].append(node)
    depth = {roots[0]: 0}
    reached = [roots[0]]
    for node in reached:
        for child in children[node]:
            depth[child] = depth[node] + 1
            reached.append(child)
    if len(reached) != len(parents):
        stray = [node for node in parents if node not in depth]
        raise RoutingError(f"tree: every node must lead to the base {roots[0]!r}, got a circle of {stray}")
    return Tree(
        parent=dict(parents),
        depth={node: depth[node] for node in parents},
        children={node: tuple(below) for node, below in children.items()},
    )


def check_datagram(tree: Tree, datagram: Datagram) -> None:
    """Make sure that a datagram can be routed.

    Raises
    ------
    RoutingError : an unknown node, several receivers without dissemination, or a receiver of a
        dissemination that is not below its source
    """
    named = (datagram.source, *datagram.destinations)
    what = f"datagram {datagram.number} of {datagram.source!r}"
    for node in named:
        if node not in tree.parent:
            raise RoutingError(f"{what}: source and receivers must be nodes, got {node!r}")
    if not datagram.disseminate and len(datagram.destinations) != 1:
        raise RoutingError(f"{what}: must have one receiver, or be disseminated, got {datagram.destinations}")
    if datagram.disseminate:
        astray = set(datagram.destinations) - set(tree.descendants(datagram.source))
        if astray:
            raise RoutingError(f"{what}: dissemination goes down the tree, not to {sorted(astray)}")


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
