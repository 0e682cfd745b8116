"""The link layer of a node where routes change, broadcasts are repeated, or sinks are many.

Every frame's load is followed in all its copies: a receiver has lost a
datagram when it lacks a part of which no copy is left anywhere. So a packet
may be sent again by another way although the first receiver has it, and a
broadcast may come from many.

Unicast: the next hop is asked of the router each time a frame goes to the MAC.
A frame that the MAC gives up stays where it is and is tried again, by the way
that is best then, `tries` times. Without a way it waits, or is lost.
Dissemination: each node that hears a frame for the first time broadcasts it,
and again `repeats` times after random pauses; what it hears again it throws
away, known by origin and number. Sinks are joined by a backbone that takes no
time and loses nothing: what one has, all have.
"""

import math
from typing import Any, cast

import numpy as np

from wsnsim.net.backbone import Backbone
from wsnsim.net.budget import Budget
from wsnsim.net.clock import Clock
from wsnsim.net.config import LinkConfig
from wsnsim.net.flights import Flight, Load
from wsnsim.net.fragmentation import fragment
from wsnsim.net.inbox import Inbox
from wsnsim.net.interface import Outcome
from wsnsim.net.linkuse import LinkUse
from wsnsim.net.mac.base import Mac
from wsnsim.net.manners import Manners, Memory, extra_bytes, is_unicast
from wsnsim.net.mesh import ALL_NEIGHBOURS, MeshHeader, decode_mesh, mesh_bytes
from wsnsim.net.parcel import Directory, Parcel, fragment_room_bytes
from wsnsim.net.phy.base import BROADCAST
from wsnsim.net.repeats import Repeats
from wsnsim.net.routing.base import Router
from wsnsim.net.routing.control import (
    ROUTE_BYTES,
    decode_broadcast,
    decode_route,
    encode_broadcast,
    encode_route,
)
from wsnsim.net.sendqueue import Control, SendQueue
from wsnsim.types import NodeId
from wsnsim.units import to_ns

_UNSENT = (Outcome.EXPIRED, Outcome.BUDGET, Outcome.NO_ROUTE)
"""What happens to a frame without the MAC."""


