"""The mixtures' work done plainly: NumPy, each formula as it is defined, in the order of the text.

The oracles of the kernels' tests, and what their time is compared with.
"""

from collections.abc import Sequence
from itertools import product as combinations

import numpy as np

from wsnsim.estimation.density import KernelDensity, kernel_density
from wsnsim.estimation.kalman import Gaussian
from wsnsim.estimation.mixtures import GaussianMixture
from wsnsim.types import FloatArray, IntArray


def plain_fit_mixture(
    points: FloatArray, weights: FloatArray, largest_order: int, rng: np.random.Generator, tolerance: float
) -> GaussianMixture:
    """Do what `fit_mixture` does, with every particle, and with six or four points a kernel for the KL."""
    density = kernel_density(points, weights)
    size = points.shape[1]
    steps = np.sqrt(size) * np.linalg.cholesky(density.covs[0]).T
    sample = (points[:, None] + np.concatenate([steps, -steps])).reshape(-1, size)
    sample_weights = np.repeat(density.weights / (2 * size), 2 * size)
    fits = []
    for order in range(1, largest_order + 1):
        labels = plain_seeded_labels(points, density.weights, rng.random((order, 3)), 2)
        fits.append(plain_em(density, np.eye(order)[labels], 100, 2e-3))
    gains = np.array([sample_weights @ fit.log_density(sample) for fit in fits])
    return fits[int(np.argmax(gains >= gains.max() - tolerance))]


def plain_em(density: KernelDensity, start: FloatArray, most_steps: int, tolerance: float) -> GaussianMixture:
    """Do EM for the normal densities of a kernel density.

    Parameters
    ----------
    start : (m, k) - shares of the components in each point, of sum 1
    most_steps, tolerance : as in `maximise`
    """
    points, weights = density.points, density.weights
    kernels = np.broadcast_to(density.covs, (len(points), *density.covs.shape[1:]))
    shares, bound, steps = start, -np.inf, 0
    while True:
        masses = weights @ shares
        parts = weights[:, None] * shares / masses
        means = parts.T @ points
        apart = points[:, None] - means
        covs = np.einsum("ij,ijk,ijl->jkl", parts, apart, apart) + np.einsum("ij,ikl->jkl", parts, kernels)
        mixture = GaussianMixture(np.log(masses), means, covs)
        if steps == most_steps:
            return mixture
        # the expected log-density under a kernel is that at its centre less half the trace
        traces = np.einsum("jkl,ilk->ij", np.linalg.inv(covs), kernels)
        terms = mixture.log_terms(points) - 0.5 * traces
        totals = np.logaddexp.reduce(terms, axis=1)
        shares = np.exp(terms - totals[:, None])
        before, bound = bound, float(weights @ totals)
        if bound - before <= tolerance:
            return mixture
        steps += 1


def plain_seeded_labels(
    points: FloatArray, weights: FloatArray, uniforms: FloatArray, rounds: int
) -> IntArray:
    """Do k-means++ and a few rounds of k-means."""
    centres = np.empty((0, points.shape[1]))
    nearest = np.ones(len(points))
    for trials in uniforms:
        chances = np.cumsum(weights * nearest)
        chosen = np.searchsorted(chances, trials * chances[-1], side="right")
        candidates = [np.vstack([centres, points[min(i, len(points) - 1)]]) for i in chosen]
        rests = [weights @ _squares(points, candidate).min(axis=1) for candidate in candidates]
        centres = candidates[int(np.argmin(rests))]
        nearest = _squares(points, centres).min(axis=1)
    labels = _squares(points, centres).argmin(axis=1)
    for _ in range(rounds):
        masses = np.bincount(labels, weights, len(centres))
        for j in np.flatnonzero(masses > 0.0):
            centres[j] = np.average(points[labels == j], axis=0, weights=weights[labels == j])
        squares = _squares(points, centres)
        squares[:, masses <= 0.0] = np.inf
        labels = squares.argmin(axis=1)
    return np.asarray(labels, dtype=np.int64)


