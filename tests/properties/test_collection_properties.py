"""Whatever a network does to messages of groups: nothing counts twice, and everything has one fate."""

import runpy
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wsnsim.metrics.conservation import _messages as broken_laws
from wsnsim.metrics.traffic import content_arrived, traffic

bench = runpy.run_path(str(Path(__file__).parents[1] / "collection_bench.py"))
CollectionBench, Plan, WildNetwork = (bench[name] for name in ("CollectionBench", "Plan", "WildNetwork"))
GUARD_S = bench["GUARD_S"]
EPOCHS = 4
PERIOD_S = 0.25


def wild_run(seed, *, loss=0.0, deaths=0, refusals=0.0, plain=0.0, slow=True):
    """A random tree whose network delays, repeats and loses, and whose nodes speak late and die."""
    rng = np.random.default_rng(seed)
    names = ["base", *(f"n{i}" for i in range(int(rng.integers(1, 10))))]
    parents = {name: names[int(rng.integers(at))] if at else None for at, name in enumerate(names)}
    motes = names[1:]

    def fate(datagram):
        if rng.random() < loss:
            return []
        copies = 1 + int(rng.random() < 0.3) + int(rng.random() < 0.1)
        # a network that is not slow keeps the service time that it promises
        delays = rng.exponential(0.05, copies) if slow else rng.uniform(0.0, 0.9 * GUARD_S, copies)
        return delays.tolist()

    plan = Plan(
        epochs=EPOCHS,
        period_s=PERIOD_S,
        due_s=float(rng.uniform(0.1, 0.4)) if slow else 0.9,
        fuse_s=float(rng.choice((0.0, 0.004, 0.05))) if slow else 0.001,
        speaks_s={
            (name, k): float(rng.exponential(0.05) if slow else rng.uniform(0.0, 0.05))
            for name in motes
            for k in range(1, EPOCHS + 1)
        },
        refusing=tuple(name for name in motes if rng.random() < refusals),
        plain=tuple(name for name in motes if rng.random() < plain),
    )
    run = CollectionBench(parents, plan, lambda env, observer: WildNetwork(env, observer, fate))
    for name in rng.choice(motes, min(deaths, len(motes)), replace=False):
        run.at(float(rng.uniform(0.0, EPOCHS * PERIOD_S)), run.nodes[str(name)]._die)
    messages = run.run(float(rng.uniform(1.0, 2.5)) if deaths else 4.0)
    return run, messages


@settings(max_examples=80, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), loss=st.sampled_from((0.0, 0.1, 0.5)), deaths=st.integers(0, 3))
def test_nothing_is_counted_twice_and_every_message_has_one_fate(seed, loss, deaths):
    run, messages = wild_run(seed, loss=loss, deaths=deaths, refusals=0.1, plain=0.2)
    for epoch in range(1, EPOCHS + 1):
        assert set(run.counted(epoch).values()) <= {1}
    assert not messages["message"].duplicated().any()
    assert messages["message"].tolist() == list(range(len(messages)))
    assert broken_laws(messages, run.nodes_table()) == []


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_where_nothing_is_lost_or_late_everything_is_counted_once_and_sent_once(seed):
    run, messages = wild_run(seed, slow=False)
    everyone = dict.fromkeys((name for name in run.nodes if name != "base"), 1)
    for epoch in range(1, EPOCHS + 1):
        assert run.counted(epoch) == everyone
    assert len(messages) == EPOCHS * len(everyone)
    assert content_arrived(messages).all()
    assert set(messages["outcome"]) <= {"delivered", "fused"}


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), loss=st.sampled_from((0.1, 0.3)))
def test_a_lost_message_costs_what_is_in_it_and_nothing_else(seed, loss):
    """With time enough, the base misses exactly the counts of the messages that the network lost."""
    run, messages = wild_run(seed, loss=loss, slow=False)
    heard = sum(sum(run.counted(epoch).values()) for epoch in range(1, EPOCHS + 1))
    spoken = EPOCHS * (len(run.nodes) - 1)
    # behind a header of 5 bytes each count takes 4: two, and a name of two letters
    lost = messages[messages["outcome"] == "dropped_no_ack"]
    assert heard == spoken - int((lost["bytes"] - 5).sum()) // 4
    assert set(messages["outcome"]) <= {"delivered", "fused", "dropped_no_ack"}


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), loss=st.sampled_from((0.1, 0.5)), deaths=st.integers(0, 2))
def test_the_delivery_ratio_is_that_of_the_ways_followed_by_hand(seed, loss, deaths):
    run, messages = wild_run(seed, loss=loss, deaths=deaths, refusals=0.1, plain=0.2)
    if messages.empty:
        return
    rows = messages.set_index("message").to_dict("index")

    def reaches(number):
        row = rows[number]
        while row["outcome"] == "fused":
            row = rows[int(row["fused_into"])]
        return row["outcome"] == "delivered" and row["destination"] == "base"

    nodes = run.nodes_table().assign(mac_tx_bytes=0)
    load = messages.head(0).assign(time_s=[], mac_tx_bytes=[])
    figures = traffic(messages, nodes, load, "base", EPOCHS, PERIOD_S, 4.0)
    assert figures["delivery_ratio"] == pytest.approx(
        np.mean([reaches(number) for number in rows]), abs=1e-12
    )
    assert figures["delivery_ratio_down"] is None
    ingress = sum(
        row["bytes"]
        for row in rows.values()
        if row["destination"] == "base" and row["outcome"] == "delivered"
    )
    assert figures["base_ingress_bytes_per_step"] == ingress / EPOCHS


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_the_same_chances_give_the_same_rows(seed):
    first, again = (wild_run(seed, loss=0.2, deaths=2, plain=0.2)[0].sink.rows for _ in range(2))
    assert repr(first) == repr(again)
