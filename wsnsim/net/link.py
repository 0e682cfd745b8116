"""The link layer of a node on a fixed tree: fragments, forwarding, and who loses what.

Unicast: relays forward fragments one by one (mesh-under); a source gives a
datagram up with its first lost fragment, or when it expires. Dissemination:
each node with children broadcasts once what it hears from its parent, and
takes nothing from anyone else; so a fragment that a node did not hear never
comes again, and the node and all below it are lost for the datagram at that
instant. A datagram for the neighbours is broadcast once and goes no further.
"""

import math
from typing import Any, cast

import numpy as np

from wsnsim.net.budget import Budget
from wsnsim.net.clock import Clock
from wsnsim.net.config import LinkConfig
from wsnsim.net.flights import Flight
from wsnsim.net.fragmentation import fragment
from wsnsim.net.inbox import Inbox
from wsnsim.net.interface import Outcome
from wsnsim.net.mac.base import Mac
from wsnsim.net.mesh import ALL_NEIGHBOURS, MeshHeader, decode_mesh, mesh_bytes
from wsnsim.net.parcel import Directory, Parcel, fragment_room_bytes
from wsnsim.net.phy.base import BROADCAST
from wsnsim.net.sendqueue import SendQueue
from wsnsim.types import NodeId
from wsnsim.units import to_ns