def plain_merged_labels(mixture: GaussianMixture, order: int, most_rounds: int) -> IntArray:
    """Do Runnalls' merging, each time over all pairs, and the refinement by Kullback–Leibler divergences."""
    clusters = [[i] for i in range(mixture.order)]
    while len(clusters) > order:
        pairs = [(a, b) for b in range(len(clusters)) for a in range(b)]
        costs = [
            _burden(mixture, clusters[a] + clusters[b])
            - _burden(mixture, clusters[a])
            - _burden(mixture, clusters[b])
            for a, b in pairs
        ]
        a, b = pairs[int(np.argmin(costs))]
        clusters[a] = clusters[a] + clusters[b]
        del clusters[b]
    for _ in range(most_rounds):
        normals = [_normal(mixture, cluster) for cluster in clusters]
        divergences = [
            [_divergence(mixture.means[i], mixture.covs[i], normal) for normal in normals]
            for i in range(mixture.order)
        ]
        nearest = np.argmin(divergences, axis=1)
        moved = [np.flatnonzero(nearest == j).tolist() for j in range(order)]
        if not all(moved) or moved == [sorted(cluster) for cluster in clusters]:
            break
        clusters = moved
    labels = np.empty(mixture.order, np.int64)
    for number, cluster in enumerate(clusters):
        labels[cluster] = number
    return labels


def plain_fuse(mixtures: Sequence[GaussianMixture], prior: Gaussian) -> GaussianMixture:
    """Multiply mixtures that each contain the prior, all at once: natural parameters of normal densities.

    log N(x; μ, V) = −½ xᵀΛx + ηᵀx + ζ with Λ = V⁻¹, η = Λμ, ζ = −½ (ηᵀμ + log|2πV|): all three add up.
    """
    choices = [
        [
            _natural(log_weight, mean, cov)
            for log_weight, mean, cov in zip(mixture.log_weights, mixture.means, mixture.covs, strict=True)
        ]
        for mixture in mixtures
    ]
    shared, times = _natural(0.0, prior.mean, prior.cov), len(mixtures) - 1
    log_weights, means, covs = [], [], []
    for choice in combinations(*choices):
        information, vector, constant = (
            sum(part[n] for part in choice) - times * shared[n] for n in range(3)
        )
        cov = np.linalg.inv(information)
        mean = cov @ vector
        log_weights.append(constant + 0.5 * (vector @ mean + np.linalg.slogdet(2.0 * np.pi * cov)[1]))
        means.append(mean)
        covs.append(0.5 * (cov + cov.T))
    return GaussianMixture(np.array(log_weights), np.array(means), np.array(covs))


def plain_climb(mixture: GaussianMixture, start: FloatArray, steps: int) -> FloatArray:
    """Do `steps` steps of x = (Σ pⱼ Aⱼ)⁻¹ Σ pⱼ Aⱼ μⱼ, pⱼ the components' shares at x."""
    precisions = np.linalg.inv(mixture.covs)
    point = start
    for _ in range(steps):
        terms = mixture.log_terms(point[None])[0]
        shares = np.exp(terms - np.logaddexp.reduce(terms))
        pull = np.einsum("j,jab,jb->a", shares, precisions, mixture.means)
        point = np.linalg.solve(np.einsum("j,jab->ab", shares, precisions), pull)
    return point


def _squares(points: FloatArray, centres: FloatArray) -> FloatArray:
    """Return squared distances (m, k)."""
    return np.asarray(((points[:, None] - centres) ** 2).sum(axis=2), dtype=np.float64)


def _normal(mixture: GaussianMixture, cluster: list[int]) -> Gaussian:
    """Return mean and covariance of some components together."""
    some = GaussianMixture(mixture.log_weights[cluster], mixture.means[cluster], mixture.covs[cluster])
    return Gaussian(*some.mean_and_cov())


def _burden(mixture: GaussianMixture, cluster: list[int]) -> float:
    """Return ½ w log|P| of some components together."""
    logs = np.linalg.slogdet(_normal(mixture, cluster).cov)[1]
    return float(0.5 * mixture.weights[cluster].sum() * logs)


def _divergence(mean: FloatArray, cov: FloatArray, other: Gaussian) -> float:
    """Return KL(N(mean, cov) ‖ other), less ½ d."""
    precision = np.linalg.inv(other.cov)
    apart = mean - other.mean
    logs = np.linalg.slogdet(other.cov)[1] - np.linalg.slogdet(cov)[1]
    return float(0.5 * (np.trace(precision @ cov) + apart @ precision @ apart + logs))


def _natural(log_weight: float, mean: FloatArray, cov: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """Return Λ, η and ζ of exp(log_weight) N(x; mean, cov)."""
    information = np.asarray(np.linalg.inv(cov), dtype=np.float64)
    vector = information @ mean
    return information, vector, log_weight - 0.5 * (vector @ mean + np.linalg.slogdet(2.0 * np.pi * cov)[1])
