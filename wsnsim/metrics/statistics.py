"""How sure a number from a few runs is: intervals of means, of paired ratios and of shares, exact tests.

The runs of a study are paired by their seeds: the same seed is the same world
and the same images, whatever the tracker. What is compared are differences and
ratios seed by seed, of which an interval tells more than one around each mean.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from wsnsim.types import FloatArray

CONFIDENCE = 0.95
"""Share of intervals that hold the true value, if the assumption behind them holds."""


@dataclass(frozen=True)
class Interval:
    """A figure and the interval around it; NaN where there is nothing to tell it from.

    Parameters
    ----------
    value : the estimate
    low, high : ends of the interval; NaN where a single value tells no spread
    n : values (or pairs) that it rests on
    """

    value: float
    low: float
    high: float
    n: int


def mean_interval(values: ArrayLike, confidence: float = CONFIDENCE) -> Interval:
    """Return the mean with Student's interval, missing values left out.

    Parameters
    ----------
    values : (n,) - independent, normal in good approximation; NaN where missing
    confidence : of the interval [-]

    References
    ----------
    Student (1908), The probable error of a mean.
    """
    present = _present(values)
    n = len(present)
    if n == 0:
        return Interval(np.nan, np.nan, np.nan, 0)
    mean = float(present.mean())
    if n == 1:
        return Interval(mean, np.nan, np.nan, 1)
    from scipy.special import stdtrit

    half = float(stdtrit(n - 1, 0.5 + confidence / 2) * present.std(ddof=1) / np.sqrt(n))
    return Interval(mean, mean - half, mean + half, n)


def ratio_interval(
    numerators: ArrayLike, denominators: ArrayLike, confidence: float = CONFIDENCE
) -> Interval:
    """Return the geometric mean of paired ratios with Student's interval of its logarithm.

    Parameters
    ----------
    numerators, denominators : (n,) - pairs; those with a missing or non-positive value are left out
    confidence : of the interval [-]
    """
    above, below = np.asarray(numerators, dtype=np.float64), np.asarray(denominators, dtype=np.float64)
    usable = (above > 0) & (below > 0)
    logs = mean_interval(np.log(above[usable]) - np.log(below[usable]), confidence)
    value, low, high = (float(np.exp(each)) for each in (logs.value, logs.low, logs.high))
    return Interval(value, low, high, logs.n)


def share_interval(hits: int, n: int, confidence: float = CONFIDENCE) -> Interval:
    """Return a share with the exact interval of a binomial distribution.

    Parameters
    ----------
    hits : how many of `n`
    n : independent trials
    confidence : at least that of the interval [-]

    Raises
    ------
    ValueError : `hits` is not between 0 and `n`

    References
    ----------
    Clopper & Pearson (1934), The use of confidence or fiducial limits.
    """
    if not 0 <= hits <= n:
        raise ValueError(f"hits must be between 0 and {n}, got {hits}")
    if n == 0:
        return Interval(np.nan, np.nan, np.nan, 0)
    from scipy.special import betaincinv

    tail = (1 - confidence) / 2
    low = 0.0 if hits == 0 else float(betaincinv(hits, n - hits + 1, tail))
    high = 1.0 if hits == n else float(betaincinv(hits + 1, n - hits, 1 - tail))
    return Interval(hits / n, low, high, n)


def sign_test(ups: int, downs: int) -> float:
    """Return the two-sided probability of so uneven a split, if up and down are equally likely.

    Of pairs of outcomes that are lost or not, those that differ make this
    McNemar's exact test.

    Parameters
    ----------
    ups, downs : pairs that changed one way and the other; those that did not change count for nothing

    References
    ----------
    Conover (1999), Practical Nonparametric Statistics, sec. 3.4 and 3.5.
    """
    if ups < 0 or downs < 0:
        raise ValueError(f"counts must not be negative, got {ups} and {downs}")
    from scipy.special import bdtr

    n = ups + downs
    return min(1.0, 2.0 * float(bdtr(min(ups, downs), n, 0.5))) if n else 1.0


def _present(values: ArrayLike) -> FloatArray:
    numbers = np.asarray(values, dtype=np.float64)
    return numbers[~np.isnan(numbers)]
