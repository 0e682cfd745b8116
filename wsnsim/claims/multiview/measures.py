"""The numbers that claims turn on, each with an interval over the runs."""

from collections.abc import Callable, Sequence

import numpy as np
import pandas as pd

from wsnsim.claims.multiview.evidence import DEFAULT, ERROR_M, LOST, TRACKERS, Evidence, turning
from wsnsim.claims.rules import exact
from wsnsim.metrics.statistics import CONFIDENCE, Interval, mean_interval, ratio_interval
from wsnsim.types import FloatArray

Measure = Callable[[Evidence], Interval | None]

BEFORE, AFTER = 8, 3
"""Steps before a single-camera interval that it is compared to; steps after it in which one may come back."""
_SINGLE = 2
"""Steps in a row that only one camera sees the target make such an interval."""


def ratio(world: str, tracker: str, other: str, key: str = ERROR_M) -> Measure:
    """Return a tracker's figure over another's: geometric mean of the ratios on the same seeds."""

    def measure(evidence: Evidence) -> Interval | None:
        ours, theirs = evidence.figure(world, tracker, key), evidence.figure(world, other, key)
        if ours is None or theirs is None:
            return None
        seeds = sorted(set(ours.index) & set(theirs.index))
        return ratio_interval(ours.loc[seeds].to_numpy(), theirs.loc[seeds].to_numpy())

    return measure


def lost_runs(world: str, tracker: str) -> Measure:
    """Return in how many runs a tracker lost the target: counted."""

    def measure(evidence: Evidence) -> Interval | None:
        lost = evidence.figure(world, tracker, LOST)
        return None if lost is None else exact(float((lost > 0).sum()), len(lost))

    return measure


def mean(world: str, tracker: str, key: str) -> Measure:
    """Return the mean of a figure over a tracker's runs."""

    def measure(evidence: Evidence) -> Interval | None:
        values = evidence.figure(world, tracker, key)
        return None if values is None else mean_interval(values.to_numpy())

    return measure


def dependence_on_pixels(world: str, tracker: str) -> Measure:
    """Return the rank correlation (Spearman) of error and pixel share in a run, mean over the runs."""

    def measure(evidence: Evidence) -> Interval | None:
        steps = evidence.steps(world, tracker)
        if steps is None:
            return None
        return mean_interval([_rank_correlation(own) for _, own in steps.groupby("seed")])

    return measure


def _rank_correlation(steps: pd.DataFrame) -> float:
    both = steps[["error_m", "pixel_share"]].dropna()
    if len(both) < 3 or (both.nunique() < 2).any():
        return float("nan")
    ranks = both.rank().to_numpy(np.float64)
    return float(np.corrcoef(ranks.T)[0, 1])


def single_camera_error(tracker: str) -> Measure:
    """Return by how much a tracker's error in B grows while a single camera sees the target."""
    return _over_before(tracker, lambda errors, first, last: errors[first : last + 1])


def error_after_return(tracker: str) -> Measure:
    """Return a tracker's error in B from a few steps after the single-camera interval on, over before."""
    return _over_before(tracker, lambda errors, first, last: errors[last + 1 + AFTER :])


def _over_before(tracker: str, take: Callable[[FloatArray, int, int], FloatArray]) -> Measure:
    """Return the ratio of a run's mean error in some steps to that before its single-camera interval."""

    def measure(evidence: Evidence) -> Interval | None:
        steps = evidence.steps("B", tracker)
        if steps is None:
            return None
        above, below = [], []
        for _, own in steps.groupby("seed"):
            found = single_camera_interval(own["participating"].to_numpy(np.int64))
            if found is not None:
                errors = own["error_m"].to_numpy(np.float64)
                first, last = found
                above.append(_mean(take(errors, first, last)))
                below.append(_mean(errors[max(first - BEFORE, 0) : first]))
        return ratio_interval(above, below)

    return measure


def single_camera_interval(participating: Sequence[int] | np.ndarray) -> tuple[int, int] | None:
    """Return first and last index of the longest time in which one single camera sees the target."""
    best: tuple[int, int] | None = None
    first = None
    for at, count in enumerate([*participating, 0]):
        if count == 1:
            first = at if first is None else first
        elif first is not None:
            longest = best[1] - best[0] + 1 if best is not None else _SINGLE - 1
            if at - first > longest:
                best = (first, at - 1)
            first = None
    return best


