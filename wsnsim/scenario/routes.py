"""What must hold of a routing tree that is given by hand."""

from collections.abc import Iterator, Mapping

from wsnsim.scenario.faults import Fault, KeyPath, did_you_mean, shown
from wsnsim.scenario.nodes import placed_nodes
from wsnsim.scenario.schema import Scenario
from wsnsim.scenario.schema_routing import GivenTree
from wsnsim.types import NodeId

PARENTS: KeyPath = ("network", "routing", "parents")


def route_faults(scenario: Scenario, tree: GivenTree) -> list[Fault]:
    """Return the faults of a tree: nodes that do not exist, have no parent, or do not lead to the base."""
    base = scenario.motes.base.id
    nodes = {node.id: None for node in placed_nodes(scenario)}
    ends = (base, *(sink.id for sink in scenario.motes.sinks))
    return [*_names(tree, nodes, ends), *_orphans(tree, nodes, ends), *_circles(tree)]


def _names(tree: GivenTree, nodes: Mapping[NodeId, None], ends: tuple[NodeId, ...]) -> Iterator[Fault]:
    for node, parent in tree.parents.items():
        path = (*PARENTS, node)
        if node not in nodes:
            yield Fault(path, f"must be a node, got {shown(node)}{did_you_mean(node, nodes)}", of_key=True)
        elif node in ends:
            what = "the base station" if node == ends[0] else "a sink"
            yield Fault(path, f"must be left out: {what} has no parent", of_key=True)
        if parent not in nodes:
            yield Fault(path, f"must be a node, got {shown(parent)}{did_you_mean(parent, nodes)}")


def _orphans(tree: GivenTree, nodes: Mapping[NodeId, None], ends: tuple[NodeId, ...]) -> Iterator[Fault]:
    missing = [node for node in nodes if node not in ends and node not in tree.parents]
    if missing:
        listed = ", ".join(shown(node) for node in missing)
        yield Fault(PARENTS, f"must name the parent of every node but the base, misses {listed}")


def _circles(tree: GivenTree) -> Iterator[Fault]:
    """Find each circle once, at the first of its nodes."""
    done: set[NodeId] = set()
    for start in tree.parents:
        way: dict[NodeId, None] = {}
        node: NodeId | None = start
        while node is not None and node not in done and node not in way:
            way[node] = None
            node = tree.parents.get(node)
        if node in way:
            circle = list(way)[list(way).index(node) :]
            around = " -> ".join([*circle, circle[0]])
            message = f"must lead to the base station, goes round in a circle: {around}"
            yield Fault((*PARENTS, circle[0]), message)
        done.update(way)
