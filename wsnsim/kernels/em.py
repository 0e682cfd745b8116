"""Expectation–maximisation for Gaussian mixtures, on the expected monomials of normal densities.

Points are small normal densities N(m, C), of which both steps need the expected monomials
alone (`monomials`); a bare point is one with C = 0. What grows is
Σ wᵢ log Σⱼ πⱼ exp E[log N(x; μⱼ, Σⱼ)] with x ~ N(mᵢ, Cᵢ), a bound from below of the mixture's mean
log-density under Σ wᵢ N(mᵢ, Cᵢ) (Vasconcelos & Lippman 1998).
"""

import numpy as np

from wsnsim.kernels.jit import frozen, kernel
from wsnsim.kernels.monomials import describe, dimension, expand
from wsnsim.types import FloatArray


def maximise(
    features: FloatArray, weights: FloatArray, start: FloatArray, most_steps: int, tolerance: float
) -> tuple[FloatArray, FloatArray, FloatArray, int]:
    """Fit a mixture by EM, starting from an M-step.

    Parameters
    ----------
    features : (m, f) - expected monomials 1, xₐ, xₐ x_b (a ≤ b, row by row), f = 1 + d + d (d + 1) / 2, in
        coordinates in which the whole has about mean 0 and variance 1
    weights : (m,) - not negative, sum 1
    start : (m, k) - how much of each weight belongs to each component at first; a row's sum is its weight
    most_steps : iterations at most
    tolerance : gain of the bound in an iteration [nat] up to which to stop

    Returns
    -------
    shares : (k,) - weights of the components; 0: given up, the other figures for it mean nothing
    means : (k, d)
    covs : (k, d, d)
    steps : iterations taken
    """
    return _maximise(
        frozen(features, np.float64),
        frozen(weights, np.float64),
        frozen(start, np.float64),
        most_steps,
        tolerance,
    )


@kernel
def _maximise(
    features: FloatArray, weights: FloatArray, start: FloatArray, most_steps: int, tolerance: float
) -> tuple[FloatArray, FloatArray, FloatArray, int]:
    size, order = features.shape[1], start.shape[1]
    d = dimension(size)
    shares, means, covs = np.zeros(order), np.zeros((order, d)), np.zeros((order, d, d))
    parts, moments, coefficients = start.copy(), np.zeros((order, size)), np.zeros((order, size))
    bound, steps = -np.inf, 0
    while True:
        np.dot(parts.T, features, moments)
        for j in range(order):
            describe(moments[j], means[j], covs[j])
            shares[j] = expand(moments[j, 0], means[j], covs[j], coefficients[j])
        if steps == most_steps:
            break
        before, bound = bound, _expect(features, weights, coefficients, parts)
        if bound - before <= tolerance:
            break
        steps += 1
    return shares, means, covs, steps


def mean_log_density(
    features: FloatArray, weights: FloatArray, shares: FloatArray, means: FloatArray, covs: FloatArray
) -> float:
    """Return the mean log-density of a mixture over points [nat].

    Parameters
    ----------
    features : (m, f) - monomials of the points, as in `maximise`
    weights : (m,) - not negative, sum 1
    shares, means, covs : (k,), (k, d), (k, d, d) - as from `maximise`
    """
    return _mean_log_density(
        *(frozen(array, np.float64) for array in (features, weights, shares, means, covs))
    )


@kernel
def _mean_log_density(
    features: FloatArray, weights: FloatArray, shares: FloatArray, means: FloatArray, covs: FloatArray
) -> float:
    coefficients = np.zeros((len(shares), features.shape[1]))
    for j in range(len(shares)):
        expand(shares[j], means[j], covs[j], coefficients[j])
    return _expect(features, weights, coefficients, np.empty((len(features), len(shares))))


@kernel
def _expect(features: FloatArray, weights: FloatArray, coefficients: FloatArray, parts: FloatArray) -> float:
    """Share the weights of points among components, into parts (m, k); return the mean log-density."""
    count, order = parts.shape
    np.dot(features, coefficients.T, parts)
    bound = 0.0
    for i in range(count):
        largest = -np.inf
        for j in range(order):
            largest = max(largest, parts[i, j])
        total = 0.0
        for j in range(order):
            parts[i, j] = np.exp(parts[i, j] - largest)
            total += parts[i, j]
        bound += weights[i] * (largest + np.log(total))
        scale = weights[i] / total
        for j in range(order):
            parts[i, j] *= scale
    return bound
