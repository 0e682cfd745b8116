"""A network of fixed nodes with radios on a routing tree, put together: medium, MACs and links.

Datagrams climb the tree to the base station (or to any node), go down it to a
named node, or are disseminated to all nodes below their source. Relays do not
look inside them.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

from simpy import Environment

from wsnsim.net.budget import Budget, BudgetConfig
from wsnsim.net.channel.channel import Channel
from wsnsim.net.clock import Clock
from wsnsim.net.config import LinkConfig, RadioConfig
from wsnsim.net.flights import Flights
from wsnsim.net.fragmentation import fragment, fragment_count
from wsnsim.net.interface import Datagram, LinkCounters, NetworkObserver, Outcome
from wsnsim.net.link import Link
from wsnsim.net.mac.base import Mac, MacFamily
from wsnsim.net.mac.csma_ca import CsmaCaFamily
from wsnsim.net.mesh import MAX_HOPS, MAX_UNICAST
from wsnsim.net.meshes import Mesh, RoutingConfig
from wsnsim.net.meshlink import MeshLink
from wsnsim.net.parcel import Directory, fragment_room_bytes
from wsnsim.net.phy.base import RadioMeter, Transmission
from wsnsim.net.phy.medium import Medium
from wsnsim.net.routing.base import Router
from wsnsim.net.routing.control import ROUTE_BYTES
from wsnsim.net.routing.reach import Reach
from wsnsim.net.routing.tree import RoutingError, Tree, check_datagram
from wsnsim.records import FrameRow
from wsnsim.rng import RandomStreams
from wsnsim.types import NodeId, Seconds
from wsnsim.units import to_s


@dataclass(frozen=True)
class Stack:
    """What all nodes of a network have alike, from the antenna up to the queue."""

    family: MacFamily = field(default_factory=CsmaCaFamily)
    radio: RadioConfig = field(default_factory=RadioConfig)
    link: LinkConfig = field(default_factory=LinkConfig)
    routing: RoutingConfig = field(default_factory=RoutingConfig)


def _nobody(node: NodeId) -> None:
    """Tell nobody."""


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
    budgets : what the nodes may put on the air; one without may send as much as it can
    budget_reached : told when a node's budget holds a frame up for the first time

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
        budgets: Mapping[NodeId, BudgetConfig] | None = None,
        budget_reached: Callable[[NodeId], None] = _nobody,
    ) -> None:
        _check(tree, names)
        self._planned = tree
        self._clock = Clock(env)
        self._stack, self._links, self._observer = stack, channel.links, observer
        self._stopped: set[NodeId] = set()
        self._flights = Flights(observer, self._stopped)
        addresses = {node: at for at, node in enumerate(names)}
        directory = Directory(tree, tuple(names), addresses, self._stopped, self._flights)
        self._directory = directory
        report = self._record if record_frames else None
        family = stack.family
        medium = Medium(self._clock, family.phy, stack.radio, channel, report)
        self._macs: dict[NodeId, Mac] = {}
        self._layers: dict[NodeId, Link | MeshLink] = {}
        self._reach = Reach(channel.links, family.phy, stack.radio)
        self._mesh: Mesh | None = None
        if not stack.routing.changes_nothing(tree):
            reach, moved = self._reach.of, observer.reparented
            self._mesh = Mesh(
                self._clock, family, stack.link, stack.routing, directory, streams, reach, moved
            )
        self._budgets: dict[NodeId, Budget] = {}
        for address, node in enumerate(names):
            mac = family.mac(self._clock, medium, address, streams.stream("net.mac", node))
            budget = None
            if budgets is not None and node in budgets:
                budget = Budget(
                    self._clock,
                    budgets[node],
                    mac.counters,
                    family.overhead_bytes,
                    partial(budget_reached, node),
                )
                self._budgets[node] = budget
            link = self._link(node, mac, budget, streams)
            radio = medium.add(streams.stream("net.reception", node), mac)
            mac.connect(radio, link)
            if node in meters:
                meters[node].attend(medium.times(radio))
            self._macs[node], self._layers[node] = mac, link

    @property
    def tree(self) -> Tree:
        """Who sends to whom now."""
        return self._planned if self._mesh is None else self._mesh.tree

    def neighbours(self, node: NodeId) -> tuple[NodeId, ...]:
        """Return the nodes that a node can speak with directly: as it has learned, or as the links are."""
        if self._mesh is not None:
            return self._mesh.neighbours(node)
        names = self._directory.names
        return tuple(names[at] for at in self._reach.of(self._directory.addresses[node]))

    def router(self, node: NodeId) -> Router:
        """Return what knows a node's ways, in a network with routers."""
        if self._mesh is None:
            raise RoutingError(f"node {node!r}: has no router, its tree stays as it was planned")
        return self._mesh.router(node)

    def fragments(self, data_bytes: int) -> int:
        """Return the number of radio frames a datagram of that size takes on one hop."""
        height = self._planned.height if self._mesh is None else self._mesh.hop_limit
        return fragment_count(data_bytes, self._room_bytes(height))

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
        everywhere = self._mesh is not None and self._stack.routing.spreads_everywhere
        check_datagram(self._planned, datagram, everywhere)
        flight = self._flights.begin(datagram)
        source = datagram.source
        if source in self._stopped:
            self._flights.lose(flight, datagram.destinations, Outcome.DEAD)
        elif datagram.destinations == (source,):
            self._clock.call(0, lambda: self._flights.deliver(flight, source, datagram.data, 0))
        elif datagram.destinations:
            if self._mesh is not None and not (datagram.disseminate or datagram.one_hop):
                source = self._mesh.entrance(source, datagram.destinations[0])
            if source in self._stopped:
                self._flights.lose(flight, datagram.destinations, Outcome.DEAD)
            else:
                self._layers[source].send(flight)

    def stop_node(self, node: NodeId) -> None:
        """Silence a node for good: its radio is dead, its queue is lost.

        What it was sending is cut off; fragments it had collected are gone. Other nodes learn
        nothing: what they send to it or through it fails for want of an acknowledgement.
        """
        if node not in self._stopped:
            self._stopped.add(node)
            self._layers[node].stop()

    def queued(self, node: NodeId) -> int:
        """Return how many frames and datagrams wait at a node to be sent."""
        return self._layers[node].queued()

    def counters(self, node: NodeId) -> LinkCounters:
        """Return what the node's link layer has done so far."""
        return self._macs[node].counters

    def allowance_bytes(self, node: NodeId) -> float:
        """Return how much the node's program may say now where it has a budget to keep [B]; else infinity."""
        return self._layers[node].allowance_bytes()

    def budget_wait_s(self, node: NodeId) -> Seconds:
        """Return how long frames of the node have waited for its budget [s]."""
        budget = self._budgets.get(node)
        return 0.0 if budget is None else to_s(budget.waited_ns)

    def _contenders(self, node: NodeId) -> int:
        """Return how many nodes of one depth share the channel on the way from `node` to its parent."""
        parent = self._planned.parent[node]
        assert parent is not None
        addresses, depth = self._directory.addresses, self._planned.depth
        here, there = addresses[node], addresses[parent]
        threshold_dbm = self._stack.radio.cca_threshold_dbm
        contenders = 1
        for other in depth:
            if other != node and depth[other] == depth[node]:
                at = addresses[other]
                loudest_dbm = max(self._links.arriving_dbm(at, here), self._links.arriving_dbm(at, there))
                contenders += loudest_dbm >= threshold_dbm
        return contenders

    def _link(self, node: NodeId, mac: Mac, budget: Budget | None, streams: RandomStreams) -> Link | MeshLink:
        if self._mesh is not None:
            return self._mesh.link(node, mac, budget)
        config, payload_bytes = self._stack.link, self._stack.family.max_payload_bytes
        rng = streams.stream("net.queue", node) if config.queue_policy == "drop_random" else None
        return Link(node, self._clock, config, mac, payload_bytes, self._directory, budget, rng)

    def _room_bytes(self, hops: int) -> int:
        extra_bytes = 0 if self._mesh is None else ROUTE_BYTES
        return fragment_room_bytes(self._stack.family.max_payload_bytes, self._stack.link, hops, extra_bytes)

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


def _check(tree: Tree, names: Sequence[NodeId]) -> None:
    if set(tree.parent) != set(names):
        odd = sorted(set(tree.parent) ^ set(names))
        raise RoutingError(f"tree: must hold the nodes that have a position and no others, differs in {odd}")
    if len(names) > MAX_UNICAST:
        raise RoutingError(f"nodes: short addresses are enough for {MAX_UNICAST}, got {len(names)}")
    if 2 * tree.height > MAX_HOPS:
        raise RoutingError(
            f"tree: a way of at most {MAX_HOPS} hops fits the mesh header, got a tree {tree.height} hops high"
        )
