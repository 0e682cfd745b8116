"""Slots of a TDMA superframe: which nodes may send at the same time, and when each does.

Each node with a parent takes turns to send up to it, and each node with
children takes turns to send down to them, to one or to all. During a turn its
sender and whoever may be addressed are on the air: receivers acknowledge. Two
turns conflict if a node has part in both, or if power of any node of the one
arrives at a node of the other, above a threshold; such turns never share a slot.
With the threshold at the weakest link that is used this is the protocol model;
further down, less and less is left of what turns of one slot add to each other's
noise. Left out: the sum of what is below the threshold, and fading above it.

Slots are given out greedily, each turn taking the first that no conflicting
turn has: turns up the tree first, those of the deepest nodes before others,
then those of nodes with more below them; then turns down, from the base
outwards; ties by address. On a line this lets a message climb one hop a slot.

References
----------
Gupta, Kumar, The capacity of wireless networks (IEEE Trans. Inform. Theory
46(2), 2000), sec. I: protocol and physical model of interference. Ergen, Varaiya,
TDMA scheduling algorithms for wireless sensor networks (Wireless Networks 16,
2010): slots from the conflict graph of a tree to the base station.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from itertools import count, islice

import numpy as np

from wsnsim.net.channel.links import Links
from wsnsim.net.routing.tree import Tree
from wsnsim.types import NodeId


@dataclass(frozen=True, slots=True)
class Turn:
    """A node's right to send up to its parent, or down to its children."""

    node: int
    """Address."""
    up: bool


class Part(Enum):
    """What a node does in a slot."""

    SEND_UP = "send_up"
    SEND_DOWN = "send_down"
    HEAR_CHILD = "hear_child"
    HEAR_PARENT = "hear_parent"


@dataclass(frozen=True, slots=True)
class Duty:
    """A slot in which a node has something to do."""

    slot: int
    part: Part


@dataclass(frozen=True)
class Timetable:
    """Who sends when.

    Parameters
    ----------
    parents : of each address, None at the base
    slots_of : slots of each turn, counted from the begin of the superframe
    length : slots of a superframe
    least_length : fewest slots that any timetable could have, as far as one node's turns tell: all turns in
        which it has part need slots of their own
    """

    parents: tuple[int | None, ...]
    slots_of: Mapping[Turn, tuple[int, ...]]
    length: int
    least_length: int

    @cached_property
    def children(self) -> tuple[tuple[int, ...], ...]:
        """The addresses of each node's children."""
        found: list[list[int]] = [[] for _ in self.parents]
        for node, parent in enumerate(self.parents):
            if parent is not None:
                found[parent].append(node)
        return tuple(map(tuple, found))

    def duties(self, node: int) -> tuple[Duty, ...]:
        """Return what a node does in a superframe, in the order of the slots."""
        parent, children = self.parents[node], self.children[node]
        asked = [(Turn(child, up=True), Part.HEAR_CHILD) for child in children]
        if children:
            asked.append((Turn(node, up=False), Part.SEND_DOWN))
        if parent is not None:
            asked.append((Turn(node, up=True), Part.SEND_UP))
            asked.append((Turn(parent, up=False), Part.HEAR_PARENT))
        duties = [Duty(slot, part) for turn, part in asked for slot in self.slots_of[turn]]
        return tuple(sorted(duties, key=lambda duty: duty.slot))


def timetable(
    tree: Tree,
    names: Sequence[NodeId],
    links: Links,
    interference_dbm: float,
    proportional: bool = False,
) -> Timetable:
    """Give every node of a tree the slots that it needs.

    Parameters
    ----------
    tree : the routing tree
    names : the nodes by address, in the order of the links
    links : who arrives where
    interference_dbm : power from which on a node disturbs another [dBm]
    proportional : whether a node gets as many turns up as there are nodes that send through it, itself
        included; else one
    """
    address = {name: at for at, name in enumerate(names)}
    parents = tuple(None if (parent := _parent(tree, name)) is None else address[parent] for name in names)
    below = _nodes_below(tree)
    parts = _parts(parents)

    def rank(turn: Turn) -> tuple[int, int, int, int]:
        name = names[turn.node]
        if turn.up:
            return (0, -tree.depth[name], -below[name], turn.node)
        return (1, tree.depth[name], -below[name], turn.node)

    wanted = {turn: below[names[turn.node]] if turn.up and proportional else 1 for turn in parts}
    conflicts = conflicting(parts, links, interference_dbm)
    slots_of: dict[Turn, tuple[int, ...]] = {}
    for turn in sorted(parts, key=rank):
        taken = {slot for other in conflicts[turn] for slot in slots_of.get(other, ())}
        free = (slot for slot in count() if slot not in taken)
        slots_of[turn] = tuple(islice(free, wanted[turn]))
    load = [0] * len(names)
    for turn, nodes in parts.items():
        for node in nodes:
            load[node] += wanted[turn]
    length = max((slots[-1] + 1 for slots in slots_of.values()), default=1)
    return Timetable(parents, slots_of, length, max(load, default=0))


def conflicting(
    parts: Mapping[Turn, frozenset[int]], links: Links, interference_dbm: float
) -> dict[Turn, frozenset[Turn]]:
    """Return the conflict graph: which other turns each turn must not share a slot with.

    Parameters
    ----------
    parts : nodes that have part in each turn
    links : who arrives where
    interference_dbm : power from which on a node disturbs another [dBm]
    """
    disturbed: list[set[int]] = [{node} for node in range(links.nodes)]
    for sender in range(links.nodes):
        row = links.row(sender)
        loud = np.asarray(links.receivers[row])[np.asarray(links.power_dbm[row]) >= interference_dbm]
        for receiver in loud.tolist():
            disturbed[sender].add(receiver)
            disturbed[receiver].add(sender)
    turns_at: list[set[Turn]] = [set() for _ in range(links.nodes)]
    for turn, nodes in parts.items():
        for node in nodes:
            turns_at[node].add(turn)
    graph = {}
    for turn, nodes in parts.items():
        near = set[int]().union(*(disturbed[node] for node in nodes))
        graph[turn] = frozenset(set[Turn]().union(*(turns_at[node] for node in near)) - {turn})
    return graph


def _parent(tree: Tree, name: NodeId) -> NodeId | None:
    """Return whom a node sends up to by radio; a sink that is wired to the base station sends to nobody."""
    return None if name in tree.wired else tree.parent[name]


def _parts(parents: Sequence[int | None]) -> dict[Turn, frozenset[int]]:
    """Return the nodes that have part in each turn."""
    families: dict[int, set[int]] = {}
    parts = {}
    for node, parent in enumerate(parents):
        if parent is not None:
            parts[Turn(node, up=True)] = frozenset((node, parent))
            families.setdefault(parent, {parent}).add(node)
    for node, family in families.items():
        parts[Turn(node, up=False)] = frozenset(family)
    return parts


def _nodes_below(tree: Tree) -> dict[NodeId, int]:
    """Return how many nodes send through each, itself included."""
    below = dict.fromkeys(tree.parent, 1)
    for node in sorted(tree.parent, key=lambda name: -tree.depth[name]):
        parent = _parent(tree, node)
        if parent is not None:
            below[parent] += below[node]
    return below
