"""Tracker T0, the base tracker: weights of synchronised particles go to the base station.

Kushwaha & Koutsoukos 2013, Algorithm 1, in the mended form. One step k:

1. the base station sends the target's state to all motes;
2. each camera that the predicted particles fall into compares them with its
   image and sends one weight a particle;
3. when all have answered, or at the deadline, the base station multiplies the
   weights, takes their mean or best particle, corrects its Kalman filter, and goes on with
   the next frame to come. Frames that passed meanwhile get a prediction.

Every message carries its step. A camera without the state of its frame's step
stays silent and says so; weights of another step are not mixed in. The
orientation stays that of the initialisation: T0 does not estimate it yet.

The position and covariance of an update are those of the weighted particles.
A sharpened Bhattacharyya coefficient is no calibrated likelihood: in setup A
the covariance is three to four times too wide.
"""

from dataclasses import dataclass

import numpy as np

from wsnsim.estimation.kalman import Gaussian
from wsnsim.estimation.particles import (
    Evidence,
    mean_and_cov,
    normalised,
    spacing_variance,
    without_prior,
)
from wsnsim.hardware.work import Work
from wsnsim.messages.state import StatePayload
from wsnsim.messages.weights import QuantisedWeightsPayload, WeightsPayload
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
    TrackedTarget,
    TrackEstimate,
)
from wsnsim.systems.multiview.estimators import position_estimate
from wsnsim.systems.multiview.filtering import advance, correct, position_cov, start
from wsnsim.systems.multiview.params import FixedNoise, MultiviewParams
from wsnsim.systems.multiview.proposal import Proposal, participants, propose, takes_part
from wsnsim.systems.multiview.reference_model import ReferenceModel
from wsnsim.systems.multiview.similarity import compare, particle_weights
from wsnsim.types import FloatArray, NodeId, Seconds
from wsnsim.vision.features import FeatureSpace
from wsnsim.vision.frame import Frame

_DRAW_FLOATS = 60.0  # one particle: three normal draws, projection, test against the image's border
_LEAST_WEIGHT = 1e-12
_FUSE_FLOATS = 25.0  # one particle and camera: logarithm and sum; its part of mean and covariance


class T0Camera:
    """What runs on a camera mote: draw, compare, send.

    Parameters
    ----------
    models : the reference model of each target of the site
    """

    def __init__(
        self, params: MultiviewParams, site: Site, node: NodeId, models: tuple[ReferenceModel, ...]
    ) -> None:
        self._params = params
        self._site = site
        self._camera = site.cameras[node]
        self._models = models
        self._features = FeatureSpace(params.colour_space)
        self._frame: Frame | None = None
        self._unanswered: set[int] = set()
        self._states: dict[int, StatePayload] = {}

    def on_start(self, ctx: Context) -> Step:
        """Wait for a state and a frame."""
        return Step()

    def on_timer(self, ctx: Context, key: str) -> Step:
        """Do nothing: a camera sets no timers."""
        return Step()

    def on_frame(self, ctx: Context, frame: Frame) -> Step:
        """Take a frame; work on it as soon as the state of its step is here."""
        unused = tuple(
            Note(
                "frame_unused",
                f"frame {self._frame.step}: no state of {self._site.targets[target].id} for it",
            )
            for target in sorted(self._unanswered)
            if self._frame is not None
        )
        self._frame = frame
        self._unanswered = set(range(len(self._site.targets)))
        return self._answer(unused)

    def on_payload(self, ctx: Context, message: Received) -> Step:
        """Take the state of a target, and work on the frame that waits for it."""
        state = message.payload
        if isinstance(state, StatePayload) and state.target < len(self._site.targets):
            self._states[state.target] = state
        return self._answer()

    def _answer(self, notes: tuple[Note, ...] = ()) -> Step:
        sends: list[Send] = []
        work = Work()
        frame = self._frame
        if frame is not None:
            for target in sorted(self._unanswered):
                state = self._states.get(target)
                if state is not None and state.step == frame.step:
                    self._unanswered.discard(target)
                    sent, cost = self._weigh(frame, state)
                    sends += sent
                    work += cost
        return Step(sends=tuple(sends), work=work, notes=notes)

    def _weigh(self, frame: Frame, state: StatePayload) -> tuple[list[Send], Work]:
        params = self._params
        proposal = propose(state, params, self._site)
        work = Work(float_ops=params.particles * _DRAW_FLOATS)
        if not takes_part(self._camera, proposal, params):
            return [], work
        similarity = compare(
            frame.image,
            self._camera,
            proposal,
            state.orientation,
            self._site.targets[state.target].semi_axes_m,
            self._models[state.target],
            self._features,
            params.colour_share,
        )
        work += similarity.work
        weights = particle_weights(similarity, params.likelihood)
        payload: WeightsPayload | QuantisedWeightsPayload
        if params.encoding == "float64":
            payload = WeightsPayload(state.target, state.step, weights)
        else:
            payload = QuantisedWeightsPayload.quantise(state.target, state.step, weights)
        expires = state.step / self._site.rate_hz + params.deadline(self._site.rate_hz)
        return [Send(Scope.BASE, payload, expires)], work


