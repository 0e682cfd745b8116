"""T0, the base tracker: every camera sends one weight a particle (Kushwaha & Koutsoukos 2013, Sec. 4.2.1).

All nodes draw the same particles in space; the base station multiplies the cameras'
weights. A thousand weights a camera and step cost more than a mote's radio carries.

The covariance of an update is that of the weighted particles. A sharpened
Bhattacharyya coefficient is no calibrated likelihood: in setup A the covariance is
three to four times too wide.
"""

from collections.abc import Sequence

import numpy as np

from wsnsim.estimation.kalman import Gaussian
from wsnsim.estimation.particles import mean_and_cov, normalised, spacing_variance
from wsnsim.hardware.work import Work
from wsnsim.messages.state import StatePayload
from wsnsim.messages.weights import WeightsPayload
from wsnsim.systems.base import Site
from wsnsim.systems.multiview.estimators import position_estimate
from wsnsim.systems.multiview.eye import Eye, shares
from wsnsim.systems.multiview.filtering import position_cov
from wsnsim.systems.multiview.params import MultiviewParams
from wsnsim.systems.multiview.proposal import Proposal
from wsnsim.systems.multiview.variants import Posterior, Question, Report, Variant
from wsnsim.types import FloatArray
from wsnsim.vision.frame import Frame

_LEAST_WEIGHT = 1e-12
_FUSE_FLOATS = 25.0  # one particle and camera: logarithm and sum; its part of mean and covariance


class T0Camera:
    """Gives every particle a weight, and says from where the target is seen."""

    def __init__(self, eye: Eye) -> None:
        self._eye = eye

    def answer(self, frame: Frame, state: StatePayload, proposal: Proposal) -> tuple[WeightsPayload, Work]:
        """Return the weights of the step's particles (Algorithm 1, lines 5 to 10)."""
        judgement = self._eye.weigh(frame, state, proposal)
        place = shares(judgement.weights) @ proposal.particles
        said, cost = self._eye.facing(frame, state, place)
        payload = WeightsPayload(
            state.target,
            state.step,
            judgement.weights,
            judgement.similarity,
            said,
            self._eye.params.encoding,
        )
        return payload, judgement.work + cost


def posterior(
    params: MultiviewParams, site: Site, question: Question, reports: Sequence[Report]
) -> Posterior:
    """Multiply the cameras' weights (Algorithm 1, lines 12 and 13)."""
    proposal, predicted = question.proposal, question.predicted
    # a weight of zero from one camera is not proof: it must not rule a particle out for all
    logs = [np.log(np.maximum(_weights(report).relative(), _LEAST_WEIGHT)) for report in reports]
    weights: FloatArray = normalised(np.sum(logs, axis=0))
    mean, cov = mean_and_cov(proposal.particles, weights)
    position = position_estimate(
        params.estimator, proposal.particles, weights, predicted.mean[:3], position_cov(predicted)
    )
    work = Work(float_ops=params.particles * (len(reports) + 1) * _FUSE_FLOATS)
    unresolved = spacing_variance(proposal.cov, params.particles)
    prior = Gaussian(proposal.mean, proposal.cov)
    return Posterior(position, mean, cov, prior, unresolved, work)


def _weights(report: Report) -> WeightsPayload:
    assert isinstance(report.said, WeightsPayload)
    return report.said


VARIANT = Variant(WeightsPayload, T0Camera, posterior)
