"""The numbers that claims turn on, each with an interval over the runs."""

from collections.abc import Callable

import numpy as np
import pandas as pd

from wsnsim.claims.rules import exact
from wsnsim.claims.scanline.evidence import Evidence, Place
from wsnsim.claims.scanline.speed import Speed
from wsnsim.claims.scanline.studies import DEFAULT, KALMAN, NONE, PERFECT, SDS, USUAL_CAMERAS
from wsnsim.metrics.statistics import Interval, mean_interval, ratio_interval
from wsnsim.types import FloatArray

Measure = Callable[[Evidence], Interval | None]
Where = Callable[[Evidence], Place | None]
"""Finds the runs of a setting."""

WANTED = 3.0
"""RMSE_tr of Fig. 11 [unit]."""


def error(where: Where) -> Measure:
    """Return the mean of a setting's RMSE [unit]."""

    def measure(evidence: Evidence) -> Interval | None:
        place = where(evidence)
        return None if place is None else mean_interval(place.rmse().to_numpy())

    return measure


def mean(where: Where, key: str) -> Measure:
    """Return the mean of another figure of a setting's runs."""

    def measure(evidence: Evidence) -> Interval | None:
        place = where(evidence)
        return None if place is None else mean_interval(place.figure(key).to_numpy())

    return measure


def ratio(where: Where, other: Where, key: str | None = None) -> Measure:
    """Return a setting's RMSE, or another figure, over another's: geometric mean over the same seeds."""

    def measure(evidence: Evidence) -> Interval | None:
        pairs = _pairs(evidence, where, other, key)
        return None if pairs is None else ratio_interval(*pairs)

    return measure


def least_ratio(where: Where, other: Where) -> Measure:
    """Return the least of the ratios of a setting's RMSE to another's, seed by seed: counted."""

    def measure(evidence: Evidence) -> Interval | None:
        pairs = _pairs(evidence, where, other, None)
        return None if pairs is None else exact(float((pairs[0] / pairs[1]).min()), len(pairs[0]))

    return measure


def growth(one: tuple[Where, Where], other: tuple[Where, Where]) -> Measure:
    """Return by how much one benefit is above another, seed by seed [unit].

    Parameters
    ----------
    one, other : the settings of a benefit
    """

    def measure(evidence: Evidence) -> Interval | None:
        above, below = (_pairs(evidence, *each, None) for each in (one, other))
        if above is None or below is None:
            return None
        return mean_interval((above[0] - above[1]) - (below[0] - below[1]))

    return measure


def _pairs(
    evidence: Evidence, where: Where, other: Where, key: str | None
) -> tuple[FloatArray, FloatArray] | None:
    """Return the figures of two settings on the seeds that both have."""
    ours, theirs = where(evidence), other(evidence)
    if ours is None or theirs is None:
        return None
    above, below = (each.rmse() if key is None else each.figure(key) for each in (ours, theirs))
    seeds = sorted(set(above.index) & set(below.index))
    return _column(above, seeds), _column(below, seeds)


def _column(values: "pd.Series[float]", seeds: list[int]) -> FloatArray:
    return np.asarray(values.loc[seeds], dtype=np.float64)


def curve(evidence: Evidence) -> tuple[FloatArray, FloatArray] | None:
    """Return Fig. 10's abscissae (k,) and errors (k, seeds), from perfect priors to none [unit].

    None where not all of its settings were run in this form.
    """
    names = [PERFECT, *(f"{KALMAN}-{sd}" for sd in SDS), NONE]
    places = [evidence.known(name) for name in names]
    found = [place for place in places if place is not None]
    if evidence.form != DEFAULT or len(found) < len(names):
        return None
    known = evidence.rooms.open
    at = np.array([0.0, *(known.filters[f"{KALMAN}-{sd}"] for sd in SDS), known.occluders])
    return at, np.array([place.rmse().to_numpy(np.float64) for place in found])


def crossing_of(at: FloatArray, errors: FloatArray) -> float:
    """Return where a curve (k,) of errors falls to its abscissae (k,); NaN where it nowhere does."""
    apart = errors - at
    for left in range(len(at) - 1):
        if apart[left] > 0.0 >= apart[left + 1]:
            share = apart[left] / (apart[left] - apart[left + 1])
            return float(at[left] + share * (at[left + 1] - at[left]))
    return float("nan")


def crossing(evidence: Evidence) -> Interval | None:
    """Return where the tracker is as good as the priors, RMSE_tr = RMSE_occ, mean over the seeds [unit]."""
    found = curve(evidence)
    if found is None:
        return None
    at, errors = found
    return mean_interval([crossing_of(at, own) for own in errors.T])


