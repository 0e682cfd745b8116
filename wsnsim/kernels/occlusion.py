"""How probable it is that a moving occluder hides a point of a floor plan from a camera.

Ercan, El Gamal & Guibas 2007, Eq. 4. Cameras are rows and sets of cameras bit masks as in `sightlines`. An
occluder's place is normal with mean (x, y) and covariance (xx, xy, yy).
"""

from math import erf, sqrt

import numpy as np

from wsnsim.kernels.jit import kernel
from wsnsim.types import FloatArray, IntArray

_FARTHEST = 6.0
"""Beyond so many standard deviations the tabled normal distribution is 0 or 1 to 1e-9."""
_PER_SD = 256
"""Entries of the table for a standard deviation: linear interpolation errs by 4.6e-7 at most, and the table
leaves room in the processor's first cache."""
_CULLED = 4.5
"""Standard deviations beyond which an occluder is left out: 3.4e-6 of it are there."""
_WIDTHS = 1024
"""Steps of the table of `widths`: it errs by 2e-6 at most."""


def normal_table() -> FloatArray:
    """Return the standard normal distribution function at -6, -6 + 1/256, ..., 6."""
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
def spreads(covs: FloatArray) -> FloatArray:
    """Return of covariances (k, 3) what `cover` wants, (k, 2).

    That is 4.5 standard deviations in the direction of the largest [m], and one over the standard deviation
    of those that are the same in all directions [1/m], 0 for others.
    """
    result = np.zeros((len(covs), 2))
    for j in range(len(covs)):
        half, skew = 0.5 * (covs[j, 0] + covs[j, 2]), 0.5 * (covs[j, 0] - covs[j, 2])
        result[j, 0] = _CULLED * np.sqrt(half + np.sqrt(skew * skew + covs[j, 1] * covs[j, 1]))
        if skew == 0.0 and covs[j, 1] == 0.0:
            result[j, 1] = 1.0 / np.sqrt(half)
    return result


@kernel
def widths(spread: FloatArray, radius: float, table: FloatArray) -> FloatArray:
    """Return the probability that an occluder lies across a line, by the distance of its mean from the line.

    Parameters
    ----------
    spread : (k, 2) - `spreads`
    radius : of the occluders [m]
    table : `normal_table`

    Returns
    -------
    (1026,) - at distances from 0 to the radius and 4.5 standard deviations; nothing, (0,), where these are
    not the same for all occluders and directions, or so small that linear interpolation would err
    """
    over = spread[0, 1] if len(spread) > 0 else 0.0
    if over * radius > 1.0 or not np.all(spread[:, 1] == over) or over == 0.0:
        return np.empty(0)
    result = np.empty(_WIDTHS + 2)
    for i in range(_WIDTHS + 2):
        across = (radius + spread[0, 0]) * i / _WIDTHS
        result[i] = tabled_normal((radius - across) * over, table)
        result[i] -= tabled_normal((-radius - across) * over, table)
    return result


@kernel
def cover(
    dx: float,
    dy: float,
    x0: float,
    y0: float,
    means: FloatArray,
    covs: FloatArray,
    spread: FloatArray,
    width: FloatArray,
    radius: float,
    table: FloatArray,
    column: FloatArray,
    totals: FloatArray,
) -> float:
    """Find how probably each occluder hides one point from one camera (Eq. 4).

    Parameters
    ----------
    dx, dy : from the camera to the point [m]
    x0, y0 : the camera [m]
    means, covs, radius, table : as in `normal_coverage`
    spread, width : `spreads` of the covariances, and their `widths`
    column : (k,) - is filled with q
    totals : (k,) - q is added

    Returns
    -------
    the sum of q over the occluders
    """
    length = np.sqrt(dx * dx + dy * dy)
    if length == 0.0:
        column[:] = 0.0
        return 0.0
    ux, uy = dx / length, dy / length
    total = 0.0
    per = _WIDTHS / (radius + spread[0, 0]) if len(width) > 0 else 0.0
    for j in range(len(means)):
        column[j] = 0.0
        rx, ry = means[j, 0] - x0, means[j, 1] - y0
        across, along = ux * ry - uy * rx, ux * rx + uy * ry
        reach = spread[j, 0]
        if abs(across) >= radius + reach or along < -reach or along > length + reach:
            continue
        if per > 0.0:
            scale, middle = spread[j, 1], along
            at = abs(across) * per
            whole = int(at)
            index = np.uint64(whole)
            q = width[index]
            q += (at - whole) * (width[index + np.uint64(1)] - q)
        else:
            xx, xy, yy = covs[j, 0], covs[j, 1], covs[j, 2]
            variance = uy * uy * xx - 2.0 * ux * uy * xy + ux * ux * yy
            over = 1.0 / np.sqrt(variance)
            coupling = ux * uy * (yy - xx) + (ux * ux - uy * uy) * xy
            middle = along - coupling / variance * across
            scale = np.sqrt(variance / (xx * yy - xy * xy))
            q = tabled_normal((radius - across) * over, table)
            q -= tabled_normal((-radius - across) * over, table)
        # most occluders are far from both ends of the line
        beyond, before = (length - middle) * scale, -middle * scale
        if beyond < _CULLED or before > -_CULLED:
            q *= tabled_normal(beyond, table) - tabled_normal(before, table)
        column[j] = q
        totals[j] += q
        total += q
    return total


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
    (m, n, k) - q, 0 for cameras that are not wanted
    """
    q = np.zeros((len(points), len(cameras), len(means)))
    spread, totals = spreads(covs), np.zeros(len(means))
    width = widths(spread, radius, table)
    for i in range(len(points)):
        for s in range(len(cameras)):
            if masks[i] >> s & 1:
                x0, y0 = cameras[s, 0], cameras[s, 1]
                dx, dy = points[i, 0] - x0, points[i, 1] - y0
                cover(dx, dy, x0, y0, means, covs, spread, width, radius, table, q[i, s], totals)
    return q
