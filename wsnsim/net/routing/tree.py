"""Who sends to whom: a tree whose root is the base station.

Further sinks hang on the base station by wire: what reaches one has reached
the base, and the wire is no hop.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

from wsnsim.errors import WsnsimError
from wsnsim.net.interface import Datagram
from wsnsim.types import NodeId


class RoutingError(WsnsimError):
    """No tree over these nodes, or no way in it to where a datagram shall go."""


@dataclass(frozen=True)
class Tree:
    """Routes of all nodes; the root is the base station.

    Parameters
    ----------
    parent : node one hop nearer to the base, None at the base itself, and at a node that has no way to it
    depth : hops to the base; -1 without a way
    children : nodes one hop farther, in the order of the nodes
    wired : further sinks; the base is their parent, though no hop away
    """

    parent: Mapping[NodeId, NodeId | None]
    depth: Mapping[NodeId, int]
    children: Mapping[NodeId, tuple[NodeId, ...]]
    wired: frozenset[NodeId] = frozenset()

    @cached_property
    def root(self) -> NodeId:
        """The base station."""
        return next(node for node, parent in self.parent.items() if parent is None and self.depth[node] == 0)

    @cached_property
    def sinks(self) -> tuple[NodeId, ...]:
        """The base station and all that are wired to it, in the order of the nodes after the base."""
        return (self.root, *(node for node in self.parent if node in self.wired))

    def collector(self, node: NodeId) -> NodeId | None:
        """Return who takes what a node sends one hop up: its parent, or the base where that is a sink."""
        parent = self.parent[node]
        return self.root if parent in self.wired else parent

    def hops(self, source: NodeId, destination: NodeId) -> int:
        """Return how many hops it is from one node to another, wires not counted."""
        if self.parent[source] == destination:
            return 0 if self.by_wire(source, destination) else 1
        depth, other = self.depth[source], self.depth[destination]
        if self.root in (source, destination) and depth >= 0 and other >= 0:
            return depth + other
        return sum(not self.by_wire(*pair) for pair in pairwise(self.path(source, destination)))

    def by_wire(self, one: NodeId, other: NodeId) -> bool:
        """Return whether two nodes that stand next to each other in the tree are joined by a wire."""
        return bool(self.wired) and self.root in (one, other) and not self.wired.isdisjoint((one, other))

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
            climbs = self.depth[down[-1]] > self.depth[up[-1]] or up[-1] == self.root
            higher = down if climbs else up
            parent = self.parent[higher[-1]]
            if parent is None:
                raise RoutingError(f"tree: {source!r} and {destination!r} have no way to each other")
            higher.append(parent)
        return (*up, *reversed(down[:-1]))


def tree_from_parents(
    parents: Mapping[NodeId, NodeId | None], wired: frozenset[NodeId] = frozenset()
) -> Tree:
    """Make a tree from each node's parent, None for the base station.

    Parameters
    ----------
    wired : further sinks, whose parent is the base station by wire

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
    depth = _depths(roots[0], children, wired)
    if len(depth) != len(parents):
        stray = [node for node in parents if node not in depth]
        raise RoutingError(f"tree: every node must lead to the base {roots[0]!r}, got a circle of {stray}")
    return Tree(
        parent=dict(parents),
        depth={node: depth[node] for node in parents},
        children={node: tuple(below) for node, below in children.items()},
        wired=wired,
    )


def tree_of_reached(
    parents: Mapping[NodeId, NodeId | None], root: NodeId, wired: frozenset[NodeId] = frozenset()
) -> Tree:
    """Make a tree of the nodes whose parents lead to the root; the others have no parent in it."""
    children: dict[NodeId, list[NodeId]] = {node: [] for node in parents}
    for node, parent in parents.items():
        if parent is not None and node != root:
            children[parent].append(node)
    depth = _depths(root, children, wired)
    return Tree(
        parent={node: parents[node] if node in depth else None for node in parents},
        depth={node: depth.get(node, -1) for node in parents},
        children={node: tuple(children[node]) if node in depth else () for node in parents},
        wired=wired,
    )


def _depths(
    root: NodeId, children: Mapping[NodeId, list[NodeId]], wired: frozenset[NodeId]
) -> dict[NodeId, int]:
    """Return the hops to the root of all that lead there."""
    depth = {root: 0}
    reached = [root]
    for node in reached:
        for child in children[node]:
            depth[child] = depth[node] + (child not in wired)
            reached.append(child)
    return depth


def check_datagram(tree: Tree, datagram: Datagram, everywhere: bool = False) -> None:
    """Make sure that a datagram can be routed.

    Parameters
    ----------
    everywhere : whether dissemination goes to all nodes, and not only down the tree

    Raises
    ------
    RoutingError : an unknown node, several receivers without dissemination, or a receiver of a
        dissemination that is not below its source
    """
    for node in (datagram.source, *datagram.destinations):
        if node not in tree.parent:
            raise RoutingError(f"{_named(datagram)}: source and receivers must be nodes, got {node!r}")
    if datagram.source in datagram.destinations and (datagram.disseminate or datagram.one_hop):
        raise RoutingError(f"{_named(datagram)}: a broadcast goes to others, not back to its source")
    if datagram.one_hop:
        return
    if not datagram.disseminate and len(datagram.destinations) != 1:
        raise RoutingError(
            f"{_named(datagram)}: must have one receiver, or be disseminated, got {datagram.destinations}"
        )
    if datagram.disseminate and not everywhere:
        astray = set(datagram.destinations) - set(tree.descendants(datagram.source))
        if astray:
            raise RoutingError(
                f"{_named(datagram)}: dissemination goes down the tree, not to {sorted(astray)}"
            )


def _named(datagram: Datagram) -> str:
    return f"datagram {datagram.number} of {datagram.source!r}"
