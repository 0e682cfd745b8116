"""What motes of 80, 416 and 1000 MHz can and cannot finish in a frame's time, side by side in one run."""

import pytest

from wsnsim.hardware.profiles import PLATFORMS
from wsnsim.metrics.conservation import violations
from wsnsim.runs.run import run
from wsnsim.scenario.load import load_scenario

RATE_HZ = 10
MOTES = {"c1": "stm32l476", "c2": "imote2_416", "c3": "rpi_zero2w", "c4": "cortex_a9_1200"}


@pytest.fixture(scope="module")
def mixed(scenarios, tmp_path_factory):
    """Return T0 with 1000 particles at 10 Hz on four kinds of motes, and a relay of a fifth."""
    kinds = ", ".join(f"{{id: {camera}, platform: {name}}}" for camera, name in MOTES.items())
    relay = (
        "{id: relay, position_m: [17, 4, 3], platform: telosb, battery: {kind: capacity, capacity_j: 500}}"
    )
    loaded = load_scenario(
        scenarios / "quickstart.yaml",
        [
            f"motes.nodes=[{kinds}, {relay}]",
            *(f"cameras[{camera}].rate_hz={RATE_HZ}" for camera in MOTES),
            "system.particles=1000",
            "system.deadline_s=0.095",
            "network.standard=ideal",
            "duration_s=1.5",
            "expect={}",
        ],
    )
    return run(loaded, out=tmp_path_factory.mktemp("platforms") / "run")


def test_only_the_80_mhz_mote_cannot_finish_a_frame_before_the_next(mixed):
    nodes = mixed.nodes.set_index("node")
    longest = nodes.loc[list(MOTES), "work_longest_s"]
    assert longest["c1"] > longest["c2"] > 5 * longest[["c3", "c4"]].max()
    assert (longest > 1 / RATE_HZ).to_dict() == {"c1": True, "c2": False, "c3": False, "c4": False}
    assert (nodes.loc[list(MOTES), "images_skipped"] > 0).to_dict() == (longest > 1 / RATE_HZ).to_dict()
    assert nodes.loc["c1", "images_skipped"] + nodes.loc["c1", "images_taken"] == 1.5 * RATE_HZ
    skipped = mixed.tables["events"].query("kind == 'frame_skipped'")
    assert set(skipped["node"]) == {"c1"}
    assert skipped["detail"].str.endswith("the processor was busy").all()


def test_time_for_a_frame_is_work_at_the_platforms_price(mixed):
    nodes = mixed.nodes.set_index("node")
    for camera, name in MOTES.items():
        mote = nodes.loc[camera]
        assert mote["frame_work_mean_s"] == pytest.approx(mote["cpu_busy_s"] / mote["images_taken"])
        assert mote["cpu_cycles"] == pytest.approx(mote["cpu_busy_s"] * PLATFORMS[name].clock_hz)
    assert nodes["frame_work_mean_s"].isna().to_dict() == {
        **dict.fromkeys(MOTES, False), "relay": True, "base": True
    }  # fmt: skip
    assert mixed.summary["frame_work_max_s"] == nodes.loc["c1", "frame_work_mean_s"]
    assert mixed.summary["busy_share_max"] == pytest.approx(
        nodes.loc["c1", "cpu_busy_s"] / mixed.summary["simulated_s"]
    )
    assert mixed.summary["work_longest_s"] == nodes.drop("base")["work_longest_s"].max()


def test_each_mote_and_the_relay_draw_what_their_own_parts_do(mixed):
    nodes = mixed.nodes.set_index("node")
    seconds = mixed.summary["simulated_s"]
    for node, name in {**MOTES, "relay": "telosb"}.items():
        platform, mote = PLATFORMS[name], nodes.loc[node]
        idle_s = seconds - mote["cpu_busy_s"]
        expected = platform.cpu_active_w * mote["cpu_busy_s"] + platform.cpu_idle_w * idle_s
        assert mote["energy_cpu_j"] == pytest.approx(expected, rel=1e-9)
        assert mote["energy_board_j"] == pytest.approx(platform.board_w * seconds, rel=1e-9)
    assert nodes.loc["relay", "battery_capacity_j"] == 500.0
    assert nodes.loc["c1", "battery_capacity_j"] == 18_720.0
    assert violations(mixed.tables, seconds) == []
