"""The distributed coordination function of IEEE 802.11: the MAC of one node.

A frame goes out at once where the channel has been idle for DIFS and no backoff
is under way; else after DIFS and a random number of idle slots, whose count
freezes while the channel is busy. Each frame sent, and each attempt that was
not acknowledged, is followed by a backoff, whether or not there is something
more to send. The channel is busy while the receiver says so (carrier sense) or a
frame for others has announced more (NAV); after a frame that could not be read
it takes EIFS instead of DIFS. A frame from above is `submit`ted when the MAC is
idle, and its fate comes back through `Upper.done`.

Where the standard leaves a choice: a frame that begins at an instant cannot be
sensed at that instant, so two nodes whose slots end together both send; after an
acknowledgement that did not come, slots count at once if the channel has been
idle for DIFS. Frames that collide cost all who hear them EIFS, for a receiver
locks on one of them. (In ns-3 it locks on none of two that are equal, and DIFS
is enough: with ten saturated stations that is 4 % of the throughput.) Left out:
RTS and CTS, MAC fragmentation, and changes of the rate.

References
----------
IEEE Std 802.11-2007: carrier sense, sec. 9.2.1; interframe spaces, 9.2.3; random backoff, 9.2.4; access
and backoff procedures, 9.2.5.1-9.2.5.3; NAV, 9.2.5.4; acknowledgement and its timeout, 9.2.8; duplicates,
9.2.9; EIFS, 9.2.10; retry limit, annex D (dot11ShortRetryLimit).
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from wsnsim.net.clock import Call, Clock
from wsnsim.net.interface import LinkCounters, Outcome
from wsnsim.net.mac.base import Upper
from wsnsim.net.mac.dcf_config import DcfConfig
from wsnsim.net.mac.frames80211 import (
    ACK_BYTES,
    SEQUENCES,
    DcfAck,
    DcfData,
    decode_frame,
    duration_us,
)
from wsnsim.net.phy.base import BROADCAST, Transmission
from wsnsim.net.phy.ieee80211b import DIFS_NS, SIFS_NS, SLOT_NS, Ieee80211b
from wsnsim.net.phy.medium import Medium, Radio
from wsnsim.types import Nanoseconds

EIFS_NS: Nanoseconds = SIFS_NS + Ieee80211b(1).air_time_ns(ACK_BYTES) + DIFS_NS
"""With an acknowledgement at 1 Mbit/s, whatever the basic rate (sec. 9.2.10)."""


@dataclass(frozen=True, slots=True)
class _Job:
    """A data frame in the hands of the MAC."""

    frame: DcfData
    meant: tuple[int, ...]
    cargo: Any


class Dcf:
    """The MAC of one node.

    Parameters
    ----------
    clock : the event clock
    medium : the channel
    phy : times on the air
    config : contention window and retry limit
    address : the node's number, its row in the medium's links
    rng : backoffs and the first sequence number
    """

    def __init__(
        self,
        clock: Clock,
        medium: Medium,
        phy: Ieee80211b,
        config: DcfConfig,
        address: int,
        rng: np.random.Generator,
    ) -> None:
        self.counters = LinkCounters()
        self.awaits_ack = False
        self._clock, self._medium, self._phy, self._config = clock, medium, phy, config
        self._address, self._rng = address, rng
        ack_ns = phy.air_time_ns(ACK_BYTES, phy.control_mode)
        self._duration_us = -((SIFS_NS + ack_ns) // -1000)
        self._ack_timeout_ns = SIFS_NS + SLOT_NS + phy.head_ns(phy.control_mode)
        self._sequence = self._draw(SEQUENCES)
        self._heard: dict[int, int] = {}
        self._job: _Job | None = None
        self._attempts = 0
        self._cw = config.cw_min
        self._slots: int | None = None
        """What is left of a backoff; None where none is under way."""
        self._idle = True
        self._changed_ns: Nanoseconds = -DIFS_NS
        """When the channel became idle or busy."""
        self._open_ns: Nanoseconds = 0
        """From when on idle slots count."""
        self._nav_ns: Nanoseconds = -DIFS_NS
        self._eifs_ns: Nanoseconds = 0
        self._sending = self._answering = False
        self._access: Call | None = None
        self._due_ns: Nanoseconds = 0
        self._timeout: Call | None = None
        self._answer: Call | None = None

    def connect(self, radio: Radio, upper: Upper) -> None:
        """Join the MAC to its radio and to the layer above, before anything else."""
        self._radio, self._upper = radio, upper
        radio.overhear = self._overhear
        self._medium.watch(radio)

    @property
    def idle(self) -> bool:
        """Whether a frame may be submitted."""
        return self._job is None

    def submit(self, payload: bytes, destination: int, meant: tuple[int, ...], cargo: Any) -> None:
        """Send a payload to a neighbour or to all; the MAC must be idle.

        Parameters
        ----------
        payload : at most 2296 B
        destination : number of a station, or `BROADCAST`
        meant : nodes whose reception is worth a record
        cargo : kept beside the bytes, for the receiver's upper layer
        """
        self._sequence = (self._sequence + 1) % SEQUENCES
        duration = 0 if destination == BROADCAST else self._duration_us
        frame = DcfData(self._sequence, destination, self._address, payload, duration)
        self._job = _Job(frame, meant, cargo)
        self._attempts = 0
        now = self._clock.now
        if self._idle and self._slots is None:
            self._open_ns = self._spaced_ns()
        sensed_idle = self._idle or self._changed_ns == now
        if sensed_idle and not self._engaged and now >= self._open_ns + (self._slots or 0) * SLOT_NS:
            self._slots = None
            self._go_at(now)
            return
        if self._slots is None:
            self._slots = self._draw(self._cw + 1)
        self._plan()

    def stop(self) -> None:
        """Stop for good."""
        for call in (self._access, self._timeout, self._answer):
            if call is not None:
                call.cancel()
        self.awaits_ack = False
        self._radio.overhear = None
        self._medium.unwatch(self._radio)
        self._medium.silence(self._radio)

    def received(self, transmission: Transmission) -> None:
        """Take a frame for this node from the radio."""
        frame = decode_frame(transmission.mpdu)
        self.counters.mac_rx_bytes += len(transmission.mpdu)
        self._eifs_ns = 0
        if isinstance(frame, DcfAck):
            if self.awaits_ack:
                self._finish(None)
            else:
                self._count()
            return
        if frame.destination != BROADCAST:
            self._prepare_answer(frame)
        if self.awaits_ack:
            self._unacknowledged()
        else:
            self._count()
        known = frame.retry and self._heard.get(frame.source) == frame.sequence
        self._heard[frame.source] = frame.sequence
        if not known:
            self._upper.received(frame.payload, frame.source, transmission.cargo)

    def carrier(self, busy: bool) -> None:
        """Learn from the radio that the channel has become busy or idle."""
        if self._sending:
            return
        if busy and self._slots is None:
            self._open_ns = self._spaced_ns()
        self._idle, self._changed_ns = not busy, self._clock.now
        if busy:
            self._freeze()
        elif self.awaits_ack and self._timeout is None:
            # The timeout waited for the end of a frame, which may be the acknowledgement.
            self._timeout = self._clock.call(0, self._unacknowledged)
        else:
            self._count()

    def sent(self, transmission: Transmission) -> None:
        """Learn from the radio that a frame of this node is over."""
        self._sending = False
        self._idle = not self._medium.watch(self._radio)
        self._changed_ns = self._clock.now if self._idle else transmission.start_ns
        if transmission.kind == "ack":
            self._answering = False
            self._count()
        elif transmission.kind == "broadcast":
            self._finish(None)
        else:
            self.awaits_ack = True
            self._timeout = self._clock.call(self._ack_timeout_ns, self._time_out)

    def _overhear(self, transmission: Transmission | None) -> None:
        """Learn from the radio of a frame for others, or of one that could not be read."""
        now = self._clock.now
        if transmission is None:
            self._eifs_ns = now + EIFS_NS
        else:
            self._eifs_ns = 0
            self._nav_ns = max(self._nav_ns, now + 1000 * duration_us(transmission.mpdu))
        if self.awaits_ack:
            # Sec. 9.2.8: anything but the acknowledgement means that this attempt has failed.
            self._unacknowledged()
        else:
            self._count()

    @property
    def _engaged(self) -> bool:
        """Whether the node is in an exchange of its own or of a frame for it."""
        return self._sending or self._answering or self.awaits_ack

    def _draw(self, count: int) -> int:
        # `Generator.integers` takes five times as long; a power of two loses nothing this way.
        return int(self._rng.random() * count)

    def _count(self) -> None:
        """Begin to count slots, if the channel is idle."""
        # A node without frame or backoff has nothing to count; `submit` makes up for it.
        if self._idle and (self._slots is not None or self._job is not None) and not self._engaged:
            self._open_ns = max(self._clock.now, self._spaced_ns())
            self._plan()

    def _spaced_ns(self) -> Nanoseconds:
        """Return when the space that must follow what was on the channel is over [ns]."""
        return max(self._changed_ns + DIFS_NS, self._nav_ns + DIFS_NS, self._eifs_ns)

    def _plan(self) -> None:
        """See to it that the frame in hand goes out after its backoff, if nothing comes between."""
        if self._job is not None and self._idle and not self._engaged:
            assert self._slots is not None
            self._go_at(self._open_ns + self._slots * SLOT_NS)

    def _go_at(self, due_ns: Nanoseconds) -> None:
        if self._access is not None:
            if self._due_ns == due_ns:
                return
            self._access.cancel()
        self._due_ns = due_ns
        self._access = self._clock.call(due_ns - self._clock.now, self._go)

    def _freeze(self) -> None:
        """Keep what is left of the backoff until the channel is idle again."""
        now = self._clock.now
        if self._access is not None:
            if self._due_ns == now:
                return
            self._access.cancel()
            self._access = None
        if self._slots is not None and not self._engaged and now > self._open_ns:
            passed = (now - self._open_ns) // SLOT_NS
            self._open_ns += passed * SLOT_NS
            self._slots = self._slots - passed if self._slots > passed else None

    def _go(self) -> None:
        """Send the frame in hand."""
        self._access = self._slots = None
        job = self._job
        assert job is not None
        self._attempts += 1
        if self._attempts > 1:
            self.counters.frames_retried += 1
        mpdu = replace(job.frame, retry=self._attempts > 1).encode()
        to = job.frame.destination
        kind, mode = ("broadcast", self._phy.control_mode) if to == BROADCAST else ("data", 0)
        self.counters.attempts += kind == "data"
        self._put_on_air(
            Transmission(self._address, mpdu, to, job.meant, kind, self._attempts, job.cargo, mode)
        )

    def _put_on_air(self, frame: Transmission) -> None:
        self.counters.frames_tx += 1
        self.counters.mac_tx_bytes += len(frame.mpdu)
        self._sending = True
        self._medium.turn(self._radio)
        self._medium.transmit(frame)

    def _time_out(self) -> None:
        """Give the acknowledgement up; if something is being received, only when it is over."""
        self._timeout = None
        if self._idle:
            self._unacknowledged()

    def _unacknowledged(self) -> None:
        self.counters.attempts_failed += 1
        self._stop_waiting()
        if self._attempts >= self._config.retry_limit:
            self._finish(Outcome.NO_ACK)
            return
        self._cw = min(2 * self._cw + 1, self._config.cw_max)
        self._slots = self._draw(self._cw + 1)
        self._count()

    def _stop_waiting(self) -> None:
        self.awaits_ack = False
        if self._timeout is not None:
            self._timeout.cancel()
            self._timeout = None

    def _finish(self, outcome: Outcome | None) -> None:
        """Hand the frame back, and back off before the next one."""
        self._stop_waiting()
        self._job = None
        self._cw = self._config.cw_min
        self._slots = self._draw(self._cw + 1)
        self._count()
        self._upper.done(outcome)

    def _prepare_answer(self, frame: DcfData) -> None:
        """Acknowledge a frame after SIFS, whatever the channel is like then."""
        self._answering = True
        if self._access is not None:
            self._access.cancel()
            self._access = None
        ack, mode = DcfAck(frame.source).encode(), self._phy.control_mode
        answer = Transmission(self._address, ack, frame.source, (frame.source,), "ack", mode=mode)
        self._answer = self._clock.call(SIFS_NS, lambda: self._put_on_air(answer))
