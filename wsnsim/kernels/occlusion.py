"""How probable it is that moving occluders hide points of a floor plan from cameras.

Ercan, El Gamal & Guibas 2007, Eqs. 4 to 6. Cameras are rows and sets of cameras bit masks as in
`sightlines`. An occluder's place is normal with mean (x, y) and covariance (xx, xy, yy).
"""

from math import erf, sqrt

import numpy as np

from wsnsim.kernels.jit import kernel
from wsnsim.types import FloatArray, IntArray

_FARTHEST = 6.0
"""Beyond so many standard deviations the tabled normal distribution is 0 or 1 to 1e-9."""
_PER_SD = 512
"""Entries of the table for a standard deviation: linear interpolation errs by 1.2e-7 at most."""
_CULLED = 4.5
"""Standard deviations beyond which an occluder is left out: 3.4e-6 of it are there."""


def normal_table() -> FloatArray:
    """Return the standard normal distribution function at -6, -6 + 1/512, ..., 6."""
    count = int(2 * _FARTHEST * _PER_SD)
    places = (i / _PER_SD - _FARTHEST for i in range(count + 1))
    return np.array([0.5 * (1.0 + erf(place / sqrt(2.0))) for place in places])


@kernel
def tabled_normal(place: float, table: FloatArray) -> float:
    """Return the standard normal distribution function by linear interpolation of `normal_table`."""
    at = (place + _FARTHEST) * _PER_SD
    if at <= 0.0:
        return 0.0
    if at >= len(table) - 1:
        return 1.0
    whole = int(at)
    share = at - whole
    index = np.uint64(whole)  # an unsigned index is not tested for counting from the end
    value = table[index]
    return float(value + share * (table[index + np.uint64(1)] - value))


@kernel
def normal_coverage(
    points: FloatArray,
    masks: IntArray,
    cameras: FloatArray,
    means: FloatArray,
    covs: FloatArray,
    radius: float,
    table: FloatArray,
) -> FloatArray:
    """Return q, the probability that an occluder hides a point from a camera (Eq. 4).

    The occluder hides it if its centre is in the rectangle round the line of sight, as long as that and
    as wide as the occluder. Eq. 4 is the marginal across the line, times the conditional along it, given
    that the centre is on the line: exact if the covariance has no part that couples both. Printed for the
    occluder's principal axes with the camera at the origin, here it is free of coordinates.

    Parameters
    ----------
    points : (m, 2) - [m]
    masks : (m,) - cameras for which q is wanted
    cameras : (n, 6)
    means : (k, 2) - of the occluders' places [m]
    covs : (k, 3) - xx, xy, yy, positive definite [m²]
    radius : of the occluders [m]
    table : `normal_table`

    Returns
    -------
    (m, k, n) - q, 0 for cameras that are not wanted
    """
    q = np.zeros((len(points), len(means), len(cameras)))
    reaches, scales = np.empty(len(means)), np.zeros(len(means))
    for j in range(len(means)):
        half, skew = 0.5 * (covs[j, 0] + covs[j, 2]), 0.5 * (covs[j, 0] - covs[j, 2])
        reaches[j] = _CULLED * np.sqrt(half + np.sqrt(skew * skew + covs[j, 1] * covs[j, 1]))
        if skew == 0.0 and covs[j, 1] == 0.0:
            scales[j] = 1.0 / np.sqrt(half)
    for i in range(len(points)):
        for s in range(len(cameras)):
            if not masks[i] >> s & 1:
                continue
            dx, dy = points[i, 0] - cameras[s, 0], points[i, 1] - cameras[s, 1]
            length = np.sqrt(dx * dx + dy * dy)
            if length == 0.0:
                continue
            ux, uy = dx / length, dy / length
            for j in range(len(means)):
                rx, ry = means[j, 0] - cameras[s, 0], means[j, 1] - cameras[s, 1]
                along, across = ux * rx + uy * ry, ux * ry - uy * rx
                reach = reaches[j]
                if abs(across) > radius + reach or along < -reach or along > length + reach:
                    continue
                if scales[j] > 0.0:  # the same in all directions
                    over, scale, middle = scales[j], scales[j], along
                else:
                    xx, xy, yy = covs[j, 0], covs[j, 1], covs[j, 2]
                    variance = uy * uy * xx - 2.0 * ux * uy * xy + ux * ux * yy
                    over = 1.0 / np.sqrt(variance)
                    coupling = ux * uy * (yy - xx) + (ux * ux - uy * uy) * xy
                    middle = along - coupling / variance * across
                    scale = np.sqrt(variance / (xx * yy - xy * xy))
                width = tabled_normal((radius - across) * over, table)
                width -= tabled_normal((-radius - across) * over, table)
                depth = tabled_normal((length - middle) * scale, table)
                depth -= tabled_normal(-middle * scale, table)
                q[i, j, s] = width * depth
    return q


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
    q : (m, k, n) - probability that occluder k hides point m from camera n
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
    points, occluders, n = q.shape
    result = np.zeros(points)
    watching, hidden = np.empty(n, np.int64), np.empty(n, np.int64)
    most = 0
    for i in range(points):
        z = 0
        for s in range(n):
            z += (masks[i] & blind) >> s & 1
        most = max(most, z)
    joint, sums = np.empty(1 << most), np.empty(1 << most)
    for i in range(points):
        if seeing & ~masks[i]:
            continue
        eyes, z = 0, 0
        certain = 1.0
        for s in range(n):
            if (masks[i] & seeing) >> s & 1:
                certain *= detected
                watching[eyes] = s
                eyes += 1
            elif (masks[i] & blind) >> s & 1:
                hidden[z] = s
                z += 1
        # a camera that is hidden so seldom bounds p(η)
        rare = False
        if detected == 1.0:
            for b in range(z):
                bound = 0.0
                for j in range(occluders):
                    bound += q[i, j, hidden[b]]
                rare = rare or bound <= negligible
        if rare:
            continue
        joint[: 1 << z] = 0.0 if covering else 1.0
        joint[0] = 1.0
        for j in range(occluders):
            seen, total = 0.0, 0.0
            for b in range(eyes):
                seen += q[i, j, watching[b]]
            for b in range(z):
                total += q[i, j, hidden[b]]
            total += seen
            if total == 0.0:
                continue
            scale = 1.0 / total if rescale and total > 1.0 else 1.0
            if covering:
                # an occluder hides nothing, or one camera: hidden already, or the last one of a set
                nothing = max(1.0 - scale * total, 0.0)
                for subset in range((1 << z) - 1, -1, -1):
                    value = joint[subset] * nothing
                    for b in range(z):
                        if subset >> b & 1:
                            value += scale * q[i, j, hidden[b]] * (joint[subset] + joint[subset ^ (1 << b)])
                    joint[subset] = value
            else:
                sums[0] = 1.0 - scale * seen
                for b in range(z):
                    part = scale * q[i, j, hidden[b]]
                    for subset in range(np.uint64(1 << b)):
                        sums[subset + np.uint64(1 << b)] = sums[subset] - part
                for subset in range(np.uint64(1 << z)):
                    joint[subset] *= sums[subset]
        # each camera that is not hidden has missed the point
        for b in range(z - 1, -1, -1):
            for subset in range(1 << b):
                if covering:
                    joint[subset] = (1.0 - detected) * joint[subset] + joint[subset | 1 << b]
                else:
                    joint[subset] -= detected * joint[subset | 1 << b]
        result[i] = certain * joint[0]
    return result
