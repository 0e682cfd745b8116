"""Fewer components for a Gaussian mixture: its components in clusters, each merged into one.

A merged component has its cluster's mass, mean and covariance, so that the whole keeps its
own. What differs is how the clusters are found.
"""

from typing import Literal, get_args

import numpy as np

from wsnsim.estimation.divergence import fixed_sample
from wsnsim.estimation.em import monomials
from wsnsim.estimation.kmeans import kmeans_labels
from wsnsim.estimation.mixtures import GaussianMixture
from wsnsim.kernels.merging import merged_labels
from wsnsim.types import IntArray

Reduction = Literal["runnalls", "kmeans", "kmeans_best"]
"""How the clusters are found:

- runnalls: greedy merging of the cheapest pair (Runnalls 2007), then each component to the cluster from
  which it diverges least (Goldberger & Roweis 2005), until none moves;
- kmeans: the k-means of Kushwaha & Koutsoukos (2013), eqs. 32-35, from one random start;
- kmeans_best: the one of `STARTS` such starts with the least Kullback–Leibler divergence.
"""

STARTS = 10
"""Random starts of `kmeans_best`."""

_SAMPLE = 512
"""Points by which `kmeans_best` tells which start is the best."""

_REFINEMENTS = 50
"""Rounds of the refinement at most; few are usual."""

_LEAST_SHARE = 1e-30
"""Share of the mass below which a component changes no figure of a merged one."""


def reduce(
    mixture: GaussianMixture,
    order: int,
    rule: Reduction = "runnalls",
    rng: np.random.Generator | None = None,
) -> GaussianMixture:
    """Return a mixture of at most `order` components with the mass, mean and covariance of `mixture`.

    Parameters
    ----------
    mixture : one that has no more than `order` components comes back as it is
    order : at least 1
    rng : for the starts of "kmeans" and "kmeans_best"; "runnalls" draws nothing

    Raises
    ------
    ValueError : an order below 1, an unknown rule, or a rule that draws without a generator
    """
    if order < 1:
        raise ValueError(f"reduction: order must be at least 1, got {order}")
    if rule not in get_args(Reduction):
        raise ValueError(f"reduction: rule must be one of {', '.join(get_args(Reduction))}, got {rule!r}")
    if mixture.order <= order:
        return mixture
    shares = mixture.weights
    told = shares > _LEAST_SHARE
    if not told.all():
        mixture = GaussianMixture(mixture.log_weights[told], mixture.means[told], mixture.covs[told])
        return reduce(mixture, order, rule, rng)
    if rule == "runnalls":
        return merged(mixture, _divergence_labels(mixture, order))
    if rng is None:
        raise ValueError(f"reduction: {rule} draws its starts and needs a generator, got none")
    if rule == "kmeans":
        return merged(mixture, kmeans_labels(mixture, order, rng))
    starts = [merged(mixture, kmeans_labels(mixture, order, rng)) for _ in range(STARTS)]
    points, weights = fixed_sample(mixture, _SAMPLE)
    return max(starts, key=lambda start: float(weights @ start.log_density(points)))


def _divergence_labels(mixture: GaussianMixture, order: int) -> IntArray:
    """Return labels (k,) from 0 to order - 1 by Runnalls' merging and its refinement."""
    mean, cov = mixture.mean_and_cov()
    back = np.linalg.inv(np.linalg.cholesky(cov))
    features = monomials((mixture.means - mean) @ back.T, back @ mixture.covs @ back.T)
    return merged_labels(features, mixture.weights, order, _REFINEMENTS)


def merged(mixture: GaussianMixture, labels: IntArray) -> GaussianMixture:
    """Return a mixture with one component for each cluster of components.

    Parameters
    ----------
    labels : (k,) from 0 on, none left out

    References
    ----------
    Kushwaha, Koutsoukos (2013), eqs. 33-35, with outer products and about the cluster's mean.
    """
    member = np.eye(int(labels.max()) + 1, dtype=bool)[labels].T  # (clusters, k)
    log_weights = np.logaddexp.reduce(np.where(member, mixture.log_weights, -np.inf), axis=1)
    parts = np.where(member, np.exp(mixture.log_weights - log_weights[labels]), 0.0)
    origin = mixture.means[int(np.argmax(mixture.log_weights))]
    inner = mixture.means - origin
    means = parts @ inner
    apart = inner - means[labels]
    seconds = mixture.covs + apart[:, :, None] * apart[:, None, :]
    covs = np.einsum("ji,ikl->jkl", parts, seconds)
    return GaussianMixture(log_weights, origin + means, covs)
