"""The radio channel once more, in plain Python: slow, and clear enough to be the oracle of the fast one.

Every frame is a span of time with a power at each node. What anybody wants to
know is worked out from the spans when it is asked for: nothing is added up as
time goes by, except the logarithm of a reception's success, from one change
anywhere on the air to the next.
"""

from dataclasses import dataclass, field
from math import exp, inf, log10

import numpy as np

from wsnsim.net.channel.propagation import to_mw
from wsnsim.net.phy.base import BROADCAST

NEVER = 2**62


@dataclass(eq=False)
class PlainRadio:
    index: int
    rng: np.random.Generator
    listener: object
    deaf_until_ns: int = 0
    sending: object = None
    on: bool = True
    asleep: bool = False
    overhear: object = None
    locked: object = None
    unlocked_ns: int = -NEVER
    watched: bool = False
    told: bool = False
    states: list = field(default_factory=list)

    def spent_ns(self, now_ns):
        """Return the time in each state [ns]."""
        spent = dict.fromkeys(("listen", "receive", "transmit", "sleep", "start"), 0)
        ends = [begin for begin, _ in self.states[1:]] + [now_ns]
        for (begin, state), end in zip(self.states, ends, strict=True):
            spent[state] += end - begin
        return spent


@dataclass(eq=False)
class Span:
    """A frame on the air."""

    frame: object
    power_mw: dict
    ending: object
    receptions: dict = field(default_factory=dict)

    def covers(self, instant):
        return self.frame.start_ns <= instant < self.frame.end_ns


@dataclass(eq=False)
class PlainReception:
    log_success: float
    worst_sinr: float = inf
    given_up: bool = False


