"""The layer of one node between the MAC and the whole network: queue, fragments, forwarding.

Frames wait in one queue, first come, first served. What a node forwards joins
it as it arrives, and is lost where the queue is full. What a node says itself
waits in an outbox of whole datagrams and joins the queue one fragment at a
time, so that neither a long message nor a busy application shuts out what the
node forwards (the hybrid send queue of the Collection Tree Protocol: Gnawali
et al., SenSys 2009).

Unicast: relays forward fragments one by one (mesh-under); a source gives a
datagram up with its first lost fragment, or when it expires. Dissemination:
each node with children broadcasts once what it hears from its parent, and
takes nothing from anyone else; so a fragment that a node did not hear never
comes again, and the node and all below it are lost for the datagram at that
instant.
"""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, cast

from wsnsim.net.clock import Call, Clock
from wsnsim.net.config import LinkConfig
from wsnsim.net.flights import Flight, Flights
from wsnsim.net.fragmentation import DatagramKey, Reassembler, fragment, parse_fragment
from wsnsim.net.interface import Outcome
from wsnsim.net.mac.base import Mac
from wsnsim.net.mesh import DEEP_MESH_BYTES, MAX_SHALLOW_HOPS, MESH_BYTES, MeshHeader, decode_mesh
from wsnsim.net.phy.base import BROADCAST
from wsnsim.net.routing.tree import Tree
from wsnsim.types import NodeId
from wsnsim.units import to_ns


@dataclass(slots=True, eq=False)
class Parcel:
    """One frame's load at one node, and what is kept beside its bytes."""

    flight: Flight
    header: MeshHeader
    body: bytes
    own: bool
    taken_by: list[NodeId] = field(default_factory=list)
    """Neighbours that took it on, whatever its sender came to know."""


@dataclass(frozen=True)
class Directory:
    """What all nodes of a network share."""

    tree: Tree
    names: tuple[NodeId, ...]
    """By short address."""
    addresses: Mapping[NodeId, int]
    stopped: set[NodeId]
    flights: Flights


