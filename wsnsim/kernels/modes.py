"""Hill climbing on a Gaussian mixture."""

import numpy as np

from wsnsim.kernels.cholesky import factorise, solve
from wsnsim.kernels.jit import frozen, kernel
from wsnsim.types import FloatArray


def climb(
    log_peaks: FloatArray,
    means: FloatArray,
    precisions: FloatArray,
    starts: FloatArray,
    most_steps: int,
    tolerance: float,
) -> tuple[FloatArray, FloatArray]:
    """Return the points (n, d) reached uphill from each start, and the log-densities (n,) there.

    A Newton step where the log-density is concave and the step leads higher; else a step
    of the fixed point x = (Σ pⱼ Aⱼ)⁻¹ Σ pⱼ Aⱼ μⱼ, pⱼ the shares of the components at x, which never leads
    down.

    Parameters
    ----------
    log_peaks : (k,) - logarithms of the components' densities at their own means, weights included
    means : (k, d)
    precisions : (k, d, d) - A, inverse covariances
    starts : (n, d)
    most_steps : a start
    tolerance : length of a fixed-point step, in standard deviations there, up to which to stop

    References
    ----------
    Carreira-Perpiñán (2000), Mode-finding for mixtures of Gaussian distributions: both kinds of steps.
    """
    return _climb(
        frozen(log_peaks, np.float64),
        frozen(means, np.float64),
        frozen(precisions, np.float64),
        frozen(starts, np.float64),
        most_steps,
        tolerance,
    )


@kernel
def _climb(
    log_peaks: FloatArray,
    means: FloatArray,
    precisions: FloatArray,
    starts: FloatArray,
    most_steps: int,
    tolerance: float,
) -> tuple[FloatArray, FloatArray]:
    d = means.shape[1]
    points, logs = starts.copy(), np.zeros(len(starts))
    terms, pulls = np.zeros(len(means)), np.zeros(means.shape)
    slope, step, trial = np.zeros(d), np.zeros(d), np.zeros(d)
    precision, bend, root = np.zeros((d, d)), np.zeros((d, d)), np.zeros((d, d))
    for n in range(len(starts)):
        point = points[n]
        here = _log_density(log_peaks, means, precisions, point, terms, pulls)
        for _ in range(most_steps):
            _slopes(terms, pulls, precisions, slope, precision, bend)
            step[:] = slope
            factorise(precision, root, 0.0)
            solve(root, step)
            length = 0.0
            for a in range(d):
                length += slope[a] * step[a]
            if length <= tolerance**2:
                break
            trial[:] = point + step
            if factorise(bend, root, 0.0) > -np.inf:
                step[:] = slope
                solve(root, step)
                step += point
                if _log_density(log_peaks, means, precisions, step, terms, pulls) > here:
                    trial[:] = step
            there = _log_density(log_peaks, means, precisions, trial, terms, pulls)
            if there < here:  # by rounding: the top is reached
                break
            point[:] = trial
            here = there
        logs[n] = here
    return points, logs


@kernel
def _log_density(
    log_peaks: FloatArray,
    means: FloatArray,
    precisions: FloatArray,
    point: FloatArray,
    terms: FloatArray,
    pulls: FloatArray,
) -> float:
    """Return the log-density; write the components' shares (k,) and pulls A (μ − x) (k, d)."""
    d = len(point)
    largest = -np.inf
    for j in range(len(means)):
        square = 0.0
        for a in range(d):
            pulls[j, a] = 0.0
            for b in range(d):
                pulls[j, a] += precisions[j, a, b] * (means[j, b] - point[b])
            square += pulls[j, a] * (means[j, a] - point[a])
        terms[j] = log_peaks[j] - 0.5 * square
        largest = max(largest, terms[j])
    total = 0.0
    for j in range(len(means)):
        terms[j] = np.exp(terms[j] - largest)
        total += terms[j]
    terms /= total
    return float(largest + np.log(total))


@kernel
def _slopes(
    terms: FloatArray,
    pulls: FloatArray,
    precisions: FloatArray,
    slope: FloatArray,
    precision: FloatArray,
    bend: FloatArray,
) -> None:
    """Write the log-density's gradient, the mean precision, and the negative of its second derivative."""
    slope[:] = 0.0
    precision[:] = 0.0
    bend[:] = 0.0
    d = len(slope)
    for j in range(len(terms)):
        for a in range(d):
            slope[a] += terms[j] * pulls[j, a]
            for b in range(d):
                precision[a, b] += terms[j] * precisions[j, a, b]
                bend[a, b] -= terms[j] * pulls[j, a] * pulls[j, b]
    for a in range(d):
        for b in range(d):
            bend[a, b] += precision[a, b] + slope[a] * slope[b]