class PlainMedium:
    """The channel between all nodes; parameters and methods are those of `wsnsim.net.phy.medium.Medium`."""

    def __init__(self, clock, phy, config, channel, report=None):
        self.clock, self.phy, self.config, self.channel, self.report = clock, phy, config, channel, report
        self.sensitivity_mw, self.cca_mw = to_mw(config.sensitivity_dbm), to_mw(config.cca_threshold_dbm)
        self.radios, self.active, self.over = [], [], []
        self.changed_ns = 0

    def add(self, rng, listener):
        radio = PlainRadio(len(self.radios), rng, listener, self.clock.now)
        radio.states.append((self.clock.now, "listen"))
        self.radios.append(radio)
        return radio

    def spent_ns(self, radio):
        return radio.spent_ns(self.clock.now)

    def turn(self, radio):
        self.account()
        for span in self.active:
            if radio.index in span.receptions:
                span.receptions[radio.index].given_up = True
        self.unlock(radio)
        radio.deaf_until_ns = NEVER

    def transmit(self, frame):
        now = self.clock.now
        self.account()
        sender = self.radios[frame.sender]
        air_ns = self.phy.air_time_ns(len(frame.mpdu), frame.mode)
        frame.start_ns, frame.end_ns = now, now + air_ns
        links = self.channel.links
        row = links.row(frame.sender)
        receivers, power_mw = links.receivers[row], links.power_mw[row]
        if self.channel.fading is not None:
            power_mw = power_mw * self.channel.fading.gains(frame.sender, receivers, now)
        span = Span(frame, dict(zip(receivers.tolist(), power_mw.tolist(), strict=True)), None)
        span.ending = self.clock.call(air_ns, lambda: self.end(span), first=True)
        sender.sending = span
        sender.states.append((now, "transmit"))
        for at, power in span.power_mw.items():
            if self.takes(self.radios[at], power):
                self.lock(self.radios[at], span)
        self.active.append(span)
        self.tell(span)

    def takes(self, radio, power_mw):
        """Whether a frame that begins now gets the receiver."""
        now, others_mw = self.clock.now, self.total_mw(radio.index)
        if power_mw < self.sensitivity_mw:
            return False
        if radio.locked is None:
            if now < radio.deaf_until_ns:
                return False
        else:
            # The noise that counts is that of the last time when the receiver was free.
            if self.config.collision != "capture":
                return False
            if now - radio.locked.frame.start_ns > self.phy.preamble_ns:
                return False
            if power_mw < to_mw(self.config.capture_db) * others_mw:
                return False
            return power_mw >= to_mw(self.config.lock_sinr_db) * (radio.noise_mw + others_mw)
        radio.noise_mw = self.noise_mw(radio.index, now)
        return power_mw >= to_mw(self.config.lock_sinr_db) * (radio.noise_mw + others_mw)

    def lock(self, radio, span):
        frame, at = span.frame, radio.index
        if radio.locked is None:
            radio.states.append((self.clock.now, "receive"))
        elif at in radio.locked.receptions:
            radio.locked.receptions[at].given_up = True
        radio.locked = span
        acknowledges = frame.kind == "ack" and radio.listener.awaits_ack
        if frame.address in (at, BROADCAST) or acknowledges or radio.overhear is not None:
            losses = self.channel.losses
            log = 0.0 if losses is None else losses.log_success(frame.sender, at, frame.start_ns)
            span.receptions[at] = PlainReception(log)

    def unlock(self, radio):
        if radio.locked is not None:
            radio.locked = None
            radio.unlocked_ns = self.clock.now
            radio.states.append((self.clock.now, "listen"))

    def busy(self, radio):
        now = self.clock.now
        since = now - self.phy.cca_ns
        if radio.locked is not None and radio.locked.frame.start_ns < now:
            return True
        if self.config.cca == "whole_window" and radio.unlocked_ns > since:
            return True
        spans = [span for span in (*self.over, *self.active) if radio.index in span.power_mw]
        begins = [span.frame.start_ns for span in spans if since <= span.frame.start_ns < now]
        instants = begins + [since if self.config.cca == "whole_window" else now - 1]
        powers = (
            sum(span.power_mw[radio.index] for span in spans if span.covers(instant)) for instant in instants
        )
        if max(powers) >= self.cca_mw:
            return True
        noise = self.channel.noise
        return noise is not None and noise.level_mw(radio.index, now) >= self.cca_mw

    def sleep(self, radio):
        self.turn(radio)
        radio.asleep = True
        radio.states.append((self.clock.now, "sleep"))

    def start(self, radio):
        radio.states.append((self.clock.now, "start"))

    def wake(self, radio):
        radio.asleep = False
        radio.deaf_until_ns = self.clock.now
        radio.states.append((self.clock.now, "listen"))

    def listen(self, radio):
        radio.deaf_until_ns = self.clock.now

    def watch(self, radio):
        radio.watched, radio.told = True, self.busy_now(radio)
        return radio.told

    def unwatch(self, radio):
        radio.watched = False

    def silence(self, radio):
        self.turn(radio)
        radio.watched = radio.on = False
        span = radio.sending
        if span is not None:
            span.ending.cancel()
            self.leave(span)
            for reception in span.receptions.values():
                reception.log_success = -inf
            self.release(span)
            radio.deaf_until_ns = NEVER
            self.tell(span)
        radio.states.append((self.clock.now, "sleep"))

    def total_mw(self, at):
        return sum(span.power_mw.get(at, 0.0) for span in self.active)

    def noise_mw(self, at, now):
        noise = self.channel.noise
        return to_mw(self.config.noise_dbm) if noise is None else noise.level_mw(at, now)

    def busy_now(self, radio):
        return radio.locked is not None or self.total_mw(radio.index) >= self.cca_mw

    def tell(self, span):
        changed = []
        for at in span.power_mw:
            radio = self.radios[at]
            if radio.watched and self.busy_now(radio) is not radio.told:
                radio.told = not radio.told
                changed.append(radio)
        for radio in changed:
            radio.listener.carrier(radio.told)

    def account(self):
        """Note what every reception has met since anything changed last."""
        since, now = self.changed_ns, self.clock.now
        self.changed_ns = now
        while since < now:
            until = now
            if self.channel.noise is not None:
                step = self.channel.noise.step_ns
                until = min(now, (since // step + 1) * step)
            for span in self.active:
                for at, reception in span.receptions.items():
                    if not reception.given_up:
                        self.stretch(span, at, reception, since, until)
            since = until

    def stretch(self, span, at, reception, since, until):
        wanted, noise = span.power_mw[at], self.noise_mw(at, since)
        others = [other.power_mw[at] for other in self.active if other is not span and at in other.power_mw]
        sinr = wanted / (noise + sum(others))
        loud = any(power >= self.sensitivity_mw for power in others)
        drowned = wanted < to_mw(self.config.capture_db) * sum(others)
        fatal = {"sinr": False, "destructive": loud, "capture": loud and drowned}[self.config.collision]
        begin = span.frame.start_ns
        survives = self.phy.log_success(sinr, since - begin, until - begin, span.frame.mode)
        reception.log_success += -inf if fatal else survives
        reception.worst_sinr = min(reception.worst_sinr, sinr)

    def leave(self, span):
        now = self.clock.now
        self.account()
        span.frame.end_ns = now
        self.active.remove(span)
        self.over = [old for old in self.over if old.frame.end_ns >= now - self.phy.cca_ns] + [span]
        sender = self.radios[span.frame.sender]
        sender.sending = None
        sender.deaf_until_ns = now + self.phy.turnaround_ns
        sender.states.append((now, "listen"))

    def end(self, span):
        self.leave(span)
        got, failed = self.release(span)
        self.tell(span)
        frame = span.frame
        for radio in got:
            if radio.on and (radio.overhear is None or frame.address in (radio.index, BROADCAST)):
                radio.listener.received(frame)
            elif radio.on:
                radio.overhear(frame)
        for radio in failed:
            if radio.on and radio.overhear is not None:
                radio.overhear(None)
        sender = self.radios[frame.sender]
        if sender.on:
            sender.listener.sent(frame)

    def release(self, span):
        got, failed = [], []
        for at, reception in span.receptions.items():
            radio = self.radios[at]
            if not reception.given_up:
                lucky = reception.log_success == 0.0 or radio.rng.random() < exp(reception.log_success)
                (got if lucky else failed).append(radio)
        if self.report is not None:
            self.describe(span, [radio.index for radio in got])
        for radio in self.radios:
            if radio.locked is span:
                self.unlock(radio)
        return got, failed

    def describe(self, span, got):
        for at in span.frame.meant:
            reception = span.receptions.get(at)
            sinr = inf if reception is None else reception.worst_sinr
            if sinr == inf:
                noise = self.noise_mw(at, self.clock.now)
                sinr = span.power_mw.get(at, 0.0) / (noise + self.total_mw(at))
            outcome = "missed" if reception is None else "received" if at in got else "corrupted"
            self.report(span.frame, at, 10.0 * log10(sinr) if sinr > 0.0 else -inf, outcome)
