"""How far two mixtures are apart."""

from functools import lru_cache

import numpy as np

from wsnsim.estimation.mixtures import GaussianMixture
from wsnsim.types import FloatArray

SAMPLE = 4096
"""Points of the fixed sample of `kl_divergence`."""


def integrated_squared_difference(first: GaussianMixture, second: GaussianMixture) -> float:
    """Return ∫ (f − g)² of two densities as they are, masses included.

    Raises
    ------
    OverflowError : the densities are too large for a number; normalise them first

    References
    ----------
    Williams, Maybeck (2003), Cost-function-based Gaussian mixture reduction.
    """
    parts = (_log_overlap(first, first), _log_overlap(first, second), _log_overlap(second, second))
    largest = max(parts)
    if largest > np.log(np.finfo(float).max):
        raise OverflowError(f"densities: must have a squared integral below 1e308, got e^{largest:.0f}")
    own, cross, other = np.exp(np.array(parts) - largest)
    return float(np.exp(largest) * max(own - 2.0 * cross + other, 0.0))


def kl_divergence(truth: GaussianMixture, model: GaussianMixture, count: int = SAMPLE) -> float:
    """Return KL(truth ‖ model) [nat] of two densities, each taken as of mass 1, by a fixed sample.

    The sample is the same in every call (`fixed_sample`): nothing is drawn, and differences
    between models are as smooth as the models. It can come out below 0 by the error of the sample.

    Parameters
    ----------
    count : points of the sample, at least; each component of `truth` has one at least
    """
    points, weights = fixed_sample(truth, count)
    logs = truth.log_density(points) - model.log_density(points)
    return float(weights @ logs) - truth.log_mass + model.log_mass


def fixed_sample(mixture: GaussianMixture, count: int) -> tuple[FloatArray, FloatArray]:
    """Return evenly spread points (n, d) of a mixture and their weights (n,), which sum to one.

    A component has as many points as its share of `count` demands, rounded up, of
    `normal_points`.
    """
    shares = mixture.weights
    numbers = np.maximum(np.ceil(count * shares), 1.0).astype(int)
    normal = normal_points(int(numbers.max()), mixture.dimension)
    points = [
        mean + normal[:number] @ root.T
        for number, mean, root in zip(numbers, mixture.means, mixture.roots, strict=True)
    ]
    return np.concatenate(points), np.repeat(shares / numbers, numbers)


@lru_cache(maxsize=8)
def normal_points(count: int, dimension: int) -> FloatArray:
    """Return points (n, d) that fill N(0, I) more evenly than draws would, read-only.

    A Kronecker sequence with the powers of the generalised golden ratio as steps, turned
    normal by Box and Muller's transformation.

    References
    ----------
    Niederreiter (1992), Random number generation and quasi-Monte Carlo methods; Box, Muller (1958).
    """
    columns = 2 * ((dimension + 1) // 2)
    ratio = 2.0
    for _ in range(64):  # the fixed point of x = (1 + x)^(1 / (D + 1))
        ratio = (1.0 + ratio) ** (1.0 / (columns + 1))
    steps = ratio ** -np.arange(1.0, columns + 1.0)
    uniform = (0.5 + np.outer(np.arange(1.0, count + 1.0), steps)) % 1.0
    radii = np.sqrt(-2.0 * np.log1p(-uniform[:, 0::2]))
    angles = 2.0 * np.pi * uniform[:, 1::2]
    normal = np.concatenate([radii * np.cos(angles), radii * np.sin(angles)], axis=1)[:, :dimension]
    normal.flags.writeable = False
    return np.asarray(normal, dtype=np.float64)


def _log_overlap(first: GaussianMixture, second: GaussianMixture) -> float:
    """Return log ∫ f g."""
    size = first.dimension
    apart = second.means[None] - first.means[:, None]
    roots = np.linalg.cholesky(first.covs[:, None] + second.covs[None])
    whitened = np.linalg.solve(roots, apart[..., None])[..., 0]
    logs = (
        first.log_weights[:, None]
        + second.log_weights[None]
        - 0.5 * size * np.log(2.0 * np.pi)
        - np.log(np.diagonal(roots, axis1=2, axis2=3)).sum(axis=2)
        - 0.5 * (whitened**2).sum(axis=2)
    )
    return float(np.logaddexp.reduce(logs, axis=None))
