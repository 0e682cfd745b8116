"""The conservation check passes a sound run and names what is wrong in an unsound one."""

import pytest

from wsnsim.metrics.conservation import violations

SIMULATED_S = 9.0


@pytest.mark.parametrize("load", ["fine", "overloaded"])
def test_a_sound_run_breaks_nothing(synthetic_run, load):
    assert violations(synthetic_run(load).tables, SIMULATED_S) == []


def changed(tables, table, row, **values):
    frame = tables[table].copy()
    for column, value in values.items():
        frame.loc[row, column] = value
    return {**tables, table: frame}


@pytest.mark.parametrize(
    ("table", "row", "values", "sentence"),
    [
        ("messages", 5, {"message": 0, "destination": "c1"}, "message 0 to c1: more than one fate"),
        ("messages", 5, {"outcome": "vanished"}, "unknown outcome 'vanished'"),
        ("messages", 5, {"outcome": "in_flight"}, "in_flight, but its delivery time disagrees"),
        ("messages", 5, {"delivered_s": 0.1}, "before it was created"),
        ("messages", 5, {"bytes": 1}, "application bytes counted"),
        ("nodes", 0, {"energy_cpu_j": 1.0}, "node c1: energy_cpu_j is 1.0, its causes add up to"),
        ("nodes", 0, {"battery_left_j": 18_000.0}, "node c1: 18720.0 J stored and harvested, but"),
        ("nodes", 0, {"died_at_s": 8.9}, "node c1: received a message at 9.004 s, after its death at 8.9 s"),
        ("energy", 0, {"seconds": 9.1}, "was on for"),
        ("energy", 0, {"cause": "unheard of", "component": "radio"}, "its causes add up to"),
    ],
)
def test_each_law_is_checked(synthetic_run, table, row, values, sentence):
    tables = synthetic_run().tables
    found = violations(changed(tables, table, row, **values), SIMULATED_S)
    assert any(sentence in violation for violation in found), found


def test_a_billionth_of_energy_is_noticed(synthetic_run):
    tables = synthetic_run().tables
    cpu_j = tables["nodes"]["energy_cpu_j"][0]
    assert violations(changed(tables, "nodes", 0, energy_cpu_j=cpu_j * (1 + 1e-12)), SIMULATED_S) == []
    assert violations(changed(tables, "nodes", 0, energy_cpu_j=cpu_j * (1 + 1e-8)), SIMULATED_S) != []
