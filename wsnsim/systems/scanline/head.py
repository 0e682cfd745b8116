"""The cluster head's part: collects what cameras say of each frame, and tracks (Ercan et al. 2007, Sec. 4).

A frame is closed when everybody was heard or its deadline is over; frames are closed in their order, each
once. What was not heard by then counts as not reported, never as not seen. A frame whose turn comes when
the deadline of the next one is over too, as the processor was busy, is left out, and noted: the tracker moves
on to the next without its reports, so that it falls behind by a frame or so and the time of its work, never
more. Reports name their frame by one byte: a head that is busy with a single one for 255 others mistakes
them.
"""

import numpy as np

from wsnsim.errors import DecodeError
from wsnsim.hardware.work import Work
from wsnsim.messages.base import Payload
from wsnsim.messages.image_part import ImagePartPayload
from wsnsim.messages.scanline import PlacesPayload, ScanLinePayload, TrackPayload, step_of
from wsnsim.systems.base import Basis, Context, Note, Scope, Send, Site, Step, Timer
from wsnsim.systems.scanline.darkroom import Darkroom
from wsnsim.systems.scanline.estimates import estimate_of, extrapolated, received_cov
from wsnsim.systems.scanline.followers import Followed, follower_for
from wsnsim.systems.scanline.occlusion import NoKnowledge
from wsnsim.systems.scanline.params import ScanlineParams
from wsnsim.systems.scanline.reading import Reading
from wsnsim.systems.scanline.sources import Heard, Nothing, source_for
from wsnsim.systems.scanline.stage import Stage
from wsnsim.types import FloatArray, NodeId

CLOSE = "close:"
CameraPayload = ScanLinePayload | PlacesPayload | ImagePartPayload
"""What cameras say."""
_MOST_CAUGHT_UP = 15
"""Steps that the tracker is moved on at most for frames that were left out. To do it costs work as well: not
more than the last frame itself, or a slow processor would never be done."""
_LEAST_SD_M = 1e-3
"""Of a place that was handed over: its covariance has been rounded."""


