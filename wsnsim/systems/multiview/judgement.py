"""One camera's verdict on the particles of a step: a weight for each, and how good the best one is."""

from dataclasses import dataclass

import numpy as np

from wsnsim.hardware.work import Work
from wsnsim.systems.multiview.log_ratio import log_ratios
from wsnsim.systems.multiview.params import MultiviewParams
from wsnsim.systems.multiview.rules import LogRatioLikelihood, RawLikelihood
from wsnsim.systems.multiview.sight import Sight
from wsnsim.systems.multiview.similarity import compare
from wsnsim.types import BoolArray, FloatArray

_LEAST_RHO = 1e-6


@dataclass(frozen=True, eq=False)
class Judgement:
    """What a camera says of M particles.

    Parameters
    ----------
    weights : (M,) above 0, up to a common factor
    judged : (M,) False where the camera cannot tell: those all have the mean weight of the others
    similarity : of the best particle to the reference model [0–1]; 0 where none can be judged
    work : what it cost
    """

    weights: FloatArray
    judged: BoolArray
    similarity: float
    work: Work


def judge(
    sight: Sight, sqrt_colour: FloatArray, sqrt_texture: FloatArray, params: MultiviewParams
) -> Judgement:
    """Weigh particles by the likelihood that the parameters name.

    Parameters
    ----------
    sight : of the particles
    sqrt_colour, sqrt_texture : (c,), (t,) roots of the reference histograms, from this side
    """
    rule = params.likelihood
    if isinstance(rule, LogRatioLikelihood):
        ratios = log_ratios(sight, sqrt_colour**2, sqrt_texture**2, params.colour_share, rule.clip)
        scores = ratios.scores
        best = compare(sight.only(int(np.argmax(scores))), sqrt_colour, sqrt_texture, params.colour_share)
        weights = np.exp(rule.sharpness * (scores - scores.max()))
        every = np.ones(weights.size, dtype=np.bool_)
        return Judgement(weights, every, float(best.rho[0]), ratios.work + best.work)
    similarity = compare(sight, sqrt_colour, sqrt_texture, params.colour_share)
    rho, judged = similarity.rho, similarity.judged
    if isinstance(rule, RawLikelihood):
        # Identical histograms of nothing have ρ = 0: never a weight of all zeros.
        weights = np.maximum(rho, _LEAST_RHO)
    else:
        weights = np.exp(rule.sharpness * (rho - rho.max()))
    weights = _neutral_where_not(judged, weights)
    return Judgement(weights, judged, float(rho.max(initial=0.0)), similarity.work)


def _neutral_where_not(judged: BoolArray, weights: FloatArray) -> FloatArray:
    """Give particles that the camera cannot judge the mean weight of the others."""
    if not judged.any():
        return np.ones(judged.size)
    return np.asarray(np.where(judged, weights, weights[judged].mean()), dtype=np.float64)
