"""Weighted expectation–maximisation: a mixture of few components close to a kernel density.

Not the bare particles but their kernels are fitted, so that no component is narrower than a
kernel and none can collapse on one particle.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Self

import numpy as np

from wsnsim.estimation.density import KernelDensity
from wsnsim.estimation.mixtures import GaussianMixture
from wsnsim.kernels.em import maximise
from wsnsim.kernels.seeding import seeded_labels
from wsnsim.types import FloatArray, IntArray

MOST_STEPS = 100
"""Iterations of EM at most; ten are usual."""

TOLERANCE = 2e-3
"""Gain of an iteration [nat] at which to stop: a tenth of what a further component must be worth."""

_CANDIDATES = 3
"""Candidates for each centre of a k-means++ start."""

_SEEDING_ROUNDS = 2
"""Rounds of k-means between the k-means++ start and EM."""


@dataclass(frozen=True, eq=False)
class Standardised:
    """A kernel density in coordinates u, x = origin + root u, in which its mean is 0 and its covariance I.

    Parameters
    ----------
    given : of x
    density : of u
    root : (d, d)
    origin : (d,)
    """

    given: KernelDensity
    density: KernelDensity
    root: FloatArray
    origin: FloatArray

    @classmethod
    def of(cls, density: KernelDensity) -> Self:
        """Return a density in its own standard coordinates."""
        mean, cov = density.mean_and_cov()
        root = np.asarray(np.linalg.cholesky(cov), dtype=np.float64)
        back = np.linalg.inv(root)
        points = (density.points - mean) @ back.T
        inner = KernelDensity(points, density.weights, back @ density.covs @ back.T)
        return cls(density, inner, root, mean)

    @cached_property
    def features(self) -> FloatArray:
        """Expected monomials (m, f) of the kernels."""
        return monomials(self.density.points, self.density.covs)


def fit(standardised: Standardised, order: int, rng: np.random.Generator) -> GaussianMixture:
    """Return a mixture of mass 1 with at most `order` components, in the density's standard coordinates.

    Fewer components come out where points coincide or a component loses its mass. The
    starts are found in the coordinates that the density was given in: where it is long and
    thin, clusters lie along it, which its standard coordinates no longer show.

    Raises
    ------
    ValueError : `order` is below 1

    References
    ----------
    Vasconcelos, Lippman (1998), Learning mixture hierarchies: EM for normal densities in place of
    points.
    """
    if order < 1:
        raise ValueError(f"mixture: order must be at least 1, got {order}")
    points, weights = standardised.density.points, standardised.density.weights
    if order == 1:
        return GaussianMixture.single(np.zeros(points.shape[1]), np.eye(points.shape[1]))
    labels = seeded_labels(
        standardised.given.points, weights, rng.random((order, _CANDIDATES)), _SEEDING_ROUNDS
    )
    start = np.zeros((len(points), order))
    start[np.arange(len(points)), labels] = weights
    shares, means, covs, _ = maximise(standardised.features, weights, start, MOST_STEPS, TOLERANCE)
    kept = shares > 0.0
    return GaussianMixture(np.log(shares[kept] / shares[kept].sum()), means[kept], covs[kept])


def monomials(points: FloatArray, covs: FloatArray | None = None) -> FloatArray:
    """Return 1, xₐ, xₐ x_b (m, f) of points (m, d), expected over covariances (m or 1, d, d) round them.

    a ≤ b, row by row, f = 1 + d + d (d + 1) / 2.
    """
    count, size = points.shape
    rows, columns = _pairs(size)
    features = np.empty((count, 1 + size + rows.size))
    features[:, 0] = 1.0
    features[:, 1 : 1 + size] = points
    features[:, 1 + size :] = points[:, rows] * points[:, columns]
    if covs is not None:
        features[:, 1 + size :] += covs[:, rows, columns]
    return features


@lru_cache(maxsize=8)
def _pairs(size: int) -> tuple[IntArray, IntArray]:
    """Return rows and columns of the upper triangle of a (d, d) matrix."""
    rows, columns = np.triu_indices(size)
    return rows, columns
