"""Products and quotients of normal densities, one component of a mixture after the other."""

import numpy as np

from wsnsim.kernels.cholesky import factorise, invert, solve
from wsnsim.kernels.jit import frozen, kernel
from wsnsim.types import FloatArray


def multiply(
    log_weights: FloatArray,
    means: FloatArray,
    covs: FloatArray,
    other_log_weights: FloatArray,
    other_means: FloatArray,
    other_covs: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Multiply each component N(μ, V) of one mixture with each N(λ, W) of another.

    All in differences: with L Lᵀ = V + W, A = L⁻¹ V, B = L⁻¹ W and δ = L⁻¹ (λ − μ) the product has
    covariance AᵀB, mean μ + Aᵀδ and log-mass −½ δᵀδ − log|L| − ½ d log 2π.

    Parameters
    ----------
    log_weights, means, covs : (k,), (k, d), (k, d, d) - covariances positive definite
    other_log_weights, other_means, other_covs : (l,), (l, d), (l, d, d)

    Returns
    -------
    (k l,), (k l, d), (k l, d, d) - the first mixture's components one after the other
    """
    return _multiply(
        frozen(log_weights, np.float64),
        frozen(means, np.float64),
        frozen(covs, np.float64),
        frozen(other_log_weights, np.float64),
        frozen(other_means, np.float64),
        frozen(other_covs, np.float64),
    )


@kernel
def _multiply(
    log_weights: FloatArray,
    means: FloatArray,
    covs: FloatArray,
    other_log_weights: FloatArray,
    other_means: FloatArray,
    other_covs: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    (count, d), others = means.shape, len(other_means)
    logs, centres = np.zeros(count * others), np.zeros((count * others, d))
    spreads = np.zeros((count * others, d, d))
    root, back = np.zeros((d, d)), np.zeros((d, d))
    own, other, apart = np.zeros((d, d)), np.zeros((d, d)), np.zeros(d)
    for n in range(count * others):
        i, j = n // others, n % others
        root[:] = covs[i] + other_covs[j]
        log_determinant = factorise(root, root, 0.0)
        invert(root, back)
        square = 0.0
        for a in range(d):
            apart[a] = 0.0
            for b in range(d):
                own[a, b] = 0.0
                other[a, b] = 0.0
            for c in range(a + 1):
                apart[a] += back[a, c] * (other_means[j, c] - means[i, c])
                for b in range(d):
                    own[a, b] += back[a, c] * covs[i, c, b]
                    other[a, b] += back[a, c] * other_covs[j, c, b]
            square += apart[a] * apart[a]
        for a in range(d):
            centres[n, a] = means[i, a]
            for c in range(d):
                centres[n, a] += own[c, a] * apart[c]
                for b in range(d):
                    # own and other are interchangeable here: the mean of both is symmetric to the last bit
                    spreads[n, a, b] += 0.5 * (own[c, a] * other[c, b] + other[c, a] * own[c, b])
        constant = square + log_determinant + d * np.log(2.0 * np.pi)
        logs[n] = log_weights[i] + other_log_weights[j] - 0.5 * constant
    return logs, centres, spreads


def divide(
    log_weights: FloatArray, means: FloatArray, covs: FloatArray, times: float
) -> tuple[FloatArray, FloatArray, FloatArray, int]:
    """Divide each component N(μ, V) of a mixture by N(0, I)^times.

    The quotient's covariance is Σ = (V⁻¹ − times I)⁻¹, its mean μ + δ with δ = times Σ μ; its mass is its
    largest value, that at the mean, times √|2πΣ|.

    Parameters
    ----------
    log_weights, means, covs : (k,), (k, d), (k, d, d) - covariances positive definite
    times : above 0

    Returns
    -------
    log_weights, means, covs : (k,), (k, d), (k, d, d)
    unsound : number of the first component whose quotient is no normal density, or -1
    """
    return _divide(
        frozen(log_weights, np.float64), frozen(means, np.float64), frozen(covs, np.float64), times
    )


@kernel
def _divide(
    log_weights: FloatArray, means: FloatArray, covs: FloatArray, times: float
) -> tuple[FloatArray, FloatArray, FloatArray, int]:
    count, d = means.shape
    logs, centres, spreads = log_weights.copy(), means.copy(), np.zeros((count, d, d))
    root, back, inverse, shift = np.zeros((d, d)), np.zeros((d, d)), np.zeros((d, d)), np.zeros(d)
    for i in range(count):
        before = factorise(covs[i], root, 0.0)
        invert(root, back)
        _square(back, inverse)
        for a in range(d):
            inverse[a, a] -= times
        information = factorise(inverse, inverse, 0.0)
        if information == -np.inf:
            return logs, centres, spreads, i
        shift[:] = times * means[i]
        solve(inverse, shift)
        invert(inverse, back)
        _square(back, spreads[i])
        centres[i] += shift
        apart, height = 0.0, 0.0
        for a in range(d):
            for b in range(a):
                shift[a] -= root[a, b] * shift[b]
            shift[a] /= root[a, a]
            apart += shift[a] * shift[a]
            height += centres[i, a] * centres[i, a]
        logs[i] += 0.5 * (times * (height + d * np.log(2.0 * np.pi)) - apart - information - before)
    return logs, centres, spreads, -1


@kernel
def _square(back: FloatArray, square: FloatArray) -> None:
    """Write BᵀB (d, d), B the lower triangle of `back`."""
    d = len(back)
    for a in range(d):
        for b in range(a, d):
            square[a, b] = 0.0
            for c in range(b, d):
                square[a, b] += back[c, a] * back[c, b]
            square[b, a] = square[a, b]