def _mean(values: FloatArray) -> float:
    present = values[~np.isnan(values)]
    return float(present.mean()) if present.size else float("nan")


def turning_over_fixed(key: str) -> Measure:
    """Return a figure in B where the target turns over that where it does not.

    Each run counts by the geometric mean over all trackers; the groups have different
    seeds, so the interval is Welch's, of the logarithm.

    References
    ----------
    Welch (1947), The generalization of Student's problem when several different population variances
    are involved.
    """

    def measure(evidence: Evidence) -> Interval | None:
        rotates = turning(evidence)
        figures = [evidence.figure("B", tracker, key) for tracker in TRACKERS]
        present = [each for each in figures if each is not None]
        if len(present) < len(TRACKERS):
            return None
        logs = pd.concat([each.map(np.log) for each in present], axis=1).mean(axis=1)
        turns = np.array([rotates[int(seed)] for seed in logs.index])
        values = logs.to_numpy(np.float64)
        return welch_ratio(values[turns], values[~turns])

    return measure


def welch_ratio(above: FloatArray, below: FloatArray, confidence: float = CONFIDENCE) -> Interval:
    """Return the ratio of two groups' geometric means with Welch's interval.

    Parameters
    ----------
    above, below : (n,), (m,) - logarithms of the values
    confidence : of the interval [-]
    """
    above, below = above[~np.isnan(above)], below[~np.isnan(below)]
    n = len(above) + len(below)
    if min(len(above), len(below)) < 2:
        value = float(np.exp(above.mean() - below.mean())) if len(above) and len(below) else np.nan
        return Interval(value, np.nan, np.nan, n)
    from scipy.special import stdtrit

    apart = float(above.mean() - below.mean())
    parts = [group.var(ddof=1) / len(group) for group in (above, below)]
    square = float(sum(parts))
    if square == 0:
        return exact(float(np.exp(apart)), n)
    freedom = square**2 / sum(part**2 / (len(g) - 1) for part, g in zip(parts, (above, below), strict=True))
    half = float(stdtrit(freedom, 0.5 + confidence / 2) * np.sqrt(square))
    return Interval(float(np.exp(apart)), float(np.exp(apart - half)), float(np.exp(apart + half)), n)


def pixel_share_end(world: str, lowest: bool) -> Measure:
    """Return the least or greatest pixel share of a world, over all runs and steps in view: counted."""

    def measure(evidence: Evidence) -> Interval | None:
        shares = _true_steps(evidence, world)["pixel_share"].dropna()
        return exact(float(shares.min() if lowest else shares.max()), len(shares))

    return measure


def share_of_small_steps(world: str, below: float) -> Measure:
    """Return the share of steps in view at which the target covers less than `below`, mean over the runs."""

    def measure(evidence: Evidence) -> Interval | None:
        steps = _true_steps(evidence, world)[["seed", "pixel_share"]].dropna()
        return mean_interval([float((own["pixel_share"] < below).mean()) for _, own in steps.groupby("seed")])

    return measure


def _true_steps(evidence: Evidence, world: str) -> pd.DataFrame:
    """Return steps for what is true in them, which is the same for each tracker and form."""
    found = evidence.seen_as(DEFAULT).steps(world, "T2")
    assert found is not None
    return found


def given_up_steps(world: str, tracker: str) -> Measure:
    """Return at how many steps a tracker had declared its target lost, over all runs: counted."""

    def measure(evidence: Evidence) -> Interval | None:
        steps = evidence.steps(world, tracker)
        return None if steps is None else exact(float((steps["kind"] == "lost").sum()), len(steps))

    return measure


def measured_share(cell: str) -> Measure:
    """Return the share of steps whose estimate rests on images of that step, over the radio; default form."""

    def measure(evidence: Evidence) -> Interval | None:
        if evidence.form != DEFAULT:
            return None
        runs = evidence.radio.steps[cell].groupby("seed")
        return mean_interval([float((own["kind"] == "update").mean()) for _, own in runs])

    return measure


def in_time_share(cell: str, limit_s: float) -> Measure:
    """Return the share of steps measured within a time from their instant, over the radio; default form."""

    def measure(evidence: Evidence) -> Interval | None:
        if evidence.form != DEFAULT:
            return None
        runs = evidence.radio.steps[cell].groupby("seed")
        return mean_interval(
            [float(((own["kind"] == "update") & (own["latency_s"] <= limit_s)).mean()) for _, own in runs]
        )

    return measure
