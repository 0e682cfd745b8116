"""Intervals and exact tests against SciPy, closed forms, and their own promise to cover."""

import numpy as np
import pytest
from scipy import stats

from wsnsim.metrics.statistics import mean_interval, ratio_interval, share_interval, sign_test


@pytest.mark.parametrize("confidence", [0.9, 0.95])
def test_the_mean_has_students_interval(test_seed: int, confidence: float) -> None:
    values = np.random.default_rng([test_seed, 1]).normal(3.0, 2.0, 15)
    ours = mean_interval([*values, np.nan], confidence)
    peer = stats.ttest_1samp(values, 0.0).confidence_interval(confidence)
    assert (ours.low, ours.high) == pytest.approx((peer.low, peer.high), rel=1e-12)
    assert ours.value == pytest.approx(values.mean())
    assert ours.n == 15


def test_one_value_has_no_interval_and_none_has_no_mean() -> None:
    one = mean_interval([4.0])
    assert one.value == 4.0
    assert np.isnan([one.low, one.high]).all()
    none = mean_interval([np.nan])
    assert none.n == 0
    assert np.isnan(none.value)


def test_the_interval_covers_as_often_as_it_says(test_seed: int) -> None:
    """4000 samples of six; the share that covers is within 4.5 of its standard errors."""
    samples = np.random.default_rng([test_seed, 2]).normal(1.0, 0.7, (4000, 6))
    covers = [(i := mean_interval(sample)).low <= 1.0 <= i.high for sample in samples]
    assert abs(np.mean(covers) - 0.95) < 4.5 * np.sqrt(0.95 * 0.05 / 4000)


def test_paired_ratios_have_the_interval_of_their_logarithms(test_seed: int) -> None:
    rng = np.random.default_rng([test_seed, 3])
    below = rng.lognormal(0.0, 1.0, 12)
    above = below * rng.lognormal(0.2, 0.1, 12)
    ours = ratio_interval(above, below)
    assert ours.value == pytest.approx(stats.gmean(above / below))
    peer = stats.ttest_rel(np.log(above), np.log(below)).confidence_interval(0.95)
    assert (ours.low, ours.high) == pytest.approx((np.exp(peer.low), np.exp(peer.high)))
    turned = ratio_interval(below, above)
    assert (1 / turned.high, 1 / turned.low) == pytest.approx((ours.low, ours.high))


def test_pairs_without_a_ratio_are_left_out() -> None:
    ratio = ratio_interval([2.0, 0.0, np.nan, 8.0], [1.0, 1.0, 1.0, 1.0])
    assert ratio.value == pytest.approx(4.0)
    assert ratio.n == 2


@pytest.mark.parametrize(("hits", "n"), [(0, 15), (1, 15), (7, 15), (15, 15), (3, 200)])
def test_shares_have_the_interval_of_clopper_and_pearson(hits: int, n: int) -> None:
    ours = share_interval(hits, n)
    peer = stats.binomtest(hits, n).proportion_ci(0.95, "exact")
    assert (ours.value, ours.n) == (hits / n, n)
    assert (ours.low, ours.high) == pytest.approx((peer.low, peer.high), abs=1e-12)


def test_no_loss_in_fifteen_runs_leaves_a_fifth_possible() -> None:
    """Closed form: the upper end of 0 of n is 1 - (α/2)^(1/n)."""
    assert share_interval(0, 15).high == pytest.approx(1 - 0.025 ** (1 / 15))
    assert share_interval(0, 15).high == pytest.approx(0.2180, abs=5e-5)
    with pytest.raises(ValueError, match="between 0 and 3, got 4"):
        share_interval(4, 3)


@pytest.mark.parametrize(("ups", "downs"), [(0, 0), (5, 0), (0, 5), (3, 4), (12, 3), (8, 8)])
def test_the_sign_test_is_the_exact_binomial_one(ups: int, downs: int) -> None:
    peer = stats.binomtest(ups, ups + downs).pvalue if ups + downs else 1.0
    assert sign_test(ups, downs) == pytest.approx(peer)


def test_five_of_five_is_one_in_sixteen() -> None:
    assert sign_test(5, 0) == pytest.approx(2 / 32)
    with pytest.raises(ValueError, match="negative"):
        sign_test(-1, 2)
