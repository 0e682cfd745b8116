"""Routes that keep up with the network: a parent dies, and those below it find another way."""

import runpy
from itertools import pairwise
from pathlib import Path

import pytest

from wsnsim.net.interface import Outcome
from wsnsim.net.mac.lpl_family import LplFamily
from wsnsim.net.meshes import RoutingConfig
from wsnsim.net.routing.config import RepairConfig
from wsnsim.net.routing.router import CHEAPER, CIRCLE, UNANSWERED

RadioBench = runpy.run_path(str(Path(__file__).parents[1] / "radio_bench.py"))["RadioBench"]

SECOND = 10**9
BEACON_S = RepairConfig().beacon_min_s

# 56 m are a good link here, 70 m are none
DIAMOND = {
    "base": (0.0, 0.0, 0.0),
    "left": (35.0, 15.0, 0.0),
    "right": (35.0, -15.0, 0.0),
    "far": (70.0, 0.0, 0.0),
    "leaf": (108.0, 0.0, 0.0),
}
DIAMOND_TREE = {"base": None, "left": "base", "right": "base", "far": "left", "leaf": "far"}
RUNGS = {
    "base": (0.0, 0.0, 0.0),
    "a": (35.0, 30.0, 0.0),
    "b": (35.0, -30.0, 0.0),
    "x": (78.0, 28.0, 0.0),
    "y": (78.0, -28.0, 0.0),
}
RUNGS_TREE = {"base": None, "a": "base", "b": "base", "x": "a", "y": "b"}


def bench(places, parents, seed=0, repair=None, **config):
    repair = RepairConfig() if repair is None else repair
    return RadioBench(places, parents, seed, routing=RoutingConfig(repair), **config)


def line(nodes, spacing_m=40.0, **kwargs):
    places = {f"n{i}": (spacing_m * i, 0.0, 0.0) for i in range(nodes)}
    return bench(places, {f"n{i}": f"n{i - 1}" if i else None for i in range(nodes)}, **kwargs)


def every(run, period_s, sources, until_s, begin_s=0.0, data=bytes(50)):
    """Let each source say something to the base again and again, and return how many messages that makes."""
    base, count = run.network.tree.root, 0
    at = begin_s
    while at < until_s - 1e-9:
        for number, source in enumerate(sources):
            run.send(source, base, data, at_ns=round((at + 0.013 * number) * SECOND))
            count += 1
        at += period_s
    return count


@pytest.mark.parametrize("seed", range(4))
def test_below_a_dead_parent_everything_goes_by_another_within_half_a_second(seed):
    run = bench(DIAMOND, DIAMOND_TREE, seed)
    count = every(run, 0.1, ("far", "leaf"), 8.0)
    run.at(4 * SECOND, lambda: run.network.stop_node("left"))
    run.run(9.0)
    assert len(run.delivered_at) == count
    assert run.dropped_at == []
    # far knew another neighbour that is nearer to the base than itself: it costs five frames in vain
    late = [
        at / SECOND for at, node, old, new, _ in run.moves if (node, old, new) == ("far", "left", "right")
    ]
    assert 4.0 < late[-1] < 4.5
    assert run.network.tree.parent == {**DIAMOND_TREE, "far": "right"}
    assert run.network.tree.depth["leaf"] == 3
    gaps = sorted(at for at, d, *_ in run.delivered_at if d.source == "leaf")
    assert max(later - sooner for sooner, later in pairwise(gaps)) < 0.5 * SECOND


def test_why_a_parent_was_left_is_told():
    run = bench(DIAMOND, DIAMOND_TREE, repair=RepairConfig(switch_etx=100.0))
    every(run, 0.1, ("far",), 3.0)
    run.at(2 * SECOND, lambda: run.network.stop_node("left"))
    run.run(4.0)
    ((at, node, old, new, why),) = run.moves
    assert (node, old, new, why) == ("far", "left", "right", UNANSWERED)
    # one frame after the other is given up, each after four attempts
    assert 2.0 < at / SECOND < 2.5


