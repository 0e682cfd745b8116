"""The tree as the nodes see it now: who has which parent, while parents come and go."""

from collections.abc import Callable
from functools import cached_property

from wsnsim.net.routing.tree import Tree, tree_of_reached
from wsnsim.types import NodeId

Moved = Callable[[NodeId, NodeId | None, NodeId | None, str], None]
"""Told of a node, its old and its new parent, and why."""


class LiveTree:
    """All nodes' parents, put together from what each of them believes.

    Parameters
    ----------
    planned : the tree from which sinks, and parents where they are known, are taken
    known : whether the nodes know the planned tree
    moved : told of every change
    """

    def __init__(self, planned: Tree, known: bool, moved: Moved) -> None:
        self._root, self._wired, self._moved = planned.root, planned.wired, moved
        self._parents = {
            node: parent if known or node in planned.wired else None
            for node, parent in planned.parent.items()
        }

    @cached_property
    def tree(self) -> Tree:
        """The nodes whose parents lead to the base station; others have no parent and no depth in it."""
        return tree_of_reached(self._parents, self._root, self._wired)

    def move(self, node: NodeId, parent: NodeId | None, why: str) -> None:
        """Give a node another parent, or none."""
        old, self._parents[node] = self._parents[node], parent
        self.__dict__.pop("tree", None)
        self._moved(node, old, parent, why)