def fragment_room_bytes(max_payload_bytes: int, config: LinkConfig, hops: int) -> int:
    """Return what a frame has left for a fragment on a way of `hops` hops [B].

    Parameters
    ----------
    max_payload_bytes : what one frame of the MAC carries [B]
    """
    if config.mesh_header_bytes == 0:
        return max_payload_bytes
    return max_payload_bytes - (MESH_BYTES if hops <= MAX_SHALLOW_HOPS else DEEP_MESH_BYTES)


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
    """

    def __init__(
        self,
        node: NodeId,
        clock: Clock,
        config: LinkConfig,
        mac: Mac,
        max_payload_bytes: int,
        directory: Directory,
    ) -> None:
        self._node, self._clock, self._config, self._mac = node, clock, config, mac
        self._max_payload_bytes = max_payload_bytes
        self._directory, self._tree, self._flights = directory, directory.tree, directory.flights
        self._address = directory.addresses[node]
        self._parent = self._tree.parent[node]
        self._children = self._tree.children[node]
        self._child_addresses = tuple(directory.addresses[child] for child in self._children)
        self._next_hops: dict[int, int] = {}
        self._queue: deque[Parcel] = deque()
        self._outbox: deque[Flight] = deque()
        self._unsent: deque[Parcel] = deque()
        self._own_queued = False
        self._tag = 0
        self._reassembler = Reassembler()
        self._waiting: dict[DatagramKey, tuple[Flight, Call]] = {}
        self._timeout_ns = to_ns(config.reassembly_timeout_s)

    def send(self, flight: Flight) -> None:
        """Take a datagram of this node's own."""
        self._purge()
        if len(self._outbox) >= self._config.outbox_datagrams:
            self._flights.lose(flight, flight.datagram.destinations, Outcome.QUEUE)
            return
        self._outbox.append(flight)
        self._serve()

    def stop(self) -> None:
        """Stop for good: the radio is silent, and all that waits here is lost."""
        self._mac.stop()
        queue, outbox, waiting = tuple(self._queue), list(self._outbox), tuple(self._waiting.values())
        if self._own_queued and not self._unsent:
            # The last frame of the first datagram stands in the queue, and speaks for it.
            del outbox[0]
        self._queue.clear()
        self._outbox.clear()
        self._unsent.clear()
        self._waiting.clear()
        for parcel in queue:
            if not self._went_on(parcel):
                self._lose(parcel, Outcome.DEAD)
        for flight in outbox:
            self._flights.lose(flight, flight.datagram.destinations, Outcome.DEAD)
        for flight, timer in waiting:
            timer.cancel()
            self._flights.lose(flight, (self._node,), Outcome.DEAD)

    def received(self, payload: bytes, source: int, cargo: Any) -> None:
        """Take a packet that the MAC received: forward it, keep it, or both."""
        sent = cast(Parcel, cargo)
        header, body = decode_mesh(payload) if self._config.mesh_header_bytes else (sent.header, payload)
        everyone = header.final == BROADCAST
        if everyone and self._directory.names[source] != self._parent:
            return
        sent.taken_by.append(self._node)
        if header.final != self._address and (self._children or not everyone):
            self._forward(Parcel(sent.flight, header.after_hop(), body, own=False))
        if everyone or header.final == self._address:
            self._keep(header, body, sent.flight)

    def done(self, outcome: Outcome | None) -> None:
        """Learn from the MAC what became of the frame at the head of the queue."""
        parcel = self._queue.popleft()
        abandoned = False
        if parcel.own:
            self._own_queued = False
            if outcome is not None:
                abandoned = bool(self._unsent)
                self._unsent.clear()
            if not self._unsent:
                self._outbox.popleft()
        if outcome is not None:
            if outcome is not Outcome.EXPIRED:
                self._mac.counters.frames_dropped += 1
            if abandoned or not self._went_on(parcel):
                self._lose(parcel, outcome)
        elif parcel.header.final == BROADCAST:
            self._note_missed(parcel)
        elif not parcel.taken_by:
            # An acknowledgement of another node's frame with the same number was taken for ours.
            self._lose(parcel, Outcome.NO_ACK)
        self._serve()

    def _serve(self) -> None:
        """Move an own fragment to the queue if none is there, and give the MAC something to do."""
        self._purge()
        if not self._own_queued and len(self._queue) < self._config.queue_frames and self._outbox:
            if not self._unsent:
                self._unsent.extend(self._cut(self._outbox[0]))
            self._queue.append(self._unsent.popleft())
            self._own_queued = True
        if not self._queue or not self._mac.idle:
            return
        head = self._queue[0]
        if head.own and self._expired(head.flight):
            self.done(Outcome.EXPIRED)
        else:
            self._submit(head)

    def _purge(self) -> None:
        """Drop own datagrams that expired in the outbox; one with a frame in the queue goes with that."""
        first = self._outbox[0] if self._own_queued else None
        expired = [flight for flight in self._outbox if flight is not first and self._expired(flight)]
        for flight in expired:
            if flight is self._outbox[0]:
                self._unsent.clear()
            self._outbox.remove(flight)
            self._flights.lose(flight, flight.datagram.destinations, Outcome.EXPIRED)

    def _expired(self, flight: Flight) -> bool:
        expires_ns = flight.datagram.expires_ns
        return expires_ns is not None and expires_ns <= self._clock.now

    def _submit(self, parcel: Parcel) -> None:
        packet = parcel.header.encode() + parcel.body if self._config.mesh_header_bytes else parcel.body
        if parcel.header.final == BROADCAST:
            self._mac.submit(packet, BROADCAST, self._child_addresses, parcel)
        else:
            hop = self._next_hop(parcel.header.final)
            self._mac.submit(packet, hop, (hop,), parcel)

    def _cut(self, flight: Flight) -> list[Parcel]:
        datagram = flight.datagram
        if datagram.disseminate:
            below = self._tree.descendants(self._node)
            hops = max(self._tree.depth[node] for node in below) - self._tree.depth[self._node]
            final = BROADCAST
        else:
            (destination,) = datagram.destinations
            hops = len(self._tree.path(self._node, destination)) - 1
            final = self._directory.addresses[destination]
        header = MeshHeader(hops, self._address, final)
        self._tag = (self._tag + 1) % 0x10000
        bodies = fragment(
            datagram.data, self._tag, fragment_room_bytes(self._max_payload_bytes, self._config, hops)
        )
        return [Parcel(flight, header, body, own=True) for body in bodies]

    def _next_hop(self, final: int) -> int:
        hop = self._next_hops.get(final)
        if hop is None:
            addresses, names = self._directory.addresses, self._directory.names
            hop = self._next_hops[final] = addresses[self._tree.path(self._node, names[final])[1]]
        return hop

    def _forward(self, parcel: Parcel) -> None:
        if len(self._queue) >= self._config.queue_frames:
            self._mac.counters.frames_dropped += 1
            self._lose(parcel, Outcome.QUEUE)
            return
        self._queue.append(parcel)
        self._serve()

    def _went_on(self, parcel: Parcel) -> bool:
        """Whether the next hop has the frame, though its acknowledgement never came back."""
        return parcel.header.final != BROADCAST and bool(parcel.taken_by)

    def _note_missed(self, parcel: Parcel) -> None:
        for child in self._children:
            if child not in parcel.taken_by:
                outcome = Outcome.DEAD if child in self._directory.stopped else Outcome.NOT_HEARD
                self._flights.lose(parcel.flight, (child, *self._tree.descendants(child)), outcome)

    def _lose(self, parcel: Parcel, outcome: Outcome) -> None:
        final = parcel.header.final
        if final == BROADCAST:
            receivers = self._tree.descendants(self._node)
        else:
            receivers = (self._directory.names[final],)
        self._flights.lose(parcel.flight, receivers, outcome)

    def _keep(self, header: MeshHeader, body: bytes, flight: Flight) -> None:
        piece = parse_fragment(body)
        data: bytes | None = body
        if piece is not None:
            key = (header.origin, piece.size, piece.tag)
            if key not in self._waiting:
                timer = self._clock.call(self._timeout_ns, lambda: self._expire(key))
                self._waiting[key] = (flight, timer)
            data = self._reassembler.add(key, piece)
            if data is not None:
                self._waiting.pop(key)[1].cancel()
        if data is not None:
            origin = self._directory.names[header.origin]
            hops = len(self._tree.path(origin, self._node)) - 1
            self._flights.deliver(flight, self._node, data, hops)

    def _expire(self, key: DatagramKey) -> None:
        flight, _ = self._waiting.pop(key)
        self._reassembler.discard(key)
        self._flights.lose(flight, (self._node,), Outcome.REASSEMBLY)
