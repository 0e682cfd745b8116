"""The radio channel that all nodes share, and the transceiver of each node in it.

Who sends, who hears it and how loud; who is deaf (sending, turning round, or
locked on another frame); which frames overlap, and which of them are received.
A receiver locks on the first frame whose preamble it can make out and stays
with it until it ends, whatever comes over it. Nothing happens at a receiver
but at the begin and the end of a frame: a frame takes two events, however many
nodes hear it.

Left out: propagation delay, capture by a later and stronger frame, and a
receiver that changes its mind inside a frame.

References
----------
IEEE Std 802.15.4-2006, sec. 6.9.9: clear channel assessment by energy or by a
reception in progress (mode 3 with OR, the CC2420's default).
"""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import exp, inf, log10
from typing import Any, Protocol, TypeAlias

import numpy as np

from wsnsim.net.clock import Call, Clock
from wsnsim.net.config import Ieee802154Config
from wsnsim.net.frames import BROADCAST
from wsnsim.net.interference import Span, peak_power, survival
from wsnsim.net.phy import BIT_NS, CCA_NS, TURNAROUND_NS, air_time_ns
from wsnsim.net.propagation import to_mw
from wsnsim.types import FloatArray, Nanoseconds

_NEVER: Nanoseconds = 2**63


class RadioMeter(Protocol):
    """Learns each change of one radio's state; whoever prices it keeps the time between two calls.

    Causes: `listen` (receiver on: waiting, in backoff, assessing the channel or turning round),
    `receive` (locked on a frame), `transmit`, and `sleep` (off for good, the last call).
    """

    def enter(self, now_ns: Nanoseconds, cause: str) -> None:
        """Note that the state `cause` begins now."""


class Listener(Protocol):
    """The MAC above a radio."""

    awaits_ack: bool

    def received(self, transmission: "Transmission") -> None:
        """Take a frame that was received without error."""

    def sent(self, transmission: "Transmission") -> None:
        """Learn that the node's own frame is over; receivers have been told before."""


@dataclass(slots=True, eq=False)
class Transmission:
    """A frame on the air."""

    sender: int
    mpdu: bytes
    address: int
    """Whom the MAC header names, or `BROADCAST`; an acknowledgement's is who waits for it."""
    meant: tuple[int, ...]
    """Nodes whose reception is worth a record."""
    kind: str
    """`data`, `broadcast` or `ack`."""
    attempt: int = 1
    cargo: Any = None
    """What the sender's upper layers keep beside the bytes; the medium never looks at it."""
    start_ns: Nanoseconds = 0
    end_ns: Nanoseconds = 0
    power_mw: Sequence[float] = ()
    locked: list["Radio"] = field(default_factory=list)
    receptions: list["Reception"] = field(default_factory=list)
    ending: Call | None = None


@dataclass(slots=True, eq=False)
class Radio:
    """The transceiver of one node."""

    index: int
    enter: Callable[[Nanoseconds, str], None]
    rng: np.random.Generator
    listener: Listener
    sending: Transmission | None = None
    locked: Transmission | None = None
    unlocked_ns: Nanoseconds = -1
    deaf_until_ns: Nanoseconds = 0
    on: bool = True


@dataclass(slots=True, eq=False)
class Reception:
    """A frame at one receiver that wants it, so far."""

    radio: Radio
    log_success: float = 0.0
    worst_sinr: float = inf


FrameReport: TypeAlias = Callable[[Transmission, int, float, str], None]
"""A frame, a receiver it was meant for, the worst SINR there [dB], and `received`, `corrupted` (locked on,
but bits failed or the sender died) or `missed` (deaf, busy with another frame, or too weak)."""


