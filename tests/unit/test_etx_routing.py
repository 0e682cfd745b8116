"""ETX of links from the PHY's own error rates, and the trees of fewest transmissions."""

import math
import runpy
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse.csgraph import dijkstra

from wsnsim.net.channel.links import Links
from wsnsim.net.config import RadioConfig
from wsnsim.net.phy.ieee802154 import O_QPSK
from wsnsim.net.routing.linkquality import expected_transmissions, frame_successes, weakest_usable_dbm
from wsnsim.net.routing.search import etx_tree
from wsnsim.net.routing.tree import RoutingError

tree_to = runpy.run_path(str(Path(__file__).parents[1] / "radio_bench.py"))["tree_to"]
QUIET = {"sensitivity_dbm": -120.0, "noise_dbm": -100.0}
BIT_ERRORS = {-5: 7.517e-2, -3: 1.642e-2, -1: 1.149e-3, 0: 1.6153e-4, 1: 1.2912e-5, 2: 5.131e-7}
"""Of IEEE 802.15.4-2006, sec. E.4.1.8, by SINR [dB]."""


def matrix(powers, nodes):
    """Return the links of `powers`, (i, j): dBm; none elsewhere."""
    power = np.full((nodes, nodes), -np.inf)
    for (sender, receiver), dbm in powers.items():
        power[sender, receiver] = dbm
    return Links.from_matrix(power)


def etx_matrix(links, *config):
    """Return the ETX (n, n) of links."""
    return links.matrix(expected_transmissions(links, *config), math.inf)


def tree_of(places, base, etx, power, most):
    """Return the tree over links of which ETX and power are given as matrices (n, n)."""
    links = Links.from_matrix(power)
    return etx_tree(places, base, links, etx[links.senders, links.receivers], most)


@pytest.mark.parametrize(("forward_db", "back_db"), [(0, 0), (-1, 2), (2, -1), (-3, 1), (-5, -5)])
def test_etx_is_one_over_the_chance_of_the_frame_and_its_ack(forward_db, back_db):
    power = matrix({(0, 1): -100.0 + forward_db, (1, 0): -100.0 + back_db}, 2)
    etx = etx_matrix(power, O_QPSK, RadioConfig(**QUIET), 127, 5)
    # 6 octets of synchronisation and PHY header, then the MPDU: 127 B, or the ACK's 5 B
    frame, ack = 8 * (6 + 127), 8 * (6 + 5)
    there = (1 - BIT_ERRORS[forward_db]) ** frame * (1 - BIT_ERRORS[back_db]) ** ack
    back = (1 - BIT_ERRORS[back_db]) ** frame * (1 - BIT_ERRORS[forward_db]) ** ack
    # the bit error rates are known to four digits
    tolerance = 1e-3 * 8 * 133 * max(BIT_ERRORS[forward_db], BIT_ERRORS[back_db])
    assert math.log(etx[0, 1] * there) == pytest.approx(0.0, abs=tolerance)
    assert math.log(etx[1, 0] * back) == pytest.approx(0.0, abs=tolerance)
    assert etx[0, 0] == math.inf


def test_what_a_receiver_does_not_notice_has_no_etx():
    config = RadioConfig(sensitivity_dbm=-95.0, noise_dbm=-120.0)
    heard = matrix({(0, 1): -94.9, (1, 0): -95.1}, 2)
    assert frame_successes(heard, O_QPSK, config, 127)[0] == pytest.approx(1.0)
    assert np.all(np.isinf(expected_transmissions(heard, O_QPSK, config, 127, 5)))
    deaf = RadioConfig(sensitivity_dbm=-120.0, noise_dbm=-100.0, lock_sinr_db=3.0)
    assert frame_successes(matrix({(0, 1): -98.0}, 2), O_QPSK, deaf, 5)[0] == 0.0


