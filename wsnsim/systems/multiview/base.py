"""What runs at the base station, whatever the tracker: ask, collect, fuse, go on.

Kushwaha & Koutsoukos 2013, Algorithms 1 and 2, the base station's part, in the mended
form. One step k:

1. the base station sends the targets' states to all motes;
2. each camera that the predicted particles fall into answers from its image, in the
   way of the tracker that runs;
3. when all have been heard of, or at the deadline, the base station fuses what came,
   corrects its Kalman filter, and goes on with the next frame to come. Frames that
   passed meanwhile get a prediction.

Every message carries its step; what belongs to another is not mixed in. A message of
cameras of which one has been heard already counts for nothing. The states of several
targets go out as one message. A track that the images no longer bear out is given up,
and the target looked for (`quests`).
"""

from dataclasses import replace

import numpy as np

from wsnsim.hardware.work import Work
from wsnsim.messages.base import Payload
from wsnsim.messages.batch import batched, parts_of
from wsnsim.messages.mixture import MixturePayload
from wsnsim.messages.ray import RayPayload
from wsnsim.messages.search import SightingPayload
from wsnsim.messages.state import StatePayload
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
)
from wsnsim.systems.multiview.filtering import position_cov, start
from wsnsim.systems.multiview.following import Fusion, begin, fuse, revisions
from wsnsim.systems.multiview.history import History
from wsnsim.systems.multiview.mixing import plausible
from wsnsim.systems.multiview.orientation import Attitude
from wsnsim.systems.multiview.params import MultiviewParams
from wsnsim.systems.multiview.proposal import DRAW_FLOATS
from wsnsim.systems.multiview.quests import meet, seek, wanted
from wsnsim.systems.multiview.track import Quest, Track
from wsnsim.systems.multiview.variants import Report, Said, variant
from wsnsim.types import NodeId, Seconds
from wsnsim.vision.frame import Frame

_RELEASE = "states"
_LATEST = 0.9
"""Part of a period after a frame at which the states for the next one go out at the latest."""


