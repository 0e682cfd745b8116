"""Whatever dies: no circle lasts, whoever has a way delivers, and every message has one fate at most."""

import runpy
from pathlib import Path

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from wsnsim.net.meshes import RoutingConfig
from wsnsim.net.routing.config import DisseminationConfig, RepairConfig

RadioBench = runpy.run_path(str(Path(__file__).parents[1] / "radio_bench.py"))["RadioBench"]

SECOND = 10**9
REACH_M = 50.0
"""Well inside what these radios reach (67 m)."""


def scattered(seed, nodes, side_m):
    rng = np.random.default_rng(seed)
    places = {"base": (side_m / 2, side_m / 2, 0.0)}
    for number in range(1, nodes):
        places[f"m{number}"] = (*rng.uniform(0, side_m, 2), 0.0)
    return places, rng


def near(one, other):
    return np.linalg.norm(np.subtract(one, other)) <= REACH_M


def connected(places, alive):
    """Return the nodes that reach the base over good links between living nodes."""
    found = ["base"]
    for node in found:
        found += [other for other in alive if other not in found and near(places[node], places[other])]
    return set(found)


def circles(run, nodes):
    """Return the circles that the nodes' own beliefs make."""
    parents = {node: run.network.router(node).parent for node in nodes}
    found = set()
    for start in nodes:
        way, node = [], start
        while node is not None and node not in way:
            way.append(node)
            at = parents[node]
            node = None if at is None else list(nodes)[at]
        if node is not None:
            found.add(frozenset(way[way.index(node) :]))
    return found


@settings(max_examples=12, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    nodes=st.integers(5, 22),
    deaths=st.integers(0, 6),
    initial=st.sampled_from(["discover", "tree"]),
    no_route=st.sampled_from(["hold", "drop"]),
)
def test_after_deaths_all_that_can_deliver_do(seed, nodes, deaths, initial, no_route):
    places, rng = scattered(seed, nodes, side_m=60.0 + 4.0 * nodes)
    repair = RepairConfig(initial=initial, no_route=no_route)
    reached = connected(places, list(places))
    places = {node: place for node, place in places.items() if node in reached}
    parents = {"base": None}
    for node in places:  # any tree over good links will do
        for child in places:
            if child not in parents and node in parents and near(places[child], places[node]):
                parents[child] = node
    places = {node: places[node] for node in parents}
    run = RadioBench(places, parents, seed % 1000, routing=RoutingConfig(repair))
    motes = [node for node in places if node != "base"]
    sent = {}
    for second in range(5, 20):
        for mote in motes:
            at = (second + rng.random()) * SECOND
            sent[run.send(mote, "base", bytes(30), at_ns=int(at))] = (mote, at)
    dead = set(rng.choice(motes, size=min(deaths, len(motes)), replace=False).tolist()) if motes else set()
    for mote in dead:
        run.at(int((5.0 + 3.0 * rng.random()) * SECOND), lambda mote=mote: run.network.stop_node(mote))
    everybody = list(places)
    run.run(20.0)
    # dead nodes believe what they believed when they died
    living = {node: None for node in everybody if node not in dead}
    loops = {loop for loop in circles(run, everybody) if loop <= set(living)}
    assert loops == set()
    assert max(run.fates().values(), default=1) == 1
    delivered = {datagram.number for _, datagram, *_ in run.delivered_at}
    able = connected(places, living)
    lost = [
        (mote, at / SECOND)
        for number, (mote, at) in sent.items()
        if mote in able and at >= 12.0 * SECOND and at < 19.0 * SECOND and number not in delivered
    ]
    assert lost == []
    tree = run.network.tree
    assert all(tree.depth[mote] > 0 for mote in able if mote != "base")


@settings(max_examples=15, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    repair=st.booleans(),
    repeats=st.integers(0, 3),
    accept=st.sampled_from(["parent", "anyone"]),
    policy=st.sampled_from(["drop_newest", "drop_oldest", "drop_random"]),
    mesh_bytes=st.sampled_from([0, 5]),
    sinks=st.sampled_from([(), ("n1",)]),
)
def test_every_receiver_has_one_fate(seed, repair, repeats, accept, policy, mesh_bytes, sinks):
    """Everything at once: dissemination, neighbours, fragments, expiry, small queues, deaths."""
    rng = np.random.default_rng(seed)
    nodes = int(rng.integers(2, 9))
    places = {f"n{i}": (float(x), float(y), 0.0) for i, (x, y) in enumerate(rng.uniform(0, 90, (nodes, 2)))}
    parents = {f"n{i}": f"n{rng.integers(0, i)}" if i else None for i in range(nodes)}
    routing = RoutingConfig(
        RepairConfig() if repair else None, spread=DisseminationConfig(repeats, 0.05, accept)
    )
    run = RadioBench(
        places, parents, seed % 1000, routing=routing, queue_policy=policy, mesh_header_bytes=mesh_bytes,
        queue_frames=int(rng.integers(1, 10)), outbox_datagrams=int(rng.integers(1, 5)),
        reassembly_timeout_s=0.5, sinks=sinks,
    )  # fmt: skip
    meant = []
    for _ in range(60):
        at, size = int(rng.uniform(0, 2.0) * SECOND), int(rng.choice([4, 60, 250, 700]))
        expires = None if rng.random() < 0.7 else at + int(rng.uniform(0, 0.5) * SECOND)
        source, other = (f"n{i}" for i in rng.integers(0, nodes, 2))
        kind = rng.choice(["up", "all", "near"])
        data = rng.bytes(size)
        if kind == "all":
            number = run.send("n0", tuple(p for p in places if p != "n0"), data, at, True, expires)
            meant += [(number, node) for node in places if node != "n0"]
        elif kind == "near":
            others = tuple(p for p in places if p != source)
            number = run.send(source, others, data, at, expires_ns=expires, one_hop=True)
            meant += [(number, node) for node in others]
        else:
            meant.append((run.send(source, other, data, at, expires_ns=expires), other))
    for node in rng.choice(list(places), size=int(rng.integers(0, 3))):
        run.at(int(rng.uniform(0, 2.0) * SECOND), lambda node=node: run.network.stop_node(str(node)))
    run.run(12.0)
    fates = run.fates()
    assert set(fates) <= set(meant)
    assert max(fates.values(), default=1) == 1
    waiting = set(meant) - set(fates)
    if not repair:
        assert waiting == set()
    else:
        # what is still on its way waits for a way, or behind what does
        queued = [node for node in places if run.network.queued(node)]
        assert all(run.network.tree.depth[node] < 0 for node in queued)
        assert not waiting or queued
