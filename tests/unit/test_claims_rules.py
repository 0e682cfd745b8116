"""Intervals against bands, and what the parts of a claim come to."""

from math import inf, nan

import numpy as np
import pytest
from scipy import stats

from wsnsim.claims.multiview.measures import single_camera_interval, welch_ratio
from wsnsim.claims.rules import Band, Claim, Mark, Part, Verdict, exact, judged, mark_of, verdict_of
from wsnsim.metrics.statistics import Interval

HOLDS, FAILS, UNDECIDED = Mark.HOLDS, Mark.FAILS, Mark.UNDECIDED


@pytest.mark.parametrize(
    ("low", "high", "band", "mark"),
    [
        (0.9, 1.1, Band(0.85, 1.15), HOLDS),
        (0.85, 1.15, Band(0.85, 1.15), HOLDS),
        (1.2, 1.3, Band(0.85, 1.15), FAILS),
        (0.5, 0.6, Band(0.85, 1.15), FAILS),
        (1.1, 1.2, Band(0.85, 1.15), UNDECIDED),
        (0.8, 1.2, Band(0.85, 1.15), UNDECIDED),
        (1.6, 9.0, Band(low=1.5), HOLDS),
        (1.4, 9.0, Band(low=1.5), UNDECIDED),
        (1.1, 1.4, Band(low=1.5), FAILS),
        (1.0, 1.0, Band(low=1.0), HOLDS),
        (1.0, 1.0, Band(low=1.0, open=True), FAILS),
        (1.01, 1.2, Band(low=1.0, open=True), HOLDS),
        (0.9, 1.1, Band(high=1.0, open=True), UNDECIDED),
        (0.0, 0.0, Band(0.0, 0.0), HOLDS),
        (2.0, 2.0, Band(0.0, 0.0), FAILS),
        (nan, nan, Band(-inf, inf), UNDECIDED),
    ],
)
def test_a_part_holds_only_if_its_whole_interval_lies_in_the_band(
    low: float, high: float, band: Band, mark: Mark
) -> None:
    assert mark_of(Interval((low + high) / 2, low, high, 15), band) is mark


@pytest.mark.parametrize(
    ("marks", "verdict"),
    [
        ([HOLDS, HOLDS], Verdict.REPRODUCED),
        ([HOLDS, FAILS], Verdict.IN_PART),
        ([HOLDS, UNDECIDED], Verdict.IN_PART),
        ([FAILS, UNDECIDED], Verdict.NOT_REPRODUCED),
        ([UNDECIDED], Verdict.NOT_REPRODUCED),
        ([], Verdict.NOT_RUN),
    ],
)
def test_a_claim_is_reproduced_only_if_all_parts_hold(marks: list[Mark], verdict: Verdict) -> None:
    assert verdict_of(marks) is verdict


def test_parts_that_nobody_ran_do_not_count() -> None:
    def part(value: Interval | None) -> Part[None]:
        return Part("a number", Band(low=1.0), lambda _: value, str)

    found = judged(Claim("key", "text", "where", (part(None), part(exact(2.0)))), None)
    assert [finding.mark for finding in found.findings] == [None, HOLDS]
    assert found.verdict is Verdict.REPRODUCED
    assert judged(Claim("key", "text", "where", (part(None),)), None).verdict is Verdict.NOT_RUN


def test_the_interval_of_two_groups_is_that_of_welch() -> None:
    rng = np.random.default_rng(3)
    above, below = rng.normal(0.3, 0.2, 5), rng.normal(0.0, 0.1, 10)
    found = welch_ratio(above, below)
    peer = stats.ttest_ind(above, below, equal_var=False).confidence_interval(0.95)
    assert (found.low, found.high) == pytest.approx((np.exp(peer.low), np.exp(peer.high)), rel=1e-9)
    assert found.value == pytest.approx(np.exp(above.mean() - below.mean()))
    assert found.n == 15


@pytest.mark.parametrize(
    ("participating", "found"),
    [
        ([3, 1, 1, 1, 2], (1, 3)),
        ([1, 1, 3, 1, 1, 1], (3, 5)),
        ([1, 1, 2, 1, 1], (0, 1)),
        ([2, 1, 2, 0, 1, 3], None),
        ([], None),
    ],
)
def test_the_longest_time_with_a_single_camera_is_found(
    participating: list[int], found: tuple[int, int] | None
) -> None:
    assert single_camera_interval(participating) == found
