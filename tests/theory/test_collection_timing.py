"""How long a hop of a collection tree takes: the formula, the standard's times and the simulated MAC."""

import math
import runpy
from pathlib import Path

import numpy as np
import pytest
import simpy

from wsnsim.net.collection import latest_s, leads_s
from wsnsim.net.config import RadioConfig
from wsnsim.net.fragmentation import fragment
from wsnsim.net.ideal import IdealNetwork
from wsnsim.net.mac.csma_ca_service import csma_ca_service_ns
from wsnsim.net.routing.tree import tree_from_parents

RadioBench = runpy.run_path(str(Path(__file__).parents[1] / "radio_bench.py"))["RadioBench"]

MEAN_DELAY_NS = {10: 2_304_000, 50: 3_584_000, 100: 5_184_000}
"""One hop of a 10, 50 and 100 B payload under 11 B of MAC overhead, as the standard's constants give it."""
CONFIRM_NS = 544_000
LONG_SPACE_NS = 640_000
MEAN_BACKOFF_NS = 3.5 * 320_000
ACK_WAIT_NS = 864_000
SENSE_AND_TURN_NS = 320_000


def one_frame_ns(payload_bytes):
    return MEAN_DELAY_NS[payload_bytes] + CONFIRM_NS + LONG_SPACE_NS


def retry_ns(payload_bytes):
    """Backoff, CCA, turnaround and the frame, as in the delay, then the wait for an acknowledgement."""
    return MEAN_DELAY_NS[payload_bytes] + ACK_WAIT_NS


@pytest.mark.parametrize("payload_bytes", MEAN_DELAY_NS)
def test_a_frame_that_nobody_disturbs_takes_the_mean_of_one_hop_and_one_retry(payload_bytes):
    service_ns = csma_ca_service_ns([payload_bytes + 11], contenders=1, min_be=3)
    assert service_ns == one_frame_ns(payload_bytes) + retry_ns(payload_bytes)
    assert MEAN_DELAY_NS[payload_bytes] == MEAN_BACKOFF_NS + SENSE_AND_TURN_NS + (
        192_000 + 32_000 * (payload_bytes + 11)
    )


def test_without_the_retry_it_is_the_rate_of_a_saturated_sender():
    service_ns = csma_ca_service_ns([111], contenders=1, min_be=3) - retry_ns(100)
    assert 800 / (service_ns / 1e9) == pytest.approx(125_630, rel=1e-4)


def test_contenders_take_turns_and_share_one_allowance():
    alone, five = (csma_ca_service_ns([61], contenders, 3) for contenders in (1, 5))
    assert five - alone == 4 * one_frame_ns(50)
    assert csma_ca_service_ns([21, 111], 2, 3) == 2 * (one_frame_ns(10) + one_frame_ns(100)) + retry_ns(100)
    # (2^5 - 2^3) / 2 backoff periods more for each attempt, the retry included
    assert csma_ca_service_ns([61], 1, 5) - alone == 2 * 12 * 320_000


@pytest.mark.parametrize("data_bytes", [50, 100, 230, 400])
def test_the_simulated_mac_takes_that_long_on_average(data_bytes, test_seed):
    """Alone, without the retry that never happens; the last fragment's confirmation and space come later."""
    bodies = fragment(bytes(data_bytes), 0, 116)
    sizes = [len(body) + 11 for body in bodies]
    bench = RadioBench.star(1, seed=test_seed)
    datagrams, period_ns = 400, 100_000_000
    for k in range(datagrams):
        bench.send("n1", "n0", bytes(data_bytes), at_ns=k * period_ns)
    bench.run(datagrams * period_ns / 1e9)
    took = np.array([at - d.number * period_ns for at, d, _, _ in bench.delivered_at])
    assert len(took) == datagrams
    one_ns = csma_ca_service_ns(sizes, 1, 3) - (
        MEAN_BACKOFF_NS + SENSE_AND_TURN_NS + 192_000 + 32_000 * max(sizes) + ACK_WAIT_NS
    )
    after_ns = CONFIRM_NS + LONG_SPACE_NS
    # backoffs are uniform on 0 … 7 periods: a variance of 63 / 12 periods² a frame
    error_ns = 320_000 * math.sqrt(63 / 12 * len(sizes) / datagrams)
    assert took.mean() + after_ns == pytest.approx(one_ns, abs=4 * error_ns)


