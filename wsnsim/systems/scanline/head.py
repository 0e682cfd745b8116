"""The cluster head's part: collects what cameras say of each frame, and tracks (Ercan et al. 2007, Sec. 4).

A frame is closed when everybody was heard or its deadline is over; frames are closed in their order, each
once. What was not heard by then counts as not reported, never as not seen.
"""

import numpy as np

from wsnsim.geometry.rotations import IDENTITY
from wsnsim.messages.base import Payload
from wsnsim.messages.scanline import PlacesPayload, ScanLinePayload, step_of
from wsnsim.systems.base import Basis, Belief, Context, Note, Site, Step, Timer, TrackEstimate
from wsnsim.systems.scanline.followers import Followed, follower_for
from wsnsim.systems.scanline.params import ScanlineParams
from wsnsim.systems.scanline.sources import Heard, source_for
from wsnsim.systems.scanline.stage import Stage
from wsnsim.types import FloatArray, NodeId

_CLOSE = "close:"


class Tracking:
    """A tracker at work on what cameras say.

    Parameters
    ----------
    params : of the system
    site : of the run
    stage : the deployment
    node : the head
    first : number of the first frame it takes
    """

    def __init__(
        self, params: ScanlineParams, site: Site, stage: Stage, node: NodeId, first: int = 1
    ) -> None:
        self._params = params
        self._site = site
        self._stage = stage
        self._numbers = {name: number for number, name in enumerate(stage.names)}
        generator = site.streams.stream("scanline.particles", node, first)
        self._follower = follower_for(params, stage, site.rate_hz, generator)
        self._source = source_for(params, stage, site.rate_hz)
        self._open: dict[int, Heard] = {}
        self._next = first
        self._deadline_s = params.deadline(site.rate_hz)

    def start(self) -> Step:
        """Wait for the first frame."""
        return Step(timers=self._timers())

    def begin(self, place: FloatArray, cov: FloatArray) -> None:
        """Take over a track: the object is at a place (2,), known with a covariance (2, 2) [m²]."""
        self._follower.begin(place, cov)

    def take(self, ctx: Context, node: NodeId, payload: Payload) -> Step:
        """Take what a camera says."""
        number = self._numbers.get(node)
        if number is None or not isinstance(payload, ScanLinePayload | PlacesPayload):
            return Step()
        step = step_of(payload.step, round(ctx.now * self._site.rate_hz))
        if step < self._next:
            return Step(notes=(Note("report_late", f"frame {step}: {node} was heard after its deadline"),))
        heard = self._open.get(step, Heard())
        if isinstance(payload, PlacesPayload):
            room = self._stage.rig.room
            places = room.low + payload.shares * room.sides
            named = {int(each): place for each, place in zip(payload.ids, places, strict=True)}
            self._open[step] = Heard(heard.values_px, heard.blobs, {**heard.places, **named})
        else:
            self._open[step] = self._with_line(heard, number, payload)
        return self._close_early(ctx)

    def on_timer(self, ctx: Context, key: str) -> Step:
        """Close a frame whose deadline is over, if nobody has."""
        step = int(key.removeprefix(_CLOSE))
        return self._close(ctx, step) if step >= self._next else Step()

    def _with_line(self, heard: Heard, number: int, payload: ScanLinePayload) -> Heard:
        edge = self._stage.rig.cameras[number].half_width_px
        value = np.nan if payload.share is None else payload.share * edge
        blobs = heard.blobs
        if payload.blobs is not None:
            blobs = {**blobs, number: np.clip(payload.blobs, -1.0, 1.0) * edge}
        return Heard({**heard.values_px, number: value}, blobs, heard.places)

    def _close_early(self, ctx: Context) -> Step:
        """Close the next frame if nothing more can come of it."""
        heard = self._open.get(self._next)
        if heard is None or len(heard.values_px) < len(self._numbers):
            return Step()
        if self._params.measures_occluders and len(heard.places) < self._stage.occluders:
            return Step()
        return self._close(ctx, self._next)

    def _close(self, ctx: Context, last: int) -> Step:
        """Take all frames up to one, and wait for the one behind it."""
        result = Step()
        for step in range(self._next, last + 1):
            result = joined(result, self._follow(ctx, step, self._open.pop(step, Heard())))
        self._next = last + 1
        return joined(result, Step(timers=self._timers()))

    def _timers(self) -> tuple[Timer, ...]:
        if self._next > self._site.steps:
            return ()
        return (Timer(f"{_CLOSE}{self._next}", self._next / self._site.rate_hz + self._deadline_s),)

    def _follow(self, ctx: Context, step: int, heard: Heard) -> Step:
        report = heard.report(len(self._numbers))
        knowledge, work = self._source.knowledge(heard, report)
        followed = self._follower.step(report, knowledge)
        notes: tuple[Note, ...] = ()
        if followed.replaced:
            notes = (Note("reinitialised", f"frame {step}: no particle explained what was seen"),)
        asked = len(self._numbers)
        estimate = estimate_of(
            self._stage,
            step / self._site.rate_hz,
            self._site.rate_hz,
            followed,
            asked,
            int(report.heard.sum()),
        )
        return Step(work=work + followed.work, estimates=(estimate,), notes=notes)


def estimate_of(
    stage: Stage, time: float, rate_hz: float, followed: Followed, asked: int, heard: int
) -> TrackEstimate:
    """Return what a tracker believes as a statement about an instant [s]."""
    cov = np.zeros((3, 3))
    cov[:2, :2] = followed.cov
    belief = Belief(
        np.array([*followed.place, stage.height_m]),
        np.array([*(followed.velocity * rate_hz), 0.0]),
        IDENTITY,
    )
    basis = Basis.UPDATE if heard else Basis.TIMED_OUT
    return TrackEstimate(time, stage.target, belief, cov, basis, asked, heard)


def joined(one: Step, other: Step) -> Step:
    """Return what two steps do, one after the other."""
    return Step(
        one.sends + other.sends,
        one.work + other.work,
        one.timers + other.timers,
        one.estimates + other.estimates,
        one.notes + other.notes,
    )