class Link:
    """The link layer of one node.

    Parameters
    ----------
    node : its name
    clock : the event clock
    config : queue sizes, timeout and mesh header
    mac : the MAC below
    max_payload_bytes : what one of its frames carries [B]
    directory : the tree, the addresses and the account of datagrams
    budget : what the node may put on the air; None where it may send as much as it can
    rng : for a queue that drops at random
    """

    __slots__ = (
        "_address",
        "_budget",
        "_child_addresses",
        "_children",
        "_config",
        "_directory",
        "_flights",
        "_hops_to",
        "_inbox",
        "_mac",
        "_max_payload_bytes",
        "_next_hops",
        "_node",
        "_parent",
        "_parent_address",
        "_queue",
        "_tag",
        "_tree",
    )

    def __init__(
        self,
        node: NodeId,
        clock: Clock,
        config: LinkConfig,
        mac: Mac,
        max_payload_bytes: int,
        directory: Directory,
        budget: Budget | None = None,
        rng: np.random.Generator | None = None,
    ) -> None:
        self._node, self._config, self._mac = node, config, mac
        self._max_payload_bytes = max_payload_bytes
        self._directory, self._tree, self._flights = directory, directory.tree, directory.flights
        self._address = directory.addresses[node]
        self._parent = self._tree.parent[node]
        self._parent_address = -1 if self._parent is None else directory.addresses[self._parent]
        self._children = self._tree.children[node]
        self._child_addresses = tuple(directory.addresses[child] for child in self._children)
        self._next_hops: dict[int, int] = {}
        self._hops_to: dict[int, int] = {}
        self._tag = 0
        self._budget = budget
        self._queue = SendQueue(clock, config, mac, self, budget, rng)
        self._inbox = Inbox(clock, to_ns(config.reassembly_timeout_s), self._late)

    def send(self, flight: Flight) -> None:
        """Take a datagram of this node's own."""
        self._queue.say(flight)

    def allowance_bytes(self) -> float:
        """Return how much the program may say now where it is to keep to a budget [B]; else infinity."""
        if self._budget is None or not self._budget.limits_programs:
            return math.inf
        room_bytes = fragment_room_bytes(self._max_payload_bytes, self._config, self._tree.depth[self._node])
        return self._budget.data_bytes(room_bytes, self._max_payload_bytes)

    def queued(self) -> int:
        """Return how many frames and datagrams wait here to be sent."""
        return len(self._queue)

    def stop(self) -> None:
        """Stop for good: the radio is silent, and all that waits here is lost."""
        self._mac.stop()
        begun = self._queue.mid_datagram
        frames, outbox = self._queue.drain()
        if not begun and any(parcel.own for parcel in frames):
            # The last frame of the first datagram stands in the queue, and speaks for it.
            del outbox[0]
        partial = list(self._inbox.empty())
        for parcel in frames:
            if not self._went_on(parcel):
                self.lost(parcel, Outcome.DEAD)
        for flight in outbox:
            self.given_up(flight, Outcome.DEAD)
        for flight in partial:
            self._flights.lose(flight, (self._node,), Outcome.DEAD)

    def received(self, payload: bytes, source: int, cargo: Any) -> None:
        """Take a packet that the MAC received: forward it, keep it, or both."""
        sent = cast(Parcel, cargo)
        header, body = decode_mesh(payload) if self._config.mesh_header_bytes else (sent.header, payload)
        everyone = header.final == BROADCAST
        if everyone and self._directory.names[source] != self._parent:
            return
        sent.taken_by.append(self._node)
        mine = header.final in (self._address, ALL_NEIGHBOURS)
        if not mine and (self._children or not everyone):
            self._queue.forward(Parcel(sent.flight, header.after_hop(), body, False, sent.hops + 1))
        if everyone or mine:
            self._keep(header, body, sent)

    def done(self, outcome: Outcome | None) -> None:
        """Learn from the MAC what became of the frame in hand."""
        begun = self._queue.mid_datagram
        parcel = self._queue.finish(outcome)
        assert parcel is not None
        if outcome is not None:
            if (parcel.own and begun) or not self._went_on(parcel):
                self.lost(parcel, outcome)
        elif parcel.header.final in (BROADCAST, ALL_NEIGHBOURS):
            self._note_missed(parcel)
        elif not parcel.taken_by:
            # An acknowledgement of another node's frame with the same number was taken for ours.
            self.lost(parcel, Outcome.NO_ACK)
        self._queue.serve()

    def ready(self, parcel: Parcel) -> bool:
        """Return True: the tree always has a way."""
        return True

    def packet_bytes(self, parcel: Parcel) -> int:
        """Return how long a frame's packet is, headers above the MAC's included [B]."""
        if self._config.mesh_header_bytes == 0:
            return len(parcel.body)
        return len(parcel.body) + mesh_bytes(parcel.header.hops_left)

    def submit(self, parcel: Parcel) -> None:
        """Give a frame to the MAC."""
        packet = parcel.header.encode() + parcel.body if self._config.mesh_header_bytes else parcel.body
        final = parcel.header.final
        if final == BROADCAST:
            self._mac.submit(packet, BROADCAST, self._child_addresses, parcel)
        elif final == ALL_NEIGHBOURS:
            addresses = self._directory.addresses
            meant = tuple(addresses[node] for node in parcel.flight.datagram.destinations)
            self._mac.submit(packet, BROADCAST, meant, parcel)
        else:
            hop = self._next_hop(final)
            self._mac.submit(packet, hop, (hop,), parcel)

    def cut(self, flight: Flight) -> list[Parcel]:
        """Return a datagram of the node's own in frames."""
        datagram = flight.datagram
        if datagram.one_hop:
            hops, final = 1, ALL_NEIGHBOURS
        elif datagram.disseminate:
            below = self._tree.descendants(self._node)
            hops = max(self._tree.depth[node] for node in below) - self._tree.depth[self._node]
            final = BROADCAST
        else:
            (destination,) = datagram.destinations
            final = self._directory.addresses[destination]
            hops = self._hops_to.get(final, 0)
            if not hops:
                hops = self._hops_to[final] = self._tree.hops(self._node, destination)
        header = MeshHeader(hops, self._address, final)
        self._tag = (self._tag + 1) % 0x10000
        bodies = fragment(
            datagram.data, self._tag, fragment_room_bytes(self._max_payload_bytes, self._config, hops)
        )
        return [Parcel(flight, header, body, own=True) for body in bodies]

    def lost(self, parcel: Parcel, outcome: Outcome) -> None:
        """Note that whoever was to get a frame by way of this node will not, unless it has it already."""
        final = parcel.header.final
        if final == ALL_NEIGHBOURS:
            receivers = parcel.flight.datagram.destinations
        elif final == BROADCAST:
            # a broadcast of many copies may have come to some when its sender dies
            served = {node for taker in parcel.taken_by for node in (taker, *self._tree.descendants(taker))}
            receivers = tuple(node for node in self._tree.descendants(self._node) if node not in served)
        else:
            receivers = (self._directory.names[final],)
        self._flights.lose(parcel.flight, receivers, outcome)

    def let_go(self, flight: Flight, outcome: Outcome | None) -> None:
        """Do nothing: what became of an own datagram's frames has been told."""

    def given_up(self, flight: Flight, outcome: Outcome) -> None:
        """Note that a datagram of the node's own is lost."""
        self._flights.lose(flight, flight.datagram.destinations, outcome)

    def _next_hop(self, final: int) -> int:
        if final == self._parent_address:
            return final
        hop = self._next_hops.get(final)
        if hop is None:
            addresses, names = self._directory.addresses, self._directory.names
            hop = self._next_hops[final] = addresses[self._tree.path(self._node, names[final])[1]]
        return hop

    def _went_on(self, parcel: Parcel) -> bool:
        """Whether the next hop has the frame, though its acknowledgement never came back."""
        return parcel.header.final not in (BROADCAST, ALL_NEIGHBOURS) and bool(parcel.taken_by)

    def _note_missed(self, parcel: Parcel) -> None:
        one_hop = parcel.header.final == ALL_NEIGHBOURS
        for child in parcel.flight.datagram.destinations if one_hop else self._children:
            if child not in parcel.taken_by:
                outcome = Outcome.DEAD if child in self._directory.stopped else Outcome.NOT_HEARD
                below = () if one_hop else self._tree.descendants(child)
                self._flights.lose(parcel.flight, (child, *below), outcome)

    def _keep(self, header: MeshHeader, body: bytes, sent: Parcel) -> None:
        data = self._inbox.take(header.origin, body, sent.flight)
        if data is not None:
            self._flights.deliver(sent.flight, self._node, data, sent.hops)

    def _late(self, flight: Flight) -> None:
        self._flights.lose(flight, (self._node,), Outcome.REASSEMBLY)
