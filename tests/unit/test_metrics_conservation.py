"""The conservation check passes a sound run and names what is wrong in an unsound one."""

import pytest

from wsnsim.metrics.conservation import violations

SIMULATED_S = 9.25


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
        ("messages", 5, {"outcome": "fused"}, "fused, but what it was fused into disagrees"),
        ("messages", 5, {"fused_into": 2}, "message 1: delivered, but what it was fused into disagrees"),
        ("messages", 5, {"fused_into": 10**6}, "message 1: fused into 1000000, which nobody sent"),
        ("messages", 5, {"fused_into": 2}, "message 1 to base: fused into 2, which c3 sent"),
        ("messages", 5, {"fused_into": 0}, "message 1: fused into 0, which was made before it arrived"),
        ("nodes", 0, {"energy_cpu_j": 1.0}, "node c1: energy_cpu_j is 1.0, its causes add up to"),
        ("nodes", 0, {"battery_left_j": 18_000.0}, "node c1: 18720.0 J stored and harvested, but"),
        ("nodes", 0, {"died_at_s": 8.9}, "node c1: received a message at 9.004 s, after its death at 8.9 s"),
        ("energy", 0, {"seconds": 9.1}, "node c1: its board was on for 9.1 s, not the 9.25 s it lived"),
        ("energy", 1, {"component": "camera"}, "node c1: its cpu was on for 5.55 s, not the 9.25 s it lived"),
        ("energy", 4, {"seconds": 9.3}, "node c1: its radio was on for"),
        ("energy", 1, {"seconds": 3.6}, "node c1: cpu_busy_s is 3.7, its processor worked 3.6 s"),
        ("nodes", 0, {"cpu_busy_s": 3.8}, "node c1: cpu_busy_s is 3.8, its processor worked 3.7 s"),
        ("load", 5, {"app_tx_bytes": 0}, "load: app_tx_bytes decreases"),
        ("load", 5, {"mac_tx_bytes": 0}, "load: mac_tx_bytes decreases"),
        ("load", 37, {"mac_tx_bytes": 10**7}, "load: mac_tx_bytes ends at 10000000, the nodes sent"),
        ("nodes", 0, {"mac_tx_bytes": 0}, "load: mac_tx_bytes ends at"),
        ("estimates", 3, {"kind": "guessed"}, "estimate of box for 1.0 s: unknown kind 'guessed'"),
        ("estimates", 3, {"made_at_s": 0.9}, "estimate of box for 1.0 s: made before that time"),
        ("estimates", 3, {"kind": "lost"}, "estimate of box for 1.0 s: of kind 'lost', with"),
        ("estimates", 3, {"heard": 0}, "of kind 'update', with 0 cameras heard"),
        ("energy", 0, {"cause": "unheard of", "component": "radio"}, "its causes add up to"),
    ],
)
def test_each_law_is_checked(synthetic_run, table, row, values, sentence):
    tables = synthetic_run().tables
    found = violations(changed(tables, table, row, **values), SIMULATED_S)
    assert any(sentence in violation for violation in found), found


@pytest.mark.parametrize(("table", "column"), [("nodes", "energy_cpu_j"), ("energy", "seconds")])
def test_a_hundred_millionth_is_noticed_and_rounding_is_not(synthetic_run, table, column):
    tables = synthetic_run().tables
    value = tables[table][column][0]
    assert violations(changed(tables, table, 0, **{column: value * (1 + 1e-12)}), SIMULATED_S) == []
    assert violations(changed(tables, table, 0, **{column: value * (1 + 1e-8)}), SIMULATED_S) != []


def test_a_run_without_load_is_no_run(synthetic_run):
    tables = synthetic_run().tables
    assert violations({**tables, "load": tables["load"].head(0)}, SIMULATED_S) == ["load: no row was written"]


def test_a_second_look_may_hear_nobody_and_a_lost_track_hears_nobody(synthetic_run):
    tables = synthetic_run().tables
    for kind in ("smoothed", "lost"):
        looked_again = changed(tables, "estimates", 3, kind=kind, heard=0)
        assert violations(looked_again, SIMULATED_S) == []


def test_a_component_that_left_no_trace_is_missed(synthetic_run):
    tables = synthetic_run().tables
    energy = tables["energy"]
    boardless = energy[(energy["node"] != "c1") | (energy["component"] != "board")]
    found = violations({**tables, "energy": boardless}, SIMULATED_S)
    assert "node c1: its board was on for 0.0 s, not the 9.25 s it lived" in found