@pytest.mark.parametrize("seed", range(4))
def test_a_node_whose_neighbours_are_no_nearer_than_itself_first_tells_that_it_is_lost(seed):
    """x and y are equally far, but for what was sent twice: y might go by x for all x knows."""
    run = bench(RUNGS, RUNGS_TREE, seed, RepairConfig(switch_etx=100.0))
    count = every(run, 0.1, ("x", "y"), 8.0)
    run.at(4 * SECOND, lambda: run.network.stop_node("a"))
    run.run(10.0)
    moves = [(node, old, new) for _, node, old, new, _ in run.moves]
    lost_s, found_s = run.moves[0][0] / SECOND, run.moves[-1][0] / SECOND
    assert lost_s < 4.5
    if moves != [("x", "a", "y")]:
        assert moves == [("x", "a", None), ("x", None, "y")]
        # its next beacon comes within two shortest intervals, and its waiting takes two more
        assert 2 * BEACON_S <= found_s - lost_s < 4 * BEACON_S + 0.05
    assert len(run.delivered_at) == count
    assert run.network.tree.depth["x"] == 3


def test_what_the_base_says_follows_the_changed_tree():
    run = bench(DIAMOND, DIAMOND_TREE)
    every(run, 0.2, ("far", "leaf"), 4.0)
    run.at(2 * SECOND, lambda: run.network.stop_node("left"))
    to_leaf = run.send("base", "leaf", bytes(300), at_ns=4 * SECOND)
    alive = ("right", "far", "leaf")
    to_all = run.send("base", ("left", *alive), bytes(50), at_ns=5 * SECOND, disseminate=True)
    run.run(16.0)
    heard = {(d.number, receiver): hops for _, d, receiver, hops in run.delivered_at}
    assert heard[to_leaf, "leaf"] == 3
    assert [heard.get((to_all, node)) for node in alive] == [1, 2, 3]
    assert [(d.number, r, o) for _, d, r, o in run.dropped_at] == [(to_all, "left", Outcome.DEAD)]


def test_where_no_parent_is_left_frames_wait_or_are_lost_as_asked():
    fates = {}
    for no_route in ("hold", "drop"):
        run = line(3, repair=RepairConfig(no_route=no_route))
        run.at(SECOND, lambda run=run: run.network.stop_node("n1"))
        for at in (2.0, 4.0, 6.0):
            run.send("n2", "n0", bytes(20), at_ns=round(at * SECOND))
        run.run(30.0)
        fates[no_route] = [outcome for *_, outcome in run.dropped_at]
        assert run.delivered_at == []
        assert run.network.tree.depth["n2"] == -1
        assert run.network.tree.parent["n2"] is None
    assert fates["hold"] == []
    assert fates["drop"] == [Outcome.NO_ROUTE] * 3


def test_what_waited_goes_when_there_is_a_way_again():
    """The far node finds nobody for as long as the relay between is not there: it has no battery yet."""
    run = line(3, repair=RepairConfig(initial="discover"))
    run.send("n2", "n0", bytes(300), at_ns=1)
    run.run(5.0)
    ((at, _, receiver, hops),) = run.delivered_at
    assert (receiver, hops) == ("n0", 2)
    found = {node: at for at, node, old, new, _ in run.moves if old is None}
    assert 0 < found["n1"] < found["n2"] < at


@pytest.mark.parametrize("seed", range(3))
def test_ways_are_found_from_nothing(seed):
    run = line(6, seed=seed, repair=RepairConfig(initial="discover"))
    assert set(run.network.tree.depth.values()) == {0, -1}
    nodes = [f"n{i}" for i in range(1, 6)]
    run.run(3.0)
    assert [run.network.tree.depth[node] for node in nodes] == [1, 2, 3, 4, 5]
    count = every(run, 1.0, nodes, 6.0, begin_s=3.0)
    down = run.send("n0", "n5", b"you", at_ns=7 * SECOND)
    run.run(8.0)
    assert len(run.delivered_at) == count + 1
    assert down in {d.number for _, d, *_ in run.delivered_at}


def test_an_idle_network_says_nothing_but_beacons_and_all_of_them_are_counted():
    """A beacon is 7 B and 11 B of MAC; intervals of 0.128 s · 2^k: eight of them begin before 32.6 s."""
    run = bench(DIAMOND, DIAMOND_TREE)
    run.run(0.128 * 255)
    for node in DIAMOND:
        counters = run.network.counters(node)
        assert counters.control_frames_tx == counters.frames_tx == 8
        assert counters.control_tx_bytes == counters.mac_tx_bytes == 8 * 18


