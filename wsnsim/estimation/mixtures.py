"""Gaussian mixtures: sums of weighted normal densities, their weights kept as logarithms.

A mixture need not integrate to one. The logarithm of what it does integrate to, its
log-mass, says after a product how far the factors agree: two cameras whose densities
lie far apart have a mass of e⁻⁴⁰⁰, which as a plain number would be nothing.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from wsnsim.types import FloatArray

_LOG_2_PI = float(np.log(2.0 * np.pi))


@dataclass(frozen=True, eq=False)
class GaussianMixture:
    """Σ exp(log_weights[i]) N(x; means[i], covs[i]).

    Parameters
    ----------
    log_weights : (k,) finite, k at least 1
    means : (k, d)
    covs : (k, d, d) symmetric positive definite

    Raises
    ------
    ValueError : no component, shapes that do not fit, numbers that are not finite, or a covariance that is
        not positive definite
    """

    log_weights: FloatArray
    means: FloatArray
    covs: FloatArray

    def __post_init__(self) -> None:
        count, *rest = self.means.shape
        if count < 1 or len(rest) != 1:
            raise ValueError(f"mixture: means must be (k, d) with k at least 1, got {self.means.shape}")
        (size,) = rest
        if self.log_weights.shape != (count,) or self.covs.shape != (count, size, size):
            raise ValueError(
                f"mixture: {count} means of {size} numbers go with log weights ({count},) and covariances "
                f"({count}, {size}, {size}), got {self.log_weights.shape} and {self.covs.shape}"
            )
        for name, numbers in (("log weights", self.log_weights), ("means", self.means), ("covs", self.covs)):
            if not np.isfinite(numbers).all():
                raise ValueError(f"mixture: {name} must be finite, got {numbers.tolist()}")
        try:
            self.roots  # noqa: B018 - the test for positive definiteness, kept for later use
        except np.linalg.LinAlgError as error:
            raise ValueError("mixture: every covariance must be positive definite") from error

    @cached_property
    def roots(self) -> FloatArray:
        """Cholesky factors (k, d, d) of the covariances."""
        return np.asarray(np.linalg.cholesky(self.covs), dtype=np.float64)

    @classmethod
    def single(cls, mean: ArrayLike, cov: ArrayLike) -> Self:
        """Return one normal density of mass 1, mean (d,) and covariance (d, d)."""
        return cls(np.zeros(1), np.atleast_2d(np.asarray(mean, float)), np.asarray(cov, float)[None])

    @property
    def order(self) -> int:
        """Number of components, k."""
        return int(self.log_weights.size)

    @property
    def dimension(self) -> int:
        """Number of coordinates, d."""
        return int(self.means.shape[1])

    @property
    def log_mass(self) -> float:
        """Logarithm of the integral over all space."""
        return float(np.logaddexp.reduce(self.log_weights))

    @property
    def weights(self) -> FloatArray:
        """Shares (k,) of the components, which sum to one."""
        return np.asarray(np.exp(self.log_weights - self.log_mass), dtype=np.float64)

    def log_density(self, points: FloatArray) -> FloatArray:
        """Return the logarithm (n,) of the density at points (n, d), also where the density itself is 0."""
        return np.asarray(np.logaddexp.reduce(self.log_terms(points), axis=1), dtype=np.float64)

    def log_terms(self, points: FloatArray) -> FloatArray:
        """Return the logarithms (n, k) of the components' densities at points (n, d), weights included."""
        whitened = np.linalg.solve(self.roots, points.T[None] - self.means[:, :, None])
        log_peaks = self.log_weights - _log_root_determinants(self.roots) - 0.5 * self.dimension * _LOG_2_PI
        return np.asarray(log_peaks[:, None] - 0.5 * (whitened**2).sum(axis=1), dtype=np.float64).T

    def sample(self, count: int, rng: np.random.Generator) -> FloatArray:
        """Return `count` independent draws (n, d) from the density, taken as of mass 1."""
        which = rng.choice(self.order, size=count, p=self.weights)
        normal = rng.standard_normal((count, self.dimension))
        return np.asarray(self.means[which] + np.einsum("nij,nj->ni", self.roots[which], normal))

    def normalised(self) -> Self:
        """Return the same density with mass 1."""
        return replace(self, log_weights=self.log_weights - self.log_mass)

    def mean_and_cov(self) -> tuple[FloatArray, FloatArray]:
        """Return mean (d,) and covariance (d, d) of the whole, whatever its mass."""
        weights = self.weights
        mean = weights @ self.means
        apart = self.means - mean
        within = np.einsum("i,ijk->jk", weights, self.covs)
        return mean, within + (weights[:, None] * apart).T @ apart

    def moved(self, root: FloatArray, origin: FloatArray) -> Self:
        """Return the density of y = origin + root x; the mass stays.

        Parameters
        ----------
        root : (d, d) invertible
        origin : (d,)
        """
        covs = root @ self.covs @ root.T
        return replace(self, means=origin + self.means @ root.T, covs=0.5 * (covs + covs.transpose(0, 2, 1)))


def _log_root_determinants(roots: FloatArray) -> FloatArray:
    """Return log √|P| (k,) from Cholesky factors (k, d, d) of P."""
    return np.asarray(np.log(np.diagonal(roots, axis1=1, axis2=2)).sum(axis=1), dtype=np.float64)