def test_the_weakest_usable_link_carries_the_wanted_share():
    config = RadioConfig(**QUIET)
    power = matrix({(0, 1): weakest_usable_dbm(O_QPSK, config, 0.73)}, 2)
    assert frame_successes(power, O_QPSK, config, 127)[0] == pytest.approx(0.73, abs=1e-9)


def test_two_good_hops_beat_a_bad_one_and_lose_to_a_fair_one():
    places = {"base": (0, 0, 0), "middle": (1, 0, 0), "far": (2, 0, 0)}
    etx = np.full((3, 3), np.inf)
    etx[1, 0] = etx[2, 1] = 1.1
    power = np.zeros((3, 3))
    etx[2, 0] = 2.3
    assert tree_of(places, "base", etx, power, 10.0).parent["far"] == "middle"
    etx[2, 0] = 2.1
    assert tree_of(places, "base", etx, power, 10.0).parent["far"] == "base"
    # as dear as the way over the middle: fewer hops win
    etx[2, 0] = 2.2
    assert tree_of(places, "base", etx, power, 10.0).parent["far"] == "base"


def test_min_hop_takes_the_long_link_that_etx_leaves():
    """One hop of which four in five frames are lost, or two of which none is."""
    radio = {"noise_dbm": -95.4, "sensitivity_dbm": -110.0}
    reach = 10 ** ((0.0 - weakest_usable_dbm(O_QPSK, RadioConfig(**radio), 0.2) - 40.05) / 30.0)
    places = {"base": (0, 0, 0), "middle": (0.5 * reach, 0, 0), "far": (0.99 * reach, 0, 0)}
    hops = tree_to("base", places, **radio, link_success_min=0.2)
    etx = tree_to("base", places, **radio, link_success_min=0.2, etx_frame_bytes=127)
    assert (hops.parent["far"], etx.parent["far"]) == ("base", "middle")


def test_ties_go_to_the_stronger_link_then_to_the_first():
    places = {"base": (0, 0, 0), "one": (1, 0, 0), "two": (2, 0, 0), "far": (3, 0, 0)}
    etx = np.full((4, 4), np.inf)
    etx[1, 0] = etx[2, 0] = etx[3, 1] = etx[3, 2] = 1.0
    power = np.full((4, 4), -50.0)
    assert tree_of(places, "base", etx, power, 10.0).parent["far"] == "one"
    power[3, 2] = power[2, 3] = -40.0
    assert tree_of(places, "base", etx, power, 10.0).parent["far"] == "two"
    power[2, 3] = -60.0
    assert tree_of(places, "base", etx, power, 10.0).parent["far"] == "one"


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), nodes=st.integers(2, 30))
def test_every_way_is_as_cheap_as_dijkstra_of_scipy_finds_it(seed, nodes):
    rng = np.random.default_rng(seed)
    names = [f"n{i}" for i in range(nodes)]
    etx = 1.0 + rng.exponential(1.0, (nodes, nodes))
    etx[rng.random((nodes, nodes)) < 0.6] = np.inf
    np.fill_diagonal(etx, np.inf)
    places = {name: tuple(rng.uniform(0, 9, 3)) for name in names}
    usable = np.where(etx <= 3.0, etx, 0.0)
    costs = dijkstra(usable.T, indices=0)
    power = rng.normal(-70, 10, (nodes, nodes))
    if not np.isfinite(costs).all():
        with pytest.raises(RoutingError, match="with an ETX of at most 3"):
            tree_of(places, "n0", etx, power, 3.0)
        return
    tree = tree_of(places, "n0", etx, power, 3.0)
    for at, name in enumerate(names):
        way = [int(node[1:]) for node in tree.path(name, "n0")]
        taken = sum(etx[i, j] for i, j in pairwise(way))
        assert taken == pytest.approx(costs[at], abs=1e-7)


def test_a_frame_length_beyond_the_standard_is_refused():
    with pytest.raises(ValueError, match="etx_frame_bytes: must be 1 to 127, got 128"):
        tree_to("a", {"a": (0, 0, 0)}, etx_frame_bytes=128)
