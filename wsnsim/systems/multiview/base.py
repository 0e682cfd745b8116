"""Tracker T0 at the base station: weights of synchronised particles come in, an estimate goes out.

Kushwaha & Koutsoukos 2013, Algorithm 1, in the mended form. One step k:

1. the base station sends the target's state to all motes;
2. each camera that the predicted particles fall into compares them with its
   image and sends one weight a particle;
3. when all have answered, or at the deadline, the base station multiplies the
   weights, takes their mean or best particle, corrects its Kalman filter, and goes on with
   the next frame to come. Frames that passed meanwhile get a prediction.

Every message carries its step; weights of another step are not mixed in. A track that
the images no longer bear out is given up, and the target looked for until the rays of
enough cameras have met twice.

The position and covariance of an update are those of the weighted particles.
A sharpened Bhattacharyya coefficient is no calibrated likelihood: in setup A
the covariance is three to four times too wide.
"""

from dataclasses import replace

import numpy as np

from wsnsim.hardware.work import Work
from wsnsim.messages.search import SearchPayload, SightingPayload
from wsnsim.messages.weights import WeightsPayload
from wsnsim.systems.base import (
    Basis,
    Belief,
    Context,
    Note,
    Received,
    Scope,
    Send,
    Site,
    Step,
    Timer,
    TrackEstimate,
)
from wsnsim.systems.multiview.filtering import advance, appear, position_cov, start
from wsnsim.systems.multiview.following import Fusion, begin, fuse, next_step, revisions
from wsnsim.systems.multiview.history import History
from wsnsim.systems.multiview.orientation import Attitude
from wsnsim.systems.multiview.params import MultiviewParams
from wsnsim.systems.multiview.search import meeting_point
from wsnsim.systems.multiview.t0_camera import DRAW_FLOATS
from wsnsim.systems.multiview.track import Quest, Track
from wsnsim.types import NodeId, Seconds
from wsnsim.vision.frame import Frame

_FUSE_FLOATS = 25.0  # one particle and camera: logarithm and sum; its part of mean and covariance
_MEET_FLOATS = 300.0  # two rays: their nearest point, its distance from the others
_REPEAT_S = 1.0
"""How often the cameras are told anew to look for a target: a search may be lost on its way."""