def test_over_sleeping_radios_a_train_of_copies_is_one_transmission_of_a_link():
    """Copies for a receiver that sleeps say nothing of the link; each is on the air and counts there."""
    run = RadioBench.line(
        3, 40.0, family=lambda *_: LplFamily(), routing=RoutingConfig(RepairConfig()), mesh_header_bytes=5
    )
    for number in range(10):
        run.send("n2", "n0", bytes(20), at_ns=(4 + 3 * number) * SECOND)
    run.run(40.0)
    assert len(run.delivered_at) == 10
    counters = run.network.counters("n2")
    assert counters.attempts > 5 * 10
    assert all(entry.link_etx < 1.5 for entry in run.network.router("n2").table)
    # it has nobody below it: beacons, joins and its own messages are all that it sends
    frame_bytes = 6 + 3 + 20 + 11
    messages = counters.frames_tx - counters.control_frames_tx
    assert counters.mac_tx_bytes - counters.control_tx_bytes == messages * frame_bytes


def test_what_the_base_says_to_many_in_turn_is_never_taken_for_a_repetition():
    """Each of eight leaves gets every eighth packet, and would see 8-bit numbers again after 256 in all."""
    run = RadioBench.star(8, routing=RoutingConfig(RepairConfig()), mesh_header_bytes=5)
    for number in range(300):
        run.send("n0", f"n{1 + number % 8}", bytes(20), at_ns=SECOND + number * SECOND // 50)
    run.run(8.0)
    assert len(run.delivered_at) == 300
    assert run.dropped_at == []


def test_a_circle_is_seen_by_the_packets_in_it_and_broken():
    run = bench(DIAMOND, DIAMOND_TREE)
    run.run(10.0)
    # far and leaf are made to believe that the other is nearer to the base
    routers = {node: run.network.router(node) for node in ("far", "leaf")}
    at = {node: number for number, node in enumerate(DIAMOND)}
    for node, other in (("far", "leaf"), ("leaf", "far")):
        routers[node].parent = at[other]
        entry = routers[node].table.meet(at[other])
        entry.cost, entry.parent, routers[node].cost = 0.5, at["base"], 1.5
    number = run.send("leaf", "base", bytes(20))
    run.run(12.0)
    assert [d.number for _, d, *_ in run.delivered_at] == [number]
    assert sum(router.loops_seen for router in routers.values()) > 0
    assert any(why == CIRCLE for *_, why in run.moves)
    assert run.network.tree.depth["leaf"] == 3


def test_a_packet_takes_no_more_hops_than_it_may():
    run = line(5, repair=RepairConfig(hop_limit=3))
    near, far = (run.send(f"n{i}", "n0", bytes(20), at_ns=i * SECOND) for i in (3, 4))
    run.run(6.0)
    assert [d.number for _, d, *_ in run.delivered_at] == [near]
    assert [(d.number, o) for _, d, _, o in run.dropped_at] == [(far, Outcome.HOP_LIMIT)]


def test_the_same_seed_gives_the_same_run():
    def rows(seed):
        run = bench(DIAMOND, DIAMOND_TREE, seed)
        every(run, 0.1, ("far", "leaf"), 3.0)
        run.at(SECOND, lambda: run.network.stop_node("left"))
        run.run(4.0)
        return [(at, d.number, hops) for at, d, _, hops in run.delivered_at], run.moves

    assert rows(1) == rows(1)
    assert rows(1) != rows(2)


def test_a_parent_that_fades_is_left_when_another_is_cheaper_by_the_threshold_and_not_before():
    """Two transmissions for each acknowledgement cost one more than a fresh neighbour: less than 1.5."""
    run = bench(DIAMOND, DIAMOND_TREE)
    run.run(30.0)
    router, left = run.network.router("far"), list(DIAMOND).index("left")
    for _ in range(200):
        router.sent(left, 2, True)
    assert router.table.get(left).link_etx > 1.8
    assert run.moves == []
    needed = 0
    while router.parent == left:
        router.sent(left, 4, True)
        needed += 1
        assert needed < 100
    ((_, node, old, new, why),) = run.moves
    assert (node, old, new, why) == ("far", "left", "right", CHEAPER)
    right = router.table.get(list(DIAMOND).index("right"))
    assert router.table.get(left).path_etx > right.path_etx + RepairConfig().switch_etx