@pytest.mark.parametrize("data_bytes", [50, 100])
@pytest.mark.parametrize("nodes", [2, 3, 5])
def test_nodes_that_begin_together_are_through_in_that_time(nodes, data_bytes, test_seed):
    """At least nine of ten that get through do so within the service time, and it is not twice too long."""
    sizes = [len(body) + 11 for body in fragment(bytes(data_bytes), 0, 116)]
    service_ns = csma_ca_service_ns(sizes, nodes, 3)
    runs, arrivals, lasts = 60, [], []
    for seed in range(runs):
        bench = RadioBench.star(nodes, seed=1000 * test_seed + seed, collision="destructive")
        for at in range(1, nodes + 1):
            bench.send(f"n{at}", "n0", bytes(data_bytes))
        bench.run(1.0)
        times = [at for at, *_ in bench.delivered_at]
        arrivals += times
        lasts.append(max(times))
    within = np.mean(np.array(arrivals) <= service_ns)
    assert within > 0.9 - 3 * math.sqrt(0.09 / len(arrivals))
    assert np.mean(lasts) > 0.5 * service_ns


def test_the_network_counts_the_frames_and_the_neighbours_of_a_hop():
    """Four leaves of 10 m round the base: each has three contenders; with a mesh header frames are longer."""
    bench = RadioBench.star(4)
    assert bench.network.hop_service_s(50, "n1") == csma_ca_service_ns([61], 4, 3) / 1e9
    bare = csma_ca_service_ns([len(body) + 11 for body in fragment(bytes(300), 0, 116)], 4, 3) / 1e9
    assert bench.network.hop_service_s(300, "n1") == bare
    meshed = RadioBench.star(4, mesh_header_bytes=5, min_be=4)
    assert meshed.network.hop_service_s(50, "n1") == csma_ca_service_ns([66], 4, 4) / 1e9


def test_only_nodes_of_the_same_depth_that_are_heard_contend():
    """Two branches: b1 and b2 are as deep as each other; a far pair of branches is not heard at -77 dBm."""
    reach_m = 10 ** ((77.0 - 40.05) / 30.0)
    places, parents = {"base": (0.0, 0.0, 0.0)}, {"base": None}
    for name, x in (("near1", 0.5), ("near2", -0.5), ("deep", 0.9)):
        places[name] = (x * reach_m, 0.0, 0.0)
    parents |= {"near1": "base", "near2": "base", "deep": "near1"}
    loud = {"noise_dbm": -106.99, "cca_threshold_dbm": -77.0}
    assert RadioBench(places, parents, **loud).network.hop_service_s(50, "near1") == pytest.approx(
        csma_ca_service_ns([66], 2, 3) / 1e9
    )
    assert RadioBench(places, parents, **loud).network.hop_service_s(50, "deep") == pytest.approx(
        csma_ca_service_ns([66], 1, 3) / 1e9
    )
    # heard by the base, though not by each other, they still disturb each other there
    places["near1"], places["near2"] = (0.8 * reach_m, 0.0, 0.0), (-0.8 * reach_m, 0.0, 0.0)
    apart = RadioBench(places, parents, **loud)
    assert apart.network.hop_service_s(50, "near2") == pytest.approx(csma_ca_service_ns([66], 2, 3) / 1e9)
    places["near2"] = (-1.2 * reach_m, 0.0, 0.0)
    beyond = RadioBench(places, parents, **loud)
    assert beyond.network.hop_service_s(50, "near1") == pytest.approx(csma_ca_service_ns([66], 1, 3) / 1e9)
    assert RadioConfig().cca_threshold_dbm == -77.0


def test_leads_add_up_along_the_way_and_a_child_is_done_when_its_parent_begins():
    parents = {"base": None, "a": "base", "b": "a", "c": "b", "d": "a"}
    hop_s = {"a": 0.01, "b": 0.02, "c": 0.04, "d": 0.08}
    leads = leads_s(tree_from_parents(parents), hop_s)
    assert leads == pytest.approx({"base": 0.0, "a": 0.01, "b": 0.03, "c": 0.07, "d": 0.09}, abs=1e-15)
    for node, parent in parents.items():
        if parent is not None:
            begins = latest_s(5.0, leads[node], 4.0)
            assert begins + hop_s[node] == pytest.approx(latest_s(5.0, leads[parent], 4.0), abs=1e-12)
    assert latest_s(5.0, leads["d"], 4.95) == 4.95


def test_over_an_ideal_network_a_hop_is_guarded_by_a_little():
    network = IdealNetwork(simpy.Environment(), tree_from_parents({"base": None, "a": "base"}), None)
    assert 0.0 < network.hop_service_s(10_000, "a") <= 0.001
