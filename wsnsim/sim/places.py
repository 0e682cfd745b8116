"""Where each node stands in the routing tree, for who collects messages of groups, while the tree changes."""

from collections.abc import Mapping
from dataclasses import dataclass

from wsnsim.net.collection import leads_s
from wsnsim.net.interface import Network
from wsnsim.net.routing.tree import Tree
from wsnsim.types import NodeId, Seconds


@dataclass(frozen=True, slots=True)
class Place:
    """Where a node stands in the tree."""

    parent: NodeId
    """Who takes its messages of groups; the base station where that is a sink."""
    below: frozenset[NodeId]
    """The node itself and all whose messages pass it."""
    lead_s: Seconds
    """How long before the base station wants it an aggregate must be begun [s]."""


class Places:
    """Where all nodes stand, while the tree changes.

    Parameters
    ----------
    tree : the tree at the beginning
    network : has the tree as it is
    hop_s : time from beginning an aggregate at a node until its parent has it, for all but the base [s]
    """

    def __init__(self, tree: Tree, network: Network, hop_s: Mapping[NodeId, Seconds]) -> None:
        self._network, self._hop_s = network, hop_s
        self._found: dict[NodeId, Place] = {}
        self._stale = False
        self._look(tree)

    def changed(self) -> None:
        """Note that the tree has changed; it is looked at when somebody asks."""
        self._stale = True

    def of(self, node: NodeId) -> Place:
        """Return where a node stands, or stood when it last had a way to the base station."""
        if self._stale:
            self._stale = False
            self._look(self._network.tree)
        return self._found[node]

    def _look(self, tree: Tree) -> None:
        leads = leads_s(tree, self._hop_s)
        for node in tree.descendants(tree.root):
            parent = tree.collector(node)
            if node not in tree.wired and parent is not None:
                below = frozenset((node, *tree.descendants(node)))
                self._found[node] = Place(parent, below, leads[node])
