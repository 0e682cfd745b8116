"""A router that keeps to a tree, for networks that repeat broadcasts or have several sinks."""

from collections.abc import Mapping

from wsnsim.net.routing.tree import Tree
from wsnsim.types import NodeId


class FixedRouter:
    """Routes of one node that never change.

    Parameters
    ----------
    node : its name
    tree : the tree
    names : all nodes by address
    addresses : the same the other way round
    reach : who is in reach over good links
    from_anyone : whether broadcasts are taken from all nodes, and not from the parent only
    """

    def __init__(
        self,
        node: NodeId,
        tree: Tree,
        names: tuple[NodeId, ...],
        addresses: Mapping[NodeId, int],
        reach: tuple[int, ...],
        from_anyone: bool,
    ) -> None:
        self._node, self._names = node, names
        self._addresses, self._reach, self._from_anyone = addresses, reach, from_anyone
        self.adopt(tree)

    def adopt(self, tree: Tree) -> None:
        """Keep to another tree."""
        self._tree = tree
        parent = tree.parent[self._node]
        self._sink = self._node in tree.sinks
        self.parent = None if parent is None or self._sink else self._addresses[parent]
        self.cost = float(tree.depth[self._node])
        self._hops: dict[int, int | None] = {}

    def start(self) -> None:
        """Do nothing: everything is known."""

    def stop(self) -> None:
        """Do nothing: it says nothing."""

    def next_hop(self, final: int) -> int | None:
        """Return to whom a packet for a node goes next; None where it goes over the wire."""
        if self._tree.depth[self._node] < 0 or self._tree.depth[self._names[final]] < 0:
            return None
        if final not in self._hops:
            hop = self._tree.path(self._node, self._names[final])[1]
            self._hops[final] = None if self._tree.by_wire(self._node, hop) else self._addresses[hop]
        return self._hops[final]

    def takes(self, source: int) -> bool:
        """Return whether what a neighbour spreads is taken."""
        return self._from_anyone or source == self.parent

    @property
    def spreads(self) -> bool:
        """Whether the node spreads what it has taken."""
        return self._from_anyone or self._sink or bool(self._tree.children[self._node])

    def neighbours(self) -> tuple[int, ...]:
        """Return who is in reach over links good enough to be used."""
        return self._reach

    def heard(self, source: int) -> None:
        """Do nothing: the tree stays."""

    def take(self, source: int, packet: bytes) -> None:
        """Do nothing: nobody says anything."""

    def carries(self, source: int, origin: int, cost: float) -> None:
        """Do nothing: the tree stays."""

    def forget(self, node: int) -> None:
        """Do nothing: the tree stays."""

    def sent(self, hop: int, attempts: int, acknowledged: bool) -> None:
        """Do nothing: the tree stays."""
