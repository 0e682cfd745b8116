"""A network of fixed nodes with radios on a routing tree, put together: medium, MACs and links.

Datagrams climb the tree to the base station (or to any node), go down it to a
named node, or are disseminated to all nodes below their source. Relays do not
look inside them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from simpy import Environment

from wsnsim.net.channel.channel import Channel
from wsnsim.net.clock import Clock
from wsnsim.net.config import LinkConfig, RadioConfig
from wsnsim.net.flights import Flights
from wsnsim.net.fragmentation import fragment, fragment_count
from wsnsim.net.interface import Datagram, LinkCounters, NetworkObserver, Outcome
from wsnsim.net.link import Directory, Link, fragment_room_bytes
from wsnsim.net.mac.base import Mac, MacFamily
from wsnsim.net.mac.csma_ca import CsmaCaFamily
from wsnsim.net.mac.frames import MAX_NODES
from wsnsim.net.mesh import MAX_HOPS
from wsnsim.net.phy.base import RadioMeter, Transmission
from wsnsim.net.phy.medium import Medium
from wsnsim.net.routing.tree import RoutingError, Tree, check_datagram
from wsnsim.records import FrameRow
from wsnsim.rng import RandomStreams
from wsnsim.types import Nanoseconds, NodeId, Seconds
from wsnsim.units import to_s


@dataclass(frozen=True)
class Stack:
    """What all nodes of a network have alike, from the antenna up to the queue."""

    family: MacFamily = field(default_factory=CsmaCaFamily)
    radio: RadioConfig = field(default_factory=RadioConfig)
    link: LinkConfig = field(default_factory=LinkConfig)


class RadioNetwork:
    """The network, as `wsnsim.net.interface.Network` asks for it.

    Parameters
    ----------
    env : SimPy environment whose time counts integer nanoseconds
    names : the nodes; their order gives addresses and is that of the channel's links
    tree : the routing tree
    channel : who arrives where
    stack : MAC, radios and queues
    streams : the run's random streams; `net.mac` and `net.reception` of each node are used
    observer : hears what became of each datagram
    meters : what keeps account of each node's radio, for the nodes that have one
    record_frames : whether the observer hears of every frame

    Raises
    ------
    RoutingError : a tree over other nodes than these, too many nodes or hops
    """

    def __init__(
        self,
        env: Environment,
        names: Sequence[NodeId],
        tree: Tree,
        channel: Channel,
        stack: Stack,
        streams: RandomStreams,
        observer: NetworkObserver,
        meters: Mapping[NodeId, RadioMeter],
        record_frames: bool = False,
    ) -> None:
        _check(tree, names)
        self.tree = tree
        self._clock = Clock(env)
        self._stack, self._links, self._observer = stack, channel.links, observer
        self._flights = Flights(observer)
        self._stopped: set[NodeId] = set()
        addresses = {node: at for at, node in enumerate(names)}
        directory = Directory(tree, tuple(names), addresses, self._stopped, self._flights)
        self._directory = directory
        report = self._record if record_frames else None
        family = stack.family
        medium = Medium(self._clock, family.phy, stack.radio, channel, report)
        self._macs: dict[NodeId, Mac] = {}
        self._layers: dict[NodeId, Link] = {}
        for address, node in enumerate(names):
            mac = family.mac(self._clock, medium, address, streams.stream("net.mac", node))
            link = Link(node, self._clock, stack.link, mac, family.max_payload_bytes, directory)
            meter = meters.get(node)
            enter = _unmetered if meter is None else meter.enter
            mac.connect(medium.add(enter, streams.stream("net.reception", node), mac), link)
            self._macs[node], self._layers[node] = mac, link

    def fragments(self, data_bytes: int) -> int:
        """Return the number of radio frames a datagram of that size takes on one hop."""
        return fragment_count(data_bytes, self._room_bytes(self.tree.height))

    def hop_service_s(self, data_bytes: int, node: NodeId) -> Seconds:
        """Return the time in which a datagram of that size goes from a node to its parent, as a rule [s].

        The nodes of the same depth that the node or its parent hears above the CCA threshold
        are taken to send one too.
        """
        payload_bytes = [len(body) for body in fragment(bytes(data_bytes), 0, self._room_bytes(1))]
        header_bytes = self._stack.family.max_payload_bytes - self._room_bytes(1)
        sizes = [header_bytes + size for size in payload_bytes]
        return to_s(self._stack.family.service_ns(sizes, self._contenders(node)))

    def send(self, datagram: Datagram) -> None:
        """Take a datagram at its source.

        Raises
        ------
        RoutingError : an unknown node, several receivers without dissemination, or a receiver of a
            dissemination that is not below its source
        """
        check_datagram(self.tree, datagram)
        flight = self._flights.begin(datagram)
        source = datagram.source
        if source in self._stopped:
            self._flights.lose(flight, datagram.destinations, Outcome.DEAD)
        elif datagram.destinations == (source,):
            self._clock.call(0, lambda: self._flights.deliver(flight, source, datagram.data, 0))
        elif datagram.destinations:
            self._layers[source].send(flight)

    def stop_node(self, node: NodeId) -> None:
        """Silence a node for good: its radio is dead, its queue is lost.

        What it was sending is cut off; fragments it had collected are gone. Other nodes learn
        nothing: what they send to it or through it fails for want of an acknowledgement.
        """
        if node not in self._stopped:
            self._stopped.add(node)
            self._layers[node].stop()

    def counters(self, node: NodeId) -> LinkCounters:
        """Return what the node's link layer has done so far."""
        return self._macs[node].counters

    def _contenders(self, node: NodeId) -> int:
        """Return how many nodes of one depth share the channel on the way from `node` to its parent."""
        parent = self.tree.parent[node]
        assert parent is not None
        addresses, depth = self._directory.addresses, self.tree.depth
        here, there = addresses[node], addresses[parent]
        threshold_dbm = self._stack.radio.cca_threshold_dbm
        contenders = 1
        for other in depth:
            if other != node and depth[other] == depth[node]:
                at = addresses[other]
                loudest_dbm = max(self._links.arriving_dbm(at, here), self._links.arriving_dbm(at, there))
                contenders += loudest_dbm >= threshold_dbm
        return contenders

    def _room_bytes(self, hops: int) -> int:
        return fragment_room_bytes(self._stack.family.max_payload_bytes, self._stack.link, hops)

    def _record(self, frame: Transmission, receiver: int, sinr_db: float, outcome: str) -> None:
        names = self._directory.names
        self._observer.frame(
            FrameRow(
                time_s=to_s(frame.start_ns),
                sender=names[frame.sender],
                receiver=names[receiver],
                kind=frame.kind,
                bytes=len(frame.mpdu),
                attempt=frame.attempt,
                rssi_dbm=self._links.arriving_dbm(frame.sender, receiver),
                sinr_db=sinr_db,
                outcome=outcome,
            )
        )


def _unmetered(now_ns: Nanoseconds, cause: str) -> None:
    """Keep no account of a radio."""


def _check(tree: Tree, names: Sequence[NodeId]) -> None:
    if set(tree.parent) != set(names):
        odd = sorted(set(tree.parent) ^ set(names))
        raise RoutingError(f"tree: must hold the nodes that have a position and no others, differs in {odd}")
    if len(names) > MAX_NODES:
        raise RoutingError(f"nodes: short addresses are enough for {MAX_NODES}, got {len(names)}")
    if 2 * tree.height > MAX_HOPS:
        raise RoutingError(
            f"tree: a way of at most {MAX_HOPS} hops fits the mesh header, got a tree {tree.height} hops high"
        )
