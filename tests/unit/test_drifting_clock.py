"""A mote's clock: what it shows, when it shows it, and what setting it does."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsnsim.hardware.clocks import DriftingClock

S = 1_000_000_000
TIMES = st.integers(0, 10**15)


def test_a_clock_that_runs_fast_gains_its_parts_per_million():
    fast, slow, right = DriftingClock(20.0), DriftingClock(-20.0), DriftingClock(0.0)
    assert fast.shown_ns(50 * S) == 50 * S + 1_000_000
    assert slow.shown_ns(50 * S) == 50 * S - 1_000_000
    assert right.shown_ns(12_345) == right.true_ns(12_345) == 12_345


def test_a_clock_that_was_set_drifts_from_there():
    clock = DriftingClock(-100.0)
    clock.set(7 * S, 7 * S + 300)
    assert clock.shown_ns(7 * S) == 7 * S + 300
    assert clock.shown_ns(8 * S) == 8 * S + 300 - 100_000


@given(drift_ppm=st.floats(-1000, 1000), set_at=TIMES, set_to=TIMES, ahead=TIMES)
def test_a_time_is_shown_first_at_the_time_that_is_told(drift_ppm, set_at, set_to, ahead):
    clock = DriftingClock(drift_ppm)
    clock.set(set_at, set_to)
    true_ns = clock.true_ns(set_to + ahead)
    assert clock.shown_ns(true_ns) >= set_to + ahead
    if ahead > 0:
        assert clock.shown_ns(true_ns - 1) < set_to + ahead
    assert true_ns - set_at == pytest.approx(ahead / (1 + drift_ppm * 1e-6), rel=1e-9, abs=1)
