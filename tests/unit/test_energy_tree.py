"""Trees of least energy: what a frame over a link costs, and who relays for it."""

import runpy
from pathlib import Path

import numpy as np
import pytest

import wsnsim
from wsnsim.hardware.profiles import RADIOS
from wsnsim.net.channel.propagation import LogDistance
from wsnsim.net.config import Draw, RadioConfig
from wsnsim.net.mac.csma_ca import CsmaCaFamily
from wsnsim.net.routing.energy import frame_energies_j
from wsnsim.net.routing.search import radio_links
from wsnsim.sim.build import build

bench = runpy.run_path(str(Path(__file__).parents[1] / "radio_bench.py"))
tree_to = bench["tree_to"]

CC2420 = Draw(RADIOS["cc2420"].transmit_w(0.0), RADIOS["cc2420"].receive_w)
MAINS = Draw(0.0, 0.0)


def test_a_frame_over_a_perfect_link_costs_its_time_and_that_of_its_acknowledgement():
    """CC2420 at 3 V: 17.4 mA to send, 18.8 mA to receive; 127 B take 4.256 ms, 5 B take 0.352 ms."""
    places = {"a": (0.0, 0.0, 0.0), "b": (10.0, 0.0, 0.0)}
    radio = RadioConfig()
    links = radio_links(places, LogDistance(), radio)
    both_w = 3.0 * (17.4e-3 + 18.8e-3)
    energies = frame_energies_j(
        links, dict.fromkeys(places, CC2420), list(places), CsmaCaFamily(), radio, 127
    )
    assert energies == pytest.approx([both_w * (4.256e-3 + 0.352e-3)] * 2)
    # to a node on mains only the sender's part is left
    draws = {"a": CC2420, "b": MAINS}
    up, _ = frame_energies_j(links, draws, list(places), CsmaCaFamily(), radio, 127)
    assert up == pytest.approx(3.0 * (17.4e-3 * 4.256e-3 + 18.8e-3 * 0.352e-3))


def test_a_link_that_loses_costs_each_repetition():
    places = {"a": (0.0, 0.0, 0.0), "b": (66.5, 0.0, 0.0)}
    radio, family = RadioConfig(noise_dbm=-94.0), CsmaCaFamily()
    links = radio_links(places, LogDistance(), radio)
    sinr = 10 ** ((float(links.power_dbm[0]) + 94.0) / 10)
    forward, back = (family.phy.frame_success(sinr, size) for size in (60, 5))
    assert forward < 0.9
    both_w = CC2420.transmit_w + CC2420.receive_w
    expected = both_w * (2.112e-3 / (forward * back) + 0.352e-3 / back)
    energies = frame_energies_j(links, dict.fromkeys(places, CC2420), list(places), family, radio, 60)
    np.testing.assert_allclose(energies, expected, rtol=1e-12)


PLACES = {
    "far": (60.0, 0.0, 0.0),
    "plugged": (35.0, 25.0, 0.0),
    "batteried": (30.0, -5.0, 0.0),
    "base": (0.0, 0.0, 0.0),
}


def test_relays_on_mains_are_preferred():
    config = {"etx_frame_bytes": 127, "link_success_min": 0.1}
    assert tree_to("base", PLACES, **config).parent["far"] == "base"
    draws = dict.fromkeys(PLACES, CC2420)
    # one hop costs least where all pay
    assert tree_to("base", PLACES, **config, draws=draws).parent["far"] == "base"
    # the direct link has to be used a little more often than once, and the rest of the detour is free
    draws |= {"plugged": MAINS, "base": MAINS}
    assert tree_to("base", PLACES, **config, draws=draws).parent["far"] == "plugged"


def test_scenarios_ask_for_it_by_name(scenarios):
    loaded = wsnsim.load(
        scenarios / "quickstart.yaml",
        overrides=("network.routing={kind: min_energy_tree, frame_bytes: 100}",),
    )
    tree = build(loaded).tree
    assert set(tree.parent.values()) == {None, "base", "relay"}
