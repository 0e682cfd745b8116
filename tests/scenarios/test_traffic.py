"""Whole runs without cameras: against ns-3 and an exact Monte Carlo, in and out of files, and refused."""

import json
import sqlite3

import numpy as np
import pytest

import wsnsim
from wsnsim.errors import ScenarioError
from wsnsim.metrics.conservation import violations
from wsnsim.metrics.figures import DROPPED, SUMMARY_KEYS, TRACKING_KEYS

NS3 = {
    "noise_dbm": -106.99,
    "sensitivity_dbm": -111.98,
    "lock_sinr_db": -5,
    "mesh_header_bytes": 0,
    "mac": {"kind": "csma_ca", "cca": "end_of_window", "cca_threshold_dbm": -96.6, "max_channel_retries": 0},
}
"""ns-3's lr-wpan module in a scenario's words."""


def traffic(layout, duration_s, network=None, motes=None, **system):
    return {
        "duration_s": duration_s,
        "motes": {"layout": layout, "default": {"platform": "telosb"}, **(motes or {})},
        "network": NS3 if network is None else network,
        "system": {"kind": "traffic", **system},
    }


def sound(run):
    assert violations(run.tables, run.summary["simulated_s"]) == []
    figures = run.summary
    assert figures["generated"] == sum(figures[key] for key in ("delivered", "fused", "in_flight", *DROPPED))
    return figures


@pytest.mark.parametrize("name", ["convergecast", "saturation", "line"])
def test_the_shipped_scenarios_meet_their_expectations(scenarios, name):
    run = wsnsim.run(scenarios / "network" / f"{name}.yaml")
    assert run.met, [str(each) for each in run.expectations]
    sound(run)


@pytest.mark.parametrize(
    ("nodes", "kbps", "busy", "fails"), [(2, 122.2, 0.547, 0.168), (5, 113.6, 0.797, 0.412)]
)
def test_saturated_senders_as_the_exact_monte_carlo_has_them(scenarios, nodes, kbps, busy, fails):
    overrides = (f"motes.layout.nodes={nodes + 1}", "duration_s=15", "expect={}")
    figures = sound(wsnsim.run(scenarios / "network" / "saturation.yaml", overrides=overrides, seed=3))
    assert figures["throughput_bps"] == pytest.approx(1e3 * kbps, rel=0.02)
    assert figures["cca_busy_ratio"] == pytest.approx(busy, abs=0.01)
    assert figures["attempt_failure_ratio"] == pytest.approx(fails, abs=0.015)


def test_one_hop_takes_as_long_as_the_standard_says():
    run = wsnsim.run(traffic({"kind": "star", "nodes": 2, "radius_m": 10}, 200, period_s=0.5))
    took = (run.messages["delivered_s"] - run.messages["created_s"]).to_numpy()
    assert took.min() == pytest.approx(4.064e-3, abs=1e-6)
    assert took.max() == pytest.approx(4.064e-3 + 2.240e-3, abs=1e-6)
    # eight equally likely backoffs, 0.733 ms a standard deviation
    assert run.summary["latency_mean_s"] == pytest.approx(5.184e-3, abs=3.5 * 0.7332e-3 / np.sqrt(400))
    assert run.summary["latency_max_s"] == took.max()


@pytest.mark.parametrize(
    ("layout", "duration_s", "period_s", "pdr", "delay_ms", "delay_error_ms"),
    # ns-3's figures; its standard error of the delay where it is told
    [("rgg_n10", 100, 10.0, 1.0, 5.866, 0.024), ("rgg_n50", 20, 1.0, 0.8624, 22.7, 0.5)],
)
def test_a_tree_as_ns3_has_it(shared, layout, duration_s, period_s, pdr, delay_ms, delay_error_ms):
    file = str(shared / "reference" / "radio" / f"{layout}.json")
    data = traffic(file, duration_s, period_s=period_s)
    runs = [wsnsim.run(data, seed=seed) for seed in range(3)]
    for run in runs:
        sound(run)
    ratios = [run.summary["delivery_ratio"] for run in runs]
    assert np.mean(ratios) == pytest.approx(pdr, abs=0.025)
    delays = np.concatenate(
        [(run.messages["delivered_s"] - run.messages["created_s"]).dropna() for run in runs]
    )
    error_ms = np.hypot(1e3 * np.std(delays) / np.sqrt(len(delays)), delay_error_ms)
    assert abs(1e3 * delays.mean() - delay_ms) < 3.5 * error_ms


