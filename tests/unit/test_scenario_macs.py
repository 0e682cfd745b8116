"""`network.mac` as a scenario writes it: MACs that let radios sleep, what they are built from, and refusals."""

# ruff: noqa: E501  (an error is one line, here as on the screen)

import pytest

from wsnsim.errors import ScenarioError
from wsnsim.net.mac.csma_ca import CsmaCaFamily
from wsnsim.net.mac.lpl_family import LplFamily
from wsnsim.net.mac.tdma_family import TdmaFamily
from wsnsim.records import EnergyRow, MemorySink, NodeRow
from wsnsim.scenario.load import load_scenario
from wsnsim.scenario.resolved import resolved_yaml
from wsnsim.sim.build import build
from wsnsim.sim.macs import mac_family, radio_config

TEXT = """\
duration_s: 2
world:
  size_m: [10, 8, 4]
  targets:
    - id: buoy
      shape: {kind: ellipsoid, semi_axes_m: [0.40, 0.28, 0.34]}
      motion: {kind: waypoints, points_m: [[3, 3, 1], [6, 5, 1]]}
cameras:
  - {id: c1, position_m: [0, 0, 3], look_at_m: [5, 4, 1], resolution_px: [80, 60]}
  - {id: c2, position_m: [10, 0, 3], look_at_m: [5, 4, 1], resolution_px: [80, 60]}
motes:
  base: {position_m: [34, 4, 2]}
network:
  mac: {kind: csma_ca}
system: {kind: multiview, variant: T0}
"""
TDMA = "kind: tdma, guard_s: 0.002, drift_ppm: 30, proportional: false"
LPL = "kind: lpl, wake_interval_s: 0.05, cca_threshold_dbm: -85"


@pytest.fixture
def loaded(tmp_path):
    def load(mac, **more):
        file = tmp_path / "s.yaml"
        file.write_text(TEXT.replace("kind: csma_ca", mac))
        return load_scenario(file, [f"{key}={value}" for key, value in more.items()])

    return load


@pytest.fixture
def problem(loaded, tmp_path):
    def fail(mac):
        with pytest.raises(ScenarioError) as raised:
            build(loaded(mac))
        return str(raised.value).replace(f"{tmp_path}/", "")

    return fail


def test_a_mac_without_a_kind_is_csma_ca(loaded):
    network = loaded("min_be: 2").scenario.network
    assert (network.mac.kind, network.mac.min_be) == ("csma_ca", 2)
    assert isinstance(mac_family(network), CsmaCaFamily)


@pytest.mark.parametrize(("mac", "family"), [(TDMA, TdmaFamily), (LPL, LplFamily)])
def test_a_mac_that_sleeps_survives_being_written_out(loaded, tmp_path, mac, family):
    first = loaded(mac)
    assert isinstance(mac_family(first.scenario.network), family)
    file = tmp_path / "again.yaml"
    file.write_text(resolved_yaml(first))
    assert load_scenario(file).scenario.network == first.scenario.network


def test_thresholds_are_those_of_the_mac(loaded):
    assert radio_config(loaded(LPL).scenario.network).cca_threshold_dbm == -85.0
    assert radio_config(loaded(TDMA).scenario.network).cca_threshold_dbm == -77.0


@pytest.mark.parametrize("mac", [TDMA, LPL])
def test_a_run_of_a_tracker_over_radios_that_sleep(loaded, mac):
    """Frames of cameras become estimates, and the radios' times add up to the run."""
    simulation, sink = build(loaded(mac)), MemorySink()
    simulation.run(sink)
    end_s = simulation.schedule.end_ns / 1e9
    nodes = {row.node: row for row in sink.rows if isinstance(row, NodeRow)}
    assert nodes["c1"].frames_tx > 0
    for name, node in nodes.items():
        rows = [row for row in sink.rows if isinstance(row, EnergyRow) and row.node == name]
        radio = {row.cause: row for row in rows if row.component == "radio"}
        assert sum(row.seconds for row in radio.values()) == pytest.approx(end_s, abs=1e-9)
        assert radio["sleep"].seconds > 0.1 * end_s
        assert node.energy_radio_listen_j == pytest.approx(radio["listen"].energy_j + radio["start"].energy_j)


@pytest.mark.parametrize(
    ("mac", "words"),
    [
        (
            "kind: tdma, guard_s: 0.0001, drift_ppm: 40, resync_s: 10",
            "s.yaml:14:8: network.mac: guard_s: must be at least 0.0008 s, by which clocks of 40 ppm differ over 1 hop when set every 10 s, got 0.0001 [s]; make it longer, or resync_s shorter",
        ),
        (
            "kind: tdma, slot_s: 0.004",
            "network.mac: slot_s: must be at least 0.008172 s for start-up, two guards of 0.001 s, the longest frame and its acknowledgement, got 0.004 [s]",
        ),
        (
            "kind: lpl, wake_interval_s: 0.01",
            "network.mac: wake_interval_s: must be at least 11.672 ms, start-up, check and a copy of the longest frame, got 0.01 [s]",
        ),
        ("kind: lpl, check_s: 0.001", "network.mac: check_s: must be at least 1.184 ms"),
        ("kind: lpl, wake_interval_s: 0", "network.mac.wake_interval_s: must be greater than 0, got 0"),
        ("kind: tdma, guard_s: -1", "network.mac.guard_s: must be greater than 0, got -1"),
        ("kind: tdma, min_be: 3", "network.mac.min_be"),
        (
            "kind: tdma}\n  routing: {kind: min_hop_tree, repair: {}",
            "routing.repair must be left out where mac is tdma",
        ),
        (
            "kind: tdma}\n  routing: {kind: etx_tree, estimate: probes",
            "routing.estimate must be model where mac is tdma",
        ),
        ("kind: lpll", 'got "lpll"; did you mean "lpl"?'),
    ],
)
def test_values_that_cannot_be_are_refused_at_their_line(problem, mac, words):
    assert words in problem(mac)


def test_a_guard_that_a_deep_tree_outgrows_is_refused_when_the_tree_is_known(loaded, tmp_path):
    """40 ppm over one hop, set every 2 s, differ by 0.16 ms and some more for two superframes."""
    with pytest.raises(ScenarioError) as raised:
        build(loaded("kind: tdma, drift_ppm: 40, guard_s: 0.000161, resync_s: 2"))
    words = str(raised.value).replace(f"{tmp_path}/", "")
    assert "s.yaml:14:8: network.mac: guard_s: must be at least 0.00016" in words
    assert "by which clocks of 40 ppm differ over 1 hop" in words