class MeshLink:
    """The link layer of one node; its router must be set before anything else.

    Parameters
    ----------
    node : its name
    clock : the event clock
    config : queue sizes, timeout and mesh header
    manners : hop limit, tries, repetitions
    mac : the MAC below
    max_payload_bytes : what one of its frames carries [B]
    directory : addresses and the account of datagrams
    backbone : the wire between the sinks, for all of them the same
    rng : draws pauses, and what a queue drops at random
    budget : what the node may put on the air; None where it may send as much as it can
    """

    router: Router

    def __init__(
        self,
        node: NodeId,
        clock: Clock,
        config: LinkConfig,
        manners: Manners,
        mac: Mac,
        max_payload_bytes: int,
        directory: Directory,
        backbone: "Backbone[MeshLink]",
        rng: np.random.Generator,
        budget: Budget | None = None,
    ) -> None:
        self._node, self._config, self._manners = node, config, manners
        self._mac, self._max_payload_bytes = mac, max_payload_bytes
        self._directory, self._flights, self._backbone = directory, directory.flights, backbone
        self._address = directory.addresses[node]
        self._budget = budget
        self._tag = 0
        self._numbers: dict[int, int] = {}
        """Of the last packet to each final address: who relays some of the packets sees no number twice."""
        self._known = Memory()
        self._use = LinkUse(mac.counters, manners.overhead_bytes)
        self._hop: int | None = None
        self._alive = True
        self._queue = SendQueue(clock, config, mac, self, budget, rng)
        self._repeats = Repeats(clock, rng, manners.spread.pause_s, self._queue.forward)
        self._inbox = Inbox(clock, to_ns(config.reassembly_timeout_s), self._late)

    def send(self, flight: Flight) -> None:
        """Take a datagram of this node's own."""
        self._queue.say(flight)

    def control(self, frame: Control) -> None:
        """Take a frame of the router."""
        if self._alive:
            self._queue.control(frame)

    def opened(self) -> None:
        """Send what has waited for a way."""
        if self._alive:
            self._queue.serve()

    def allowance_bytes(self) -> float:
        """Return how much the program may say now where it is to keep to a budget [B]; else infinity."""
        if self._budget is None or not self._budget.limits_programs:
            return math.inf
        room_bytes = self._room_bytes(ROUTE_BYTES, self._manners.hop_limit)
        return self._budget.data_bytes(room_bytes, self._max_payload_bytes)

    def queued(self) -> int:
        """Return how many frames and datagrams wait here to be sent."""
        return len(self._queue) + len(self._repeats)

    def stop(self) -> None:
        """Stop for good: the radio is silent, and all that waits here is lost."""
        self._alive = False
        self._mac.stop()
        self.router.stop()
        frames, outbox = self._queue.drain()
        for flight in self._inbox.empty():
            self._flights.lose(flight, (self._node,), Outcome.DEAD)
        for parcel in (*frames, *self._repeats.drain()):
            self.lost(parcel, Outcome.DEAD)
        for flight in outbox:
            self._flights.let_go(flight, Outcome.DEAD)

    def received(self, payload: bytes, source: int, cargo: Any) -> None:
        """Take a packet that the MAC received: forward it, keep it, or both."""
        self.router.heard(source)
        if cargo is None:
            self.router.take(source, payload)
            return
        sent = cast(Parcel, cargo)
        header, rest = decode_mesh(payload) if self._config.mesh_header_bytes else (sent.header, payload)
        if header.final == ALL_NEIGHBOURS:
            self._keep(header, rest, sent)
        elif header.final == BROADCAST:
            self._take_broadcast(header, rest, source, sent)
        else:
            self._take_unicast(header, rest, source, sent)

    def over_wire(self, parcel: Parcel) -> None:
        """Take a frame that another sink has."""
        if not self._alive:
            _end_for_the_dead(parcel)
        elif is_unicast(parcel) or self._is_new(parcel.header, parcel.sequence):
            self._pass_on(parcel.header, parcel.body, parcel.sequence, parcel)

    def done(self, outcome: Outcome | None) -> None:
        """Learn from the MAC what became of the frame in hand."""
        parcel = self._queue.in_hand
        if outcome not in _UNSENT:
            if isinstance(parcel, Control):
                self._use.control(self.router, self._queue.control_sent, outcome)
            else:
                self._use.data(self.router, self._hop, outcome)
            if isinstance(parcel, Parcel) and outcome is None and parcel.repeats > 0:
                self._repeats.add(parcel)
            if isinstance(parcel, Parcel) and outcome is not None and is_unicast(parcel):
                parcel.tries += 1
                if parcel.tries < self._manners.tries:
                    self._queue.keep()
                    self._queue.serve()
                    return
        finished = self._queue.finish(outcome)
        if finished is not None:
            self.lost(finished, outcome)
        self._queue.serve()

    def ready(self, parcel: Parcel) -> bool:
        """Return whether a frame has a way now, or need not wait for one."""
        if not is_unicast(parcel) or not self._manners.hold or self._address in self._backbone.links:
            return True
        return self.router.next_hop(parcel.header.final) is not None

    def packet_bytes(self, parcel: Parcel) -> int:
        """Return how long a frame's packet is, headers above the MAC's included [B]."""
        if self._config.mesh_header_bytes == 0:
            return len(parcel.body)
        return len(parcel.body) + mesh_bytes(parcel.header.hops_left) + extra_bytes(parcel.header.final)

    def submit(self, parcel: Parcel) -> None:
        """Give a frame to the MAC, or to another sink."""
        final = parcel.header.final
        self._hop = None
        if final == ALL_NEIGHBOURS:
            meant = tuple(self._directory.addresses[node] for node in parcel.flight.datagram.destinations)
            self._mac.submit(self._packet(parcel, b""), BROADCAST, meant, parcel)
        elif final == BROADCAST:
            for other in self._backbone.others(self._address):
                other.over_wire(parcel)
            packet = self._packet(parcel, encode_broadcast(parcel.sequence))
            self._mac.submit(packet, BROADCAST, self.router.neighbours(), parcel)
        else:
            self._submit_unicast(parcel)

    def cut(self, flight: Flight) -> list[Parcel]:
        """Return a datagram of the node's own in frames."""
        datagram = flight.datagram
        hops, final, repeats = self._manners.hop_limit, BROADCAST, 0
        if datagram.one_hop:
            hops, final = 1, ALL_NEIGHBOURS
        elif datagram.disseminate:
            repeats = self._manners.spread.repeats
        else:
            final = self._directory.addresses[datagram.destinations[0]]
        header = MeshHeader(hops, self._address, final)
        self._tag = (self._tag + 1) % 0x10000
        bodies = fragment(datagram.data, self._tag, self._room_bytes(extra_bytes(final), hops))
        flight.loads = [Load() for _ in bodies]
        return [
            Parcel(flight, header, body, True, load=load, sequence=self._number(final), repeats=repeats)
            for body, load in zip(bodies, flight.loads, strict=True)
        ]

    def lost(self, parcel: Parcel, outcome: Outcome | None) -> None:
        """Note that a copy is gone: sent well (None), or lost. An own datagram is let go as a whole."""
        if not parcel.own and parcel.load is not None:
            self._flights.release(parcel.flight, parcel.load, outcome)

    def let_go(self, flight: Flight, outcome: Outcome | None) -> None:
        """Note that an own datagram has no frame left here: all sent (None), or the rest given up."""
        self._flights.let_go(flight, outcome)

    def given_up(self, flight: Flight, outcome: Outcome) -> None:
        """Note that a datagram of the node's own is lost."""
        self._flights.let_go(flight, outcome)

    def _submit_unicast(self, parcel: Parcel) -> None:
        final = parcel.header.final
        hop = self.router.next_hop(final)
        if hop is not None:
            self._hop = hop
            parcel.cost = self.router.cost if hop == self.router.parent else math.inf
            packet = self._packet(parcel, encode_route(parcel.cost, parcel.sequence))
            self._mac.submit(packet, hop, (hop,), parcel)
            return
        other = self._backbone.towards(self._address, final)
        if other is not None:
            other.over_wire(parcel)
            self.done(None)
        else:
            self.done(Outcome.NO_ROUTE)

    def _packet(self, parcel: Parcel, extra: bytes) -> bytes:
        if self._config.mesh_header_bytes == 0:
            return parcel.body
        return parcel.header.encode() + extra + parcel.body

    def _take_broadcast(self, header: MeshHeader, rest: bytes, source: int, sent: Parcel) -> None:
        sequence, body = decode_broadcast(rest) if self._config.mesh_header_bytes else (sent.sequence, rest)
        if not self.router.takes(source):
            return
        if self._is_new(header, sequence):
            self._pass_on(header.after_hop(), body, sequence, sent)
            self._keep(header, body, sent)
        else:
            self._mac.counters.duplicates += 1

    def _take_unicast(self, header: MeshHeader, rest: bytes, source: int, sent: Parcel) -> None:
        cost, sequence, body = sent.cost, sent.sequence, rest
        if self._config.mesh_header_bytes:
            cost, sequence, body = decode_route(rest)
        if math.isfinite(cost):
            self.router.carries(source, header.origin, cost)
        if not self._is_new(header, sequence):
            self._mac.counters.duplicates += 1
            return
        ends = self._backbone.is_end(self._address, header.final)
        if not ends and self.router.next_hop(header.final) == source:
            self.router.forget(header.final)
        self._pass_on(header.after_hop(), body, sequence, sent)

    def _pass_on(self, header: MeshHeader, body: bytes, sequence: int, sent: Parcel) -> None:
        """Send on what is for others, and keep what is for this node, or for the base station at any sink."""
        unicast = header.final != BROADCAST
        if self._backbone.is_end(self._address, header.final):
            taker = self._backbone.links.get(header.final, self)
            if taker._alive:
                taker._keep(header, body, sent, after_hop=True)
            else:
                _end_for_the_dead(sent)
            return
        if not unicast and not self.router.spreads:
            return
        load = sent.load
        assert load is not None
        if header.hops_left == 0:
            if unicast:
                load.cause = Outcome.HOP_LIMIT
            return
        repeats = 0 if unicast else self._manners.spread.repeats
        load.copies += 1
        self._queue.forward(
            Parcel(sent.flight, header, body, False, load=load, sequence=sequence, repeats=repeats)
        )

    def _is_new(self, header: MeshHeader, sequence: int) -> bool:
        """Return whether a packet was never here, and know it from now on."""
        everyone = header.final == BROADCAST
        if everyone and header.origin == self._address:
            return False
        hops_left = 0 if everyone else header.hops_left
        return self._known.add((header.origin, header.final, sequence, hops_left))

    def _number(self, final: int) -> int:
        number = self._numbers[final] = (self._numbers.get(final, 0) + 1) % 256
        return number

    def _room_bytes(self, extra_bytes: int, hops: int) -> int:
        return fragment_room_bytes(self._max_payload_bytes, self._config, hops, extra_bytes)

    def _keep(self, header: MeshHeader, body: bytes, sent: Parcel, after_hop: bool = False) -> None:
        if sent.load is not None:
            sent.load.heard.add(self._node)
        data = self._inbox.take(header.origin, body, sent.flight)
        if data is not None:
            hops = 1
            if header.final != ALL_NEIGHBOURS:
                hops = self._manners.hop_limit - header.hops_left + (not after_hop)
            self._flights.deliver(sent.flight, self._node, data, hops)

    def _late(self, flight: Flight) -> None:
        self._flights.lose(flight, (self._node,), Outcome.REASSEMBLY)


def _end_for_the_dead(parcel: Parcel) -> None:
    """Note why a frame for one node goes no further: who is behind the wire has stopped."""
    if is_unicast(parcel) and parcel.load is not None:
        parcel.load.cause = Outcome.DEAD
