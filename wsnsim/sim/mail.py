"""Messages on their way: encoded once, followed to every receiver, decoded there.

One row a message and receiver it was meant for, written when its fate is known.
A message of a group goes up the tree hop by hop, each hop a message of its
own, and ends as part of the next one.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import partial

from wsnsim.errors import DecodeError
from wsnsim.messages.base import Payload, decode_any
from wsnsim.net.clock import Clock
from wsnsim.net.interface import Datagram, Network, Outcome
from wsnsim.records import EventRow, FrameRow, MessageRow, Sink
from wsnsim.systems.base import GroupKey, Received, Scope, Send
from wsnsim.types import Nanoseconds, NodeId, Seconds
from wsnsim.units import to_ns, to_s

REFUSED = "dropped_refused"
"""The program of a relay would not fuse it, nor send anything in its place."""
UNDECODABLE = "dropped_undecodable"
"""What arrived is no message of the system."""


@dataclass(frozen=True, slots=True)
class Letter:
    """A message of a group between two nodes of the tree.

    The group is not sent: it stands in the payload, where the programs find it.
    """

    maker: NodeId
    """Whose program made the payload; nodes that only pass it on leave this as it is."""
    kind: str
    data: bytes
    group: GroupKey
    expires_ns: Nanoseconds | None


@dataclass(slots=True)
class _Sent:
    datagram: Datagram
    kind: str
    created_s: Seconds
    fragments: int
    open: dict[NodeId, None]
    """Receivers whose fate is not known yet, in the order they were named."""
    letter: Letter | None
    arrived: tuple[Seconds, int] | None = None
    """When and over how many hops a message of a group came to the node at which it waits."""


def _nobody(node: NodeId, key: str) -> None:
    """Tell nobody."""


class MailRoom:
    """Turns payloads into datagrams and back, and keeps the books.

    Parameters
    ----------
    payload_types : what this system's programs say
    base : the base station's name
    motes : everybody else
    receive : gives a decoded message to a node
    collect : gives a message of a group, and its number, to a node on its way to the base station
    left : tells a node, by the key it asked for, that its link layer has done with a message
    """

    def __init__(
        self,
        clock: Clock,
        sink: Sink,
        payload_types: tuple[type[Payload], ...],
        base: NodeId,
        motes: tuple[NodeId, ...],
        receive: Callable[[NodeId, Received], None],
        collect: Callable[[NodeId, int, Letter], None],
        left: Callable[[NodeId, str], None] = _nobody,
    ) -> None:
        self._clock = clock
        self._sink = sink
        self._payload_types = payload_types
        self._base = base
        self._motes = motes
        self._receive = receive
        self._collect = collect
        self._left = left
        self._on_move: list[Callable[[], None]] = []
        self._sent: dict[int, _Sent] = {}
        self._next = 0
        self.app_tx_bytes: dict[NodeId, int] = dict.fromkeys((base, *motes), 0)

    def post(self, network: Network, source: NodeId, send: Send) -> None:
        """Encode a message and hand it to the network."""
        datagram = Datagram(
            number=self._next,
            source=source,
            destinations=self._receivers(network, source, send.to),
            data=send.payload.encode(),
            disseminate=send.to is Scope.TREE,
            one_hop=send.to is Scope.NEIGHBOURS,
            expires_ns=None if send.expires is None else to_ns(send.expires),
            left=None if send.when_left is None else partial(self._left, source, send.when_left),
        )
        self._hand_over(network, datagram, send.payload.kind, None)

    def climb(self, network: Network, source: NodeId, parent: NodeId, letter: Letter) -> int:
        """Send a message of a group one hop up the tree and return its number."""
        datagram = Datagram(self._next, source, (parent,), letter.data, expires_ns=letter.expires_ns)
        self._hand_over(network, datagram, letter.kind, letter)
        return datagram.number

    def decode(self, data: bytes) -> Payload:
        """Return what the bytes say.

        Raises
        ------
        DecodeError : nothing that this system's programs say
        """
        return decode_any(data, self._payload_types)

    def delivered(self, datagram: Datagram, receiver: NodeId, hops: int) -> None:
        """Take a datagram that arrived, and pass it on; one that arrived before changes nothing."""
        sent = self._sent.get(datagram.number)
        if sent is None or receiver not in sent.open or sent.arrived is not None:
            return
        arrived = (to_s(self._clock.now), hops)
        if sent.letter is None:
            self._read(datagram.number, receiver, datagram.source, datagram.data, arrived)
        else:
            sent.arrived = arrived
            self._collect(receiver, datagram.number, replace(sent.letter, data=datagram.data))

    def arrived(self, number: int, data: bytes) -> None:
        """Give what arrived as a message of a group to the base station's program."""
        sent = self._sent[number]
        assert sent.letter is not None
        assert sent.arrived is not None
        self._read(number, self._base, sent.letter.maker, data, sent.arrived)

    def dropped(self, datagram: Datagram, receiver: NodeId, outcome: Outcome) -> None:
        """Note a datagram that will not arrive."""
        self._close(datagram.number, receiver, outcome.value)

    def fused(self, parts: Iterable[int], into: int) -> None:
        """Note messages that arrived and went on as one, by their numbers."""
        for number in parts:
            sent = self._sent[number]
            self._close(number, sent.datagram.destinations[0], "fused", sent.arrived, into)

    def set_aside(self, parts: Iterable[int], outcome: str) -> None:
        """Note messages that arrived at a node on their way and go no further, by their numbers."""
        for number in parts:
            self._close(number, self._sent[number].datagram.destinations[0], outcome)

    def reparented(self, node: NodeId, old: NodeId | None, new: NodeId | None, why: str) -> None:
        """Record that a node has another parent, and tell those who follow the tree."""
        now = to_s(self._clock.now)
        detail = f"from {old or 'nobody'} to {new or 'nobody'}: {why}"
        self._sink.write(EventRow(now, node, "reparented", detail))
        for follow in self._on_move:
            follow()

    def on_move(self, follow: Callable[[], None]) -> None:
        """Call `follow` whenever a node has another parent."""
        self._on_move.append(follow)

    def frame(self, row: FrameRow) -> None:
        """Record a radio frame."""
        self._sink.write(row)

    def close(self) -> None:
        """Write the rows of what is still on its way at the end of the run."""
        for number in list(self._sent):
            for receiver in list(self._sent[number].open):
                self._close(number, receiver, "in_flight")

    def _hand_over(self, network: Network, datagram: Datagram, kind: str, letter: Letter | None) -> None:
        self._next += 1
        self.app_tx_bytes[datagram.source] += len(datagram.data)
        self._sent[datagram.number] = _Sent(
            datagram,
            kind,
            to_s(self._clock.now),
            network.fragments(len(datagram.data)),
            dict.fromkeys(datagram.destinations),
            letter,
        )
        network.send(datagram)

    def _read(
        self, number: int, receiver: NodeId, maker: NodeId, data: bytes, arrived: tuple[Seconds, int]
    ) -> None:
        try:
            payload = self.decode(data)
        except DecodeError:
            self._close(number, receiver, UNDECODABLE)
            return
        self._close(number, receiver, "delivered", arrived)
        self._receive(receiver, Received(maker, payload))

    def _receivers(self, network: Network, source: NodeId, to: NodeId | Scope) -> tuple[NodeId, ...]:
        if to is Scope.BASE:
            return (self._base,)
        if to is Scope.TREE:
            return tuple(node for node in self._motes if node != source)
        if to is Scope.NEIGHBOURS:
            return network.neighbours(source)
        assert isinstance(to, str)
        return (to,)

    def _close(
        self,
        number: int,
        receiver: NodeId,
        outcome: str,
        arrived: tuple[Seconds, int] | None = None,
        fused_into: int | None = None,
    ) -> None:
        sent = self._sent[number]
        del sent.open[receiver]
        if not sent.open:
            del self._sent[number]
        delivered_s, hops = (None, None) if arrived is None else arrived
        self._sink.write(
            MessageRow(
                message=number,
                kind=sent.kind,
                source=sent.datagram.source,
                destination=receiver,
                created_s=sent.created_s,
                delivered_s=delivered_s,
                bytes=len(sent.datagram.data),
                fragments=sent.fragments,
                hops=hops,
                outcome=outcome,
                fused_into=fused_into,
            )
        )
