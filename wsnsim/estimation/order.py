"""How many components a mixture needs to stand for a kernel density."""

from dataclasses import replace
from typing import Literal

import numpy as np

from wsnsim.estimation.density import Bandwidth, KernelDensity, kernel_density
from wsnsim.estimation.em import Standardised, fit, monomials
from wsnsim.estimation.mixtures import GaussianMixture
from wsnsim.kernels.em import mean_log_density
from wsnsim.types import FloatArray

OrderRule = Literal["tolerance", "argmin"]
"""Which of the orders 1 to the largest is taken, by KL(kernel density ‖ mixture):

- tolerance: the smallest whose KL is within a tolerance of the least;
- argmin: the one with the least KL (Kushwaha & Koutsoukos 2013, eq. 28), nearly always the largest.
"""

TOLERANCE = 0.02
"""What further components must be worth together [nat]: about the error of a KL estimated from particles."""

_MOST_POINTS = 2048
"""Points of the quadrature above which a kernel has two of them, in place of two in each direction."""


def fit_mixture(
    points: FloatArray,
    weights: FloatArray,
    largest_order: int,
    rule: OrderRule,
    rng: np.random.Generator,
    *,
    tolerance: float = TOLERANCE,
    bandwidth: Bandwidth = "silverman",
    smoothing: float = 1.0,
) -> GaussianMixture:
    """Return a mixture of mass 1 that stands for weighted particles.

    Parameters
    ----------
    points : (m, d)
    weights : (m,) not negative, of any sum above 0
    largest_order : components at most; fewer where the particles do not need them, or cannot tell them
    rng : for the starts of EM; nothing is drawn where `largest_order` is 1
    tolerance : of `rule` [nat]
    bandwidth : how wide the particles' kernels are
    smoothing : share of the kernel's covariance that stays in the components' in the end, above 0. 1: the
        mixture stands for the kernel density, which is wider than the particles are; a small share: the
        kernel smooths the fit, and the mixture stands for the particles

    Raises
    ------
    ValueError : particles of which no density can be made, an order below 1, or a share outside (0, 1]
    """
    if not 0.0 < smoothing <= 1.0:
        raise ValueError(f"mixture: smoothing must be above 0 and at most 1, got {smoothing}")
    density = kernel_density(points, weights, bandwidth)
    mixture = fit_density(density, largest_order, rule, rng, tolerance=tolerance)
    if smoothing == 1.0:
        return mixture
    # each component's covariance is that of its particles, and the kernel's: the rest is never negative
    return replace(mixture, covs=mixture.covs - (1.0 - smoothing) * density.covs)


def fit_density(
    density: KernelDensity,
    largest_order: int,
    rule: OrderRule,
    rng: np.random.Generator,
    *,
    tolerance: float = TOLERANCE,
) -> GaussianMixture:
    """Return a mixture of mass 1 that stands for a kernel density, its kernels alike or each its own.

    Parameters
    ----------
    largest_order, rule, rng, tolerance : as in `fit_mixture`

    Raises
    ------
    ValueError : an order below 1
    """
    if largest_order < 1:
        raise ValueError(f"mixture: largest order must be at least 1, got {largest_order}")
    standardised = Standardised.of(density.without_negligible())
    fits = [fit(standardised, order, rng) for order in range(1, largest_order + 1)]
    chosen = 0
    if len(fits) > 1:
        points, weights = quadrature(standardised.density)
        features = monomials(points)
        # KL(kernel density ‖ mixture) = a constant − the mixture's mean log-density under the kernel density
        gains = np.array(
            [
                mean_log_density(features, weights, mixture.weights, mixture.means, mixture.covs)
                for mixture in fits
            ]
        )
        allowed = gains.max() - (tolerance if rule == "tolerance" else 0.0)
        chosen = int(np.argmax(gains >= allowed))
    return fits[chosen].moved(standardised.root, standardised.origin)


def quadrature(density: KernelDensity) -> tuple[FloatArray, FloatArray]:
    """Return points (n, d) and weights (n,) of sum 1 whose mean of a function is nearly the density's.

    Each kernel is replaced by pairs of points at ±√d standard deviations along the columns of
    its Cholesky factor: one pair a column, which is exact for cubic functions; of many kernels
    a pair along one column each, in turn.
    """
    points, weights = density.points, density.weights
    count, size = points.shape
    steps = np.sqrt(size) * np.linalg.cholesky(density.covs).transpose(0, 2, 1)
    if 2 * size * count > _MOST_POINTS:
        kernels, columns = np.arange(count) % len(steps), np.arange(count) % size
        offsets = steps[kernels, columns][:, None]
    else:
        offsets = np.broadcast_to(steps, (count, size, size))
    both = np.concatenate([points[:, None] + offsets, points[:, None] - offsets], axis=1)
    each = both.shape[1]
    return both.reshape(-1, size), np.repeat(weights / each, each)