class BaseProgram:
    """What runs at the base station."""

    def __init__(self, params: MultiviewParams, site: Site) -> None:
        self._params = params
        self._site = site
        self._variant = variant(params.variant)
        self._cameras = tuple(site.cameras)
        self._tracks: list[Track | Quest] = []
        self._held: list[StatePayload] = []

    def on_start(self, ctx: Context) -> Step:
        """Send every target's initial state, give or take the error asked for, or have it looked for."""
        steps = []
        for number, target in enumerate(self._site.targets):
            if self._params.start == "automatic":
                quest, step = seek(self._params, self._site, number, 1, None)
                self._tracks.append(quest)
                steps.append(step)
                continue
            error = self._params.initial_error
            draws = self._site.streams.stream("initial_error", number).standard_normal(6)
            belief = Belief(
                target.start.position + error.position_sd_m * draws[:3],
                target.start.velocity + error.velocity_sd_mps * draws[3:],
                target.start.orientation,
            )
            history = History(self._params.smoothing_scans)
            state, attitude = start(belief, error), Attitude(belief.orientation)
            steps.append(
                self._follow(begin(self._params, self._site, number, state, attitude, 1, 0.0, history))
            )
        return _together(*steps, self._release(ctx.now))

    def on_frame(self, ctx: Context, frame: Frame) -> Step:
        """Do nothing: a base station has no camera."""
        return Step()

    def on_payload(self, ctx: Context, message: Received) -> Step:
        """Take what cameras say, and fuse when all that were asked have answered; or take sightings."""
        steps = [self._take(ctx, message.source, payload) for payload in parts_of(message.payload)]
        return _together(*steps, self._release(ctx.now))

    def on_timer(self, ctx: Context, key: str) -> Step:
        """Fuse what has come by the deadline, see whether the sightings of a step meet, or send states."""
        kind, _, number_step = key.partition(":")
        if kind == _RELEASE:
            return self._release(ctx.now, at_once=True)
        number, step = int(kind), int(number_step)
        track = self._tracks[number]
        if track.step != step:
            return Step()
        done = self._fuse(track, ctx.now) if isinstance(track, Track) else self._meet(track, ctx.now)
        return _together(done, self._release(ctx.now))

    def _take(self, ctx: Context, source: NodeId, payload: Payload) -> Step:
        """Take one payload."""
        if not isinstance(payload, (WeightsPayload, MixturePayload, RayPayload, SightingPayload)):
            return Step()
        if payload.target >= len(self._tracks):
            return _refused(payload.kind, source, f"no target {payload.target}")
        track = self._tracks[payload.target]
        if isinstance(payload, SightingPayload):
            if source not in self._site.cameras:
                return _refused(payload.kind, source, "is no camera")
            if isinstance(track, Quest) and wanted(self._params, self._site, payload, track):
                track.sightings[source] = payload
                return Step()
        elif isinstance(track, Track) and payload.step == track.step:
            cameras = self._cameras_of(source, payload)
            refusal = self._refusal(source, cameras, payload, track)
            if refusal:
                return _refused(payload.kind, source, refusal)
            track.reports.append(Report(cameras, payload))
            return self._fuse(track, ctx.now) if track.heard >= set(track.asked) else Step()
        detail = f"{source}: {payload.kind} of step {payload.step} came during step {track.step}"
        return Step(notes=(Note(f"{payload.kind}_late", detail),))

    def _cameras_of(self, source: NodeId, said: Said) -> tuple[NodeId, ...]:
        """Return whose images are in what was said; of a number that no camera has, the number."""
        if not isinstance(said, MixturePayload):
            return (source,)
        known = len(self._cameras)
        return tuple(
            self._cameras[number] if number < known else f"camera {number}" for number in said.cameras
        )

    def _refusal(self, source: NodeId, cameras: tuple[NodeId, ...], said: Said, track: Track) -> str:
        """Return why something said is of no use, or nothing."""
        if not isinstance(said, self._variant.said):
            return f"tracker {self._params.variant} has no use for it"
        strangers = [camera for camera in cameras if camera not in self._site.cameras]
        if strangers:
            return f"{', '.join(strangers)}: is no camera"
        unasked = [camera for camera in cameras if camera not in track.asked]
        if unasked:
            return f"{', '.join(unasked)}: was not asked at step {track.step}"
        again = track.heard.intersection(cameras)
        if again:
            return f"{', '.join(sorted(again))}: heard already at step {track.step}"
        if isinstance(said, WeightsPayload) and said.weights.size != self._params.particles:
            return f"{said.weights.size} weights for {self._params.particles} particles"
        if isinstance(said, MixturePayload) and said.mixture.dimension != self._variant.dimension:
            return f"a mixture in {said.mixture.dimension} dimensions, not {self._variant.dimension}"
        if not self._variant.fused_on_the_way and cameras != (source,):
            return f"tracker {self._params.variant} hears each camera by itself, got {', '.join(cameras)}"
        if isinstance(said, MixturePayload) and not plausible(said.mixture):
            return "a mixture that no particles make"
        return ""

    def _fuse(self, track: Track, now: Seconds) -> Step:
        """Estimate a step; then follow the target, or look for it where the images do not show it."""
        params, site, loss = self._params, self._site, self._params.loss
        fusion = fuse(params, site, track, now)
        done = Step(work=fusion.work, estimates=fusion.estimates)
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
        """Hold the state from which the cameras predict a step; nobody asked, nothing to wait for."""
        self._tracks[track.number : track.number + 1] = [track]
        self._held.append(track.sent)
        wait = self._params.deadline(self._site.rate_hz) if track.asked else 0.0
        return Step(
            timers=(Timer(f"{track.number}:{track.step}", track.step / self._site.rate_hz + wait),),
            work=Work(float_ops=self._params.particles * DRAW_FLOATS * len(self._site.cameras)),
        )

    def _release(self, now: Seconds, at_once: bool = False) -> Step:
        """Send the states that are held as one message, as soon as no other can join them in time."""
        if not self._held:
            return Step()
        upcoming = min(state.step for state in self._held)
        latest = (upcoming - 1 + _LATEST) / self._site.rate_hz
        waiting = any(isinstance(track, Track) and track.step < upcoming for track in self._tracks)
        if waiting and not at_once and now < latest:
            return Step(timers=(Timer(f"{_RELEASE}:{upcoming}", latest),))
        states, self._held = sorted(self._held, key=lambda state: state.target), []
        return Step(sends=(Send(Scope.TREE, batched(states)),))

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
        quest, step = seek(self._params, self._site, track.number, fusion.upcoming, last)
        self._tracks[track.number : track.number + 1] = [quest]
        return _together(ended, step)

    def _meet(self, quest: Quest, now: Seconds) -> Step:
        """Go on looking for a target, or follow it where it was found."""
        params, site = self._params, self._site
        found, done = meet(params, site, quest, now)
        if isinstance(found, Quest):
            self._tracks[quest.number : quest.number + 1] = [found]
            return done
        if found.upcoming > site.steps:
            quest.step = found.upcoming
            return done
        history = History(params.smoothing_scans)
        track = begin(params, site, quest.number, found.state, found.attitude, found.upcoming, 0.0, history)
        return _together(done, self._follow(track))


def _refused(kind: str, source: NodeId, why: str) -> Step:
    return Step(notes=(Note(f"{kind}_refused", f"{source}: {why}"),))


def _together(*steps: Step) -> Step:
    """Return what several steps do, in their order, as one."""
    return Step(
        sends=tuple(send for step in steps for send in step.sends),
        work=sum((step.work for step in steps), Work()),
        timers=tuple(timer for step in steps for timer in step.timers),
        estimates=tuple(estimate for step in steps for estimate in step.estimates),
        notes=tuple(note for step in steps for note in step.notes),
    )
