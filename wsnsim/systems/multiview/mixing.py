"""Mixtures as the trackers use them: fitted to particles, fused, and read at the base station.

All in coordinates in which the step's prediction is N(0, I) (`whitening`).
"""

from collections.abc import Sequence
from functools import reduce as accumulate

import numpy as np

from wsnsim.estimation.kalman import Gaussian
from wsnsim.estimation.mixtures import GaussianMixture
from wsnsim.estimation.modes import highest_mode
from wsnsim.estimation.order import fit_mixture
from wsnsim.estimation.products import INTERMEDIATE_ORDER, fuse_reduced, product
from wsnsim.estimation.reduction import reduce
from wsnsim.hardware.work import Work
from wsnsim.messages.mixture import MixturePayload, mixture_bytes
from wsnsim.messages.state import StatePayload
from wsnsim.systems.multiview.eye import Eye
from wsnsim.systems.multiview.judgement import Judgement
from wsnsim.systems.multiview.params import MultiviewParams
from wsnsim.systems.multiview.proposal import Proposal
from wsnsim.systems.multiview.variants import Posterior, Report
from wsnsim.systems.multiview.whitening import Whitening
from wsnsim.types import FloatArray

# Operations of the mote's own fixed-point implementation, counted from the inner loops.
_EM_OPS = 50.0  # one particle, component and iteration: distance, exponential, its part of the moments
_EM_ITERATIONS = 15.0
_KL_OPS = 40.0  # one point of the sample and component
_PAIR_FLOATS = 300.0  # two components multiplied: a sum of covariances, its inverse, mean and weight
_MERGE_FLOATS = 80.0  # two components compared: the determinant of what they would become
_NEGLIGIBLE = 1e-6

_FARTHEST, _NARROWEST = 100.0, 1e-9
"""Standard deviations of the prediction, and parts of its variance."""


def plausible(mixture: GaussianMixture) -> bool:
    """Tell whether particles drawn from the prediction can make a mixture: a damaged message is not one."""
    near = bool(np.abs(mixture.means).max() < _FARTHEST)
    return near and bool((np.linalg.eigvalsh(mixture.covs) > _NARROWEST).all())


def standard(dimension: int) -> Gaussian:
    """Return N(0, I), the prediction in its own coordinates."""
    return Gaussian(np.zeros(dimension), np.eye(dimension))


def largest_order(params: MultiviewParams, dimension: int, cameras: Sequence[int], facing: int) -> int:
    """Return how many components a message may have: K, or fewer where they do not fit, but one at least.

    Parameters
    ----------
    cameras : numbers of those in the message
    facing : how many numbers each says of the orientation
    """
    rules = params.mixtures
    if rules.message_bytes is None:
        return rules.components
    fitting = [
        order
        for order in range(1, rules.components + 1)
        if mixture_bytes(order, dimension, cameras, facing, params.encoding) <= rules.message_bytes
    ]
    return max(fitting, default=1)


def fitted(
    eye: Eye, state: StatePayload, points: FloatArray, judgement: Judgement, facing: int
) -> tuple[GaussianMixture, Work]:
    """Approximate what a camera's particles say by a mixture that fits into a message.

    The kernel density of the weighted points (m, d), and its mixture. Where the camera
    cannot judge some of them, because its image ends, it says nothing about there: the
    prediction itself, a component of its own, stands for that, and what is fitted is
    by how much the particles that it can judge are better. A normal density fitted to
    particles beyond the image's border would reach into the image. Not for densities in
    the image itself, of which T4's base station seeks the tops: that lowers them. Nor in
    the printed form, where the prediction stays in once a camera.
    """
    rules, dimension = eye.params.mixtures, points.shape[1]
    order = largest_order(eye.params, dimension, (eye.number,), facing)
    rng = eye.site.streams.stream("mixture", state.target, state.step, eye.number)
    weights, judged = judgement.weights, judgement.judged
    printed = rules.prior == "every_camera"
    whole = printed or dimension == 2 or order == 1 or bool(judged.all())
    if not whole:
        neutral = float(weights[~judged][0])
        weights = np.where(judged, np.maximum(weights - neutral, 0.0), 0.0)
        if not weights.any():
            return GaussianMixture.single(np.zeros(dimension), np.eye(dimension)), Work()
        order -= 1
    mixture = fit_mixture(points, weights, order, rules.order, rng, smoothing=rules.smoothing)
    if not whole:
        told = float(weights.mean())
        shares = np.log(np.array([neutral, told]) / (neutral + told))
        mixture = GaussianMixture(
            np.append(shares[0], shares[1] + mixture.log_weights),
            np.vstack([np.zeros(dimension), mixture.means]),
            np.concatenate([np.eye(dimension)[None], mixture.covs]),
        )
    counted = float(np.count_nonzero(weights > _NEGLIGIBLE * weights.max()))
    components = order * (order + 1) / 2.0
    work = Work(int_ops=counted * components * (_EM_OPS * _EM_ITERATIONS + 2.0 * dimension * _KL_OPS))
    return mixture, work


def fused(
    mixtures: Sequence[GaussianMixture], params: MultiviewParams, order: int, rng: np.random.Generator
) -> tuple[GaussianMixture, Work]:
    """Multiply mixtures that each contain the prediction, and reduce the product to `order` components."""
    rules = params.mixtures
    if rules.prior == "once":
        density = fuse_reduced(mixtures, standard(mixtures[0].dimension), order, rules.reduction, rng)
    else:
        # as printed: the prediction counts once a camera
        density = accumulate(
            lambda first, second: reduce(product(first, second), order, rules.reduction, rng), mixtures
        )
    work, held = Work(), mixtures[0].order
    for mixture in mixtures[1:]:
        work += joining_work(held, mixture.order)
        held = min(held * mixture.order, order)
    return density, work


def joining_work(first: int, second: int) -> Work:
    """Return the work of multiplying two mixtures of so many components, and of reducing the product."""
    pairs = first * second
    return Work(float_ops=pairs * (_PAIR_FLOATS + _MERGE_FLOATS * pairs))


def at_base(
    reports: Sequence[Report],
    params: MultiviewParams,
    proposal: Proposal,
    unresolved: float,
    rng: np.random.Generator,
) -> Posterior:
    """Multiply what came to the base station, and take the mean or a mode (Eqs. 29 and 30).

    Parameters
    ----------
    unresolved : variance that particles so far apart cannot tell [m²]
    """
    mixtures = [report.said.mixture for report in reports if isinstance(report.said, MixturePayload)]
    order = max(INTERMEDIATE_ORDER, params.mixtures.components)
    density, work = fused(mixtures, params, order, rng)
    frame = Whitening.of(proposal.mean, proposal.cov)
    mean, cov = density.mean_and_cov()
    if params.estimator == "mmse":
        place = mean
    elif params.estimator == "map":
        place = highest_mode(density).point
    else:
        place = _likeliest(density)
    return Posterior(
        position=proposal.mean + frame.root @ place,
        mean=proposal.mean + frame.root @ mean,
        cov=frame.root @ cov @ frame.root.T,
        prior=Gaussian(proposal.mean, proposal.cov),
        unresolved=unresolved,
        work=work,
    )


def _likeliest(density: GaussianMixture) -> FloatArray:
    """Return the mean of a component where density over prediction is largest: the quotient has no mode."""
    ratios = density.log_density(density.means) + 0.5 * (density.means**2).sum(axis=1)
    return np.asarray(density.means[int(np.argmax(ratios))], dtype=np.float64)
