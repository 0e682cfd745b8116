"""A position from weighted particles (Kushwaha & Koutsoukos 2013, Eqs. 24–26)."""

from typing import Literal

import numpy as np

from wsnsim.types import FloatArray


def position_estimate(
    kind: Literal["mmse", "mle", "map"],
    particles: FloatArray,
    weights: FloatArray,
    prior_mean: FloatArray,
    prior_cov: FloatArray,
) -> FloatArray:
    """Return the estimate (3,) [m].

    Parameters
    ----------
    kind : mmse, the weighted mean (Eq. 24); mle, the particle of largest weight (Eq. 25); map, that of
        largest weight times prior density (Eq. 26)
    particles : (m, 3) [m]
    weights : (m,) sum to one
    prior_mean, prior_cov : (3,) [m], (3, 3) [m²] of the filter's prediction, for map

    Raises
    ------
    numpy.linalg.LinAlgError : `prior_cov` is singular
    """
    if kind == "mmse":
        return np.asarray(weights @ particles, dtype=np.float64)
    scores = np.log(np.maximum(weights, np.finfo(np.float64).tiny))
    if kind == "map":
        offsets = particles - prior_mean
        scores -= 0.5 * np.einsum("ij,ij->i", offsets, np.linalg.solve(prior_cov, offsets.T).T)
    return np.asarray(particles[int(np.argmax(scores))], dtype=np.float64)
