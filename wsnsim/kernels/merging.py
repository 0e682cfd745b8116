"""Clusters of the components of a Gaussian mixture: greedy merging, and its refinement.

Both lower one figure, the sum of wᵢ KL(component i ‖ normal density of its cluster): a bound
from above of the Kullback–Leibler divergence that merging the clusters causes.
"""

import numpy as np

from wsnsim.kernels.jit import frozen, kernel
from wsnsim.kernels.monomials import LEAST_VARIANCE, describe, dimension, expand
from wsnsim.types import FloatArray, IntArray


def merged_labels(features: FloatArray, weights: FloatArray, order: int, most_rounds: int) -> IntArray:
    """Return labels (k,) from 0 to order - 1 of the clusters that components fall into.

    The pair that costs least is merged until `order` clusters are left; merging i and j
    costs ½ [(wᵢ + wⱼ) log|P_ij| − wᵢ log|Pᵢ| − wⱼ log|Pⱼ|], P_ij the covariance of the two together. Then
    each component goes to the cluster from which it diverges least, until none moves.

    Parameters
    ----------
    features : (k, f) - expected monomials of the components (`monomials`)
    weights : (k,) - above 0
    order : from 1 to k
    most_rounds : of the refinement

    References
    ----------
    Runnalls (2007), Kullback–Leibler approach to Gaussian mixture reduction, the cost B(i, j);
    Goldberger, Roweis (2005), Hierarchical clustering of a mixture model, for the refinement.
    """
    features, weights = frozen(features, np.float64), frozen(weights, np.float64)
    return _refined(features, weights, _greedy(features, weights, order), order, most_rounds)


@kernel
def _greedy(features: FloatArray, weights: FloatArray, order: int) -> IntArray:
    count, size = features.shape
    d = dimension(size)
    moments, scratch = np.zeros((count, size)), np.zeros((d, d))
    alive, labels = np.ones(count, np.bool_), np.arange(count)
    costs, best = np.full((count, count), np.inf), np.zeros(count, np.int64)  # of pairs i < j
    burdens = np.zeros(count)  # w log|P|
    for i in range(count):
        for a in range(size):
            moments[i, a] = weights[i] * features[i, a]
        burdens[i] = _burden(moments, i, i, scratch)
    for i in range(count):
        for j in range(i + 1, count):
            costs[i, j] = _burden(moments, i, j, scratch) - burdens[i] - burdens[j]
        best[i] = _cheapest(costs, i)
    for _ in range(count - order):
        i = -1
        for k in range(count):
            if alive[k] and (i < 0 or costs[k, best[k]] < costs[i, best[i]]):
                i = k
        j = best[i]
        moments[i] += moments[j]
        burdens[i] = _burden(moments, i, i, scratch)
        alive[j] = False
        for k in range(count):
            if labels[k] == j:
                labels[k] = i
            costs[min(j, k), max(j, k)] = np.inf
            if alive[k] and k != i:
                cost = _burden(moments, i, k, scratch) - burdens[i] - burdens[k]
                costs[min(i, k), max(i, k)] = cost
        for k in range(count):
            if alive[k] and (k == i or best[k] == i or best[k] == j):
                best[k] = _cheapest(costs, k)
            elif alive[k] and k < i and costs[k, i] < costs[k, best[k]]:
                best[k] = i
    return (np.cumsum(alive) - 1)[labels]


@kernel
def _cheapest(costs: FloatArray, i: int) -> int:
    """Return with which later cluster i merges at the least cost; i if there is none."""
    best, least = i, np.inf
    for j in range(i + 1, len(costs)):
        if costs[i, j] < least:
            best, least = j, costs[i, j]
    return best


@kernel
def _burden(moments: FloatArray, i: int, j: int, scratch: FloatArray) -> float:
    """Return w log|P| of clusters i and j together, or of cluster i alone if j is i."""
    d = len(scratch)
    share = 0.0 if i == j else 1.0
    mass = moments[i, 0] + share * moments[j, 0]
    scale, place = 1.0 / mass, 1 + d
    for a in range(d):
        mean = scale * (moments[i, 1 + a] + share * moments[j, 1 + a])
        for b in range(a, d):
            second = moments[i, place] + share * moments[j, place]
            scratch[a, b] = scale * (second - mean * (moments[i, 1 + b] + share * moments[j, 1 + b]))
            place += 1
    determinant = 1.0
    for a in range(d):  # Gauss's elimination without Cholesky's roots: most of the time goes here
        pivot = max(scratch[a, a], LEAST_VARIANCE)
        determinant *= pivot
        for b in range(a + 1, d):
            factor = scratch[a, b] / pivot
            for c in range(b, d):
                scratch[b, c] -= factor * scratch[a, c]
    return float(mass * np.log(determinant))


@kernel
def _refined(
    features: FloatArray, weights: FloatArray, labels: IntArray, order: int, most_rounds: int
) -> IntArray:
    count, size = features.shape
    d = dimension(size)
    moments, coefficients = np.zeros((order, size)), np.zeros((order, size))
    mean, cov = np.zeros(d), np.zeros((d, d))
    moved, members = labels.copy(), np.zeros(order, np.int64)
    for _ in range(most_rounds):
        moments[:] = 0.0
        for i in range(count):
            for a in range(size):
                moments[labels[i], a] += weights[i] * features[i, a]
        for j in range(order):
            moments[j] /= moments[j, 0]
            describe(moments[j], mean, cov)
            expand(1.0, mean, cov, coefficients[j])
        members[:] = 0
        for i in range(count):
            highest = -np.inf
            for j in range(order):
                expected = 0.0  # log-density of cluster j under component i
                for a in range(size):
                    expected += coefficients[j, a] * features[i, a]
                if expected > highest:
                    highest, moved[i] = expected, j
            members[moved[i]] += 1
        # where a cluster would lose all its components, nothing moves any more
        if members.min() == 0 or np.all(moved == labels):
            break
        labels[:] = moved
    return labels
