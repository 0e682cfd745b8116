"""Routes reach the base over good links; each receiver's fate is told once; one seed gives one run."""

import runpy
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from wsnsim.net.channel.propagation import distances
from wsnsim.net.interface import Outcome
from wsnsim.net.routing.tree import RoutingError

BENCH = runpy.run_path(str(Path(__file__).parents[1] / "radio_bench.py"))
RadioBench, tree_to = BENCH["RadioBench"], BENCH["tree_to"]
RANGE_M = 10.0 ** ((95.0 - 40.05) / 30.0)


def scattered(seed, nodes, side_m):
    spots = np.random.default_rng(seed).uniform(0, side_m, (nodes, 2))
    return {f"n{i}": (x, y, 0.0) for i, (x, y) in enumerate(spots)}


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), nodes=st.integers(2, 40), side_m=st.floats(20, 250))
def test_the_tree_reaches_the_base_in_fewest_hops(seed, nodes, side_m):
    places = scattered(seed, nodes, side_m)
    linked = distances(np.array(list(places.values()))) <= RANGE_M
    within, hops = np.zeros(nodes, bool), np.full(nodes, -1)
    within[0], hops[0], step = True, 0, 0
    while True:
        step += 1
        reached = linked[within].any(axis=0) & ~within
        if not reached.any():
            break
        hops[reached] = step
        within |= reached
    if not within.all():
        with pytest.raises(RoutingError) as raised:
            tree_to("n0", places)
        lost, said = np.flatnonzero(~within), str(raised.value)
        assert [at for at in range(nodes) if f"'n{at}' cannot" in said] == lost[:20].tolist()
        assert (f"nor can {len(lost) - 20} others" in said) == (len(lost) > 20)
        return
    tree = tree_to("n0", places)
    assert list(tree.depth.values()) == hops.tolist()
    for node, parent in tree.parent.items():
        if parent is not None:
            assert linked[int(node[1:]), int(parent[1:])]
            assert tree.depth[node] == tree.depth[parent] + 1
            assert node in tree.children[parent]
    assert tree.parent["n0"] is None
    assert len(tree.descendants("n0")) == nodes - 1


def busy_day(seed, layout, collision, mesh_header_bytes, deaths):
    """Random traffic of all kinds for two seconds in a network whose nodes die."""
    rng = np.random.default_rng(layout)
    places = scattered(layout, 8, 110.0)
    try:
        bench = RadioBench(
            places, "n0", seed, collision=collision, mesh_header_bytes=mesh_header_bytes, record_frames=True,
            queue_frames=6, outbox_datagrams=3, reassembly_timeout_s=0.5,
        )  # fmt: skip
    except RoutingError:
        return None
    intended = {}
    for _ in range(60):
        at_ns, size = int(rng.integers(2_000_000_000)), int(rng.integers(0, 900))
        source = f"n{rng.integers(8)}"
        if rng.random() < 0.2:
            source, to = "n0", tuple(f"n{i}" for i in range(1, 8))
        elif rng.random() < 0.5:
            to = ("n0",)
        else:
            to = (f"n{rng.integers(8)}",)
        number = bench.send(source, to, rng.bytes(size), at_ns, disseminate=len(to) > 1)
        intended.update({(number, receiver): 0 for receiver in to})
    for _ in range(deaths):
        node = f"n{rng.integers(8)}"
        bench.at(int(rng.integers(2_000_000_000)), lambda node=node: bench.network.stop_node(node))
    bench.run(30.0)
    return bench, intended


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 1000), layout=st.integers(0, 1000), deaths=st.integers(0, 3),
    collision=st.sampled_from(("sinr", "destructive")), mesh=st.sampled_from((0, 5)),
)  # fmt: skip
def test_every_intended_receiver_ends_as_delivered_or_dropped_once(seed, layout, deaths, collision, mesh):
    day = busy_day(seed, layout, collision, mesh, deaths)
    assume(day is not None)
    bench, intended = day
    # long after the last frame nothing is in flight any more
    assert bench.fates() == dict.fromkeys(intended, 1)
    if not deaths:
        assert Outcome.DEAD not in {o for *_, o in bench.dropped_at}
    sent = Counter(row.sender for row in bench.frames if row.kind != "broadcast")
    for node in bench.network.tree.parent:
        counters = bench.network.counters(node)
        assert sent[node] <= counters.frames_tx
    times = [row.time_s for row in bench.frames]
    assert all(0.0 <= time <= 30.0 for time in times)


def test_the_same_seed_gives_the_same_run_and_another_seed_another():
    runs = [busy_day(seed, 3, "sinr", 5, 1)[0] for seed in (1, 1, 2)]
    first, again, other = (repr((run.delivered_at, run.dropped_at, run.frames)) for run in runs)
    assert first == again
    assert first != other
