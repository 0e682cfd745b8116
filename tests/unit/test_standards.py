"""What `network.standard` brings with it in a scenario: defaults, and what does not go together."""

import pytest
import yaml

from wsnsim.errors import ScenarioError
from wsnsim.hardware.profiles import RADIOS
from wsnsim.net.mac.csma_ca import CsmaCaFamily
from wsnsim.net.mac.dcf_family import DcfFamily
from wsnsim.scenario.load import load_scenario, scenario_from_dict
from wsnsim.scenario.nodes import placed_nodes
from wsnsim.scenario.resolved import resolved_yaml
from wsnsim.sim.macs import channel_bps, mac_family, most_attempts, radio_config

SCENARIO = "published/multiview_fgh.yaml"
"""Says nothing of radios or medium access."""


@pytest.fixture
def load(scenarios):
    return lambda *overrides: load_scenario(scenarios / SCENARIO, overrides)


def problems(load, *overrides):
    with pytest.raises(ScenarioError) as caught:
        load(*overrides)
    return {problem.path: problem.message for problem in caught.value.problems}


def test_802_11b_comes_with_its_own_defaults(load):
    loaded = load("network.standard=ieee80211b")
    network = loaded.scenario.network
    radio = radio_config(network)
    assert (radio.tx_power_dbm, radio.noise_dbm, radio.sensitivity_dbm) == (15.0, -89.0, -91.0)
    assert radio.cca_threshold_dbm == -80.0
    assert network.mac.kind == "dcf"
    assert isinstance(mac_family(network), DcfFamily)
    assert channel_bps(network) == 11e6
    assert most_attempts(network) == 7
    assert {node.radio for node in placed_nodes(loaded.scenario)} == {"wavelan_silver"}


def test_what_a_scenario_says_comes_before_the_defaults(load):
    loaded = load(
        "network.standard=ieee80211b",
        "network.tx_power_dbm=10",
        "network.mac.rate_mbps=5.5",
        "network.mac.preamble=short",
        "motes.default.radio=wifi_ns3",
    )
    network = loaded.scenario.network
    assert (network.tx_power_dbm, network.noise_dbm) == (10.0, -89.0)
    assert channel_bps(network) == 5.5e6
    assert mac_family(network).phy.air_time_ns(36) == (96 + 53) * 1000
    assert {node.radio for node in placed_nodes(loaded.scenario)} == {"wifi_ns3"}


def test_802_15_4_keeps_its_defaults(load):
    network = load("network.standard=ieee802154").scenario.network
    assert (network.tx_power_dbm, network.sensitivity_dbm, network.mac.kind) == (0.0, -95.0, "csma_ca")
    assert isinstance(mac_family(network), CsmaCaFamily)


def test_the_resolved_scenario_holds_every_default_and_is_the_same(load):
    loaded = load("network.standard=ieee80211b")
    again = scenario_from_dict(yaml.safe_load(resolved_yaml(loaded)), loaded.base_dir)
    assert again.scenario == loaded.scenario
    written = yaml.safe_load(resolved_yaml(loaded))
    assert written["network"]["tx_power_dbm"] == 15.0
    assert written["network"]["mac"]["basic_rate_mbps"] == 1.0
    assert written["motes"]["default"]["radio"] == "wavelan_silver"


def test_a_radio_of_the_other_standard_is_refused_where_it_stands(load):
    found = problems(load, "network.standard=ieee80211b", "motes.default.radio=cc2420")
    assert found == {
        "motes.default.radio": "must be a radio of IEEE 802.11b, which the network is: "
        '"wavelan_silver" or "wifi_ns3" (or left out), got "cc2420"'
    }
    found = problems(load, "network.standard=ieee802154", "motes.base.radio=wavelan_silver")
    assert list(found) == ["motes.base.radio"]
    assert "IEEE 802.15.4" in found["motes.base.radio"]
    sink = "{id: gate, position_m: [1, 2, 3], radio: wavelan_silver}"
    found = problems(load, "network.standard=ieee802154", f"motes.sinks=[{sink}]")
    assert list(found) == ["motes.sinks[0].radio"]
    assert load("network.standard=ideal", "motes.default.radio=wavelan_silver")


@pytest.mark.parametrize(
    ("overrides", "path", "words"),
    [
        (["ieee80211b", "network.mac.kind=csma_ca"], "network.mac.kind", 'must be "dcf" in IEEE 802.11b'),
        (["ieee802154", "network.mac.kind=dcf"], "network.mac.kind", 'must be "csma_ca", "tdma" or "lpl"'),
        (["ieee80211b", "network.mac.min_be=3"], "network.mac.min_be", "unknown key"),
        (["ieee80211b", "network.mac.rate_mbps=54"], "network.mac.rate_mbps", "1, 2, 5.5 or 11, got 54"),
        (["ieee80211b", "network.mac.cw_min=2000"], "network.mac", "at most cw_max, got 2000 and 1023"),
        (
            ["ieee80211b", "network.mac.rate_mbps=1", "network.mac.basic_rate_mbps=2"],
            "network.mac",
            "basic_rate_mbps must be at most rate_mbps, got 2 and 1 Mbit/s",
        ),
        (["ieee80211b", "network.mac.retry_limit=0"], "network.mac.retry_limit", "at least 1"),
        (
            ["ieee802154", "network.routing.kind=etx_tree", "network.routing.frame_bytes=1000"],
            "network.routing.frame_bytes",
            "must be at most 127 in IEEE 802.15.4, got 1000",
        ),
        (
            ["ieee80211b", "network.routing.kind=etx_tree", "network.routing.frame_bytes=2333"],
            "network.routing.frame_bytes",
            "2332",
        ),
    ],
)
def test_what_does_not_go_with_the_standard(load, overrides, path, words):
    standard, *others = overrides
    found = problems(load, f"network.standard={standard}", *others)
    assert words in found[path]


def test_frames_of_802_11b_may_be_longer(load):
    longer = ("network.routing.kind=etx_tree", "network.routing.frame_bytes=1500")
    assert load("network.standard=ieee80211b", *longer)


def test_a_transmitter_beyond_the_card_is_refused(load):
    from wsnsim.sim.build import build

    with pytest.raises(ScenarioError, match="wavelan_silver: tx power must be at most 15 dBm, got 20 dBm"):
        build(load("network.standard=ieee80211b", "network.tx_power_dbm=20"))


def test_cards_draw_what_was_measured():
    """Feeney and Nilsson (2001): 47, 739, 901 and 1346 mW; ns-3: 33, 273, 313 and 380 mA at 3 V."""
    silver, ns3 = RADIOS["wavelan_silver"], RADIOS["wifi_ns3"]
    powers = [silver.sleep_w, silver.listen_w, silver.receive_w, silver.transmit_w(15.0)]
    assert powers == pytest.approx([0.047, 0.739, 0.901, 1.346], abs=0.0005)
    powers = [ns3.sleep_w, ns3.listen_w, ns3.receive_w, ns3.transmit_w(15.0)]
    assert powers == pytest.approx([0.099, 0.819, 0.939, 1.140])
    assert {name for name, radio in RADIOS.items() if radio.standard == "ieee80211b"} == {
        silver.name,
        ns3.name,
    }
