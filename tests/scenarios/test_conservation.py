"""What every run must keep: messages, joules and time; over all networks, in overload and in death."""

from pathlib import Path

import numpy as np
import pytest

import wsnsim
from wsnsim.metrics.conservation import violations
from wsnsim.runs.result import Run

SHORT = ("duration_s=3", "expect={}")
DYING = (
    "motes.default.battery={kind: capacity, capacity_j: 1.0}",
    "motes.nodes=[{id: relay, position_m: [17, 4, 3]}, {id: c2, battery: {kind: capacity, capacity_j: 0.6}}]",
)


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
