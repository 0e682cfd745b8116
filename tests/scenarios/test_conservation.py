"""What every run must keep: messages, joules and time; over all networks, in overload and in death."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import wsnsim
from wsnsim.metrics.conservation import violations
from wsnsim.metrics.figures import DROPPED
from wsnsim.runs.result import Run

SHORT = ("duration_s=3", "expect={}")
DYING = (
    "motes.default.battery={kind: capacity, capacity_j: 1.0}",
    "motes.nodes=[{id: relay, position_m: [17, 4, 3]}, {id: c2, battery: {kind: capacity, capacity_j: 0.6}}]",
)

MESH = {"kind": "grid", "nodes": 9, "spacing_m": 40}
REPAIR = {"kind": "etx_tree", "repair": {}}
DISCOVER = {"kind": "etx_tree", "repair": {"initial": "discover", "no_route": "drop", "hop_limit": 3}}
MANY_PACKETS = {"period_s": 0.1, "payload_bytes": 300}
WIFI = {"standard": "ieee80211b", "tx_power_dbm": 8}


def frail(*capacities_j: float) -> dict[str, Any]:
    """Return batteries that some relays of the mesh empty on the way."""
    batteries = [{"kind": "capacity", "capacity_j": joules} for joules in capacities_j]
    return {"nodes": [{"id": n, "battery": b} for n, b in zip(("n1", "n3", "n4"), batteries, strict=True)]}


def budget(at_limit: str) -> dict[str, Any]:
    return {"default": {"platform": "telosb", "budget": {"bandwidth_bps": 4000, "at_limit": at_limit}}}


def outcome(run: Run) -> list[str]:
    return violations(run.tables, run.summary["simulated_s"])


@pytest.mark.parametrize(
    "overrides",
    [
        ("network.standard=ideal",),
        ("network.standard=ieee802154", "record.frames=true"),
        ("network.collision=destructive",),
        ("system.encoding=float64", "system.particles=1000"),
        ("network.mac={kind: csma_ca, queue_frames: 1, outbox_datagrams: 1, cca_threshold_dbm: -60}",),
        ("motes.default.platform=telosb",),
        ("system.deadline_s=0.01",),
        DYING,
        (*DYING, "network.standard=ideal"),
    ],
)
def test_nothing_is_lost_or_made(scenarios: Path, overrides: tuple[str, ...]) -> None:
    assert outcome(wsnsim.run(scenarios / "quickstart.yaml", overrides=(*SHORT, *overrides))) == []


@pytest.mark.parametrize(
    ("network", "motes", "system"),
    [
        pytest.param(
            {"routing": REPAIR}, frail(0.1, 0.15, 0.2), {"period_s": 0.2}, id="csma_ca, repair, deaths"
        ),
        pytest.param(
            {"routing": DISCOVER, "fading": {"kind": "rayleigh"}},
            frail(0.1, 0.15, 0.2),
            {"period_s": 0.2},
            id="csma_ca, ways found, fading, deaths",
        ),
        pytest.param(
            {
                "mac": {"kind": "csma_ca", "queue_frames": 3, "outbox_datagrams": 2},
                "queue_policy": "drop_random",
                "collision": "capture",
            },
            {"sinks": [{"id": "gate", "position_m": [90, 90, 0]}]},
            MANY_PACKETS,
            id="csma_ca, two sinks, full queues",
        ),
        pytest.param(
            {"routing": {"kind": "etx_tree", "estimate": "probes", "probes": 5, "probe_interval_s": 0.2}},
            {},
            {"period_s": 0.2, "payload_bytes": 200},
            id="csma_ca, probes",
        ),
        pytest.param(
            {"mac": {"kind": "lpl"}}, frail(0.03, 0.05, 0.1), {"saturated": True}, id="lpl, saturated, deaths"
        ),
        pytest.param(
            {"mac": {"kind": "lpl", "queue_frames": 4}, "routing": REPAIR, "queue_policy": "drop_oldest"},
            frail(0.03, 0.05, 0.1),
            {"period_s": 0.5},
            id="lpl, repair, full queues",
        ),
        pytest.param({"mac": {"kind": "tdma"}}, {}, {"saturated": True}, id="tdma, saturated"),
        pytest.param(
            {"mac": {"kind": "tdma", "queue_frames": 3}, "fading": {"kind": "rician"}},
            {},
            MANY_PACKETS,
            id="tdma, fading, full queues",
        ),
        pytest.param(
            WIFI, {}, {"saturated": True, "payload_bytes": 3000, "period_s": 0.01}, id="dcf, saturated"
        ),
        pytest.param(
            {**WIFI, "routing": REPAIR}, frail(1, 2, 3), {"period_s": 0.05}, id="dcf, repair, deaths"
        ),
        pytest.param({}, budget("drop"), {"period_s": 0.1}, id="budget, drop"),
        pytest.param({"routing": REPAIR}, budget("delay"), {"saturated": True}, id="budget, delay, repair"),
        pytest.param(
            {"mac": {"kind": "tdma"}}, budget("degrade"), {"period_s": 0.2}, id="budget, degrade, tdma"
        ),
        pytest.param({"mac": {"kind": "lpl"}}, budget("delay"), {"period_s": 0.2}, id="budget, delay, lpl"),
    ],
)
def test_every_packet_and_every_second_has_its_place(
    network: dict[str, Any], motes: dict[str, Any], system: dict[str, Any]
) -> None:
    """Packets made are packets delivered, lost by one cause or on their way; and a seed is a run."""
    scenario = {
        "duration_s": 4,
        "motes": {"layout": MESH, "default": {"platform": "telosb"}, **motes},
        "network": network,
        "system": {"kind": "traffic", "drain_s": 0.5, **system},
    }
    run, again = wsnsim.run(scenario, seed=5), wsnsim.run(scenario, seed=5)
    assert outcome(run) == []
    figures = run.summary
    assert figures["generated"] > 0 < figures["delivered"]
    assert figures["generated"] == run.messages["message"].nunique() == len(run.messages)
    assert figures["generated"] == sum(figures[key] for key in ("delivered", "fused", "in_flight", *DROPPED))
    assert set(run.tables["energy"].query("component == 'radio'")["node"]) == set(run.nodes["node"])
    stopped = {node for node, lived in run.nodes.set_index("node")["died_at_s"].items() if lived > 0}
    assert stopped == {entry["id"] for entry in motes.get("nodes", [])}
    for name, table in run.tables.items():
        pd.testing.assert_frame_equal(table, again.tables[name], check_exact=True)


def test_the_quickstart_conserves(quickstart: Run) -> None:
    assert outcome(quickstart) == []


def test_a_mote_dies_at_the_instant_its_battery_is_empty(scenarios: Path) -> None:
    run = wsnsim.run(scenarios / "quickstart.yaml", overrides=(*SHORT, *DYING))
    nodes = run.nodes.set_index("node")
    assert nodes.loc["c2", "died_at_s"] < nodes.loc["c1", "died_at_s"] < 3.25
    np.testing.assert_allclose(nodes.loc[["c1", "c2", "c3", "c4"], "battery_left_j"], 0.0, atol=1e-12)
    deaths = run.tables["events"].query("kind == 'death'").set_index("node")["time_s"]
    np.testing.assert_array_equal(deaths[["c1", "c2"]], nodes.loc[["c1", "c2"], "died_at_s"])
    late = run.tables["messages"].query("source == 'c2'")
    assert (late["created_s"] <= nodes.loc["c2", "died_at_s"]).all()
    assert nodes.loc["base", "died_at_s"] is None or np.isnan(nodes.loc["base", "died_at_s"])


def test_a_mote_too_slow_for_its_frames_says_so(scenarios: Path) -> None:
    run = wsnsim.run(scenarios / "quickstart.yaml", overrides=(*SHORT, "motes.default.platform=telosb"))
    assert run.summary["images_skipped"] > 0
    skipped = run.tables["events"].query("kind == 'frame_skipped'")
    assert len(skipped) == run.summary["images_skipped"] == run.nodes["images_skipped"].sum()
    cameras = run.nodes.query("role == 'camera'")
    assert (cameras["images_taken"] + cameras["images_skipped"] == 12).all()


def test_only_motes_that_send_show_transmit_energy(quickstart: Run) -> None:
    nodes = quickstart.nodes
    assert ((nodes["energy_radio_tx_j"] > 0) == (nodes["frames_tx"] > 0)).all()
    assert (nodes["energy_radio_listen_j"] > 0).all()


def test_float64_weights_do_not_fit_and_the_report_says_so(scenarios: Path, tmp_path: Path) -> None:
    """Four cameras, 1000 particles, 4 Hz: 1.03 Mbit/s wanted, 250 kbit/s there."""
    run = wsnsim.run(
        scenarios / "published" / "multiview_setup_a.yaml",
        overrides=("network.standard=ieee802154",),
        out=tmp_path,
    )
    assert outcome(run) == []
    weights = run.messages.query("kind == 'weights'")
    assert (weights["outcome"] == "delivered").mean() < 0.2
    assert run.summary["unmeasured_steps"] > 18
    page = (tmp_path / "report.html").read_text()
    words = " ".join(page.replace("\u202f", " ").replace("\u00a0", " ").split())
    assert "The network could not carry it" in words
    assert "would take 1.03 Mbit/s" in words
    assert "a channel of 250 kbit/s" in words
