"""Messages on their way: encoded once, followed to every receiver, decoded there.

One row a message and receiver it was meant for, written when its fate is known.
"""

from collections.abc import Callable
from dataclasses import dataclass

from wsnsim.errors import DecodeError
from wsnsim.messages.base import Payload, decode_any
from wsnsim.net.clock import Clock
from wsnsim.net.interface import Datagram, Network, Outcome
from wsnsim.records import FrameRow, MessageRow, Sink
from wsnsim.systems.base import Received, Scope, Send
from wsnsim.types import NodeId
from wsnsim.units import to_ns, to_s


@dataclass(slots=True)
class _Sent:
    datagram: Datagram
    kind: str
    created_s: float
    fragments: int
    open: dict[NodeId, None]
    """Receivers whose fate is not known yet, in the order they were named."""


class MailRoom:
    """Turns payloads into datagrams and back, and keeps the books.

    Parameters
    ----------
    payload_types : what this system's programs say
    base : the base station's name
    motes : everybody else
    receive : gives a decoded message to a node
    """

    def __init__(
        self,
        clock: Clock,
        sink: Sink,
        payload_types: tuple[type[Payload], ...],
        base: NodeId,
        motes: tuple[NodeId, ...],
        receive: Callable[[NodeId, Received], None],
    ) -> None:
        self._clock = clock
        self._sink = sink
        self._payload_types = payload_types
        self._base = base
        self._motes = motes
        self._receive = receive
        self._sent: dict[int, _Sent] = {}
        self._next = 0
        self.app_tx_bytes: dict[NodeId, int] = dict.fromkeys((base, *motes), 0)

    def post(self, network: Network, source: NodeId, send: Send) -> None:
        """Encode a message and hand it to the network."""
        data = send.payload.encode()
        datagram = Datagram(
            number=self._next,
            source=source,
            destinations=self._receivers(source, send.to),
            data=data,
            disseminate=send.to is Scope.TREE,
            expires_ns=None if send.expires is None else to_ns(send.expires),
        )
        self._next += 1
        self.app_tx_bytes[source] += len(data)
        self._sent[datagram.number] = _Sent(
            datagram,
            send.payload.kind,
            to_s(self._clock.now),
            network.fragments(len(data)),
            dict.fromkeys(datagram.destinations),
        )
        network.send(datagram)

    def delivered(self, datagram: Datagram, receiver: NodeId, hops: int) -> None:
        """Take a datagram that arrived; decode it and pass it on."""
        try:
            payload = decode_any(datagram.data, self._payload_types)
        except DecodeError:
            self._close(datagram.number, receiver, "dropped_undecodable", None, None)
            return
        self._close(datagram.number, receiver, "delivered", to_s(self._clock.now), hops)
        self._receive(receiver, Received(datagram.source, payload))

    def dropped(self, datagram: Datagram, receiver: NodeId, outcome: Outcome) -> None:
        """Note a datagram that will not arrive."""
        self._close(datagram.number, receiver, outcome.value, None, None)

    def frame(self, row: FrameRow) -> None:
        """Record a radio frame."""
        self._sink.write(row)

    def close(self) -> None:
        """Write the rows of what is still on its way at the end of the run."""
        for number in list(self._sent):
            for receiver in list(self._sent[number].open):
                self._close(number, receiver, "in_flight", None, None)

    def _receivers(self, source: NodeId, to: NodeId | Scope) -> tuple[NodeId, ...]:
        if to is Scope.BASE:
            return (self._base,)
        if to is Scope.TREE:
            return tuple(node for node in self._motes if node != source)
        assert isinstance(to, str)
        return (to,)

    def _close(
        self, number: int, receiver: NodeId, outcome: str, delivered_s: float | None, hops: int | None
    ) -> None:
        sent = self._sent[number]
        del sent.open[receiver]
        if not sent.open:
            del self._sent[number]
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
            )
        )
