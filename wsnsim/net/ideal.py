"""A network without loss and without delay, on the same tree: what a radio costs a tracker shows against it.

A datagram arrives at the instant it is sent, as an event of its own, after
everything that is already due at that instant and in the order of sending.
Each hop counts the datagram's bytes once, without headers, as one frame. No
time passes on the air, so no radio is metered: the joules of a run over this
network hold none of the radio.
"""

import math
from collections.abc import Callable
from itertools import pairwise

from simpy import Environment

from wsnsim.net.clock import Clock
from wsnsim.net.collection import GUARD_S
from wsnsim.net.flights import Flight, Flights
from wsnsim.net.interface import Datagram, LinkCounters, NetworkObserver, Outcome
from wsnsim.net.routing.tree import Tree, check_datagram
from wsnsim.types import NodeId, Seconds


class IdealNetwork:
    """The network, as `wsnsim.net.interface.Network` asks for it.

    Parameters
    ----------
    env : SimPy environment
    tree : the routing tree; hops are counted along it
    observer : hears what became of each datagram
    reach : names whom a node could speak with by radio
    """

    def __init__(
        self,
        env: Environment,
        tree: Tree,
        observer: NetworkObserver,
        reach: Callable[[NodeId], tuple[NodeId, ...]] | None = None,
    ) -> None:
        self.tree = tree
        self._neighbours = self._in_tree if reach is None else reach
        self._clock = Clock(env)
        self._flights = Flights(observer)
        self._counters = {node: LinkCounters() for node in tree.parent}
        self._stopped: set[NodeId] = set()

    def neighbours(self, node: NodeId) -> tuple[NodeId, ...]:
        """Return whom a node could speak with by radio; where nobody says, parent and children."""
        return self._neighbours(node)

    def fragments(self, data_bytes: int) -> int:
        """Return 1: a datagram of any size is one frame."""
        return 1

    def hop_service_s(self, data_bytes: int, node: NodeId) -> Seconds:
        """Return a small guard: no time passes, but what is collected must come after its parts."""
        return GUARD_S

    def send(self, datagram: Datagram) -> None:
        """Take a datagram at its source.

        Raises
        ------
        RoutingError : an unknown node, several receivers without dissemination, or a receiver of a
            dissemination that is not below its source
        """
        check_datagram(self.tree, datagram)
        flight = self._flights.begin(datagram)
        carry = self._spread if datagram.disseminate else self._tell if datagram.one_hop else self._carry
        self._clock.call(0, lambda: carry(flight))
        if datagram.left is not None:
            self._clock.call(0, datagram.left)

    def stop_node(self, node: NodeId) -> None:
        """Silence a node for good: whatever would pass it is lost."""
        self._stopped.add(node)

    def counters(self, node: NodeId) -> LinkCounters:
        """Return what the node's link layer has done so far."""
        return self._counters[node]

    def allowance_bytes(self, node: NodeId) -> float:
        """Return infinity: nothing limits a program here."""
        return math.inf

    def budget_wait_s(self, node: NodeId) -> Seconds:
        """Return 0: nothing waits here."""
        return 0.0

    def _carry(self, flight: Flight) -> None:
        datagram = flight.datagram
        way = self.tree.path(datagram.source, datagram.destinations[0])
        for sender, receiver in pairwise(way):
            if sender in self._stopped:
                break
            if not self.tree.by_wire(sender, receiver):
                self._count(sender, (receiver,), len(datagram.data))
        if self._stopped.isdisjoint(way):
            self._flights.deliver(flight, way[-1], datagram.data, self.tree.hops(way[0], way[-1]))
        else:
            self._flights.lose(flight, datagram.destinations, Outcome.DEAD)

    def _spread(self, flight: Flight) -> None:
        datagram = flight.datagram
        reached = [] if datagram.source in self._stopped else [datagram.source]
        for node in reached:
            children = self.tree.children[node]
            heard = tuple(child for child in children if child not in self.tree.wired)
            if heard:
                self._count(node, heard, len(datagram.data))
            reached.extend(child for child in children if child not in self._stopped)
        for receiver in datagram.destinations:
            if receiver in reached:
                hops = self.tree.depth[receiver] - self.tree.depth[datagram.source]
                self._flights.deliver(flight, receiver, datagram.data, hops)
        self._flights.lose(flight, datagram.destinations, Outcome.DEAD)

    def _tell(self, flight: Flight) -> None:
        datagram = flight.datagram
        if datagram.source not in self._stopped:
            self._count(datagram.source, datagram.destinations, len(datagram.data))
            for receiver in datagram.destinations:
                if receiver not in self._stopped:
                    self._flights.deliver(flight, receiver, datagram.data, 1)
        self._flights.lose(flight, datagram.destinations, Outcome.DEAD)

    def _in_tree(self, node: NodeId) -> tuple[NodeId, ...]:
        parent = self.tree.parent[node]
        return (*(() if parent is None else (parent,)), *self.tree.children[node])

    def _count(self, sender: NodeId, receivers: tuple[NodeId, ...], data_bytes: int) -> None:
        self._counters[sender].mac_tx_bytes += data_bytes
        self._counters[sender].frames_tx += 1
        for receiver in receivers:
            if receiver not in self._stopped:
                self._counters[receiver].mac_rx_bytes += data_bytes
