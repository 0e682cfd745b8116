"""What waits at a node to be sent, and which of it the MAC gets next.

Frames wait in one queue, first come, first served. What a node forwards joins
it as it arrives. What a node says itself waits in an outbox of whole datagrams
and joins the queue one fragment at a time, so that neither a long message nor
a busy application shuts out what the node forwards (the hybrid send queue of
the Collection Tree Protocol: Gnawali et al., SenSys 2009). Frames of the
routing protocol go before both.

Where there is no room, the newcomer is lost, or the one that has waited
longest, or one at random (Mankin, Ramakrishnan, RFC 1254, sec. 2.2: random
drop); never the frame that the MAC has in hand.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np

from wsnsim.net.budget import Budget
from wsnsim.net.clock import Call, Clock
from wsnsim.net.config import LinkConfig
from wsnsim.net.flights import Flight
from wsnsim.net.interface import Outcome
from wsnsim.net.mac.base import Mac
from wsnsim.net.parcel import Parcel
from wsnsim.types import Nanoseconds

Waiting = TypeVar("Waiting", Parcel, Flight)


@dataclass(frozen=True, slots=True)
class Control:
    """A frame of the routing protocol, written when its turn comes."""

    write: Callable[[], tuple[bytes, int] | None]
    """Returns payload and destination; None where it is not wanted any more."""
    done: Callable[[Outcome | None, int], None]
    """Told what became of it, and for whom it was."""


class Sender(Protocol):
    """The link above a queue: it knows where things go."""

    def cut(self, flight: Flight) -> list[Parcel]:
        """Return a datagram of the node's own in frames."""

    def packet_bytes(self, parcel: Parcel) -> int:
        """Return how long a frame's packet is, headers above the MAC's included [B]."""

    def submit(self, parcel: Parcel) -> None:
        """Give a frame to the MAC."""

    def ready(self, parcel: Parcel) -> bool:
        """Return whether there is a way for a frame now."""

    def done(self, outcome: Outcome | None) -> None:
        """Learn that the frame in hand is finished."""

    def lost(self, parcel: Parcel, outcome: Outcome) -> None:
        """Learn that a frame is lost that the MAC did not have in hand."""

    def let_go(self, flight: Flight, outcome: Outcome | None) -> None:
        """Learn that an own datagram has no frame left here: all sent (None), or the rest given up."""

    def given_up(self, flight: Flight, outcome: Outcome) -> None:
        """Learn that a datagram of the node's own is lost, none of whose frames is in the queue."""


