"""Who sends to whom: a spanning tree of fewest hops to the base station, or one given by hand."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import networkx as nx
import numpy as np
from numpy.typing import ArrayLike

from wsnsim.errors import WsnsimError
from wsnsim.net.interface import Datagram
from wsnsim.net.propagation import distances
from wsnsim.types import FloatArray, NodeId


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
    nodes = list(positions)
    if base not in positions:
        raise RoutingError(f"base: must be one of the nodes {nodes}, got {base!r}")
    strength = np.minimum(power_dbm, power_dbm.T)
    graph: nx.Graph[int] = nx.Graph()
    graph.add_nodes_from(range(len(nodes)))
    graph.add_edges_from(
        (int(one), int(other)) for one, other in np.argwhere(np.triu(strength >= weakest_dbm, 1))
    )
    depth = nx.single_source_shortest_path_length(graph, nodes.index(base))
    if len(depth) < len(nodes):
        raise RoutingError(_unreached(positions, base, {nodes[at] for at in depth}, range_m))
    parents: dict[NodeId, NodeId | None] = {}
    for at, node in enumerate(nodes):
        nearer = [other for other in sorted(graph[at]) if depth[other] == depth[at] - 1]
        parents[node] = nodes[max(nearer, key=lambda other: strength[at, other])] if nearer else None
    return tree_from_parents(parents)


def _unreached(
    positions: Mapping[NodeId, ArrayLike], base: NodeId, reached: set[NodeId], range_m: float
) -> str:
    nodes = list(positions)
    apart = distances(np.array([positions[node] for node in nodes], dtype=np.float64))
    apart[:, [node not in reached for node in nodes]] = np.inf
    lines = [f"routing: every node must reach the base {base!r} over links of up to {range_m:.1f} m"]
    for at, node in enumerate(nodes):
        if node not in reached:
            nearest = int(np.argmin(apart[at]))
            lines.append(
                f"  node {node!r} cannot: the nearest node that does is {nodes[nearest]!r}, "
                f"{apart[at, nearest]:.1f} m away"
            )
    lines.append("move these nodes, add relays, or raise the transmit power")
    return "\n".join(lines)
