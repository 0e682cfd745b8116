"""The radio channel that all nodes share: who sends, who hears it, and which frames get through.

A receiver locks on the first frame whose preamble it can make out and stays
with it until it ends, whatever comes over it; in the mode `capture` a frame
that is enough stronger than all others takes it over while it is still at the
preamble. Nothing happens at a receiver but at the begin and the end of a
frame: a frame takes two events and two passes over those in its sender's
range, however many nodes and frames there are elsewhere.

A node outside a sender's row of links knows nothing of its frames, not even as
noise. Left out: propagation delay. Noise that changes in time is asked for
when a node might lock on a frame, for the stretches of a reception, and at the
end of a window of clear channel assessment, where it counts as power by
itself.
"""

from collections.abc import Callable, Sequence
from functools import lru_cache, partial
from math import exp, inf, log10
from typing import TypeAlias

import numpy as np

from wsnsim.kernels import radio as table
from wsnsim.net.channel.channel import Channel
from wsnsim.net.channel.propagation import to_mw
from wsnsim.net.clock import Clock
from wsnsim.net.config import RadioConfig
from wsnsim.net.phy.base import BROADCAST, Listener, Phy, Transmission
from wsnsim.net.phy.interference import survival
from wsnsim.net.phy.radios import NEVER, Radio, Radios, RadioTimes, view
from wsnsim.net.phy.receptions import Reception, Receptions
from wsnsim.net.phy.rows import Row, Rows
from wsnsim.types import Nanoseconds

__all__ = ["FrameReport", "Medium", "Radio"]

