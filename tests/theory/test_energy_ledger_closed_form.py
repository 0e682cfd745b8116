"""The ledger against sums that can be done by hand."""

import math
from fractions import Fraction

import numpy as np
import pytest

from wsnsim.errors import SimulationError
from wsnsim.hardware.ledger import EnergyLedger
from wsnsim.hardware.profiles import RADIOS

S = 1_000_000_000
CC2420 = RADIOS["cc2420"]


class Times:
    """The times of a component that a test moves from state to state by hand."""

    def __init__(self, *changes):
        self.changes, self.now = changes, changes[0][0]

    def at(self, now_ns):
        spent, state = dict.fromkeys(("listen", "transmit", "sleep"), 0), None
        for (begin, state), end in zip(
            self.changes, [*(begin for begin, _ in self.changes[1:]), 10**18], strict=True
        ):
            if begin > now_ns:
                break
            spent[state], now = spent[state] + min(now_ns, end) - begin, state
        return spent, now

    @property
    def state(self):
        return self.at(self.now)[1]

    def spent_ns(self, now_ns):
        self.now = now_ns
        return self.at(now_ns)[0]


POWERS = {"listen": 0.06, "transmit": 0.05, "sleep": 6e-5}


def test_a_component_that_is_asked_for_its_times_draws_what_one_that_tells_of_them_does():
    """Two accounts of the same states, one told of each change, one asked now and then: equal to the unit."""
    generator = np.random.default_rng(7)
    begins = np.cumsum(generator.integers(1, 10**8, 300)).tolist()
    changes = [(begin, str(generator.choice(list(POWERS)))) for begin in begins]
    told, asked = EnergyLedger(100.0), EnergyLedger(100.0)
    asked.meter(begins[0], "radio", Times(*changes), POWERS)
    for begin, state in changes:
        told.enter(begin, "radio", state, POWERS[state])
    looks = np.sort(generator.integers(begins[0], begins[-1] + S, 20)).tolist()
    for look in looks:
        asked.enter(look, "cpu", "work", 0.0)
    now = begins[-1] + 2 * S
    radio = {key: drawn for key, drawn in asked.drawn_j(now).items() if key[0] == "radio"}
    assert radio == told.drawn_j(now)
    assert asked.total_drawn_j(now) == told.total_drawn_j(now)
    assert math.fsum(s for (component, _), s in asked.seconds(now).items() if component == "radio") == (
        pytest.approx((now - begins[0]) / S, rel=1e-12)
    )


def test_a_battery_that_is_looked_at_in_time_empties_at_the_instant_though_nobody_tells_of_states():
    """Listening to 1 s, then sending: 0.06 J and the rest at 0.05 W."""
    changes = ((0, "listen"), (S, "transmit"))
    told, asked = EnergyLedger(0.0734), EnergyLedger(0.0734)
    asked.meter(0, "radio", Times(*changes), POWERS)
    for begin, state in changes:
        told.enter(begin, "radio", state, POWERS[state])
    empty_ns = told.empty_at_ns()
    assert empty_ns == pytest.approx(S + 268_000_000, abs=1)
    assert asked.left_j(S) == pytest.approx(0.0134)
    assert asked.empty_at_ns() == empty_ns
    assert asked.left_j(empty_ns - 1) > 0.0
    assert asked.left_j(empty_ns + S) == 0.0
    assert asked.empty_at_ns() == empty_ns
    assert asked.seconds(3 * S)["radio", "transmit"] == (empty_ns - S) / S
    assert asked.drawn_j(3 * S)["radio", "transmit"] == pytest.approx(0.0134)


def test_a_battery_that_is_looked_at_too_late_lasts_as_long_as_the_mean_power_allows():
    asked = EnergyLedger(0.055)
    asked.meter(0, "radio", Times((0, "listen"), (S, "transmit")), POWERS)
    assert asked.left_j(2 * S) == 0.0
    assert asked.empty_at_ns() == 2 * S * 0.055 / 0.11
    assert asked.total_drawn_j(3 * S) == pytest.approx(0.055, rel=1e-12)
    seconds = asked.seconds(3 * S)
    assert seconds["radio", "listen"] + seconds["radio", "transmit"] == pytest.approx(1.0, abs=1e-9)


def test_a_cc2420_that_only_listens_drains_two_aa_cells_in_3_842_days():
    ledger = EnergyLedger(18_720.0)
    ledger.enter(0, "radio", "listen", CC2420.listen_w)
    empty_ns = ledger.empty_at_ns()
    assert empty_ns / S / 86_400 == pytest.approx(3.842, abs=0.0005)
    exact = Fraction(18_720) * S / Fraction(CC2420.listen_w)
    assert abs(empty_ns - exact) <= 1 + exact * Fraction(1, 10**15)


def test_sending_a_100_byte_payload_costs_195_4_microjoules():
    ledger = EnergyLedger(None)
    ledger.enter(0, "radio", "listen", 0.0)
    ledger.enter(S, "radio", "transmit", CC2420.transmit_w(0.0))
    ledger.enter(S + 3_744_000, "radio", "listen", 0.0)
    drawn = ledger.drawn_j(2 * S)
    assert drawn["radio", "transmit"] == pytest.approx(195.4e-6, abs=0.05e-6)
    assert ledger.seconds(2 * S)["radio", "transmit"] == 3744e-6