@dataclass
class _Track:
    """What the base station holds of one target between two fusions.

    Parameters
    ----------
    state : belief (6,) at step - 1
    step : the step that is being measured
    sent : the state that the cameras predict from
    proposal, asked : the particles they draw, and who sees them
    weights : (M,) of each camera that has answered
    """

    target: TrackedTarget
    state: Gaussian
    step: int
    sent: StatePayload
    proposal: Proposal
    asked: tuple[NodeId, ...]
    weights: dict[NodeId, FloatArray]


class T0Base:
    """What runs at the base station: collect, multiply, estimate, send the next state."""

    def __init__(self, params: MultiviewParams, site: Site) -> None:
        self._params = params
        self._site = site
        self._dt: Seconds = 1.0 / site.rate_hz
        self._tracks: list[_Track] = []

    def on_start(self, ctx: Context) -> Step:
        """Send every target's initial state, where the scenario puts it, give or take the error asked for."""
        for number, target in enumerate(self._site.targets):
            error = self._params.initial_error
            draws = self._site.streams.stream("initial_error", number).standard_normal(6)
            belief = Belief(
                target.start.position + error.position_sd_m * draws[:3],
                target.start.velocity + error.velocity_sd_mps * draws[3:],
                target.start.orientation,
            )
            self._tracks.append(self._begin(number, target, start(belief, error), step=1))
        return Step(
            sends=tuple(Send(Scope.TREE, track.sent) for track in self._tracks),
            timers=tuple(self._timer(track) for track in self._tracks),
            work=self._drawing_work(len(self._tracks)),
        )

    def on_frame(self, ctx: Context, frame: Frame) -> Step:
        """Do nothing: a base station has no camera."""
        return Step()

    def on_payload(self, ctx: Context, message: Received) -> Step:
        """Take a camera's weights; fuse when all that were asked have answered."""
        payload = message.payload
        if not isinstance(payload, (WeightsPayload, QuantisedWeightsPayload)):
            return Step()
        if payload.target >= len(self._tracks):
            return Step(notes=(Note("weights_refused", f"{message.source}: no target {payload.target}"),))
        track = self._tracks[payload.target]
        weights = payload.relative()
        if payload.step != track.step:
            detail = f"{message.source}: weights of step {payload.step} came during step {track.step}"
            return Step(notes=(Note("weights_late", detail),))
        if weights.size != self._params.particles:
            detail = f"{message.source}: {weights.size} weights for {self._params.particles} particles"
            return Step(notes=(Note("weights_refused", detail),))
        if message.source not in track.asked:
            detail = f"{message.source}: was not asked at step {track.step}"
            return Step(notes=(Note("weights_refused", detail),))
        track.weights[message.source] = weights
        if len(track.weights) == len(track.asked):
            return self._fuse(payload.target, ctx.now)
        return Step()

    def on_timer(self, ctx: Context, key: str) -> Step:
        """Fuse what has come by the deadline."""
        number, step = (int(part) for part in key.split(":"))
        if self._tracks[number].step == step:
            return self._fuse(number, ctx.now)
        return Step()

    def _begin(self, number: int, target: TrackedTarget, state: Gaussian, step: int) -> _Track:
        sent = StatePayload(number, step, state.mean[:3], state.mean[3:], target.start.orientation)
        proposal = propose(sent, self._params, self._site)
        asked = participants(self._site, proposal, self._params)
        return _Track(target, state, step, sent, proposal, asked, {})

    def _fuse(self, number: int, now: Seconds) -> Step:
        """Estimate the step being measured, predict those that passed meanwhile, begin the next."""
        params, track = self._params, self._tracks[number]
        estimate, state = self._estimate(track)
        estimates = [estimate]
        upcoming = max(track.step + 1, int(now * self._site.rate_hz + 1e-6) + 1)
        for step in range(track.step + 1, min(upcoming, self._site.steps + 1)):
            state = advance(state, self._dt, params.acceleration_sd_mps2)
            estimates.append(self._prediction(track, state, step, Basis.SKIPPED))
        work = Work(float_ops=params.particles * (len(track.weights) + 1) * _FUSE_FLOATS)
        if upcoming > self._site.steps:
            track.step = upcoming
            return Step(work=work, estimates=tuple(estimates))
        following = self._begin(number, track.target, state, upcoming)
        self._tracks[number] = following
        return Step(
            sends=(Send(Scope.TREE, following.sent),),
            timers=(self._timer(following),),
            work=work + self._drawing_work(1),
            estimates=tuple(estimates),
        )

    def _estimate(self, track: _Track) -> tuple[TrackEstimate, Gaussian]:
        """Return the estimate of the track's step and the filter's belief after it."""
        predicted = advance(track.state, self._dt, self._params.acceleration_sd_mps2)
        if not track.weights:
            basis = Basis.TIMED_OUT if track.asked else Basis.UNASKED
            return self._prediction(track, predicted, track.step, basis), predicted
        proposal = track.proposal
        # a weight of zero from one camera is not proof: it must not rule a particle out for all
        logs = [np.log(np.maximum(weights, _LEAST_WEIGHT)) for weights in track.weights.values()]
        weights = normalised(np.sum(logs, axis=0))
        mean, cov = mean_and_cov(proposal.particles, weights)
        position = position_estimate(
            self._params.estimator,
            proposal.particles,
            weights,
            predicted.mean[:3],
            position_cov(predicted),
        )
        noise = self._params.measurement_noise
        if isinstance(noise, FixedNoise):
            evidence = Evidence(position, np.eye(3), noise.sd_m**2 * np.eye(3))
        else:
            unresolved = spacing_variance(proposal.cov, self._params.particles)
            evidence = without_prior(mean, cov, proposal.mean, proposal.cov, unresolved)
        state = correct(predicted, evidence)
        estimate = TrackEstimate(
            time=track.step * self._dt,
            track=track.target.id,
            belief=Belief(position, state.mean[3:], track.sent.orientation),
            cov=cov,
            basis=Basis.UPDATE,
            asked=len(track.asked),
            heard=len(track.weights),
        )
        return estimate, state

    def _prediction(self, track: _Track, state: Gaussian, step: int, basis: Basis) -> TrackEstimate:
        return TrackEstimate(
            time=step * self._dt,
            track=track.target.id,
            belief=Belief(state.mean[:3], state.mean[3:], track.sent.orientation),
            cov=position_cov(state),
            basis=basis,
            asked=len(track.asked) if step == track.step else 0,
            heard=0,
        )

    def _timer(self, track: _Track) -> Timer:
        """Return the deadline of the step being measured; nobody asked, nothing to wait for."""
        wait = self._params.deadline(self._site.rate_hz) if track.asked else 0.0
        return Timer(f"{track.sent.target}:{track.step}", track.step * self._dt + wait)

    def _drawing_work(self, tracks: int) -> Work:
        return Work(float_ops=tracks * self._params.particles * _DRAW_FLOATS * len(self._site.cameras))
