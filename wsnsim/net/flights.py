"""What has become of each datagram, told to the observer once for every receiver."""

from collections.abc import Iterable
from dataclasses import dataclass, field

from wsnsim.net.interface import Datagram, NetworkObserver, Outcome
from wsnsim.types import NodeId


@dataclass(slots=True, eq=False)
class Load:
    """What one frame carries of a datagram, however many copies of it there are."""

    copies: int = 0
    """How many wait somewhere to be sent, or are being sent."""
    heard: set[NodeId] = field(default_factory=set)
    """Receivers that have it."""
    cause: Outcome | None = None
    """Why the last copy was lost, unless it went out well."""


@dataclass(slots=True, eq=False)
class Flight:
    """A datagram on its way.

    It goes beside the frames for the account only; what a receiver gets is
    made of the bytes that travelled.
    """

    datagram: Datagram
    open: dict[NodeId, None]
    """Receivers whose fate is not known yet, in the order they were named."""
    held: bool = True
    """Whether its source has frames of it that never left."""
    loads: list[Load] = field(default_factory=list)
    """Its parts, once it is cut, where copies are counted."""


class Flights:
    """The account of all datagrams: each intended receiver ends as delivered or dropped at most once.

    Parameters
    ----------
    observer : who is told
    stopped : nodes that have stopped, as the network keeps them
    """

    def __init__(self, observer: NetworkObserver, stopped: set[NodeId] | None = None) -> None:
        self._observer = observer
        self._stopped = set() if stopped is None else stopped

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

    def release(self, flight: Flight, load: Load, outcome: Outcome | None) -> None:
        """Note that a copy of a part is gone: sent well (None), or lost for that reason."""
        load.copies -= 1
        if outcome is not None:
            load.cause = outcome
        self._settle(flight, load)

    def let_go(self, flight: Flight, outcome: Outcome | None) -> None:
        """Note that the source has done with a datagram: all of it sent (None), or given up."""
        flight.held = False
        if not flight.loads:
            self.lose(flight, flight.datagram.destinations, outcome or Outcome.NOT_HEARD)
        for load in flight.loads:
            if outcome is not None and load.cause is None:
                load.cause = outcome
            self._settle(flight, load)

    def _settle(self, flight: Flight, load: Load) -> None:
        """Where no copy of a part is left, it is lost for those that do not have it."""
        if load.copies or flight.held:
            return
        unicast = not (flight.datagram.disseminate or flight.datagram.one_hop)
        usual = Outcome.NO_ACK if unicast else Outcome.NOT_HEARD
        for receiver in tuple(flight.open):
            if receiver not in load.heard:
                dead = not unicast and receiver in self._stopped
                self.lose(flight, (receiver,), Outcome.DEAD if dead else load.cause or usual)
