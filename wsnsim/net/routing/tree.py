"""Who sends to whom: a tree whose root is the base station."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

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