class Medium:
    """The channel between all nodes.

    Parameters
    ----------
    clock : the event clock
    config : powers, thresholds and models
    power_mw : (n, n) - power of node i at node j [mW], 0 on the diagonal
    report : hears of every frame at each receiver it was meant for; None where nobody asks
    """

    def __init__(
        self,
        clock: Clock,
        config: Ieee802154Config,
        power_mw: FloatArray,
        report: FrameReport | None = None,
    ) -> None:
        self._clock = clock
        self._report = report
        self._noise_mw = to_mw(config.noise_dbm)
        self._lock_ratio = to_mw(config.lock_sinr_db)
        self._cca_mw = to_mw(config.cca_threshold_dbm)
        self._whole_window = config.cca == "whole_window"
        sensitivity_mw = to_mw(config.sensitivity_dbm)
        self._survival = survival(config.collision, self._noise_mw, sensitivity_mw)
        self._peak_power = peak_power(config.cca)
        # A memoryview hands out Python floats, which scalar arithmetic likes better than NumPy's.
        self._rows = [memoryview(np.ascontiguousarray(row).data) for row in power_mw]
        weakest_mw = max(sensitivity_mw, self._lock_ratio * self._noise_mw)
        self._hearers = [np.flatnonzero(row >= weakest_mw).tolist() for row in power_mw]
        self._radios: list[Radio] = []
        self._active: list[Transmission] = []
        self._recent: deque[Transmission] = deque()
        self._chunk_ns: Nanoseconds = 0

    def add(
        self, enter: Callable[[Nanoseconds, str], None], rng: np.random.Generator, listener: Listener
    ) -> Radio:
        """Switch on the radio of the next node (in the order of the power matrix) and return it."""
        radio = Radio(len(self._radios), enter, rng, listener)
        self._radios.append(radio)
        enter(self._clock.now, "listen")
        return radio

    def turn(self, radio: Radio) -> None:
        """Make a radio turn from receiving to sending: it hears nothing more until it has sent."""
        self._unlock(radio, self._clock.now)
        radio.deaf_until_ns = _NEVER

    def transmit(self, frame: Transmission) -> None:
        """Put a frame on the air; the sender has turned."""
        now = self._clock.now
        self._close_chunk(now)
        sender = self._radios[frame.sender]
        frame.start_ns, frame.power_mw = now, self._rows[frame.sender]
        air_ns = air_time_ns(len(frame.mpdu))
        frame.end_ns = now + air_ns
        frame.ending = self._clock.call(air_ns, lambda: self._end(frame), first=True)
        sender.sending = frame
        sender.enter(now, "transmit")
        quiet = not self._active
        for at in self._hearers[frame.sender]:
            radio = self._radios[at]
            if radio.locked is None and now >= radio.deaf_until_ns and (quiet or self._audible(frame, at)):
                self._lock(radio, frame)
        self._active.append(frame)

    def busy(self, radio: Radio) -> bool:
        """Return whether the 8-symbol window that ends now shows a busy channel to `radio`."""
        now = self._clock.now
        since = now - CCA_NS
        if radio.locked is not None and radio.locked.start_ns < now:
            return True
        if self._whole_window and radio.unlocked_ns > since:
            return True
        spans: list[Span] = [
            (frame.start_ns, frame.end_ns, frame.power_mw[radio.index])
            for frame in (*self._recent, *self._active)
            if frame.start_ns < now and frame.end_ns > since
        ]
        return bool(spans) and self._peak_power(spans, since, now) >= self._cca_mw

    def silence(self, radio: Radio) -> None:
        """Switch a radio off for good; what it was sending is cut off and lost."""
        self.turn(radio)
        radio.on = False
        frame = radio.sending
        if frame is not None:
            if frame.ending is not None:
                frame.ending.cancel()
            frame.end_ns = self._clock.now
            self._leave(frame)
            for reception in frame.receptions:
                reception.log_success = -inf
            self._release(frame)
            radio.sending = None
        radio.enter(self._clock.now, "sleep")

    def _audible(self, frame: Transmission, at: int) -> bool:
        others = sum(other.power_mw[at] for other in self._active)
        return frame.power_mw[at] >= self._lock_ratio * (self._noise_mw + others)

    def _lock(self, radio: Radio, frame: Transmission) -> None:
        radio.locked = frame
        frame.locked.append(radio)
        radio.enter(frame.start_ns, "receive")
        wanted = frame.address in (radio.index, BROADCAST)
        if wanted or (frame.kind == "ack" and radio.listener.awaits_ack):
            frame.receptions.append(Reception(radio))

    def _unlock(self, radio: Radio, now: Nanoseconds) -> None:
        if radio.locked is not None:
            radio.locked = None
            radio.unlocked_ns = now
            radio.enter(now, "listen")

    def _close_chunk(self, now: Nanoseconds) -> None:
        """Account for the stretch since the last frame began or ended, in which nothing changed."""
        since, self._chunk_ns = self._chunk_ns, now
        if now == since:
            return
        for frame in self._active:
            bits = (now - max(since, frame.start_ns)) / BIT_NS
            for reception in frame.receptions:
                at = reception.radio.index
                wanted = frame.power_mw[at]
                others = [other.power_mw[at] for other in self._active if other is not frame]
                reception.log_success += self._survival(wanted, bits, others)
                if self._report is not None:
                    sinr = wanted / (self._noise_mw + sum(others))
                    reception.worst_sinr = min(reception.worst_sinr, sinr)

    def _leave(self, frame: Transmission) -> None:
        now = self._clock.now
        self._close_chunk(now)
        self._active.remove(frame)
        while self._recent and self._recent[0].end_ns <= now - CCA_NS:
            self._recent.popleft()
        self._recent.append(frame)

    def _end(self, frame: Transmission) -> None:
        self._leave(frame)
        now = self._clock.now
        sender = self._radios[frame.sender]
        sender.sending = None
        sender.deaf_until_ns = now + TURNAROUND_NS
        sender.enter(now, "listen")
        for radio in self._release(frame):
            # What one receiver does with a frame may stop another, or the sender.
            if radio.on:
                radio.listener.received(frame)
        if sender.on:
            sender.listener.sent(frame)

    def _release(self, frame: Transmission) -> list[Radio]:
        """Unlock a frame's receivers and return those that got it."""
        now = self._clock.now
        got: list[Radio] = []
        for reception in frame.receptions:
            radio, log_success = reception.radio, reception.log_success
            stayed = radio.locked is frame
            if stayed and (log_success == 0.0 or radio.rng.random() < exp(log_success)):
                got.append(radio)
        if self._report is not None:
            self._describe(self._report, frame, [radio.index for radio in got])
        for radio in frame.locked:
            if radio.locked is frame:
                self._unlock(radio, now)
        return got

    def _describe(self, report: FrameReport, frame: Transmission, got: Sequence[int]) -> None:
        tried = {reception.radio.index: reception for reception in frame.receptions}
        for at in frame.meant:
            reception = tried.get(at)
            if reception is None:
                others = sum(other.power_mw[at] for other in self._active)
                sinr, outcome = frame.power_mw[at] / (self._noise_mw + others), "missed"
            else:
                sinr, outcome = reception.worst_sinr, "received" if at in got else "corrupted"
            report(frame, at, 10.0 * log10(sinr) if sinr > 0.0 else -inf, outcome)
