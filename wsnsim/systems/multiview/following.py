"""A track from step to step: send a state, fuse what comes back.

Kushwaha & Koutsoukos 2013, Algorithm 1, lines 11–15.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from wsnsim.estimation.kalman import Gaussian
from wsnsim.estimation.particles import Evidence, without_prior
from wsnsim.hardware.work import Work
from wsnsim.messages.mixture import MixturePayload
from wsnsim.messages.state import StatePayload
from wsnsim.messages.weights import WeightsPayload
from wsnsim.systems.base import Basis, Belief, Site, TrackEstimate
from wsnsim.systems.multiview.filtering import advance, correct, position_cov
from wsnsim.systems.multiview.history import History
from wsnsim.systems.multiview.orientation import Attitude, corrected
from wsnsim.systems.multiview.params import MultiviewParams
from wsnsim.systems.multiview.proposal import participants, propose, spread
from wsnsim.systems.multiview.rules import FixedNoise
from wsnsim.systems.multiview.track import Track
from wsnsim.systems.multiview.variants import Question, Report, variant
from wsnsim.types import FloatArray, NodeId, Seconds


@dataclass(frozen=True, eq=False)
class Fusion:
    """What a step has come to.

    Parameters
    ----------
    estimates : of the step, of those that passed meanwhile, and the smoothed ones that are due
    state, attitude : belief (6,) and how the target stands at the last of these steps
    upcoming : the next step that can be measured
    bad_s : for how long the images have not borne the track out [s]
    history : beliefs that are not smoothed yet
    work : what it cost
    """

    estimates: tuple[TrackEstimate, ...]
    state: Gaussian
    attitude: Attitude
    upcoming: int
    bad_s: Seconds
    history: History
    work: Work


def begin(
    params: MultiviewParams,
    site: Site,
    number: int,
    state: Gaussian,
    attitude: Attitude,
    step: int,
    bad_s: Seconds,
    history: History,
) -> Track:
    """Return the track of target `number` that waits for the measurements of `step`.

    Parameters
    ----------
    state, attitude : belief (6,) and how the target stands at step - 1
    """
    dt = 1.0 / site.rate_hz
    predicted, turned = advance(state, dt, params.acceleration_sd_mps2), attitude.after(dt)
    sent = StatePayload(
        number,
        step,
        state.mean[:3],
        state.mean[3:],
        turned.orientation,
        spread(position_cov(predicted), params),
        params.encoding,
    )
    # the cameras draw from the numbers as they arrive, rounded
    heard = StatePayload.decode(sent.encode())
    proposal = propose(heard, params, site)
    asked = participants(site, proposal, heard, params)
    turned = replace(turned, orientation=heard.orientation)
    return Track(state, turned, step, sent, heard, proposal, asked, bad_s, history)


def fuse(params: MultiviewParams, site: Site, track: Track, now: Seconds) -> Fusion:
    """Estimate the step being measured, and predict those that passed meanwhile."""
    dt, acceleration_sd = 1.0 / site.rate_hz, params.acceleration_sd_mps2
    estimate, state, attitude, work = _measured(params, site, track)
    estimates, history = [estimate], track.history.followed_by(track.step, state)
    upcoming = next_step(site, track.step, now)
    for step in range(track.step + 1, min(upcoming, site.steps + 1)):
        state, attitude = advance(state, dt, acceleration_sd), attitude.after(dt)
        history = history.followed_by(step, state)
        estimates.append(_stated(site, track, state, attitude, step, Basis.SKIPPED))
    ripe, history = history.ripe(dt, acceleration_sd)
    if upcoming > site.steps:
        ripe += history.rest(dt, acceleration_sd)
    estimates += revisions(site, track, ripe)
    passed_s = (upcoming - track.step) * dt
    bad_s = 0.0 if _borne_out(params, track) else track.bad_s + passed_s
    return Fusion(tuple(estimates), state, attitude, upcoming, bad_s, history, work)


def next_step(site: Site, step: int, now: Seconds) -> int:
    """Return the first step after `step` whose frame is still to come."""
    return max(step + 1, int(now * site.rate_hz + 1e-6) + 1)


def revisions(site: Site, track: Track, beliefs: tuple[tuple[int, Gaussian], ...]) -> list[TrackEstimate]:
    """Return smoothed beliefs as estimates."""
    return [_stated(site, track, belief, track.attitude, step, Basis.SMOOTHED) for step, belief in beliefs]


def _measured(
    params: MultiviewParams, site: Site, track: Track
) -> tuple[TrackEstimate, Gaussian, Attitude, Work]:
    """Return the estimate of the track's step, and the filter's belief and the attitude after it."""
    dt = 1.0 / site.rate_hz
    predicted = advance(track.state, dt, params.acceleration_sd_mps2)
    if not track.reports:
        basis = Basis.TIMED_OUT if track.asked else Basis.UNASKED
        estimate = _stated(site, track, predicted, track.attitude, track.step, basis)
        return estimate, predicted, track.attitude, Work()
    question = Question(track.heard_state, track.proposal, predicted)
    posterior = variant(params.variant).posterior(params, site, question, track.reports)
    noise = params.measurement_noise
    if isinstance(noise, FixedNoise):
        evidence = Evidence(posterior.position, np.eye(3), noise.sd_m**2 * np.eye(3))
    else:
        prior = posterior.prior
        evidence = without_prior(posterior.mean, posterior.cov, prior.mean, prior.cov, posterior.unresolved)
    state = correct(predicted, evidence)
    attitude = corrected(
        track.attitude, _facings(track.reports), site.cameras, posterior.position, params.orientation, dt
    )
    estimate = TrackEstimate(
        time=track.step / site.rate_hz,
        track=site.targets[track.number].id,
        belief=Belief(posterior.position, state.mean[3:], attitude.orientation),
        cov=posterior.cov,
        basis=Basis.UPDATE,
        asked=len(track.asked),
        heard=len(track.heard),
    )
    return estimate, state, attitude, posterior.work


def _facings(reports: Sequence[Report]) -> dict[NodeId, FloatArray]:
    """Return what each camera said of the orientation; a ray says nothing of it."""
    facings: dict[NodeId, FloatArray] = {}
    for report in reports:
        said = report.said
        if isinstance(said, WeightsPayload):
            facings[report.cameras[0]] = said.facing
        elif isinstance(said, MixturePayload):
            facings.update(zip(report.cameras, said.facings, strict=True))
    return facings


def _stated(
    site: Site, track: Track, state: Gaussian, attitude: Attitude, step: int, basis: Basis
) -> TrackEstimate:
    """Return the filter's belief at a step as an estimate that rests on no weights of its own."""
    return TrackEstimate(
        time=step / site.rate_hz,
        track=site.targets[track.number].id,
        belief=Belief(state.mean[:3], state.mean[3:], attitude.orientation),
        cov=position_cov(state),
        basis=basis,
        asked=len(track.asked) if step == track.step else 0,
        heard=0,
    )


def _borne_out(params: MultiviewParams, track: Track) -> bool:
    """Tell whether an image shows something like the target where the track has it."""
    best = max((report.said.similarity for report in track.reports), default=0.0)
    return params.loss is None or best >= params.loss.similarity_min