def test_a_run_in_a_folder_repeats_from_its_own_scenario(tmp_path):
    data = traffic({"kind": "random", "nodes": 12, "side_m": 60}, 5, network={}, period_s=0.5)
    first = wsnsim.run(data, seed=4, out=tmp_path / "one")
    again = wsnsim.run(tmp_path / "one" / "scenario.yaml", out=tmp_path / "two")
    assert {**first.summary, "wall_s": 0} == {**again.summary, "wall_s": 0}
    for table in first.tables:
        dumps = []
        for folder in ("one", "two"):
            with sqlite3.connect(tmp_path / folder / "results.sqlite") as file:
                dumps.append(file.execute(f"SELECT * FROM {table}").fetchall())
        assert dumps[0] == dumps[1]
    figures = json.loads((tmp_path / "one" / "summary.json").read_text())
    # what only a tracker can have is not there, and everything else is
    assert set(figures) == SUMMARY_KEYS - TRACKING_KEYS
    for table in ("truth", "views", "estimates", "steps", "images"):
        assert first.tables[table].empty
    assert set(first.nodes["role"]) == {"mote", "base"}


def test_the_report_shows_the_network_and_nothing_of_cameras(tmp_path):
    data = traffic({"kind": "line", "nodes": 4, "spacing_m": 40}, 10, network={}, period_s=0.2)
    wsnsim.run(data, out=tmp_path / "run")
    page = (tmp_path / "run" / "report.html").read_text("utf-8")
    shown = page[: page.index("Software in this page")]
    for words in ("The network from above", "How long packets take", "What became of all packets", "3 motes"):
        assert words in shown
    for words in ("camera", "Camera", "Error over time", "tracker", "quality of information", "NaN"):
        assert words not in shown


@pytest.mark.parametrize("standard", ["ideal", "ieee802154"])
def test_the_load_is_noted_from_beginning_to_end(standard):
    data = traffic({"kind": "star", "nodes": 3, "radius_m": 5}, 7.5, {"standard": standard}, drain_s=1.25)
    run = wsnsim.run(data)
    load = run.tables["load"]
    assert load["time_s"].iloc[0] == 0
    assert load["time_s"].iloc[-1] == run.summary["simulated_s"] == 8.75
    assert (np.diff(load["time_s"]) > 0).all()
    assert len(load) >= 10
    assert run.summary["generated"] == 16
    assert run.summary["offered_bps"] == pytest.approx(16 * 800 / 7.5)
    sound(run)


def test_a_saturated_source_over_an_ideal_network_does_not_stop_time():
    data = traffic({"kind": "star", "nodes": 2, "radius_m": 5}, 10, {"standard": "ideal"}, saturated=True)
    assert wsnsim.run(data | {"seed": 1}).summary["generated"] == pytest.approx(10, abs=1)


def test_an_empty_battery_stops_a_source():
    motes = {"nodes": [{"id": "n1", "battery": {"kind": "capacity", "capacity_j": 0.2}}]}
    data = traffic({"kind": "star", "nodes": 3, "radius_m": 5}, 20, {}, motes, period_s=0.1)
    run = wsnsim.run(data)
    died = run.nodes.set_index("node")["died_at_s"]
    assert 1 < died["n1"] < 10
    sent = run.messages.groupby("source")["created_s"].max()
    assert sent["n1"] <= died["n1"] < 19 < sent["n2"]
    sound(run)