def test_the_last_joule_ends_at_the_empty_instant_and_nothing_is_drawn_after_it():
    ledger = EnergyLedger(1e-6)
    ledger.enter(0, "radio", "listen", 0.07)
    ledger.enter(0, "cpu", "active", 0.023)
    ledger.enter(0, "board", "on", 0.0)
    empty_ns = ledger.empty_at_ns()
    assert empty_ns == 10_753  # 1 µJ / 93 mW = 10752.69 ns
    assert not ledger.stopped
    assert ledger.left_j(empty_ns - 1) > 0
    ledger.enter(empty_ns, "radio", "transmit", 1.0)
    assert ledger.stopped
    assert ledger.total_drawn_j(S) == pytest.approx(1e-6, rel=1e-12)
    assert ledger.left_j(S) == pytest.approx(0.0, abs=1e-18)
    assert ledger.drawn_j(S)["radio", "listen"] == pytest.approx(1e-6 * 70 / 93, rel=1e-9)
    assert ("radio", "transmit") not in ledger.drawn_j(S)
    assert ledger.seconds(S)["board", "on"] == empty_ns / S
    assert ledger.empty_at_ns() == empty_ns


def test_a_late_question_finds_the_same_end_as_a_punctual_one():
    late, punctual = EnergyLedger(2e-3), EnergyLedger(2e-3)
    for ledger in (late, punctual):
        ledger.enter(5, "radio", "listen", 0.0564)
        ledger.enter(9, "cpu", "idle", 0.0011)
    punctual.stop(punctual.empty_at_ns())
    late.stop(90 * S)
    assert late.empty_at_ns() == punctual.empty_at_ns()
    assert late.drawn_j(90 * S) == punctual.drawn_j(90 * S)
    assert late.seconds(90 * S) == punctual.seconds(90 * S)


def test_stop_freezes_the_account_before_the_battery_is_empty():
    ledger = EnergyLedger(100.0)
    ledger.enter(0, "board", "on", 2.0)
    ledger.stop(3 * S)
    ledger.enter(4 * S, "board", "on", 5.0)
    assert ledger.total_drawn_j(10 * S) == 6.0
    assert ledger.left_j(10 * S) == 94.0
    assert ledger.empty_at_ns() is None


def test_mains_never_empties():
    ledger = EnergyLedger(None)
    ledger.enter(0, "cpu", "active", 15.0)
    assert ledger.empty_at_ns() is None
    assert ledger.left_j(10**18) == math.inf
    assert ledger.total_drawn_j(10**18) == 15e9


def test_no_state_draws_nothing():
    ledger = EnergyLedger(1.0)
    assert ledger.empty_at_ns() is None
    assert ledger.left_j(10 * S) == 1.0


def test_a_million_transitions_lose_nothing():
    generator = np.random.default_rng(20)
    powers = {"listen": 0.0564, "transmit": 0.0522, "sleep": 60e-6}
    causes = list(powers)
    ledger = EnergyLedger(18_720.0)
    now = 0
    spent = dict.fromkeys(causes, 0)
    choices = generator.integers(0, 3, 1_000_000).tolist()
    steps = generator.integers(1, 40_000_000, 1_000_000).tolist()
    for choice, step in zip(choices, steps, strict=True):
        cause = causes[choice]
        ledger.enter(now, "radio", cause, powers[cause])
        spent[cause] += step
        now += step
    drawn = ledger.drawn_j(now)
    for cause in causes:
        assert drawn["radio", cause] == pytest.approx(powers[cause] * spent[cause] / S, rel=1e-12)
    assert ledger.total_drawn_j(now) + ledger.left_j(now) == pytest.approx(18_720.0, rel=1e-12)
    assert math.fsum(drawn.values()) == pytest.approx(ledger.total_drawn_j(now), rel=1e-12)


def test_time_cannot_run_backwards():
    ledger = EnergyLedger(1.0)
    ledger.enter(10, "radio", "listen", 0.1)
    with pytest.raises(SimulationError, match="must not run backwards, got 9 ns after 10 ns"):
        ledger.enter(9, "radio", "listen", 0.1)
    with pytest.raises(SimulationError):
        ledger.drawn_j(9)


@pytest.mark.parametrize("power_w", [-1.0, math.nan, math.inf])
def test_impossible_powers_are_refused(power_w):
    with pytest.raises(ValueError, match="radio listen: power must be a finite number >= 0"):
        EnergyLedger(1.0).enter(0, "radio", "listen", power_w)


def test_unknown_components_are_refused():
    with pytest.raises(ValueError, match="component must be one of radio, cpu, camera, board, got 'fan'"):
        EnergyLedger(1.0).enter(0, "fan", "on", 1.0)


@pytest.mark.parametrize("capacity_j", [-1.0, math.nan, math.inf])
def test_impossible_capacities_are_refused(capacity_j):
    with pytest.raises(ValueError, match="capacity_j must be"):
        EnergyLedger(capacity_j)
