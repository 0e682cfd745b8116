"""Several sinks, wired to the base station: the nearest one takes what is sent, each spreads to its own."""

import runpy
from pathlib import Path

import pytest
import simpy

from wsnsim.net.ideal import IdealNetwork
from wsnsim.net.interface import Outcome
from wsnsim.net.meshes import RoutingConfig
from wsnsim.net.routing.config import RepairConfig
from wsnsim.net.routing.tree import tree_from_parents

bench = runpy.run_path(str(Path(__file__).parents[1] / "radio_bench.py"))
RadioBench, tree_to = bench["RadioBench"], bench["tree_to"]

SECOND = 10**9
ROW = {"base": 0.0, "a": 40.0, "b": 80.0, "c": 120.0, "d": 160.0, "gate": 200.0}
PLACES = {node: (x, 0.0, 0.0) for node, x in ROW.items()}
PARENTS = {"base": None, "a": "base", "b": "a", "c": "d", "d": "gate", "gate": "base"}
MOTES = ("a", "b", "c", "d")


def row(repair=None, seed=0, **config):
    return RadioBench(PLACES, PARENTS, seed, routing=RoutingConfig(repair), sinks=("gate",), **config)


@pytest.mark.parametrize("metric", [{}, {"etx_frame_bytes": 100, "link_success_min": 0.1}])
def test_ways_lead_to_the_nearest_sink(metric):
    tree = tree_to("base", PLACES, sinks=("gate",), **metric)
    assert tree.parent == PARENTS
    assert tree.depth == {"base": 0, "a": 1, "b": 2, "c": 2, "d": 1, "gate": 0}
    assert tree.sinks == ("base", "gate")
    assert [tree.collector(node) for node in MOTES] == ["base", "a", "d", "base"]
    assert tree.hops("c", "base") == 2
    assert tree.path("b", "c") == ("b", "a", "base", "gate", "d", "c")
    assert tree.hops("b", "c") == 4


@pytest.mark.parametrize("repair", [None, RepairConfig()], ids=["fixed", "repaired"])
def test_what_reaches_a_sink_has_reached_the_base(repair):
    run = row(repair)
    for number, mote in enumerate(MOTES):
        run.send(mote, "base", bytes(300), at_ns=(1 + number) * SECOND)
    run.run(8.0)
    assert {d.source: (receiver, hops) for _, d, receiver, hops in run.delivered_at} == {
        "a": ("base", 1),
        "b": ("base", 2),
        "c": ("base", 2),
        "d": ("base", 1),
    }
    assert run.dropped_at == []


@pytest.mark.parametrize("repair", [None, RepairConfig()], ids=["fixed", "repaired"])
def test_the_base_speaks_through_the_sink_that_is_near(repair):
    run = row(repair)
    one = run.send("base", "c", bytes(300), at_ns=SECOND)
    everyone = run.send("base", MOTES, bytes(50), at_ns=2 * SECOND, disseminate=True)
    across = run.send("b", "c", bytes(30), at_ns=3 * SECOND)
    run.run(15.0)
    hops = {(d.number, receiver): hops for _, d, receiver, hops in run.delivered_at}
    assert hops == {
        (one, "c"): 2,
        (across, "c"): 4,
        **{(everyone, node): depth for node, depth in zip(MOTES, (1, 2, 2, 1), strict=True)},
    }


def test_the_wire_takes_no_time_and_no_frames():
    """d is as far from the gate as a is from the base."""
    run = row(mesh_header_bytes=5)
    run.send("a", "base", bytes(50))
    run.send("d", "base", bytes(50), at_ns=SECOND)
    run.run(3.0)
    assert [run.network.counters(node).frames_tx for node in PLACES] == [1, 1, 0, 0, 1, 1]


def test_motes_change_to_another_sink_when_theirs_dies():
    run = row(RepairConfig())
    count = 0
    for tenth in range(80):
        for mote in MOTES:
            run.send(mote, "base", bytes(20), at_ns=(tenth + 1) * SECOND // 10 + 10_000_000 * len(mote))
            count += 1
    run.at(4 * SECOND, lambda: run.network.stop_node("gate"))
    down = run.send("base", "d", b"still there?", at_ns=9 * SECOND)
    run.run(12.0)
    assert run.network.tree.parent == {**PARENTS, "c": "b", "d": "c"}
    assert [(d.number, receiver, hops) for _, d, receiver, hops in run.delivered_at if d.number == down] == [
        (down, "d", 4)
    ]
    assert len(run.delivered_at) == count + 1
    assert run.dropped_at == []


def test_a_dead_sink_without_repair_loses_what_goes_through_it():
    run = row()
    run.network.stop_node("gate")
    run.send("d", "base", bytes(20))
    run.send("base", "d", bytes(20), at_ns=SECOND)
    run.run(3.0)
    assert [(d.source, outcome) for _, d, _, outcome in run.dropped_at] == [
        ("d", Outcome.NO_ACK),
        ("base", Outcome.DEAD),
    ]


@pytest.mark.parametrize("repair", [None, RepairConfig()], ids=["fixed", "repaired"])
def test_what_reaches_a_sink_is_lost_when_the_base_behind_it_is_dead(repair):
    run = row(repair)
    run.at(SECOND, lambda: run.network.stop_node("base"))
    run.send("d", "base", bytes(20), at_ns=2 * SECOND)
    run.run(4.0)
    assert run.delivered_at == []
    assert [(d.source, outcome) for _, d, _, outcome in run.dropped_at] == [("d", Outcome.DEAD)]


class Ideal:
    def __init__(self):
        self.env = simpy.Environment()
        self.heard = {}
        self.network = IdealNetwork(self.env, tree_from_parents(PARENTS, frozenset(["gate"])), self)

    def delivered(self, datagram, receiver, hops):
        self.heard[datagram.number, receiver] = hops


def test_an_ideal_network_counts_no_frames_for_the_wire():
    ideal = Ideal()
    of = bench["Datagram"]
    ideal.network.send(of(0, "c", ("base",), bytes(10)))
    ideal.network.send(of(1, "base", MOTES, bytes(10), disseminate=True))
    ideal.network.send(of(2, "b", ("a",), bytes(10), one_hop=True))
    ideal.env.run()
    assert ideal.heard == {(0, "base"): 2, (1, "a"): 1, (1, "b"): 2, (1, "c"): 2, (1, "d"): 1, (2, "a"): 1}
    assert {node: ideal.network.counters(node).frames_tx for node in PLACES} == {
        "base": 1, "a": 1, "b": 1, "c": 1, "d": 2, "gate": 1,
    }  # fmt: skip
    assert ideal.network.neighbours("d") == ("gate", "c")
