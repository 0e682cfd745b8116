"""What a set of weighted particles says: moments, and the information that is new in them."""

from dataclasses import dataclass

import numpy as np

from wsnsim.types import FloatArray

_UNINFORMED = 0.5
"""Share of the prior's variance above which a direction counts as unmeasured."""


def normalised(log_weights: FloatArray) -> FloatArray:
    """Return weights (m,) that sum to one from their logarithms (m,), at least one of them finite.

    Raises
    ------
    ValueError : no weight is above zero, or one is not a number
    """
    largest = log_weights.max()
    if not np.isfinite(largest):
        raise ValueError(f"at least one log weight must be finite and none NaN, got a largest of {largest}")
    weights = np.exp(log_weights - largest)
    return np.asarray(weights / weights.sum(), dtype=np.float64)


def mean_and_cov(points: FloatArray, weights: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return mean (d,) and covariance (d, d) of points (m, d) with weights (m,) that sum to one.

    The mean is the MMSE estimate (Kushwaha & Koutsoukos 2013, Eq. 24).
    """
    mean = weights @ points
    centred = points - mean
    return mean, (weights[:, None] * centred).T @ centred


def spacing_variance(prior_cov: FloatArray, particles: int) -> float:
    """Return the smallest variance [m²] that `particles` draws from a normal prior can resolve.

    (1.25 det(Σ)^(1/6) / M^(1/3))² for a 3-D prior: the square of about the
    distance between neighbouring particles near the mean.

    Parameters
    ----------
    prior_cov : (3, 3) Σ [m²]
    particles : M
    """
    scale = float(np.linalg.det(prior_cov)) ** (1.0 / 6.0)
    return float((1.25 * scale / particles ** (1.0 / 3.0)) ** 2)


@dataclass(frozen=True, eq=False)
class Evidence:
    """What the measurements alone say of a position, z = H x + v, where they say anything.

    Parameters
    ----------
    values : (r,) z, r from 0 to d
    matrix : (r, d) H
    cov : (r, r) R
    """

    values: FloatArray
    matrix: FloatArray
    cov: FloatArray


def without_prior(
    mean: FloatArray,
    cov: FloatArray,
    prior_mean: FloatArray,
    prior_cov: FloatArray,
    unresolved: float,
) -> Evidence:
    """Divide a normal prior out of a posterior, so that a filter does not count it twice.

    In coordinates in which the prior is N(0, I) the posterior's principal
    variances c are below one where the measurements said something: there the
    likelihood has variance c / (1 − c) and mean m / (1 − c). A direction with c
    of one or more, within what can be told, says nothing and is left out.

    Parameters
    ----------
    mean, cov : (d,), (d, d) posterior
    prior_mean, prior_cov : (d,), (d, d) the proposal the particles were drawn from
    unresolved : variance added to the evidence in every direction: what the particles cannot resolve

    Raises
    ------
    numpy.linalg.LinAlgError : `prior_cov` is not positive definite
    """
    root = np.linalg.cholesky(prior_cov)
    inverse_root = np.linalg.inv(root)
    variances, axes = np.linalg.eigh(inverse_root @ cov @ inverse_root.T)
    shift = axes.T @ (inverse_root @ (mean - prior_mean))
    informed = variances < _UNINFORMED
    remaining = 1.0 - variances[informed]
    back = axes.T[informed] @ inverse_root
    lengths = 1.0 / np.linalg.norm(back, axis=1)
    directions = back * lengths[:, None]
    values = directions @ prior_mean + lengths * shift[informed] / remaining
    spread = lengths[:, None] * np.diag(variances[informed] / remaining) * lengths[None, :]
    return Evidence(values, directions, spread + unresolved * np.eye(values.size))
