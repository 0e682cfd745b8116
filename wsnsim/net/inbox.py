"""What a node receives for itself: fragments until a datagram is whole, or for as long as they may wait."""

from collections.abc import Callable, Iterator

from wsnsim.net.clock import Call, Clock
from wsnsim.net.flights import Flight
from wsnsim.net.fragmentation import DatagramKey, Reassembler, parse_fragment
from wsnsim.types import Nanoseconds


class Inbox:
    """The datagrams that a node has in part.

    Parameters
    ----------
    clock : the event clock
    timeout_ns : how long the first fragment of a datagram waits for the others [ns]
    late : told of a datagram whose time is over
    """

    __slots__ = ("_clock", "_late", "_reassembler", "_timeout_ns", "_waiting")

    def __init__(self, clock: Clock, timeout_ns: Nanoseconds, late: Callable[[Flight], None]) -> None:
        self._clock, self._timeout_ns, self._late = clock, timeout_ns, late
        self._reassembler = Reassembler()
        self._waiting: dict[DatagramKey, tuple[Flight, Call]] = {}

    def take(self, origin: int, body: bytes, flight: Flight) -> bytes | None:
        """Take what came in one frame and return the datagram that it completes, if it does.

        Parameters
        ----------
        origin : who made it
        body : a fragment, or a whole datagram
        flight : its account
        """
        piece = parse_fragment(body)
        if piece is None:
            return body
        key = (origin, piece.size, piece.tag)
        if key not in self._waiting:
            timer = self._clock.call(self._timeout_ns, lambda: self._expire(key))
            self._waiting[key] = (flight, timer)
        data = self._reassembler.add(key, piece)
        if data is not None:
            self._waiting.pop(key)[1].cancel()
        return data

    def empty(self) -> Iterator[Flight]:
        """Throw away what is not whole, and name it."""
        waiting = tuple(self._waiting.values())
        self._waiting.clear()
        for flight, timer in waiting:
            timer.cancel()
            yield flight

    def _expire(self, key: DatagramKey) -> None:
        flight, _ = self._waiting.pop(key)
        self._reassembler.discard(key)
        self._late(flight)