class T0Base:
    """What runs at the base station: collect, multiply, estimate, send the next state."""

    def __init__(self, params: MultiviewParams, site: Site) -> None:
        self._params = params
        self._site = site
        self._tracks: list[Track | Quest] = []

    def on_start(self, ctx: Context) -> Step:
        """Send every target's initial state, give or take the error asked for, or have it looked for."""
        steps = []
        for number, target in enumerate(self._site.targets):
            if self._params.start == "automatic":
                steps.append(self._seek(number, 1, None))
                continue
            error = self._params.initial_error
            draws = self._site.streams.stream("initial_error", number).standard_normal(6)
            belief = Belief(
                target.start.position + error.position_sd_m * draws[:3],
                target.start.velocity + error.velocity_sd_mps * draws[3:],
                target.start.orientation,
            )
            history = History(self._params.smoothing_scans)
            track = begin(
                self._params,
                self._site,
                number,
                start(belief, error),
                Attitude(belief.orientation),
                1,
                0.0,
                history,
            )
            steps.append(self._follow(track))
        return _together(*steps)

    def on_frame(self, ctx: Context, frame: Frame) -> Step:
        """Do nothing: a base station has no camera."""
        return Step()

    def on_payload(self, ctx: Context, message: Received) -> Step:
        """Take weights, and fuse when all that were asked have answered; or take a sighting."""
        source, payload = message.source, message.payload
        if not isinstance(payload, (WeightsPayload, SightingPayload)):
            return Step()
        if payload.target >= len(self._tracks):
            return Step(notes=(Note(f"{payload.kind}_refused", f"{source}: no target {payload.target}"),))
        if source not in self._site.cameras:
            return Step(notes=(Note(f"{payload.kind}_refused", f"{source}: is no camera"),))
        track = self._tracks[payload.target]
        if isinstance(payload, SightingPayload):
            if isinstance(track, Quest) and self._wanted(payload, track):
                track.sightings[source] = payload
                return Step()
        elif isinstance(track, Track) and payload.step == track.step:
            refusal = self._refusal(source, payload, track)
            if refusal:
                return Step(notes=(Note("weights_refused", f"{source}: {refusal}"),))
            track.reports[source] = payload
            return self._fuse(track, ctx.now) if len(track.reports) == len(track.asked) else Step()
        detail = f"{source}: {payload.kind} of step {payload.step} came during step {track.step}"
        return Step(notes=(Note(f"{payload.kind}_late", detail),))

    def on_timer(self, ctx: Context, key: str) -> Step:
        """Fuse what has come by the deadline, or see whether the sightings of a step meet."""
        number, step = (int(part) for part in key.split(":"))
        track = self._tracks[number]
        if track.step != step:
            return Step()
        return self._fuse(track, ctx.now) if isinstance(track, Track) else self._meet(track, ctx.now)

    def _refusal(self, source: NodeId, payload: WeightsPayload, track: Track) -> str:
        """Return why weights are of no use, or nothing."""
        if payload.weights.size != self._params.particles:
            return f"{payload.weights.size} weights for {self._params.particles} particles"
        return "" if source in track.asked else f"was not asked at step {track.step}"

    def _fuse(self, track: Track, now: Seconds) -> Step:
        """Estimate a step; then follow the target, or look for it where the images do not show it."""
        params, site, loss = self._params, self._site, self._params.loss
        fusion = fuse(params, site, track, now)
        work = Work(float_ops=params.particles * (len(track.reports) + 1) * _FUSE_FLOATS)
        done = Step(work=work, estimates=fusion.estimates)
        if fusion.upcoming > site.steps:
            track.step = fusion.upcoming
            return done
        if loss is not None and fusion.bad_s >= loss.after_s > track.bad_s:
            done = replace(done, notes=(Note("track_lost", self._why(track.number, fusion.bad_s)),))
            if loss.search:
                return _together(done, self._give_up(track, fusion))
        following = begin(
            params,
            site,
            track.number,
            fusion.state,
            fusion.attitude,
            fusion.upcoming,
            fusion.bad_s,
            fusion.history,
        )
        return _together(done, self._follow(following))

    def _why(self, number: int, bad_s: Seconds) -> str:
        return f"{self._site.targets[number].id}: not borne out by any image for {bad_s:g} s"

    def _follow(self, track: Track) -> Step:
        """Send the state from which the cameras predict a step; nobody asked, nothing to wait for."""
        self._tracks[track.number : track.number + 1] = [track]
        wait = self._params.deadline(self._site.rate_hz) if track.asked else 0.0
        return Step(
            sends=(Send(Scope.TREE, track.sent),),
            timers=(Timer(f"{track.number}:{track.step}", track.step / self._site.rate_hz + wait),),
            work=Work(float_ops=self._params.particles * DRAW_FLOATS * len(self._site.cameras)),
        )

    def _give_up(self, track: Track, fusion: Fusion) -> Step:
        """Smooth what is left of a track, and have the target looked for from where it was last."""
        rest = fusion.history.rest(1.0 / self._site.rate_hz, self._params.acceleration_sd_mps2)
        last = replace(
            fusion.estimates[0],
            belief=Belief(fusion.state.mean[:3], np.zeros(3), fusion.attitude.orientation),
            cov=position_cov(fusion.state),
            basis=Basis.LOST,
            asked=0,
            heard=0,
        )
        ended = Step(estimates=tuple(revisions(self._site, track, rest)))
        return _together(ended, self._seek(track.number, fusion.upcoming, last))

    def _seek(self, number: int, step: int, last: TrackEstimate | None) -> Step:
        """Have the cameras look for a target from `step` on."""
        self._tracks[number : number + 1] = [Quest(number, step, step, last)]
        return Step(
            sends=(Send(Scope.TREE, SearchPayload(number, step)),), timers=(self._collected(number, step),)
        )

    def _wanted(self, sighting: SightingPayload, quest: Quest) -> bool:
        """Tell whether a sighting is recent, and of an image after those that met before."""
        return self._recent(sighting.step, quest.step) and (quest.met is None or sighting.step > quest.met[0])

    def _recent(self, seen: int, step: int) -> bool:
        """Tell whether what was seen still says something at a step: slow motes search for several frames."""
        return step - seen <= self._params.searching.after_s * self._site.rate_hz

    def _meet(self, quest: Quest, now: Seconds) -> Step:
        """Take where the cameras' last sightings meet; the second such place begins a track."""
        target, loss = self._site.targets[quest.number], self._params.searching
        work = Work(float_ops=_MEET_FLOATS * len(quest.sightings) ** 2)
        reach_m = float(target.semi_axes_m.max())
        meeting = meeting_point(quest.sightings, self._site.cameras, reach_m, loss.cameras_min)
        if meeting is None:
            return _together(Step(work=work), self._go_on(quest))
        place, cameras = meeting
        seen = max(quest.sightings[camera].step for camera in cameras)
        if quest.met is None or not self._recent(quest.met[0], seen):
            # a second meeting must rest on other images
            again = replace(quest, met=(seen, place), sightings={})
            return _together(Step(work=work), self._go_on(again))
        apart = (seen - quest.met[0]) / self._site.rate_hz
        state = appear(place, (place - quest.met[1]) / apart, 0.5 * reach_m, apart)
        orientation = target.start.orientation if quest.last is None else quest.last.belief.orientation
        upcoming, estimates = next_step(self._site, seen, now), []
        for step in range(seen, min(upcoming, self._site.steps + 1)):
            if step > seen:
                state = advance(state, 1.0 / self._site.rate_hz, self._params.acceleration_sd_mps2)
            estimates.append(
                TrackEstimate(
                    time=step / self._site.rate_hz,
                    track=target.id,
                    belief=Belief(state.mean[:3], state.mean[3:], orientation),
                    cov=position_cov(state),
                    basis=Basis.UPDATE if step == seen else Basis.SKIPPED,
                    asked=len(self._site.cameras) if step == seen else 0,
                    heard=len(cameras) if step == seen else 0,
                )
            )
        note = Note("track_started", f"{target.id}: seen by {', '.join(cameras)}")
        done = Step(work=work, estimates=tuple(estimates), notes=(note,))
        if upcoming > self._site.steps:
            quest.step = upcoming
            return done
        history = History(self._params.smoothing_scans)
        track = begin(
            self._params, self._site, quest.number, state, Attitude(orientation), upcoming, 0.0, history
        )
        return _together(done, self._follow(track))

    def _go_on(self, quest: Quest) -> Step:
        """Collect the sightings of the next step; tell the cameras again now and then."""
        rate_hz = self._site.rate_hz
        held = () if quest.last is None else (replace(quest.last, time=quest.step / rate_hz),)
        step = quest.step + 1
        if step > self._site.steps:
            quest.step = step
            return Step(estimates=held)
        again = step - quest.asked_at >= _REPEAT_S * rate_hz
        recent = {
            node: sighting for node, sighting in quest.sightings.items() if self._recent(sighting.step, step)
        }
        asked_at = step if again else quest.asked_at
        self._tracks[quest.number] = replace(quest, step=step, asked_at=asked_at, sightings=recent)
        sends = (Send(Scope.TREE, SearchPayload(quest.number, step)),) if again else ()
        return Step(sends=sends, timers=(self._collected(quest.number, step),), estimates=held)

    def _collected(self, number: int, step: int) -> Timer:
        """Return when the sightings of a step are in."""
        rate_hz = self._site.rate_hz
        return Timer(f"{number}:{step}", step / rate_hz + min(self._params.deadline(rate_hz), 0.9 / rate_hz))


def _together(*steps: Step) -> Step:
    """Return what several steps do, in their order, as one."""
    return Step(
        sends=tuple(send for step in steps for send in step.sends),
        work=sum((step.work for step in steps), Work()),
        timers=tuple(timer for step in steps for timer in step.timers),
        estimates=tuple(estimate for step in steps for estimate in step.estimates),
        notes=tuple(note for step in steps for note in step.notes),
    )
