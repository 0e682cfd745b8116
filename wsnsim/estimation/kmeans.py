"""The modified k-means of Kushwaha & Koutsoukos (2013), sec. 5.2.2, over the components of a mixture.

Mended where the printed form cannot run: the starts are drawn without replacement, and a
cluster that has lost all its components takes the one that fits its own cluster worst.
"""

import numpy as np

from wsnsim.estimation.mixtures import GaussianMixture
from wsnsim.types import FloatArray, IntArray

_MOST_ROUNDS = 50
_CONVERGED = 1e-9
"""Change of the clusters' shares of the mass, all together, at which to stop."""


def kmeans_labels(mixture: GaussianMixture, order: int, rng: np.random.Generator) -> IntArray:
    """Return labels (k,) from 0 to order - 1 of the clusters found from one random start.

    Parameters
    ----------
    order : from 1 to k
    """
    shares = mixture.weights
    precisions = np.asarray(np.linalg.inv(mixture.covs), dtype=np.float64)
    heads = rng.choice(mixture.order, size=order, replace=False)
    means, head_precisions, masses = mixture.means[heads], precisions[heads], shares[heads]
    for _ in range(_MOST_ROUNDS):
        labels = _nearest(mixture.means, precisions, means, head_precisions)
        parts = shares * np.eye(order)[labels].T  # (order, k)
        before, masses = masses, parts.sum(axis=1)
        parts /= masses[:, None]
        means = parts @ mixture.means
        apart = mixture.means - means[labels]
        covs = np.einsum("ji,ikl->jkl", parts, mixture.covs + apart[:, :, None] * apart[:, None, :])
        head_precisions = np.asarray(np.linalg.inv(covs), dtype=np.float64)
        if np.abs(masses - before).sum() <= _CONVERGED:
            break
    return labels


def _nearest(
    means: FloatArray, precisions: FloatArray, heads: FloatArray, head_precisions: FloatArray
) -> IntArray:
    """Return the head nearest to each component by Eq. 32; no head is left alone."""
    apart = means[:, None] - heads[None]
    both = precisions[:, None] + head_precisions[None]
    distances = np.einsum("ija,ijab,ijb->ij", apart, both, apart)
    labels = distances.argmin(axis=1)
    for head in range(len(heads)):
        numbers = np.bincount(labels, minlength=len(heads))
        if numbers[head] == 0:
            own = np.where(numbers[labels] > 1, distances[np.arange(len(labels)), labels], -np.inf)
            labels[int(own.argmax())] = head
    return np.asarray(labels, dtype=np.int64)