def gain_from_crossing(evidence: Evidence) -> Interval | None:
    """Return the error without priors over that with priors as good as the tracker."""
    found = curve(evidence)
    if found is None:
        return None
    at, errors = found
    return ratio_interval(errors[-1], [crossing_of(at, own) for own in errors.T])


def needed(evidence: Evidence, wanted: float = WANTED) -> float:
    """Return the RMSE_occ at which four cameras come to an error, of the mean curve; NaN: at none [unit]."""
    found = curve(evidence)
    if found is None:
        return float("nan")
    at, errors = found
    mean_errors = errors.mean(axis=1)
    if mean_errors[0] > wanted:
        return float("nan")
    for left in range(len(at) - 1):
        low, high = mean_errors[left], mean_errors[left + 1]
        if low <= wanted < high:
            return float(at[left] + (wanted - low) / (high - low) * (at[left + 1] - at[left]))
    return float(at[-1])


def needed_for(evidence: Evidence, cameras: int) -> float:
    """Return how good priors must be for an error of 3 units; NaN where perfect ones do not do [unit].

    With other than four cameras there are runs with perfect priors and with none only: where neither decides,
    on the straight line between them.
    """
    if cameras == USUAL_CAMERAS:
        return needed(evidence)
    places = [evidence.open_room(cameras, prior) for prior in (PERFECT, NONE)]
    perfect, none = (float(place.rmse().mean()) for place in places if place is not None)
    worst = evidence.rooms.open.occluders
    if perfect > WANTED:
        return float("nan")
    return worst if none <= WANTED else worst * (WANTED - perfect) / (none - perfect)


def time_growth(prior: str, low: int, high: int) -> Measure:
    """Return a step's CPU time with `high` cameras over that with `low`."""
    return _timed(lambda speed: speed.growth(prior, low, high))


def time_growth_over(prior: str, other: str, low: int, high: int) -> Measure:
    """Return the growth of a step's CPU time with some priors over that with others."""

    def compared(speed: Speed) -> float | None:
        above, below = speed.growth(prior, low, high), speed.growth(other, low, high)
        return None if above is None or below is None else above / below

    return _timed(compared)


def time_over(prior: str, other: str, cameras: int) -> Measure:
    """Return a step's CPU time with some priors over that with others."""
    return _timed(lambda speed: speed.over(prior, other, cameras))


def over_twin(cameras: int) -> Measure:
    """Return the CPU time of the plain-Python twin over that of a step with Gaussian priors."""
    return _timed(lambda speed: speed.over_twin.get(cameras))


def _timed(value: Callable[[Speed], float | None]) -> Measure:
    """Return a number of the measured CPU times; they are those of the mended tracker."""

    def measure(evidence: Evidence) -> Interval | None:
        if evidence.speed is None or evidence.form != DEFAULT:
            return None
        found = value(evidence.speed)
        return None if found is None else exact(found)

    return measure


COMPONENTS = ("radio_tx", "radio_rx", "radio_listen", "cpu", "camera", "board")


def energy_a_frame(evidence: Evidence, cell: str) -> dict[str, FloatArray]:
    """Return the joules of a camera's node a frame by component, (seeds,) each, mean over the cameras."""
    nodes, place = evidence.nodes[cell], evidence.on_air(cell)
    assert place is not None
    motes = nodes[nodes["role"] == "camera"]
    steps = place.figure("steps")
    means = motes.groupby("seed")[[f"energy_{each}_j" for each in COMPONENTS]].mean()
    return {
        each: (means[f"energy_{each}_j"] / steps.loc[means.index]).to_numpy(np.float64) for each in COMPONENTS
    }


def energy_ratio(cell: str, other: str, components: tuple[str, ...]) -> Measure:
    """Return a camera's joules a frame in one setting over those in another."""

    def measure(evidence: Evidence) -> Interval | None:
        if evidence.form != DEFAULT or not {cell, other} <= set(evidence.nodes):
            return None
        sums = [
            np.sum([energy_a_frame(evidence, name)[each] for each in components], axis=0)
            for name in (cell, other)
        ]
        return ratio_interval(*sums)

    return measure


def head_cycles(evidence: Evidence, cell: str) -> float:
    """Return the cluster head's cycles a frame, mean over the runs."""
    nodes, place = evidence.nodes[cell], evidence.on_air(cell)
    assert place is not None
    head = nodes[nodes["role"] == "base"].groupby("seed")["cpu_cycles"].sum()
    return float((head / place.figure("steps").loc[head.index]).mean())
