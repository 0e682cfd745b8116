"""A radio network by itself: no motes' programs, packets that a test bench sends, and what became of them.

For studies of the network alone: the comparison with other simulators, with theory, and of speed.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import partial

import numpy as np

from wsnsim.net.channel.channel import Channel
from wsnsim.net.clock import Clock
from wsnsim.net.interface import Datagram, LinkCounters, Outcome
from wsnsim.net.phy.base import RadioMeter
from wsnsim.net.radio import RadioNetwork, Stack
from wsnsim.net.routing.tree import tree_from_parents
from wsnsim.records import FrameRow
from wsnsim.rng import RandomStreams
from wsnsim.sim.agenda import Agenda
from wsnsim.types import FloatArray, Nanoseconds, NodeId, Seconds
from wsnsim.units import to_ns, to_s


@dataclass(frozen=True, eq=False)
class Tally:
    """What became of the packets of a test bench.

    Parameters
    ----------
    generated : packets sent
    dropped : lost packets, by their outcome
    delays_s : (m,) - how long each packet that arrived was on its way, in the order of arrival [s]
    counters : of all nodes together
    """

    generated: int
    dropped: Mapping[Outcome, int]
    delays_s: FloatArray
    counters: LinkCounters

    @property
    def delivered(self) -> int:
        """Packets that arrived."""
        return len(self.delays_s)

    @property
    def queued(self) -> int:
        """Packets that are still on their way."""
        return self.generated - self.delivered - sum(self.dropped.values())


class Testbed:
    """A radio network of fixed nodes, a clock, and an observer that counts.

    Parameters
    ----------
    parents : node to its parent, None for the base station; their order is that of the links
    channel : who arrives where
    stack : MAC, radios and queues
    seed : of all that is drawn
    record_frames : whether `frames` shall hold all frames
    meters : what keeps account of radios, by node
    """

    __test__ = False  # no test, whatever pytest makes of its name

    def __init__(
        self,
        parents: Mapping[NodeId, NodeId | None],
        channel: Channel,
        stack: Stack,
        seed: int = 0,
        *,
        record_frames: bool = False,
        meters: Mapping[NodeId, RadioMeter] | None = None,
    ) -> None:
        self._env = Agenda()
        self._clock = Clock(self._env)
        self._streams = RandomStreams(seed)
        self._left_ns: list[Nanoseconds] = []
        self._delays_ns: list[Nanoseconds] = []
        self._dropped: dict[Outcome, int] = {}
        self._again: bytes | None = None
        self.frames: list[FrameRow] = []
        self.arrivals: Counter[tuple[NodeId, NodeId]] = Counter()
        self.nodes = tuple(parents)
        self.network = RadioNetwork(
            self._env,
            self.nodes,
            tree_from_parents(parents),
            channel,
            stack,
            self._streams,
            self,
            {} if meters is None else meters,
            record_frames,
        )

    @property
    def sources(self) -> tuple[NodeId, ...]:
        """All nodes but the base station."""
        return tuple(node for node in self.nodes if node != self.network.tree.root)

    @property
    def now_ns(self) -> Nanoseconds:
        """The time on the event clock [ns]."""
        return self._clock.now

    def at(self, time_ns: Nanoseconds, action: Callable[[], None]) -> None:
        """Do something at a time [ns]."""
        self._clock.call(time_ns - self._clock.now, action)

    def send(self, source: NodeId, destination: NodeId, data: bytes) -> None:
        """Send a packet now."""
        self._left_ns.append(self._clock.now)
        self.network.send(Datagram(len(self._left_ns) - 1, source, (destination,), data))

    def announce(self, source: NodeId, destinations: Sequence[NodeId], data: bytes) -> None:
        """Broadcast a packet now, once and unacknowledged, meant for neighbours; `arrivals` counts it."""
        number = len(self._left_ns)
        self._left_ns.append(self._clock.now)
        self.network.send(Datagram(number, source, tuple(destinations), data, one_hop=True))

    def periodic(self, period_s: Seconds, packets: int, data: bytes, *, one_hop: bool = False) -> None:
        """Let each source send `packets` packets to the base station, the k-th at a random time of period k.

        Parameters
        ----------
        one_hop : to each source's parent instead
        """
        tree = self.network.tree
        for node in self.sources:
            parent = tree.parent[node]
            destination = parent if one_hop and parent is not None else tree.root
            rng = self._streams.stream("testbed.traffic", node)
            times = [to_ns(period_s * (k + share)) for k, share in enumerate(rng.random(packets))]
            self._next(node, destination, data, times[::-1])

    def saturate(self, data: bytes, begin_within_s: Seconds = 0.01) -> None:
        """Let each source always have two packets on their way to the base station, from a random time on.

        The protocol's times are multiples of 32 µs: sources that began together would meet in exact
        ties for ever.
        """
        self._again = data
        for node in self.sources:
            begin = self._streams.stream("testbed.begin", node).integers(to_ns(begin_within_s))
            for _ in range(2):
                self.at(int(begin), partial(self.send, node, self.network.tree.root, data))

    def run(self, until_s: Seconds) -> None:
        """Let time pass until `until_s` [s]."""
        self._env.run(until=to_ns(until_s))

    def tally(self) -> Tally:
        """Return what became of the packets so far."""
        return Tally(
            len(self._left_ns),
            dict(self._dropped),
            np.array(self._delays_ns, dtype=np.float64) * to_s(1),
            added([self.network.counters(node) for node in self.nodes]),
        )

    def delivered(self, datagram: Datagram, receiver: NodeId, hops: int) -> None:
        """Count a packet that arrived (`wsnsim.net.interface.NetworkObserver`)."""
        self._delays_ns.append(self._clock.now - self._left_ns[datagram.number])
        self.arrivals[datagram.source, receiver] += 1
        self._settled(datagram)

    def dropped(self, datagram: Datagram, receiver: NodeId, outcome: Outcome) -> None:
        """Count a packet that is lost."""
        self._dropped[outcome] = self._dropped.get(outcome, 0) + 1
        self._settled(datagram)

    def frame(self, row: FrameRow) -> None:
        """Keep what became of a frame."""
        self.frames.append(row)

    def reparented(self, node: NodeId, old: NodeId | None, new: NodeId | None, why: str) -> None:
        """Keep nothing: trees of a test bench stay as they are."""

    def _next(self, node: NodeId, destination: NodeId, data: bytes, times: list[Nanoseconds]) -> None:
        if times:
            self.at(times.pop(), lambda: self._leave(node, destination, data, times))

    def _leave(self, node: NodeId, destination: NodeId, data: bytes, times: list[Nanoseconds]) -> None:
        self.send(node, destination, data)
        self._next(node, destination, data, times)

    def _settled(self, datagram: Datagram) -> None:
        if self._again is not None:
            self.send(datagram.source, self.network.tree.root, self._again)


def added(counters: Sequence[LinkCounters]) -> LinkCounters:
    """Return the sum of counters."""
    names = [field.name for field in fields(LinkCounters)]
    return LinkCounters(**{name: sum(getattr(each, name) for each in counters) for name in names})
