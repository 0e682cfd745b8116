"""The base station's part where a mote tracks: it makes an estimate of every track that arrives.

What counts is what the base station knows, and when: a mote that is the head makes no estimates of its own,
and an estimate is as late as its message. Where the object was at a frame whose track does not come the base
station reckons from the latest; of a head that is not heard for long it believes nothing more.
"""

from dataclasses import dataclass

from wsnsim.messages.scanline import TrackPayload, step_of
from wsnsim.systems.base import Context, Note, Site, Step, Timer
from wsnsim.systems.scanline.estimates import estimate_of, extrapolated, received_cov
from wsnsim.systems.scanline.followers import Followed
from wsnsim.systems.scanline.params import ScanlineParams
from wsnsim.systems.scanline.stage import Stage
from wsnsim.types import NodeId

DUE = "due:"
_SILENT_S = 5.0
"""For so long the base station goes on from the last track that it has."""


@dataclass(frozen=True)
class _Told:
    """The latest track.

    Parameters
    ----------
    step : the frame that it is about
    followed : what it says
    """

    step: int
    followed: Followed


class Desk:
    """Turns tracks into estimates.

    Parameters
    ----------
    params : of the system
    site : of the run
    stage : the deployment
    first : number of the first frame of which a track is awaited
    """

    def __init__(self, params: ScanlineParams, site: Site, stage: Stage, first: int = 1) -> None:
        self._site = site
        self._stage = stage
        self._wait_s = params.settle_s(site.rate_hz)
        self._patience = max(1, round(_SILENT_S * site.rate_hz))
        self._next = first
        self._told: set[int] = set()
        self._latest: _Told | None = None
        self._heard = first - 1
        self._silent = False

    def start(self) -> Step:
        """Await the first track."""
        return Step(timers=self._timers())

    def know(self, step: int, followed: Followed) -> None:
        """Note what the base station itself believed of a frame, when it was the head."""
        self._latest = self._latest or _Told(step, followed)

    def take(self, ctx: Context, node: NodeId, payload: TrackPayload) -> Step:
        """Make an estimate of a track."""
        step = step_of(payload.step, round(ctx.now * self._site.rate_hz))
        notes: tuple[Note, ...] = ()
        if self._silent:
            notes = (Note("head_heard", f"frame {step}: {node} tells of the object again"),)
        self._silent = False
        followed = self._followed(payload)
        if step >= self._next:
            self._told.add(step)
        if self._latest is None or step > self._latest.step:
            self._latest = _Told(step, followed)
        self._heard = max(self._heard, step)
        estimate = estimate_of(self._stage, self._site.rate_hz, step, followed, payload.heard)
        return Step(estimates=(estimate,), notes=notes)

    def on_timer(self, ctx: Context, key: str) -> Step:
        """Reckon where the object was at a frame of which no track came."""
        step = int(key.removeprefix(DUE))
        self._next = step + 1
        timers = self._timers()
        if step in self._told:
            self._told.remove(step)
            return Step(timers=timers)
        if step - self._heard > self._patience:
            said = f"frame {step}: no track for {_SILENT_S:g} s, nothing more is believed"
            notes = () if self._silent else (Note("head_silent", said),)
            self._silent = True
            return Step(timers=timers, notes=notes)
        if self._latest is None:
            return Step(timers=timers)
        gone = extrapolated(self._stage, self._latest.followed, step - self._latest.step)
        estimate = estimate_of(self._stage, self._site.rate_hz, step, gone, 0)
        return Step(timers=timers, estimates=(estimate,))

    def _timers(self) -> tuple[Timer, ...]:
        if self._next > self._site.steps:
            return ()
        return (Timer(f"{DUE}{self._next}", self._next / self._site.rate_hz + self._wait_s),)

    def _followed(self, payload: TrackPayload) -> Followed:
        room = self._stage.rig.room
        return Followed(
            room.low + payload.shares * room.sides,
            received_cov(payload.cov),
            payload.velocity / self._site.rate_hz,
        )