def test_long_packets_travel_in_fragments():
    data = traffic({"kind": "line", "nodes": 3, "spacing_m": 30}, 10, {}, payload_bytes=1000, period_s=2)
    run = wsnsim.run(data)
    assert set(run.messages["fragments"]) == {10}  # 104 bytes in each
    assert run.summary["delivery_ratio"] == 1.0
    sound(run)


def test_cameras_may_be_sources_too(scenarios):
    overrides = ("system={kind: traffic, period_s: 0.5}", "expect={}", "record={}", "duration_s=2")
    run = wsnsim.run(scenarios / "quickstart.yaml", overrides=overrides)
    assert set(run.messages["source"]) == {"c1", "c2", "c3", "c4", "relay"}
    assert run.summary["position_error_mean_m"] is None


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            {"layout": {"kind": "line", "nodes": 3, "spacing_m": 500}},
            r"network: routing: every node must reach.*\n.*'n1'",
        ),
        ({"sources": ["n9"]}, r"system\.sources\[0\]: must be the name of a mote, got 'n9'"),
        ({"payload_bytes": 9}, r"system\.payload_bytes: must be at least 10, got 9"),
        ({"payload_bytes": 600_000}, r"system\.payload_bytes: must be at most 524287, got 600000"),
        ({"period_s": 0}, r"system\.period_s: must be at least 1e-06, got 0"),
        ({"battery": 0}, r"motes\.nodes\[0\]\.battery\.capacity_j: must be greater than 0, got 0"),
        ({"battery": -5}, r"capacity_j: must be greater than 0, got -5"),
        ({"kind": "multiview"}, r"cameras: must be given \(what sees\)"),
    ],
)
def test_what_cannot_be_run_is_told_with_its_place(tmp_path, change, words):
    system = {key: value for key, value in change.items() if key not in ("layout", "battery")}
    nodes = []
    if "battery" in change:
        nodes = [{"id": "n1", "battery": {"kind": "capacity", "capacity_j": change["battery"]}}]
    layout = change.get("layout", {"kind": "line", "nodes": 3, "spacing_m": 20})
    file = tmp_path / "scenario.yaml"
    file.write_text(json.dumps(traffic(layout, 5, {}, {"nodes": nodes}, **system), indent=1))
    with pytest.raises(ScenarioError, match=rf"scenario\.yaml:\d+:\d+: {words}|{words}") as raised:
        wsnsim.run(file)
    assert "scenario.yaml:" in str(raised.value)


def test_motes_in_one_place_are_a_run_with_a_report(tmp_path):
    """They are a reference distance apart; the map has no extent of its own."""
    motes = {"nodes": [{"id": "a", "position_m": [3, 4, 1]}], "base": {"position_m": [3, 4, 1]}}
    data = {"duration_s": 4, "motes": motes, "system": {"kind": "traffic"}}
    run = wsnsim.run(data, out=tmp_path / "run")
    assert sound(run)["delivered"] == 4
    assert (tmp_path / "run" / "report.html").is_file()


@pytest.mark.parametrize("nodes", [{}, {"nodes": []}])
def test_a_base_station_alone_is_no_network(nodes):
    data = {
        "duration_s": 4,
        "motes": {"base": {"position_m": [3, 4, 1]}, **nodes},
        "system": {"kind": "traffic"},
    }
    with pytest.raises(ScenarioError) as refused:
        wsnsim.run(data)
    (problem,) = refused.value.problems
    assert str(problem).startswith("motes.nodes: must ")


def test_who_misspells_the_system_is_asked_for_nothing_else():
    layout = {"kind": "line", "nodes": 3, "spacing_m": 40}
    with pytest.raises(ScenarioError) as refused:
        wsnsim.run({"duration_s": 4, "motes": {"layout": layout}, "system": {"kind": "trafic"}})
    (problem,) = refused.value.problems
    assert str(problem).endswith('got "trafic"; did you mean "traffic"?')
