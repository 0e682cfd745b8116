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
from dataclasses import dataclass
from math import exp, inf, log10
from typing import TypeAlias

import numpy as np

from wsnsim.net.channel.channel import Channel
from wsnsim.net.channel.propagation import to_mw
from wsnsim.net.clock import Clock
from wsnsim.net.config import RadioConfig
from wsnsim.net.phy.base import BROADCAST, Listener, Phy, Transmission
from wsnsim.net.phy.interference import Span, peak_power, survival
from wsnsim.types import Nanoseconds

_NEVER: Nanoseconds = 2**63


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
    """Whether it will ever do anything again."""
    asleep: bool = False
    watched: bool = False
    """Whether its listener is told when the channel becomes busy or idle."""
    found_busy: bool = False
    """What it was told last."""


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
    phy : times on the air, and what noise does to bits
    config : thresholds and models
    channel : who arrives where
    report : hears of every frame at each receiver it was meant for; None where nobody asks
    """

    def __init__(
        self,
        clock: Clock,
        phy: Phy,
        config: RadioConfig,
        channel: Channel,
        report: FrameReport | None = None,
    ) -> None:
        self._clock, self._phy = clock, phy
        self._report = report
        self._noise_mw = to_mw(config.noise_dbm)
        self._lock_ratio = to_mw(config.lock_sinr_db)
        self._cca_mw = to_mw(config.cca_threshold_dbm)
        self._whole_window = config.cca == "whole_window"
        sensitivity_mw = to_mw(config.sensitivity_dbm)
        self._survival = survival(config.collision, phy, self._noise_mw, sensitivity_mw)
        self._peak_power = peak_power(config.cca)
        weakest_mw = max(sensitivity_mw, self._lock_ratio * self._noise_mw)
        links = channel.links
        self._rows: list[dict[int, float]] = []
        self._hearers: list[list[int]] = []
        for sender in range(links.nodes):
            row = links.row(sender)
            powers = dict(zip(links.receivers[row].tolist(), links.power_mw[row].tolist(), strict=True))
            self._rows.append(powers)
            self._hearers.append([at for at, power in powers.items() if power >= weakest_mw])
        self._radios: list[Radio] = []
        self._active: list[Transmission] = []
        self._recent: deque[Transmission] = deque()
        self._chunk_ns: Nanoseconds = 0

    def add(
        self, enter: Callable[[Nanoseconds, str], None], rng: np.random.Generator, listener: Listener
    ) -> Radio:
        """Switch on the radio of the next node (in the order of the links) and return it."""
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
        air_ns = self._phy.air_time_ns(len(frame.mpdu), frame.mode)
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
        self._tell_watchers(frame)

    def busy(self, radio: Radio) -> bool:
        """Return whether the 8-symbol window that ends now shows a busy channel to `radio`."""
        now = self._clock.now
        since = now - self._phy.cca_ns
        if radio.locked is not None and radio.locked.start_ns < now:
            return True
        if self._whole_window and radio.unlocked_ns > since:
            return True
        spans: list[Span] = [
            (frame.start_ns, frame.end_ns, frame.power_mw.get(radio.index, 0.0))
            for frame in (*self._recent, *self._active)
            if frame.start_ns < now and frame.end_ns > since
        ]
        return bool(spans) and self._peak_power(spans, since, now) >= self._cca_mw

    def sleep(self, radio: Radio) -> None:
        """Switch a radio off for a while; it must not be sending."""
        self.turn(radio)
        radio.asleep = True
        radio.enter(self._clock.now, "sleep")

    def wake(self, radio: Radio) -> None:
        """Switch a sleeping radio on: it listens at once, and hears the frames that begin from now on."""
        radio.asleep = False
        radio.deaf_until_ns = self._clock.now
        radio.enter(self._clock.now, "listen")

    def listen(self, radio: Radio) -> None:
        """Let a radio that had turned to sending hear again, though it has not sent."""
        radio.deaf_until_ns = self._clock.now

    def watch(self, radio: Radio) -> bool:
        """Tell the radio's listener from now on when the channel becomes busy or idle; return which it is.

        Busy: a reception is in progress, or more power than the CCA threshold arrives now.
        """
        radio.watched = True
        radio.found_busy = self._busy_now(radio)
        return radio.found_busy

    def unwatch(self, radio: Radio) -> None:
        """Tell it nothing more."""
        radio.watched = False

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

    def _busy_now(self, radio: Radio) -> bool:
        if radio.locked is not None:
            return True
        return sum(frame.power_mw.get(radio.index, 0.0) for frame in self._active) >= self._cca_mw

    def _tell_watchers(self, frame: Transmission) -> None:
        for at in frame.power_mw:
            radio = self._radios[at]
            if radio.watched:
                busy = self._busy_now(radio)
                if busy is not radio.found_busy:
                    radio.found_busy = busy
                    radio.listener.carrier(busy)

    def _audible(self, frame: Transmission, at: int) -> bool:
        others = sum(other.power_mw.get(at, 0.0) for other in self._active)
        return frame.power_mw.get(at, 0.0) >= self._lock_ratio * (self._noise_mw + others)

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
            stretch = (max(since, frame.start_ns) - frame.start_ns, now - frame.start_ns, frame.mode)
            for reception in frame.receptions:
                at = reception.radio.index
                wanted = frame.power_mw.get(at, 0.0)
                others = [other.power_mw.get(at, 0.0) for other in self._active if other is not frame]
                reception.log_success += self._survival(wanted, others, stretch)
                if self._report is not None:
                    sinr = wanted / (self._noise_mw + sum(others))
                    reception.worst_sinr = min(reception.worst_sinr, sinr)

    def _leave(self, frame: Transmission) -> None:
        now = self._clock.now
        self._close_chunk(now)
        self._active.remove(frame)
        while self._recent and self._recent[0].end_ns <= now - self._phy.cca_ns:
            self._recent.popleft()
        self._recent.append(frame)

    def _end(self, frame: Transmission) -> None:
        self._leave(frame)
        now = self._clock.now
        sender = self._radios[frame.sender]
        sender.sending = None
        sender.deaf_until_ns = now + self._phy.turnaround_ns
        sender.enter(now, "listen")
        got = self._release(frame)
        self._tell_watchers(frame)
        for radio in got:
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
                others = sum(other.power_mw.get(at, 0.0) for other in self._active)
                sinr, outcome = frame.power_mw.get(at, 0.0) / (self._noise_mw + others), "missed"
            else:
                sinr, outcome = reception.worst_sinr, "received" if at in got else "corrupted"
            report(frame, at, 10.0 * log10(sinr) if sinr > 0.0 else -inf, outcome)
