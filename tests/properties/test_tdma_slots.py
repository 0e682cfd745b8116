"""Timetables of random trees: nobody disturbs anybody, everyone has a turn, all messages arrive."""

import runpy
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from wsnsim.net.channel.links import Links
from wsnsim.net.channel.propagation import LogDistance
from wsnsim.net.config import RadioConfig
from wsnsim.net.interface import Datagram, Outcome
from wsnsim.net.mac.slots import Part, Turn, timetable
from wsnsim.net.routing.search import radio_links
from wsnsim.net.routing.tree import RoutingError, tree_from_parents

TESTS = Path(__file__).parents[1]
BENCH = runpy.run_path(str(TESTS / "radio_bench.py"))
RadioBench, tree_to = BENCH["RadioBench"], BENCH["tree_to"]
SLEEP = runpy.run_path(str(TESTS / "sleep_bench.py"))
tdma, lpl, StateMeter = SLEEP["tdma"], SLEEP["lpl"], SLEEP["StateMeter"]
LOSS = LogDistance(exponent=3.0, reference_loss_db=40.05)


def scattered(seed, nodes, side_m):
    spots = np.random.default_rng(seed).uniform(0, side_m, (nodes, 2))
    return {f"n{i}": (x, y, 0.0) for i, (x, y) in enumerate(spots)}


def random_tree(seed, nodes, side_m):
    """Return places, the powers between them and the tree of fewest hops, where there is one."""
    places = scattered(seed, nodes, side_m)
    try:
        tree = tree_to("n0", places)
    except RoutingError:
        assume(False)
    links = radio_links(places, LOSS, RadioConfig())
    return places, links.matrix(links.power_dbm, -np.inf), tree


@settings(max_examples=50, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1), nodes=st.integers(2, 40), side_m=st.floats(20, 220),
    threshold_dbm=st.sampled_from((-85.0, -95.0, -105.0)), proportional=st.booleans(),
)  # fmt: skip
def test_in_no_slot_does_a_node_disturb_one_of_another_turn(seed, nodes, side_m, threshold_dbm, proportional):
    places, power_dbm, tree = random_tree(seed, nodes, side_m)
    names = tuple(places)
    table = timetable(tree, names, Links.from_matrix(power_dbm), threshold_dbm, proportional)
    loud = (power_dbm >= threshold_dbm) | (power_dbm >= threshold_dbm).T | np.eye(nodes, dtype=bool)
    on_air = {slot: [] for slot in range(table.length)}
    for turn, slots in table.slots_of.items():
        name = names[turn.node]
        others = (tree.parent[name],) if turn.up else tree.children[name]
        for slot in slots:
            on_air[slot].append({turn.node, *(names.index(other) for other in others)})
    for groups in on_air.values():
        for number, one in enumerate(groups):
            for other in groups[number + 1 :]:
                assert not loud[np.ix_(sorted(one), sorted(other))].any()
    assert table.least_length <= table.length <= sum(map(len, table.slots_of.values()))
    for at, name in enumerate(names):
        through = 1 + len(tree.descendants(name))
        if tree.parent[name] is not None:
            assert len(table.slots_of[Turn(at, up=True)]) == (through if proportional else 1)
        assert (Turn(at, up=False) in table.slots_of) == bool(tree.children[name])
        duties = table.duties(at)
        slots = [duty.slot for duty in duties]
        assert slots == sorted(set(slots))
        heard = Counter(duty.part for duty in duties)
        assert heard[Part.HEAR_PARENT] == (tree.parent[name] is not None)
        assert heard[Part.HEAR_CHILD] == sum(
            len(table.slots_of[Turn(names.index(child), up=True)]) for child in tree.children[name]
        )


@settings(max_examples=12, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), nodes=st.integers(2, 25), side_m=st.floats(30, 180))
def test_no_frame_is_lost_and_everyone_reaches_the_base_though_clocks_drift(seed, nodes, side_m):
    """Any overlap with a frame above the sensitivity is fatal here, and noise is far below it."""
    places, _, _ = random_tree(seed, nodes, side_m)
    config = {"drift_ppm": 20.0, "resync_s": 1.0, "guard_s": 0.002}
    meters = {node: StateMeter() for node in places}
    bench = RadioBench(
        places, "n0", seed, meters, family=tdma(**config), collision="destructive", noise_dbm=-120.0,
        record_frames=True,
    )  # fmt: skip
    rng = np.random.default_rng(seed)
    wanted = {}
    for at_s in (1.0, 12.0):
        for name in list(places)[1:]:
            at_ns = round((at_s + rng.random()) * 1e9)
            wanted[bench.send(name, "n0", rng.bytes(90), at_ns=at_ns), "n0"] = 1
        number = bench.send("n0", tuple(places)[1:], bytes(60), at_ns=round(at_s * 1e9), disseminate=True)
        wanted |= {(number, name): 1 for name in list(places)[1:]}
    bench.run(20.0)
    assert bench.fates() == wanted
    assert not bench.dropped_at
    assert {row.outcome for row in bench.frames} <= {"received"}
    assert bench.network.counters("n1").frames_retried == 0
    for meter in meters.values():
        assert sum(meter.until(bench.env.now).values()) == bench.env.now


