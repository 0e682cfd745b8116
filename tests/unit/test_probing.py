"""Trees by measured links: probes that are sent, lost and counted."""

import runpy
from pathlib import Path

import numpy as np
import pytest

import wsnsim
from wsnsim.metrics.conservation import violations
from wsnsim.net.interface import Outcome
from wsnsim.net.meshes import RoutingConfig
from wsnsim.net.routing.probing import ProbingConfig

RadioBench = runpy.run_path(str(Path(__file__).parents[1] / "radio_bench.py"))["RadioBench"]

SECOND = 10**9
NOISE_DBM = -93.9
# far hears the base now and then; both hear the relay well
PLACES = {"base": (0.0, 0.0, 0.0), "relay": (33.0, 10.0, 0.0), "far": (66.5, 0.0, 0.0)}
STAR = {"base": None, "relay": "base", "far": "base"}


def bench(config, seed=0, places=PLACES, parents=STAR):
    return RadioBench(places, parents, seed, routing=RoutingConfig(probing=config), noise_dbm=NOISE_DBM)


def test_a_link_is_as_good_as_its_probes_say_and_the_tree_follows(test_seed):
    config = ProbingConfig(count=200, interval_s=0.1, packet_bytes=105)
    run = bench(config, test_seed)
    assert run.network.tree.depth == {"base": 0, "relay": -1, "far": -1}
    early = run.send("far", "base", bytes(20), at_ns=SECOND)
    run.run(config.ready_s + 1.0)
    sinr = 10 ** ((-40.05 - 30 * np.log10(66.5) - NOISE_DBM) / 10)
    chance = run.phy.frame_success(sinr, 105 + 11)
    assert 0.2 < chance < 0.8
    error = np.sqrt(chance * (1 - chance) / config.count)
    heard = run.network.router("base").heard_probes
    assert heard[2] / config.count == pytest.approx(chance, abs=4 * error)
    assert heard[1] >= 0.97 * config.count
    # twice through the relay is less than one way with an ETX of 1 / chance²
    assert run.network.tree.parent == {"base": None, "relay": "base", "far": "relay"}
    assert [(node, new) for _, node, _, new, _ in run.moves] == [("relay", "base"), ("far", "relay")]
    ((at, datagram, _, hops),) = run.delivered_at
    assert (datagram.number, hops) == (early, 2)
    assert at >= config.ready_s * SECOND
    for node in PLACES:
        counters = run.network.counters(node)
        assert counters.control_frames_tx == config.count
        assert counters.control_tx_bytes == config.count * (105 + 11)


def test_whom_no_probe_reaches_has_no_way():
    places = {**PLACES, "lone": (500.0, 0.0, 0.0)}
    run = bench(ProbingConfig(count=10, interval_s=0.1), places=places, parents={**STAR, "lone": "far"})
    run.send("lone", "base", bytes(20), at_ns=2 * SECOND)
    run.send("base", "lone", bytes(20), at_ns=3 * SECOND)
    run.run(5.0)
    assert run.network.tree.depth["lone"] == -1
    assert run.network.queued("lone") == 1
    assert [(d.source, outcome) for _, d, _, outcome in run.dropped_at] == [("base", Outcome.NO_ROUTE)]


def test_scenarios_may_ask_for_it(scenarios):
    routing = "network.routing={kind: etx_tree, estimate: probes, probes: 20, probe_interval_s: 0.04}"
    overrides = ("duration_s=3", "expect={}", "system.particles=50", routing)
    run = wsnsim.run(scenarios / "quickstart.yaml", overrides=overrides)
    assert violations(run.tables, run.summary["simulated_s"]) == []
    found = run.tables["events"].query("kind == 'reparented'")
    assert len(found) >= 5
    assert set(found["time_s"]) == {0.82}
    assert (run.nodes.query("role != 'base'")["depth"] > 0).all()
    assert run.summary["control_share"] > 0
    with pytest.raises(wsnsim.ScenarioError, match="its beacons measure the links"):
        wsnsim.load(scenarios / "quickstart.yaml", overrides=(routing.replace("}", ", repair: {}}"),))
