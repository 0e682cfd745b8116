"""Kernel densities of weighted particles: what a mixture is fitted to.

Each particle stands for a normal density round it, so that the sum is smooth and says how
far the particles can be trusted between themselves.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from wsnsim.estimation.mixtures import GaussianMixture
from wsnsim.estimation.particles import mean_and_cov
from wsnsim.types import FloatArray

Bandwidth = Literal["silverman", "scott"]
"""How wide the kernels are for particles of covariance Σ in d dimensions, n of them effective: h² Σ with

- silverman: h = (n (d + 2) / 4)^(−1 / (d + 4)), best for a normal density (Silverman 1986, sec. 4.3);
- scott: h = n^(−1 / (d + 4)) (Scott 1992, sec. 6.5).
"""

NEGLIGIBLE = 1e-3
"""Share of the weight that the lightest particles may have together to be left out."""

_FLATTEST = 1e-6
"""Share of the largest variance of a cloud of particles below which another counts as this share."""


@dataclass(frozen=True, eq=False)
class KernelDensity:
    """Σ weights[i] N(x; points[i], covs[i]).

    Parameters
    ----------
    points : (m, d)
    weights : (m,) not negative, sum 1
    covs : (m, d, d), or (1, d, d) for one kernel that all points share; symmetric positive definite
    """

    points: FloatArray
    weights: FloatArray
    covs: FloatArray

    def mean_and_cov(self) -> tuple[FloatArray, FloatArray]:
        """Return mean (d,) and covariance (d, d) of the whole."""
        mean, cov = mean_and_cov(self.points, self.weights)
        if len(self.covs) == 1:
            return mean, cov + self.covs[0]
        return mean, cov + np.einsum("i,ijk->jk", self.weights, self.covs)

    def without_negligible(self, share: float = NEGLIGIBLE) -> "KernelDensity":
        """Leave out the lightest points, as many as have at most `share` of the weight together."""
        lightest_first = np.argsort(self.weights, kind="stable")
        kept = np.sort(lightest_first[np.cumsum(self.weights[lightest_first]) > share])
        weights = self.weights[kept] / self.weights[kept].sum()
        covs = self.covs if len(self.covs) == 1 else self.covs[kept]
        return KernelDensity(self.points[kept], weights, covs)

    def as_mixture(self) -> GaussianMixture:
        """Return the same density as a mixture, one component for each point with a weight above 0."""
        kept = np.flatnonzero(self.weights > 0.0)
        covs = np.broadcast_to(self.covs, (self.weights.size, *self.covs.shape[1:]))[kept]
        return GaussianMixture(np.log(self.weights[kept]), self.points[kept], covs)


def effective_number(weights: FloatArray) -> float:
    """Return 1 / Σ wᵢ²: how many equal particles weights (m,) of sum 1 are worth.

    References
    ----------
    Kong, Liu, Wong (1994), Sequential imputations and Bayesian missing data problems.
    """
    return float(1.0 / (weights @ weights))


def kernel_density(points: FloatArray, weights: FloatArray, rule: Bandwidth = "silverman") -> KernelDensity:
    """Return the weighted kernel density of particles.

    The kernel is as wide as `rule` says for the particles' weighted covariance, but in no
    direction narrower than half the distance between neighbouring particles near their
    unweighted mean, √(2π) |C|^(1/2d) / m^(1/d) for a normal cloud of covariance C: where one
    particle has all the weight, the others tell how little is known beyond it.

    Parameters
    ----------
    points : (m, d)
    weights : (m,) not negative, of any sum above 0

    Raises
    ------
    ValueError : shapes that do not fit, numbers that are not finite, a negative weight, or a sum of 0

    References
    ----------
    Kushwaha, Koutsoukos (2013), eq. 27, which leaves out the weights: without them it says nothing of
    the image.
    """
    if points.ndim != 2 or weights.shape != points.shape[:1]:
        raise ValueError(
            f"particles: points must be (m, d) and weights (m,), got {points.shape} and {weights.shape}"
        )
    total = float(weights.sum())
    if not (np.isfinite(points).all() and np.isfinite(total) and total > 0.0 and weights.min() >= 0.0):
        raise ValueError(
            "particles: points and weights must be finite, no weight below 0 and their sum above 0, "
            f"got a sum of {total}"
        )
    shares = weights / total
    count, size = points.shape
    _, cov = mean_and_cov(points, shares)
    effective = effective_number(shares)
    factor = (0.25 * effective * (size + 2) if rule == "silverman" else effective) ** (-1.0 / (size + 4))
    spread, back = _spread(points)
    variances, axes = np.linalg.eigh(back @ (factor**2 * cov) @ back.T)
    sides = spread @ axes
    narrowest = 0.5 * np.pi * count ** (-2.0 / size)  # (√(2π) / 2)² m^(−2/d): there the cloud has |C| = 1
    kernel = (sides * np.maximum(variances, narrowest)) @ sides.T
    return KernelDensity(points, shares, 0.5 * (kernel + kernel.T)[None])


def _spread(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return a root (d, d) of the covariance of points that count alike, and its inverse."""
    _, cov = mean_and_cov(points, np.full(len(points), 1.0 / len(points)))
    variances, axes = np.linalg.eigh(cov)
    rounding = (np.finfo(float).eps * max(float(np.abs(points).max()), 1.0)) ** 2
    deviations = np.sqrt(np.maximum(variances, max(_FLATTEST * float(variances[-1]), rounding / _FLATTEST)))
    return axes * deviations, (axes / deviations).T