@pytest.mark.parametrize("make", [tdma, lpl])
@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 1000), layout=st.integers(0, 1000), deaths=st.integers(0, 3))
def test_every_intended_receiver_ends_as_delivered_or_dropped_once(make, seed, layout, deaths):
    places = scattered(layout, 8, 110.0)
    rng = np.random.default_rng(layout)
    meters = {node: StateMeter() for node in places}
    try:
        bench = RadioBench(places, "n0", seed, meters, family=make(), queue_frames=6, outbox_datagrams=3)
    except RoutingError:
        assume(False)
    wanted = {}
    for _ in range(30):
        at_ns, size = int(rng.integers(2_000_000_000)), int(rng.integers(0, 400))
        source, to = f"n{rng.integers(8)}", ("n0",)
        if rng.random() < 0.2:
            source, to = "n0", tuple(f"n{i}" for i in range(1, 8))
        elif rng.random() < 0.4:
            to = (f"n{rng.integers(8)}",)
        number = bench.send(source, to, rng.bytes(size), at_ns, disseminate=len(to) > 1)
        wanted.update({(number, receiver): 1 for receiver in to})
    for _ in range(deaths):
        node = f"n{rng.integers(8)}"
        bench.at(int(rng.integers(2_000_000_000)), lambda node=node: bench.network.stop_node(node))
    bench.run(45.0)
    assert bench.fates() == wanted
    if not deaths:
        assert Outcome.DEAD not in {outcome for *_, outcome in bench.dropped_at}
    for node, meter in meters.items():
        spent = meter.until(bench.env.now)
        assert sum(spent.values()) == bench.env.now
        assert spent["sleep"] > 0.5 * bench.env.now, node


@pytest.mark.parametrize("make", [tdma, lpl])
def test_the_same_seed_gives_the_same_run_and_another_seed_another(make):
    def run(seed):
        bench = RadioBench(scattered(3, 8, 110.0), "n0", seed, family=make(), record_frames=True)
        for number in range(1, 8):
            bench.send(f"n{number}", "n0", bytes(150), at_ns=number * 1_000_000)
        bench.run(5.0)
        return repr((bench.delivered_at, bench.dropped_at, bench.frames))

    assert run(1) == run(1)
    assert run(1) != run(2)


def test_a_line_uses_each_slot_again_three_hops_on():
    """Neighbours disturb each other and nobody else: turns up of nodes three hops apart share a slot."""
    nodes = 10
    power_dbm = np.full((nodes, nodes), -120.0)
    for at in range(nodes - 1):
        power_dbm[at, at + 1] = power_dbm[at + 1, at] = -80.0
    names = tuple(f"n{at}" for at in range(nodes))
    tree = tree_from_parents({name: names[at - 1] if at else None for at, name in enumerate(names)})
    table = timetable(tree, names, Links.from_matrix(power_dbm), -95.0)
    # a turn up of node k is on the air at k and k - 1, so k and k + 3 are free of each other
    assert [table.slots_of[Turn(at, up=True)] for at in range(1, nodes)] == [
        ((nodes - 1 - at) % 3,) for at in range(1, nodes)
    ]
    assert table.length == 6
    assert table.least_length == 4


def test_a_star_needs_a_slot_for_each_leaf_and_one_for_the_base():
    power_dbm = np.full((6, 6), -60.0)
    names = tuple(f"n{at}" for at in range(6))
    tree = tree_from_parents(dict.fromkeys(names, "n0") | {"n0": None})
    table = timetable(tree, names, Links.from_matrix(power_dbm), -95.0)
    assert table.length == table.least_length == 6


def test_a_base_alone_has_nothing_to_do():
    table = timetable(
        tree_from_parents({"n0": None}), ("n0",), Links.from_matrix(np.full((1, 1), -np.inf)), -95.0
    )
    assert table.length == 1
    assert table.duties(0) == ()


def test_a_wired_sink_sends_up_to_nobody():
    names = ("base", "sink", "a", "b")
    parents = {"base": None, "sink": "base", "a": "sink", "b": "base"}
    tree = tree_from_parents(parents, frozenset({"sink"}))
    power_dbm = np.full((4, 4), -120.0)
    for one, other in (("sink", "a"), ("base", "b")):
        one, other = names.index(one), names.index(other)
        power_dbm[one, other] = power_dbm[other, one] = -80.0
    table = timetable(tree, names, Links.from_matrix(power_dbm), -95.0)
    assert table.parents == (None, None, 1, 0)
    # the sinks are out of each other's reach, so both halves use the same two slots
    assert table.length == 2
    assert [duty.part for duty in table.duties(1)] == [Part.HEAR_CHILD, Part.SEND_DOWN]


def test_a_neighbour_broadcast_is_heard_by_children_or_by_the_parent_of_a_leaf():
    bench = RadioBench.star(3, family=tdma(), record_frames=True)
    everyone = set(bench.network.tree.parent)
    for number, source in enumerate(("n0", "n1")):
        to = tuple(sorted(everyone - {source}))
        bench.network.send(Datagram(number, source, to, b"hello", one_hop=True))
    bench.run(1.0)
    assert {(datagram.source, at) for _, datagram, at, _ in bench.delivered_at} == {
        ("n0", "n1"), ("n0", "n2"), ("n0", "n3"), ("n1", "n0"),
    }  # fmt: skip
    assert {(at, outcome) for _, _, at, outcome in bench.dropped_at} == {
        ("n2", Outcome.NOT_HEARD),
        ("n3", Outcome.NOT_HEARD),
    }
