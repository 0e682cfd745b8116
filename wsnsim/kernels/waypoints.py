"""Modified random waypoints of many particles at once (Ercan et al. 2007, Sec. 4.1).

The regime of a step is 0: toward the target, 1: toward a new one, 2: none.
"""

import numpy as np

from wsnsim.kernels.jit import kernel
from wsnsim.types import FloatArray, IntArray


@kernel
def waypoint_steps(
    places: FloatArray,
    targets: FloatArray,
    speeds: FloatArray,
    draws: FloatArray,
    fresh: FloatArray,
    noise: FloatArray,
    memory: float,
    reached: tuple[float, float],
    under_way: tuple[float, float],
) -> tuple[FloatArray, FloatArray, FloatArray, IntArray]:
    """Move each particle by one step.

    Parameters
    ----------
    places, targets, speeds : (m, 2), (m, 2), (m,) - before the step [m], [m], [m/step]
    draws : (m,) - uniform in 0 to 1, of the regime
    fresh : (m, 2) - the target of a particle that takes a new one [m]
    noise : (m, 2) - added to the step [m]
    memory : φ, weight of the length just walked in the new speed
    reached, under_way : probabilities of the regimes 0 and 1 nearer to the target than a step, and elsewhere

    Returns
    -------
    places, targets, speeds, regimes : after the step
    """
    count = len(places)
    new_places, new_targets, new_speeds = places.copy(), targets.copy(), speeds.copy()
    regimes = np.full(count, 2, np.int64)
    for i in range(count):
        wx, wy = targets[i, 0] - places[i, 0], targets[i, 1] - places[i, 1]
        left = np.sqrt(wx * wx + wy * wy)
        towards, change = reached if left < speeds[i] else under_way
        if draws[i] >= towards + change:
            continue
        regimes[i] = 0
        if draws[i] >= towards:
            regimes[i] = 1
            new_targets[i] = fresh[i]
            wx, wy = fresh[i, 0] - places[i, 0], fresh[i, 1] - places[i, 1]
            left = np.sqrt(wx * wx + wy * wy)
        share = speeds[i] / left if left > 0.0 else 0.0
        sx, sy = share * wx + noise[i, 0], share * wy + noise[i, 1]
        new_places[i, 0] += sx
        new_places[i, 1] += sy
        new_speeds[i] = (1.0 - memory) * speeds[i] + memory * np.sqrt(sx * sx + sy * sy)
    return new_places, new_targets, new_speeds, regimes


@kernel
def mean_waypoint_steps(
    places: FloatArray,
    targets: FloatArray,
    speeds: FloatArray,
    low: FloatArray,
    high: FloatArray,
    reached: tuple[float, float],
    under_way: tuple[float, float],
) -> FloatArray:
    """Return where each particle is after one step in the mean, (m, 2) [m]; parameters as above.

    Parameters
    ----------
    low, high : (2,) - corners of the room, in which new targets are uniform [m]
    """
    result = mean_directions(places, low, high)
    for i in range(len(places)):
        wx, wy = targets[i, 0] - places[i, 0], targets[i, 1] - places[i, 1]
        left = np.sqrt(wx * wx + wy * wy)
        towards, change = reached if left < speeds[i] else under_way
        share = towards / left if left > 0.0 else 0.0
        result[i, 0] = places[i, 0] + speeds[i] * (share * wx + change * result[i, 0])
        result[i, 1] = places[i, 1] + speeds[i] * (share * wy + change * result[i, 1])
    return result


@kernel
def mean_directions(places: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Return the mean unit vectors from places (m, 2) to a place that is uniform in a rectangle, (m, 2).

    The integral of x / √(x² + y²) over a rectangle is that of √(x² + y²) over its right side, less over its
    left.
    """
    result = np.empty((len(places), 2))
    area = (high[0] - low[0]) * (high[1] - low[1])
    for i in range(len(places)):
        left, below = low[0] - places[i, 0], low[1] - places[i, 1]
        right, above = high[0] - places[i, 0], high[1] - places[i, 1]
        across = side_integral(right, below, above) - side_integral(left, below, above)
        up = side_integral(above, left, right) - side_integral(below, left, right)
        result[i, 0], result[i, 1] = across / area, up / area
    return result


@kernel
def side_integral(at: float, start: float, end: float) -> float:
    """Return the integral of √(at² + y²) for y from `start` to `end`."""
    first, last = np.sqrt(at * at + start * start), np.sqrt(at * at + end * end)
    result = end * last - start * first
    if at != 0.0:
        # y + √(at² + y²) cancels below 0; both such sums are above 0 as at is not 0
        above = end + last if end > 0.0 else at * at / (last - end)
        below = start + first if start > 0.0 else at * at / (first - start)
        result += at * at * np.log(above / below)
    return float(0.5 * result)
