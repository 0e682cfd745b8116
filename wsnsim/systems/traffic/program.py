"""What runs on a source: a packet, a pause, a packet."""

import numpy as np

from wsnsim.messages.packet import PacketPayload
from wsnsim.systems.base import Context, Received, Scope, Send, Step, Timer
from wsnsim.systems.traffic.params import TrafficParams
from wsnsim.types import Seconds
from wsnsim.vision.frame import Frame

_NEXT = "next packet"
_LEFT = "packet left"
_ROUNDING = 1e-9


class SourceProgram:
    """Sends packets to the base station, by the clock or as fast as the network takes them.

    By the clock, packet k leaves at start + k T (`jitter` none), at start + k T + U(0, T) (uniform) for
    all k with k T below the time from start to end, or after exponential gaps of mean T (poisson). As fast
    as the network takes them, the first leaves at such a time and each further one when the node's own
    link layer is done with the last, sent or given up; where that takes no time, which happens over a
    network without limits or beyond a budget, it leaves a period later.

    Parameters
    ----------
    params : how much, how often
    origin : the node's number
    end_s : after which no packet is made [s]
    rng : for the pauses
    """

    def __init__(self, params: TrafficParams, origin: int, end_s: Seconds, rng: np.random.Generator) -> None:
        self._params, self._origin, self._end_s, self._rng = params, origin, end_s, rng
        self._number = 0
        self._due_s = params.start_s

    def on_start(self, ctx: Context) -> Step:
        """Wait for the first packet's time."""
        return self._later()

    def on_frame(self, ctx: Context, frame: Frame) -> Step:
        """Do nothing: images are of no interest here."""
        return Step()

    def on_payload(self, ctx: Context, message: Received) -> Step:
        """Do nothing: packets are for the base station."""
        return Step()

    def on_timer(self, ctx: Context, key: str) -> Step:
        """Send the next packet, and see to the one after it."""
        if key == _LEFT and ctx.now <= self._due_s:
            # it took no time: not again at this instant, or time would stand still
            self._due_s = ctx.now + self._params.period_s
            return self._timer(self._due_s)
        if self._params.saturated:
            if ctx.now >= self._end_s:
                return Step()
            self._due_s = ctx.now
            return Step(sends=(self._packet(ctx, when_left=_LEFT),))
        later = self._later(self._number + 1)
        return Step(sends=(self._packet(ctx),), timers=later.timers)

    def _packet(self, ctx: Context, when_left: str | None = None) -> Send:
        packet = PacketPayload(self._origin, self._number, round(1e6 * ctx.now), self._params.payload_bytes)
        self._number += 1
        return Send(Scope.BASE, packet, when_left=when_left)

    def _later(self, number: int = 0) -> Step:
        """Wait for the time of a packet, unless it is too late for it."""
        period_s, jitter = self._params.period_s, self._params.jitter
        if jitter == "poisson":
            self._due_s += self._rng.exponential(period_s)
            return self._timer(self._due_s) if self._due_s < self._end_s else Step()
        begins_s = self._params.start_s + number * period_s
        if begins_s >= self._end_s - _ROUNDING * period_s:
            return Step()
        self._due_s = begins_s + (period_s * self._rng.random() if jitter == "uniform" else 0.0)
        return self._timer(self._due_s)

    def _timer(self, at: Seconds) -> Step:
        return Step(timers=(Timer(_NEXT, at),))