class SendQueue:
    """Queue and outbox of one node.

    Parameters
    ----------
    clock : the event clock
    config : sizes, and what is lost where there is no room
    mac : the MAC below
    sender : the link above
    budget : holds frames up, or has them dropped; None where there is none
    rng : draws the frame that is lost under `drop_random`
    """

    __slots__ = (
        "_asked",
        "_budget",
        "_clock",
        "_config",
        "_control",
        "_frames",
        "_held",
        "_held_since_ns",
        "_in_hand",
        "_mac",
        "_outbox",
        "_own_queued",
        "_rng",
        "_sender",
        "_serving",
        "_unsent",
        "control_sent",
    )

    def __init__(
        self,
        clock: Clock,
        config: LinkConfig,
        mac: Mac,
        sender: Sender,
        budget: Budget | None = None,
        rng: np.random.Generator | None = None,
    ) -> None:
        self._clock, self._config, self._mac, self._sender, self._rng = clock, config, mac, sender, rng
        self._budget = budget
        self._held: Call | None = None
        self._held_since_ns: Nanoseconds = 0
        # Few wait at a node, and nodes are many: an empty deque takes ten times the memory of a list.
        self._frames: list[Parcel] = []
        self._outbox: list[Flight] = []
        self._unsent: list[Parcel] = []
        self._control: list[Control] = []
        self._own_queued = False
        self._serving = self._asked = False
        self._in_hand: Parcel | Control | None = None
        self.control_sent = (0, 0)
        """Payload length [B] and destination of the routing protocol's frame in hand."""

    def say(self, flight: Flight) -> None:
        """Take a datagram of the node's own."""
        self._purge()
        if len(self._outbox) >= self._config.outbox_datagrams:
            begun = 1 if self._own_queued else 0
            victim = self._victim(self._outbox[begun:])
            if victim is None:
                self._sender.given_up(flight, Outcome.QUEUE)
                _tell(flight)
                return
            self._outbox.append(flight)
            self._give_up(victim, Outcome.QUEUE)
        else:
            self._outbox.append(flight)
        self.serve()

    def forward(self, parcel: Parcel) -> None:
        """Take a frame that another node has sent here to go on, or one that is to go once more."""
        if len(self._frames) >= self._config.queue_frames:
            self._mac.counters.frames_dropped += 1
            victim = self._victim([frame for frame in self._frames if frame is not self._in_hand])
            if victim is None:
                self._sender.lost(parcel, Outcome.QUEUE)
                return
            self._frames.append(parcel)
            self._remove(victim, Outcome.QUEUE)
            self._sender.lost(victim, Outcome.QUEUE)
        else:
            self._frames.append(parcel)
        self.serve()

    def control(self, frame: Control) -> None:
        """Take a frame of the routing protocol; it goes next."""
        self._control.append(frame)
        self.serve()

    @property
    def in_hand(self) -> Parcel | Control | None:
        """What the MAC has now."""
        return self._in_hand

    def finish(self, outcome: Outcome | None) -> Parcel | None:
        """Take the frame in hand out and return it, None for one of the routing protocol."""
        parcel, self._in_hand = self._in_hand, None
        if isinstance(parcel, Control):
            parcel.done(outcome, self.control_sent[1])
            return None
        assert parcel is not None
        self._remove(parcel, outcome)
        if outcome is not None and outcome is not Outcome.EXPIRED:
            self._mac.counters.frames_dropped += 1
        return parcel

    def keep(self) -> None:
        """Leave the frame in hand where it is, to be sent again."""
        self._in_hand = None

    def serve(self) -> None:
        """Move an own fragment to the queue if none is there, and give the MAC something to do."""
        # what is dropped instead asks for the next: in a loop, for a whole queue may go at one instant
        self._asked = True
        if self._serving:
            return
        self._serving = True
        while self._asked:
            self._asked = False
            self._serve_once()
        self._serving = False

    def _serve_once(self) -> None:
        self._purge()
        if not self._own_queued and len(self._frames) < self._config.queue_frames and self._outbox:
            if not self._unsent:
                self._unsent.extend(self._sender.cut(self._outbox[0]))
            self._frames.append(self._unsent.pop(0))
            self._own_queued = True
        if self._in_hand is not None or not self._mac.idle:
            return
        if self._control and self._submit_control():
            return
        if self._held is not None:
            self._release_hold()
        for parcel in self._frames:
            if parcel.own and self._expired(parcel.flight):
                self._in_hand = parcel
                self._sender.done(Outcome.EXPIRED)
                return
            if self._sender.ready(parcel):
                if self._budget is None or self._affordable(self._budget, parcel):
                    self._in_hand = parcel
                    self._sender.submit(parcel)
                return

    def drain(self) -> tuple[list[Parcel], list[Flight]]:
        """Empty all, and return the frames and the own datagrams that were here."""
        self._release_hold()
        frames, outbox = list(self._frames), list(self._outbox)
        for waiting in (self._frames, self._outbox, self._unsent, self._control):
            waiting.clear()
        self._own_queued, self._in_hand = False, None
        return frames, outbox

    def __len__(self) -> int:
        """Return how many frames wait or are being sent, and datagrams none of whose frames do."""
        begun = 1 if self._own_queued else 0
        return len(self._frames) + len(self._outbox) - begun

    @property
    def mid_datagram(self) -> bool:
        """Whether frames of the datagram that is being sent have not joined the queue yet."""
        return bool(self._unsent)

    def _affordable(self, budget: Budget, parcel: Parcel) -> bool:
        """Return whether the budget lets a frame go; if not, it is dropped, or asked for again in time."""
        wait_ns = budget.wait_ns(self._sender.packet_bytes(parcel))
        if wait_ns == 0:
            return True
        if budget.drops:
            self._in_hand = parcel
            self._sender.done(Outcome.BUDGET)
        else:
            self._held_since_ns = self._clock.now
            self._held = self._clock.call(wait_ns, self.serve)
        return False

    def _release_hold(self) -> None:
        if self._held is not None and self._budget is not None:
            self._held.cancel()
            self._held = None
            self._budget.waited_ns += self._clock.now - self._held_since_ns

    def _submit_control(self) -> bool:
        while self._control:
            frame = self._control.pop(0)
            written = frame.write()
            if written is not None:
                payload, destination = written
                self._in_hand, self.control_sent = frame, (len(payload), destination)
                self._mac.submit(payload, destination, (), None)
                return True
        return False

    def _remove(self, parcel: Parcel, outcome: Outcome | None) -> None:
        self._frames.remove(parcel)
        if parcel.own:
            self._own_queued = False
            if outcome is not None:
                self._unsent.clear()
            if not self._unsent:
                del self._outbox[0]
                self._sender.let_go(parcel.flight, outcome)
                _tell(parcel.flight)

    def _victim(self, waiting: list[Waiting]) -> Waiting | None:
        """Return what makes room, None for the newcomer itself."""
        policy = self._config.queue_policy
        if policy == "drop_newest" or not waiting:
            return None
        if policy == "drop_oldest":
            return waiting[0]
        assert self._rng is not None
        drawn = int(self._rng.random() * (len(waiting) + 1))
        return waiting[drawn] if drawn < len(waiting) else None

    def _purge(self) -> None:
        """Drop own datagrams that expired in the outbox; one with a frame in the queue goes with that."""
        begun = 1 if self._own_queued else 0
        for flight in self._outbox[begun:]:
            if self._expired(flight):
                self._give_up(flight, Outcome.EXPIRED)

    def _give_up(self, flight: Flight, outcome: Outcome) -> None:
        if flight is self._outbox[0] and not self._own_queued:
            self._unsent.clear()
        self._outbox.remove(flight)
        self._sender.given_up(flight, outcome)
        _tell(flight)

    def _expired(self, flight: Flight) -> bool:
        expires_ns = flight.datagram.expires_ns
        return expires_ns is not None and expires_ns <= self._clock.now


def _tell(flight: Flight) -> None:
    """Tell who waits for it that a datagram of the node's own has left."""
    if flight.datagram.left is not None:
        flight.datagram.left()