FrameReport: TypeAlias = Callable[[Transmission, int, float, str], None]
"""A frame, a receiver it was meant for, the worst SINR there [dB], and `received`, `corrupted` (locked on,
but bits failed, another frame captured the receiver, or the sender died) or `missed` (deaf, busy with
another frame, or too weak)."""


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
        self._clock, self._phy, self._report = clock, phy, report
        self._noise, self._losses = channel.noise, channel.losses
        self._noise_mw, self._cca_mw = to_mw(config.noise_dbm), to_mw(config.cca_threshold_dbm)
        nodes = channel.links.nodes
        rows = self._rows = Rows(channel.links, self._noise_mw, to_mw(config.sensitivity_dbm), channel.fading)
        cca, noise = rows.count(self._cca_mw), rows.count(self._noise_mw)
        self._states = Radios(nodes, noise, cca, config.cca, phy.cca_ns)
        self._receptions = Receptions(
            survival(config, phy), rows.unit_mw, self._noise_mw, channel.noise, report is not None
        )
        self._air_ns = lru_cache(maxsize=None)(phy.air_time_ns)
        self._radios: list[Radio] = []
        self._endings: list[Callable[[], None]] = []
        self._row_of: list[Row] = []
        self._receiving: list[Reception | None] = []
        self._awaiting: set[int] = set()
        self._overhearing: set[int] | None = None
        reports = np.zeros((5, nodes + 1), dtype=np.int64)
        self._changed, self._before, self._loud, self._locks, self._told = map(view, reports)
        states = self._states
        common = (states.air, states.table, rows.receivers, reports, rows.sensitivity, cca)
        always = noise if channel.noise is None else -1
        lock_ratio, capture_ratio = to_mw(config.lock_sinr_db), to_mw(config.capture_db)
        self._captures = config.collision == "capture"
        capture_ns = phy.preamble_ns if self._captures else -1
        self._begin = partial(
            table.begin_frame.compiled, *common, always, lock_ratio, capture_ratio, capture_ns
        )
        self._finish = partial(table.end_frame.compiled, *common, phy.turnaround_ns)

    def add(self, rng: np.random.Generator, listener: Listener) -> Radio:
        """Switch on the radio of the next node (in the order of the links) and return it."""
        radio = Radio(len(self._radios), rng, listener, self._clock.now)
        self._radios.append(radio)
        self._endings.append(partial(self._end, radio))
        self._row_of.append(self._rows.of(radio))
        self._receiving.append(None)
        self._states.open(radio.index, self._clock.now)
        return radio

    def times(self, radio: Radio) -> RadioTimes:
        """Return the account of how long a radio has been in each of its states."""
        return RadioTimes(self._states, radio.index)

    def turn(self, radio: Radio) -> None:
        """Make a radio turn from receiving to sending: it hears nothing more until it has sent.

        A listener that watches the channel learns what this changes with the next frame.
        """
        at = radio.index
        if self._receiving[at] is not None:
            self._give_up(at)
        self._states.turn(radio, self._clock.now)

    def transmit(self, frame: Transmission) -> None:
        """Put a frame on the air; the sender has turned."""
        now, sender = self._clock.now, frame.sender
        row = self._row_of[sender]
        air_ns = self._air_ns(len(frame.mpdu), frame.mode)
        frame.start_ns, frame.end_ns = now, now + air_ns
        row.frame = row.radio.sending = frame
        row.ending = self._clock.call(air_ns, self._endings[sender], first=True)
        self._rows.fade(row, now)
        if self._noise is not None:
            self._ask_noise(row)
        reports = self._begin(row.powers, row.first, row.start, row.weak, row.stop, sender, now)
        if reports:
            changed = reports & table.COUNT_MASK
            if changed:
                self._account(changed, now)
            locks = reports >> table.LOCKS_SHIFT & table.COUNT_MASK
            if locks:
                self._receive(row, frame, locks)
            told = reports >> table.CARRIER_SHIFT
            if told:
                self._tell(told)

    def busy(self, radio: Radio) -> bool:
        """Return whether the window of clear channel assessment that ends now shows a busy channel."""
        now = self._clock.now
        if self._states.assess(radio.index, now):
            return True
        return self._noise is not None and self._noise.level_mw(radio.index, now) >= self._cca_mw

    def sleep(self, radio: Radio) -> None:
        """Switch a radio off for a while; it must not be sending."""
        self.turn(radio)
        radio.asleep = True
        self._states.enter(radio.index, table.SLEEP, self._clock.now)

    def start(self, radio: Radio) -> None:
        """Let the crystal of a sleeping radio start: it hears nothing yet, but draws more than asleep."""
        self._states.enter(radio.index, table.START, self._clock.now)

    def wake(self, radio: Radio) -> None:
        """Switch a sleeping radio on: it listens at once, and hears the frames that begin from now on."""
        radio.asleep = False
        self._states.deafen(radio, self._clock.now)
        self._states.enter(radio.index, table.LISTEN, self._clock.now)

    def listen(self, radio: Radio) -> None:
        """Let a radio that had turned to sending hear again, though it has not sent."""
        self._states.deafen(radio, self._clock.now)

    def watch(self, radio: Radio) -> bool:
        """Tell the radio's listener from now on when the channel becomes busy or idle; return which it is.

        Busy: a reception is in progress, or as much power as the CCA threshold arrives now. What the
        radio sends itself is not in it, though what arrives meanwhile is. Changes are told when a
        frame in the node's range begins or ends.
        """
        return self._states.watch(radio.index, True)

    def unwatch(self, radio: Radio) -> None:
        """Tell it nothing more."""
        self._states.watch(radio.index, False)

    def silence(self, radio: Radio) -> None:
        """Switch a radio off for good; what it was sending is cut off and lost."""
        self.turn(radio)
        self.unwatch(radio)
        radio.on = False
        row = self._row_of[radio.index]
        if row.frame is not None:
            assert row.ending is not None
            row.ending.cancel()
            row.frame.end_ns = self._clock.now
            frame, told = self._leave(row)
            for reception in row.receptions:
                reception.log_success = -inf
            _, failed = self._release(row, frame)
            self._states.deafen(radio, NEVER)
            if told:
                self._tell(told)
            _tell_of_failure(failed)
        self._states.enter(radio.index, table.SLEEP, self._clock.now)

    def _ask_noise(self, row: Row) -> None:
        """Ask for the noise where a frame might be noticed."""
        assert self._noise is not None
        now, radios = self._clock.now, self._states.table
        receivers = self._rows.receivers[row.start : row.stop]
        powers = row.powers[row.start - row.first : row.stop - row.first]
        free = (self._states.air[receivers, table.FLAGS] < table.ONE_LOCKED) & (
            radios[receivers, table.DEAF_NS] <= now
        )
        for at in receivers[free & (powers >= self._rows.sensitivity)].tolist():
            radios[at, table.NOISE] = self._rows.count(self._noise.level_mw(at, now))

    def _receive(self, row: Row, frame: Transmission, locks: int) -> None:
        """Keep account of a frame where it is for somebody who has locked on it."""
        if frame.address == BROADCAST:
            nodes: Sequence[int] = [self._rows.receiver_of[link] for link in self._locks[:locks]]
        else:
            nodes = self._takers(frame)
        sender, lost, log_success = frame.sender, self._losses, 0.0
        for at in self._states.locked_on(sender, nodes):
            if lost is not None:
                log_success = lost.log_success(sender, at, frame.start_ns)
            arriving_mw, arriving = self._rows.arriving(row, at)
            reception = Reception(frame, self._radios[at], arriving_mw, arriving, frame.start_ns, log_success)
            row.receptions.append(reception)
            self._receiving[at] = reception
            self._states.want(at)

    def _takers(self, frame: Transmission) -> Sequence[int]:
        """Return the nodes that would take a frame which is not a broadcast."""
        if self._overhearing is None:
            self._overhearing = {radio.index for radio in self._radios if radio.overhear is not None}
        takers = self._overhearing
        if self._awaiting and frame.kind == "ack":
            # Such a frame may name nobody, and then all who wait for one take it.
            self._awaiting = {at for at in self._awaiting if self._radios[at].listener.awaits_ack}
            takers = takers | self._awaiting
        named = frame.address < len(self._radios)
        if not takers:
            return (frame.address,) if named else ()
        return sorted(takers | {frame.address} if named else takers)

    def _account(self, changed: int, now: Nanoseconds) -> None:
        """Note what receptions have met until now, where that changes."""
        for number in range(changed):
            at = self._changed[number]
            reception = self._receiving[at]
            assert reception is not None
            self._receptions.account(reception, self._before[number], self._loud[number], now)
            # A frame that captures the receiver has locked it already; the one that ends has unlocked it.
            if self._captures and self._states.locked(at) not in (reception.frame.sender, -1):
                reception.given_up, self._receiving[at] = True, None

    def _give_up(self, at: int) -> None:
        """Let a node turn away from the frame that is for it."""
        reception = self._receiving[at]
        assert reception is not None
        total, loud = self._states.arriving(at)
        self._receptions.account(reception, total, loud, self._clock.now)
        reception.given_up, self._receiving[at] = True, None

    def _leave(self, row: Row) -> tuple[Transmission, int]:
        """Take a sender's frame off the air; return it, and how many watchers have something to learn."""
        frame, radio, now = row.frame, row.radio, self._clock.now
        assert frame is not None
        row.frame = row.ending = radio.sending = None
        reports = self._finish(row.powers, row.first, row.start, row.weak, row.stop, radio.index, now)
        radio.deaf_until_ns = now + self._phy.turnaround_ns
        changed = reports & table.COUNT_MASK
        if changed:
            self._account(changed, now)
        return frame, reports >> table.CARRIER_SHIFT

    def _end(self, radio: Radio) -> None:
        row = self._row_of[radio.index]
        frame, told = self._leave(row)
        got, failed = self._release(row, frame)
        if told:
            self._tell(told)
        for receiver in got:
            # What one receiver does with a frame may stop another, or the sender.
            if receiver.on:
                if receiver.overhear is None or frame.address in (receiver.index, BROADCAST):
                    receiver.listener.received(frame)
                else:
                    receiver.overhear(frame)
        _tell_of_failure(failed)
        if radio.on:
            radio.listener.sent(frame)
            if radio.listener.awaits_ack:
                self._awaiting.add(radio.index)

    def _release(self, row: Row, frame: Transmission) -> tuple[list[Radio], list[Radio]]:
        """Return who has received a frame that has just left the air, and who stayed with it in vain."""
        got: list[Radio] = []
        failed: list[Radio] = []
        for reception in row.receptions:
            radio, log_success = reception.radio, reception.log_success
            if reception.given_up:
                continue
            self._receiving[radio.index] = None
            if log_success == 0.0 or radio.rng.random() < exp(log_success):
                got.append(radio)
            else:
                failed.append(radio)
        if self._report is not None:
            self._describe(self._report, row, frame, got)
        row.receptions.clear()
        return got, failed

    def _tell(self, told: int) -> None:
        """Tell watchers what has become of the channel."""
        # In the order of the nodes, whatever that of the links, for what they do then may be of one instant.
        for at in sorted(self._told[:told].tolist()):
            listens, busy = self._states.told(at)
            if listens:
                self._radios[at].listener.carrier(busy)

    def _describe(self, report: FrameReport, row: Row, frame: Transmission, got: list[Radio]) -> None:
        tried = {reception.radio.index: reception for reception in row.receptions}
        for at in frame.meant:
            reception = tried.get(at)
            outcome = "missed" if reception is None else "corrupted"
            if reception is None or reception.worst_sinr == inf:
                sinr = self._sinr(row, at)
            else:
                sinr, outcome = reception.worst_sinr, "received" if reception.radio in got else "corrupted"
            report(frame, at, 10.0 * log10(sinr) if sinr > 0.0 else -inf, outcome)

    def _sinr(self, row: Row, at: int) -> float:
        """Return the SINR that a frame which has just ended had at a node in the end."""
        arriving_mw, arriving = self._rows.arriving(row, at)
        if arriving == 0:
            return 0.0
        noise_mw = self._noise_mw if self._noise is None else self._noise.level_mw(at, self._clock.now)
        total, _ = self._states.arriving(at)
        return arriving_mw / (noise_mw + total * self._rows.unit_mw)


def _tell_of_failure(failed: list[Radio]) -> None:
    """Tell who wants to know it of a frame that they stayed with in vain."""
    for receiver in failed:
        if receiver.on and receiver.overhear is not None:
            receiver.overhear(None)
