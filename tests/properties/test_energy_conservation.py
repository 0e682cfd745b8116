"""Whatever a node does, capacity = drawn + left, and the empty instant is exact."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsnsim.hardware.ledger import COMPONENTS, EnergyLedger

TRANSITIONS = st.lists(
    st.tuples(
        st.integers(0, 10**10),
        st.sampled_from(COMPONENTS),
        st.sampled_from(["a", "b", "c"]),
        st.floats(0, 5, allow_subnormal=False),
    ),
    max_size=40,
)


def play(ledger, transitions):
    """Return the time after all transitions."""
    now = 0
    for wait_ns, component, cause, power_w in transitions:
        ledger.enter(now, component, cause, power_w)
        now += wait_ns
    return now


@given(st.floats(1e-6, 1e5), TRANSITIONS)
def test_capacity_is_drawn_plus_left(capacity_j, transitions):
    ledger = EnergyLedger(capacity_j)
    now = play(ledger, transitions)
    by_cause = math.fsum(ledger.drawn_j(now).values())
    assert by_cause == pytest.approx(ledger.total_drawn_j(now), rel=1e-12, abs=1e-24)
    assert by_cause + ledger.left_j(now) == pytest.approx(capacity_j, rel=1e-9)
    assert 0 <= ledger.left_j(now) <= capacity_j * (1 + 1e-12)


@given(st.floats(1e-6, 1e3), TRANSITIONS)
def test_the_battery_lasts_to_the_nanosecond_before_and_not_after(capacity_j, transitions):
    ledger = EnergyLedger(capacity_j)
    now = play(ledger, transitions)
    ledger.total_drawn_j(now)
    empty_ns = ledger.empty_at_ns()
    if empty_ns is None:
        return
    if ledger.stopped:
        assert empty_ns <= now
    else:
        assert empty_ns > now
        ledger.left_j(empty_ns - 1)
        assert not ledger.stopped
        ledger.left_j(empty_ns)
    assert ledger.stopped
    assert ledger.total_drawn_j(max(now, empty_ns) + 10**12) == pytest.approx(capacity_j, rel=1e-9)


@given(TRANSITIONS)
def test_a_component_is_in_one_state_at_a_time(transitions):
    ledger = EnergyLedger(None)
    now = play(ledger, transitions)
    started = {}
    clock = 0
    for wait_ns, component, _, _ in transitions:
        started.setdefault(component, clock)
        clock += wait_ns
    spent = ledger.seconds(now)
    for component, since in started.items():
        seconds = math.fsum(v for (name, _), v in spent.items() if name == component)
        assert seconds == pytest.approx((now - since) / 1e9, rel=1e-12, abs=1e-12)
