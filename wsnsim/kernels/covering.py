"""How probable it is that some cameras see a point of a floor plan and others do not.

Ercan, El Gamal & Guibas 2007, Eqs. 5 and 6. Cameras are rows and sets of cameras bit masks as in
`sightlines`; the occluders are those of `occlusion`.
"""

import numpy as np

from wsnsim.kernels.jit import kernel
from wsnsim.kernels.occlusion import cover, spreads, widths
from wsnsim.types import FloatArray, IntArray

_MOST_HIDDEN = 10
"""Blind cameras whose joint probability is found: the work doubles with each. Further ones, which no room of
eight cameras has, count as hidden independently of the others."""


@kernel
def compound(
    q: FloatArray,
    totals: FloatArray,
    hidden: int,
    detected: float,
    covering: bool,
    rescale: bool,
    joint: FloatArray,
    sums: FloatArray,
) -> float:
    """Return the probability of what the cameras say of one point (Eqs. 5, 6).

    Parameters
    ----------
    q : (n, k) - for the `hidden` cameras that do not see it, which come first
    totals : (k,) - sums of q over these and those that see it
    detected, covering, rescale : as in `joint_probabilities`
    joint, sums : (2^hidden,) or more - work space
    """
    subsets = 1 << hidden
    joint[:subsets] = 0.0 if covering else 1.0
    joint[0] = 1.0
    for j in range(q.shape[1]):
        total = totals[j]
        if total == 0.0:
            continue
        scale = 1.0 / total if rescale and total > 1.0 else 1.0
        if covering:
            # an occluder hides nothing, or one camera: hidden already, or the last one of a set
            nothing = max(1.0 - scale * total, 0.0)
            for subset in range(subsets - 1, -1, -1):
                value = joint[subset] * nothing
                for b in range(hidden):
                    if subset >> b & 1:
                        value += scale * q[b, j] * (joint[subset] + joint[subset ^ (1 << b)])
                joint[subset] = value
        else:
            clear = total
            for b in range(hidden):
                clear -= q[b, j]
            sums[0] = 1.0 - scale * clear
            for b in range(hidden):
                part = scale * q[b, j]
                for subset in range(np.uint64(1 << b)):
                    sums[subset + np.uint64(1 << b)] = sums[subset] - part
            for subset in range(np.uint64(subsets)):
                joint[subset] *= sums[subset]
    # each camera that is not hidden has missed the point
    for b in range(hidden - 1, -1, -1):
        for subset in range(1 << b):
            if covering:
                joint[subset] = (1.0 - detected) * joint[subset] + joint[subset | 1 << b]
            else:
                joint[subset] -= detected * joint[subset | 1 << b]
    return float(joint[0])


@kernel
def alone(q: FloatArray, detected: float) -> float:
    """Return how probably a camera is blind if occluders hide the point from it with q (k,), on its own."""
    clear = detected
    for j in range(len(q)):
        clear *= max(1.0 - q[j], 0.0)
    return 1.0 - clear


@kernel
def most_hidden(masks: IntArray, blind: int) -> int:
    """Return how many of the blind cameras are allowed to see a point (m,), at most."""
    most = 0
    for i in range(len(masks)):
        rest, count = masks[i] & blind, 0
        while rest:
            rest &= rest - 1
            count += 1
        most = max(most, count)
    return most


@kernel
def joint_probabilities(
    q: FloatArray,
    masks: IntArray,
    seeing: int,
    blind: int,
    detected: float,
    covering: bool,
    rescale: bool,
    negligible: float,
) -> FloatArray:
    """Return the probability that the cameras `seeing` see a point and those `blind` do not (Eqs. 5, 6).

    With independent occluders, each of which hides the point from one camera at most.

    Parameters
    ----------
    q : (m, n, k) - probability that occluder k hides point m from camera n
    masks : (m,) - cameras that walls and fields of view allow to see the point
    seeing, blind : what the cameras report; others say nothing
    detected : probability that a camera that could see the point reports it
    covering : by the covering recursion, all of whose terms are positive, instead of by subset sums
    rescale : where an occluder's q add up to more than 1, divide by the sum; printed is without
    negligible : p(η) that is at most this may be returned as 0

    Returns
    -------
    (m,) - p(η); without `rescale`, or by rounding of the subset sums, it may be below 0
    """
    points, n, occluders = q.shape
    result = np.zeros(points)
    most = min(most_hidden(masks, blind), _MOST_HIDDEN)
    chosen, totals = np.empty((most + 1, occluders)), np.empty(occluders)
    joint, sums = np.empty(1 << most), np.empty(1 << most)
    for i in range(points):
        if seeing & ~masks[i]:
            continue
        hidden, beyond, rare = 0, 1.0, False
        totals[:] = 0.0
        for s in range(n):
            if (masks[i] & blind) >> s & 1:
                chosen[hidden] = q[i, s]
                # a camera that is hidden so seldom bounds p(η)
                rare = rare or (detected == 1.0 and q[i, s].sum() <= negligible)
                if hidden < most:
                    totals += q[i, s]
                    hidden += 1
                else:
                    beyond *= alone(chosen[hidden], detected)
        if rare:
            continue
        for s in range(n):
            if seeing >> s & 1:
                beyond *= detected
                totals += q[i, s]
        result[i] = beyond * compound(chosen, totals, hidden, detected, covering, rescale, joint, sums)
    return result


@kernel
def normal_joint(
    points: FloatArray,
    masks: IntArray,
    cameras: FloatArray,
    means: FloatArray,
    covs: FloatArray,
    radius: float,
    table: FloatArray,
    seeing: int,
    blind: int,
    detected: float,
    covering: bool,
    rescale: bool,
    negligible: float,
) -> FloatArray:
    """Return `joint_probabilities` (m,) of `normal_coverage`, point by point and without its array."""
    n, occluders = len(cameras), len(means)
    result = np.zeros(len(points))
    spread = spreads(covs)
    width = widths(spread, radius, table)
    most = min(most_hidden(masks, blind), _MOST_HIDDEN)
    q, totals, spare = np.empty((most + 1, occluders)), np.empty(occluders), np.empty(occluders)
    joint, sums = np.empty(1 << most), np.empty(1 << most)
    for i in range(len(points)):
        if seeing & ~masks[i]:
            continue
        hidden, beyond, rare = 0, 1.0, False
        totals[:] = 0.0
        for s in range(n):
            if (masks[i] & blind) >> s & 1:
                x0, y0 = cameras[s, 0], cameras[s, 1]
                dx, dy = points[i, 0] - x0, points[i, 1] - y0
                into = totals if hidden < most else spare
                total = cover(dx, dy, x0, y0, means, covs, spread, width, radius, table, q[hidden], into)
                # a camera that is hidden so seldom bounds p(η)
                if detected == 1.0 and total <= negligible:
                    rare = True
                    break
                if hidden < most:
                    hidden += 1
                else:
                    beyond *= alone(q[hidden], detected)
        if rare:
            continue
        for s in range(n):
            if seeing >> s & 1:
                beyond *= detected
                x0, y0 = cameras[s, 0], cameras[s, 1]
                dx, dy = points[i, 0] - x0, points[i, 1] - y0
                cover(dx, dy, x0, y0, means, covs, spread, width, radius, table, q[most], totals)
        result[i] = beyond * compound(q, totals, hidden, detected, covering, rescale, joint, sums)
    return result
