"""A tree by measured links: all nodes broadcast probes first, and the tree is that of the losses counted.

Each node broadcasts `count` probes, one in each interval at a random instant,
real frames on the real MAC; all count whose they hear. The ETX of a link is
1 / (p_f p_r), with the shares of the probes that arrived in each direction,
and the tree is that of least ETX. Until then nobody has a way, and what is
sent waits. A link that no probe crossed is none; a node that no probe reached,
or that reached nobody, stays without a way.

Left out: that the counts have to be brought together; they are, at no cost,
half an interval after the last probe.

References
----------
De Couto et al. (2003), sec. 4.1: dedicated broadcast probes of a fixed size, as many in both directions.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from wsnsim.net.channel.links import Links
from wsnsim.net.clock import Call, Clock
from wsnsim.net.interface import Outcome
from wsnsim.net.phy.base import BROADCAST
from wsnsim.net.routing.control import PROBE
from wsnsim.net.routing.fixed import FixedRouter
from wsnsim.net.routing.search import etx_tree
from wsnsim.net.routing.tree import Tree, tree_of_reached
from wsnsim.net.sendqueue import Control
from wsnsim.types import NodeId
from wsnsim.units import to_ns


@dataclass(frozen=True)
class ProbingConfig:
    """How links are measured.

    Raises
    ------
    ValueError : a number outside its range
    """

    count: int = 20
    """Probes of each node."""
    interval_s: float = 0.5
    """Time in which each node sends one [s]."""
    packet_bytes: int = 116
    """What a probe carries, headers of the MAC left off [B]."""
    etx_max: float = 10.0
    """ETX above which a link is not used."""

    def __post_init__(self) -> None:
        if self.count < 1 or self.packet_bytes < 1:
            raise ValueError(f"probes: must be at least one of at least 1 B, got {self}")
        if not self.interval_s > 0.0:
            raise ValueError(f"interval_s: must be positive, got {self.interval_s} [s]")
        if not self.etx_max >= 1.0:
            raise ValueError(f"etx_max: must be at least 1, got {self.etx_max}")

    @property
    def ready_s(self) -> float:
        """When the tree is there [s]."""
        return (self.count + 0.5) * self.interval_s


class ProbingRouter(FixedRouter):
    """Routes of one node that has none until links are measured.

    Parameters
    ----------
    node, names, addresses, reach, from_anyone : as for `FixedRouter`
    empty : a tree in which nobody has a way
    clock : the event clock
    config : how many probes, and how often
    rng : draws their instants
    say : takes frames for the MAC
    """

    def __init__(
        self,
        node: NodeId,
        empty: Tree,
        names: tuple[NodeId, ...],
        addresses: Mapping[NodeId, int],
        reach: tuple[int, ...],
        from_anyone: bool,
        clock: Clock,
        config: ProbingConfig,
        rng: np.random.Generator,
        say: Callable[[Control], None],
    ) -> None:
        super().__init__(node, empty, names, addresses, reach, from_anyone)
        self._clock, self._config, self._rng, self._say = clock, config, rng, say
        self._calls: list[Call] = []
        self.heard_probes: dict[int, int] = {}
        """How many of each node's probes have arrived here."""

    def start(self) -> None:
        """Begin to send probes."""
        for number in range(self._config.count):
            at_s = (number + self._rng.random()) * self._config.interval_s
            self._calls.append(self._clock.call(to_ns(at_s), self._probe))

    def stop(self) -> None:
        """Send no more probes."""
        for call in self._calls:
            call.cancel()

    def take(self, source: int, packet: bytes) -> None:
        """Count a neighbour's probe."""
        if packet[:1] == bytes((PROBE,)):
            self.heard_probes[source] = self.heard_probes.get(source, 0) + 1

    def _probe(self) -> None:
        packet = bytes((PROBE,)).ljust(self._config.packet_bytes, b"\0")
        self._say(Control(lambda: (packet, BROADCAST), _nothing))


def measured_tree(
    planned: Tree, names: tuple[NodeId, ...], heard: list[dict[int, int]], config: ProbingConfig
) -> Tree:
    """Return the tree of least ETX over links as probes have found them.

    Parameters
    ----------
    planned : has the base station and the other sinks
    names : the nodes
    heard : how many of each node's probes arrived at each of the nodes
    config : how many there were
    """
    nodes = len(names)
    share = np.zeros((nodes, nodes))
    for receiver, counts in enumerate(heard):
        for sender, count in counts.items():
            share[sender, receiver] = count / config.count
    both = share * share.T
    usable = both * config.etx_max >= 1.0
    reached = _connected(usable, [names.index(sink) for sink in planned.sinks])
    kept = [at for at in range(nodes) if at in reached]
    within = usable[np.ix_(kept, kept)]
    senders, receivers = np.nonzero(within)
    etx = 1.0 / both[np.ix_(kept, kept)][senders, receivers]
    links = Links.from_pairs(len(kept), senders, receivers, np.zeros(len(senders)))
    places = {names[at]: (0.0, 0.0, 0.0) for at in kept}
    tree = etx_tree(places, planned.root, links, etx, config.etx_max, planned.sinks[1:])
    parents: dict[NodeId, NodeId | None] = {name: tree.parent.get(name) for name in names}
    return tree_of_reached(parents, planned.root, planned.wired)


def _connected(usable: np.ndarray, ends: list[int]) -> set[int]:
    found = list(ends)
    for node in found:
        found += [int(at) for at in np.flatnonzero(usable[:, node]) if at not in found]
    return set(found)


def _nothing(outcome: Outcome | None, destination: int) -> None:
    """Take no notice: a probe that was not sent counts as lost."""