class Tracking:
    """A tracker at work on what cameras say.

    Parameters
    ----------
    params : of the system
    site : of the run
    stage : the deployment
    node : the head
    tells : whether the head is a mote, whose track goes to the base station instead of being its estimate
    first : number of the first frame it takes
    given : whether it begins as the scenario says, not with an object that may be anywhere
    """

    def __init__(
        self,
        params: ScanlineParams,
        site: Site,
        stage: Stage,
        node: NodeId,
        tells: bool,
        first: int = 1,
        given: bool = True,
    ) -> None:
        self._params = params
        self._site = site
        self._stage = stage
        self._tells = tells
        self._numbers = {name: number for number, name in enumerate(stage.names)}
        generator = site.streams.stream("scanline.particles", node, first)
        self._follower = follower_for(params, stage, site.rate_hz, generator, given)
        self._source = source_for(params, stage, site.rate_hz)
        self._darkroom = Darkroom(params, site)
        self._open: dict[int, Heard] = {}
        self._next = first
        self._last = site.steps
        self._left_out = 0
        self._step_work = Work()
        self.fresh = True
        """Whether nothing was heard of the object yet."""
        self._followed: Followed | None = None
        self._deadline_s = params.deadline(site.rate_hz)

    @property
    def done(self) -> bool:
        """Whether all frames that are its own are closed."""
        return self._next > self._last

    def start(self) -> Step:
        """Wait for the first frame."""
        return Step(timers=self._timers())

    def begin(self, place: FloatArray, cov: FloatArray) -> None:
        """Take over a track: the object is at a place (2,), known with a covariance (xx, xy, yy) [m²]."""
        rounded = _LEAST_SD_M**2 * np.eye(2)
        self._follower.begin(place, received_cov(cov) + rounded)

    def end(self, last: int) -> None:
        """Take no frame beyond one."""
        self._last = last

    @property
    def belief(self) -> tuple[int, Followed] | None:
        """The last frame that was closed, and what is believed of it; None where nothing was followed."""
        if self._followed is None:
            return None
        return self._next - 1, extrapolated(self._stage, self._followed, self._left_out)

    def take(self, ctx: Context, node: NodeId, payload: Payload) -> Step:
        """Take what a camera says."""
        number = self._numbers.get(node)
        if number is None or not isinstance(payload, CameraPayload):
            return Step()
        step = step_of(payload.step, round(ctx.now * self._site.rate_hz))
        if step < self._next:
            return Step(notes=(Note("report_late", f"frame {step}: {node} was heard after its deadline"),))
        heard = self._open.get(step, Heard())
        result = Step()
        if isinstance(payload, ImagePartPayload):
            reading, result = self._developed(step, node, payload)
            if reading is not None:
                heard = heard.with_line(number, reading.value_px, reading.blobs)
        elif isinstance(payload, PlacesPayload):
            room = self._stage.rig.room
            heard = heard.with_places(payload.ids, room.low + payload.shares * room.sides)
        else:
            heard = heard.with_line(number, *self._line(number, payload))
        self._open[step] = heard
        return joined(result, self._close_early(ctx))

    def on_timer(self, ctx: Context, key: str) -> Step:
        """Close a frame whose deadline is over, if nobody has."""
        step = int(key.removeprefix(CLOSE))
        return self._close(ctx) if step == self._next and not self.done else Step()

    def _developed(self, step: int, node: NodeId, part: ImagePartPayload) -> tuple[Reading | None, Step]:
        """Return what an image shows that is whole with this part, and what it took to see it."""
        try:
            reading, work = self._darkroom.take(step, node, part)
        except DecodeError as error:
            return None, Step(notes=(Note("image_refused", f"frame {step}, {node}: {error}"),))
        return reading, Step(work=work)

    def _line(self, number: int, payload: ScanLinePayload) -> tuple[float, FloatArray | None]:
        """Return z and the blobs, None where nothing was said of them, that a camera told [px]."""
        edge = self._stage.rig.cameras[number].half_width_px
        value = float("nan") if payload.share is None else payload.share * edge
        return value, None if payload.blobs is None else np.clip(payload.blobs, -1.0, 1.0) * edge

    def _close_early(self, ctx: Context) -> Step:
        """Close the next frame if nothing more can come of it."""
        heard = self._open.get(self._next)
        if self.done or heard is None or len(heard.values_px) < len(self._numbers):
            return Step()
        if self._params.measures_occluders and len(heard.places) < self._stage.occluders:
            return Step()
        return self._close(ctx)

    def _close(self, ctx: Context) -> Step:
        """Take the next frame, or leave it out, and wait for the one behind it."""
        step = self._next
        heard = self._open.pop(step, Heard())
        self._next = step + 1
        overdue = ctx.now > self._due_s(step + 1)
        leaves_out = overdue and step < self._last
        result = self._leave_out(ctx, step) if leaves_out else self._follow(step, heard)
        return joined(result, Step(timers=self._timers()))

    def _due_s(self, step: int) -> float:
        return step / self._site.rate_hz + self._deadline_s

    def _timers(self) -> tuple[Timer, ...]:
        return () if self.done else (Timer(f"{CLOSE}{self._next}", self._due_s(self._next)),)

    def _leave_out(self, ctx: Context, step: int) -> Step:
        self._left_out += 1
        late_s = ctx.now - self._due_s(step)
        said = f"frame {step}: the processor was busy until {late_s:.3g} s after its deadline"
        notes = (Note("frame_left_out", said, step),)
        if self._tells or self._followed is None:
            return Step(notes=notes)
        gone = extrapolated(self._stage, self._followed, self._left_out)
        estimate = estimate_of(self._stage, self._site.rate_hz, step, gone, 0, Basis.SKIPPED)
        return Step(estimates=(estimate,), notes=notes)

    def _follow(self, step: int, heard: Heard) -> Step:
        caught_up = self._catch_up()
        report = heard.report(len(self._numbers))
        knowledge, work = self._source.knowledge(heard, report)
        count = int(report.heard.sum())
        # of nobody's report nobody asks how probable it is
        followed = self._followed = self._follower.step(report, knowledge if count else NoKnowledge())
        notes: tuple[Note, ...] = ()
        if followed.replaced:
            notes = (Note("reinitialised", f"frame {step}: no particle explained what was seen"),)
        if isinstance(knowledge, NoKnowledge) and not isinstance(self._source, Nothing):
            said = f"frame {step}: the blobs cut the floor into too many pieces to know of occluders"
            notes += (Note("occluders_unknown", said),)
        self._step_work = work + followed.work
        result = Step(work=caught_up + self._step_work, notes=notes)
        self.fresh = self.fresh and count == 0
        if not self._tells:
            estimate = estimate_of(self._stage, self._site.rate_hz, step, followed, count)
            return joined(result, Step(estimates=(estimate,)))
        room = self._stage.rig.room
        track = TrackPayload(
            step & 0xFF,
            (followed.place - room.low) / room.sides,
            followed.velocity * self._site.rate_hz,
            followed.cov.ravel()[[0, 1, 3]],
            count,
        )
        return joined(result, Step(sends=(Send(Scope.BASE, track),)))

    def _catch_up(self) -> Work:
        """Move the tracker on through frames that were left out, of which nothing was heard."""
        nothing = Heard().report(len(self._numbers))
        work = Work()
        for _ in range(min(self._left_out, _MOST_CAUGHT_UP)):
            if work.float_ops >= self._step_work.float_ops:
                break
            work += self._source.knowledge(Heard(), nothing)[1]
            work += self._follower.step(nothing, NoKnowledge()).work
        self._left_out = 0
        return work


def joined(one: Step, other: Step) -> Step:
    """Return what two steps do, one after the other."""
    return Step(
        one.sends + other.sends,
        one.work + other.work,
        one.timers + other.timers,
        one.estimates + other.estimates,
        one.notes + other.notes,
    )
