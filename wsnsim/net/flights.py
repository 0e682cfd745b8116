"""What has become of each datagram, told to the observer once for every receiver."""

from collections.abc import Iterable
from dataclasses import dataclass

from wsnsim.net.interface import Datagram, NetworkObserver, Outcome
from wsnsim.types import NodeId


@dataclass(slots=True, eq=False)
class Flight:
    """A datagram on its way.

    It goes beside the frames for the account only; what a receiver gets is
    made of the bytes that travelled.
    """

    datagram: Datagram
    open: dict[NodeId, None]
    """Receivers whose fate is not known yet, in the order they were named."""


class Flights:
    """The account of all datagrams: each intended receiver ends as delivered or dropped at most once.

    Parameters
    ----------
    observer : who is told
    """

    def __init__(self, observer: NetworkObserver) -> None:
        self._observer = observer

    def begin(self, datagram: Datagram) -> Flight:
        """Open the account of a datagram."""
        return Flight(datagram, dict.fromkeys(datagram.destinations))

    def deliver(self, flight: Flight, receiver: NodeId, data: bytes, hops: int) -> None:
        """Hand the bytes that arrived to `receiver`, unless its fate is settled or they are not for it."""
        if receiver not in flight.open:
            return
        del flight.open[receiver]
        sent = flight.datagram
        arrived = Datagram(sent.number, sent.source, sent.destinations, data, sent.disseminate)
        self._observer.delivered(arrived, receiver, hops)

    def lose(self, flight: Flight, receivers: Iterable[NodeId], outcome: Outcome) -> None:
        """Settle those of `receivers` that are still open: they will never get the datagram."""
        for receiver in tuple(receivers):
            if receiver in flight.open:
                del flight.open[receiver]
                self._observer.dropped(flight.datagram, receiver, outcome)
