"""Starts for clustering: k-means++ on weighted points, and a few rounds of k-means."""

import numpy as np

from wsnsim.kernels.jit import frozen, kernel
from wsnsim.types import FloatArray, IntArray


def seeded_labels(points: FloatArray, weights: FloatArray, uniforms: FloatArray, rounds: int) -> IntArray:
    """Return labels (m,) of clusters whose first centres lie as far apart as chance and weights let them.

    Parameters
    ----------
    points : (m, d)
    weights : (m,) - not negative, sum above 0
    uniforms : (k, t) - draws from [0, 1): for each centre t candidates, of which the one is taken that
        leaves the points nearest to their centres; a label can stay without points where these are fewer
        than the centres
    rounds : of k-means that follow

    References
    ----------
    Arthur, Vassilvitskii (2007), k-means++: the advantages of careful seeding.
    """
    return _seeded_labels(
        frozen(points, np.float64), frozen(weights, np.float64), frozen(uniforms, np.float64), rounds
    )


@kernel
def _seeded_labels(points: FloatArray, weights: FloatArray, uniforms: FloatArray, rounds: int) -> IntArray:
    count, d = points.shape
    order = len(uniforms)
    labels, nearest = np.zeros(count, np.int64), np.ones(count)
    centres, masses = np.zeros((order, d)), np.ones(order)
    for j in range(order):
        least = np.inf
        for uniform in uniforms[j]:
            candidate = _drawn(weights, nearest, uniform)
            rest = 0.0
            for i in range(count):
                apart = _square(points[i], points[candidate])
                rest += weights[i] * (apart if j == 0 else min(apart, nearest[i]))
            if rest < least:
                least = rest
                centres[j] = points[candidate]
        for i in range(count):
            apart = _square(points[i], centres[j])
            if j == 0 or apart < nearest[i]:
                nearest[i] = apart
                labels[i] = j
    for _ in range(rounds):
        masses[:] = 0.0
        centres[:] = 0.0
        for i in range(count):
            masses[labels[i]] += weights[i]
            for a in range(d):
                centres[labels[i], a] += weights[i] * points[i, a]
        for j in range(order):
            if masses[j] > 0.0:
                centres[j] /= masses[j]
        for i in range(count):
            least = np.inf
            for j in range(order):
                if masses[j] > 0.0:
                    apart = _square(points[i], centres[j])
                    if apart < least:
                        least = apart
                        labels[i] = j
    return labels


@kernel
def _drawn(weights: FloatArray, factors: FloatArray, uniform: float) -> int:
    """Return an index drawn with chances proportional to weights (m,) times factors (m,)."""
    total = 0.0
    for i in range(len(weights)):
        total += weights[i] * factors[i]
    rest = uniform * total
    chosen = 0
    for i in range(len(weights)):
        chance = weights[i] * factors[i]
        if chance > 0.0:
            chosen = i
            rest -= chance
            if rest < 0.0:
                break
    return chosen


@kernel
def _square(first: FloatArray, second: FloatArray) -> float:
    """Return the squared distance of two points (d,)."""
    total = 0.0
    for a in range(len(first)):
        total += (first[a] - second[a]) ** 2
    return total
