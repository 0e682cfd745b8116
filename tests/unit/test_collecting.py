"""Messages of a group are fused on their way: one message a node, and whatever is lost costs itself only."""

import runpy
from pathlib import Path

import pytest

from wsnsim.errors import SimulationError
from wsnsim.metrics.conservation import _messages as broken_laws
from wsnsim.metrics.traffic import content_arrived
from wsnsim.systems.base import GroupKey, Scope, Send, Step
from wsnsim.units import to_ns

bench = runpy.run_path(str(Path(__file__).parents[1] / "collection_bench.py"))
CollectionBench, Plan, Tally, WildNetwork = (
    bench[name] for name in ("CollectionBench", "Plan", "Tally", "WildNetwork")
)
BINARY, CHAIN, PLATFORM, STAR, TREES = (
    bench[name] for name in ("BINARY", "CHAIN", "PLATFORM", "STAR", "TREES")
)
NETWORKS = ("ideal", "ieee802154")
GUARD_S = bench["GUARD_S"]


def all_of(tree):
    return {node: 1 for node in tree if node != "base"}


def wild(**kwargs):
    """Return a maker of a network that obeys `fate`."""
    return lambda env, observer: WildNetwork(env, observer, **kwargs)


def outcomes(messages):
    return messages["outcome"].value_counts().to_dict()


@pytest.mark.parametrize("network", NETWORKS)
@pytest.mark.parametrize("name", TREES)
def test_every_node_sends_one_message_an_epoch_and_the_base_has_the_sum(name, network):
    tree = TREES[name]
    run = CollectionBench(tree, Plan(epochs=5, fuse_s=0.005), network)
    messages = run.run()
    for epoch in range(1, 6):
        assert run.counted(epoch) == all_of(tree)
    assert len(messages) == 5 * len(all_of(tree))
    assert (messages["destination"] == messages["source"].map(tree)).all()
    assert (messages["hops"] == 1).all()
    assert (messages["kind"] == "tally").all()
    roots = messages["destination"] == "base"
    assert (messages.loc[roots, "outcome"] == "delivered").all()
    assert (messages.loc[~roots, "outcome"] == "fused").all()
    assert content_arrived(messages).all()
    assert broken_laws(messages, run.nodes_table()) == []
    # a sum is longer than its parts, and its bytes are those that travelled
    assert messages["bytes"].tolist() == [
        5 + sum(2 + len(n) for n in all_of(tree) if n == s or s in way(tree, n)) for s in messages["source"]
    ]


def way(tree, node):
    while tree[node] is not None:
        node = tree[node]
        yield node


def test_over_an_ideal_network_only_the_processors_take_time():
    run = CollectionBench(CHAIN, Plan(fuse_s=0.02))
    messages = run.run()
    assert messages["source"].tolist() == ["c", "b", "a"]
    assert messages["created_s"].tolist() == pytest.approx([1.03, 1.05, 1.07], abs=1e-9)
    assert [at for at, *_ in run.programs["base"].heard] == [pytest.approx(1.07, abs=1e-9)]
    assert messages["fused_into"].tolist()[:2] == [1, 2]
    seconds = run.nodes["b"].power.ledger.seconds(to_ns(2.0))["cpu", "work"]
    assert seconds == pytest.approx(0.02, abs=2e-9)
    drawn = run.nodes["b"].power.ledger.drawn_j(to_ns(2.0))["cpu", "work"]
    assert drawn == pytest.approx(0.02 * PLATFORM.cpu_active_w, rel=1e-6)


@pytest.mark.parametrize("network", NETWORKS)
def test_a_silent_child_is_waited_for_until_the_latest_instant_and_no_longer(network):
    run = CollectionBench(BINARY, Plan(fuse_s=0.01, silent=("c",)), network)
    messages = run.run()
    assert run.counted() == dict.fromkeys("abdef", 1)
    hop_s = 0.01 + run.network.hop_service_s(30, "a")
    (made,) = [at for at, _ in run.programs["a"].fused]
    assert made == pytest.approx(1.8 - hop_s, abs=1e-9)
    # b waits for nobody; a's message still comes before everything is due
    assert [at for at, _ in run.programs["b"].fused] == [pytest.approx(1.0, abs=0.2)]
    assert max(at for at, *_ in run.programs["base"].heard) <= 1.8
    assert outcomes(messages) == {"delivered": 2, "fused": 3}


def test_deeper_nodes_give_up_earlier_and_their_parents_still_hear_them():
    """Every leaf is silent: the others wait to their latest, and the sum climbs from wait to wait."""
    run = CollectionBench(CHAIN, Plan(fuse_s=0.01, silent=("c",)))
    run.run()
    times = [run.programs[node].fused[0][0] for node in "ba"]
    assert times == [pytest.approx(1.8 - depth * (0.01 + GUARD_S), abs=1e-9) for depth in (2, 1)]
    assert run.counted() == {"a": 1, "b": 1}
    assert len(run.programs["base"].heard) == 1


def test_a_node_that_only_passes_on_takes_time_for_its_hop_but_not_for_fusing():
    run = CollectionBench(CHAIN, Plan(fuse_s=0.01, silent=("c",), plain=("a",)), "ieee802154")
    run.run()
    lead_s = 0.01 + run.network.hop_service_s(30, "b") + run.network.hop_service_s(30, "a")
    assert [at for at, _ in run.programs["b"].fused] == [pytest.approx(1.8 - lead_s, abs=1e-9)]
    assert run.counted() == {"a": 1, "b": 1}


def test_nobody_gives_up_before_the_epochs_frame():
    """A deadline that the tree cannot keep: what is late goes on by itself."""
    run = CollectionBench(CHAIN, Plan(due_s=0.05, fuse_s=0.03, speaks_s={"a": 0.02, "b": 0.01, "c": 0.0}))
    run.run()
    first = {node: run.programs[node].fused[0][0] for node in "abc"}
    assert first["c"] == pytest.approx(1.0, abs=1e-9)
    assert first["b"] == pytest.approx(1.01, abs=1e-9)
    assert first["a"] == pytest.approx(1.02, abs=1e-9)


@pytest.mark.parametrize("network", NETWORKS)
def test_a_relay_that_dies_stops_its_own_branch_only(network):
    """The battery of b, which has two children, ends in the third epoch; a's branch goes on."""
    draws_w = CollectionBench(BINARY, Plan(), network).nodes["b"].power._most_w
    alone = CollectionBench(BINARY, Plan(epochs=2), network, capacities_j={"b": 1e9})
    alone.run(3.405)
    used_j = 1e9 - alone.nodes["b"].power.left_j()
    assert 0.0 < used_j < draws_w * 3.405
    plan = Plan(epochs=6, speaks_s={"e": 0.3, "f": 0.6})
    run = CollectionBench(BINARY, plan, network, capacities_j={"b": used_j})
    messages = run.run()
    assert 3.0 < run.nodes["b"].died_at_s < 3.6
    for epoch in range(1, 7):
        here = "abcdef" if epoch < 3 else "acd"
        assert run.counted(epoch) == dict.fromkeys(here, 1)
    # in the third epoch e's message waited at b; f's found nobody
    lost = messages[~messages["outcome"].isin(("delivered", "fused"))]
    assert set(lost["source"]) == {"e", "f"}
    third = lost[lost["created_s"] < 4.0].set_index("source")["outcome"]
    assert third["e"] == "dropped_dead_node"
    assert third["f"] == ("dropped_dead_node" if network == "ideal" else "dropped_no_ack")
    assert broken_laws(messages, run.nodes_table()) == []


def test_a_node_that_dies_over_an_aggregate_loses_it_with_its_parts():
    run = CollectionBench(CHAIN, Plan(fuse_s=0.1))
    b = run.nodes["b"]
    run.at(1.15, b._die)  # b began at 1.11 s
    messages = run.run()
    assert messages[["source", "outcome"]].to_numpy().tolist() == [
        ["c", "dropped_dead_node"], ["a", "delivered"]
    ]  # fmt: skip
    assert run.counted() == {"a": 1}
    assert messages["delivered_s"].isna().tolist() == [True, False]


def test_a_late_child_costs_time_and_goes_on_by_itself():
    """c speaks after b gave it up, but in time for the base: two messages, nothing twice."""
    run = CollectionBench(CHAIN, Plan(fuse_s=0.01, due_s=0.8, speaks_s={"c": 0.77}))
    messages = run.run()
    assert run.counted() == {"a": 1, "b": 1, "c": 1}
    assert [tally.counts for *_, tally in run.programs["base"].heard] == [{"a": 1, "b": 1}, {"c": 1}]
    assert run.programs["base"].heard[0][0] == pytest.approx(1.8 - GUARD_S, abs=1e-9)
    assert [who for _, who in run.programs["b"].fused] == [("b",), ("c",)]
    assert [who for _, who in run.programs["a"].fused] == [("a", "b"), ("b",)]
    assert outcomes(messages) == {"fused": 3, "delivered": 2}
    assert broken_laws(messages, run.nodes_table()) == []


@pytest.mark.parametrize("after_s", [0.6, 1.2])
def test_what_comes_after_it_is_due_is_dropped_where_it_came(after_s):
    """While b knows the group, and when it has forgotten it; its program is not asked any more."""
    run = CollectionBench(CHAIN, Plan(due_s=0.5, speaks_s={("c", 1): after_s}, epochs=2))
    awaits, asked = run.programs["b"].awaits, []
    run.programs["b"].awaits = lambda *args: asked.append((args[0].epoch, run.now_s())) or awaits(*args)
    messages = run.run()
    assert asked
    assert all(at <= run.plan.due(epoch) for epoch, at in asked)
    assert run.counted(1) == {"a": 1, "b": 1}
    assert run.counted(2) == {"a": 1, "b": 1, "c": 1}
    late = messages[messages["outcome"] == "dropped_expired"]
    assert late[["source", "destination", "created_s"]].to_numpy().tolist() == [["c", "b", 1.0 + after_s]]


def test_what_waits_for_the_processor_until_it_is_due_is_dropped_then():
    """b is busy from 1.4 s to 1.9 s with something else; c's message came at 1.45 s, due is 1.8 s."""
    run = CollectionBench(CHAIN, Plan(speaks_s={"c": 0.45, "b": 0.95}))
    run.at(1.4, lambda: run.nodes["b"].take(lambda ctx: (bench["work_s"](0.5), lambda: None)))
    messages = run.run()
    assert messages.loc[messages["source"] == "c", "outcome"].tolist() == ["dropped_expired"]
    assert run.counted() == {"a": 1}
    # b's own is late too: it goes to the network as any late message does, and a drops it
    assert messages.loc[messages["source"] == "b", ["created_s", "outcome"]].to_numpy().tolist() == [
        [1.95, "dropped_expired"]
    ]


def test_what_a_radio_cannot_send_until_it_is_due_expires():
    """c's program is late itself: a network where time passes does not send it any more."""
    run = CollectionBench(CHAIN, Plan(speaks_s={"c": 0.9}), "ieee802154")
    messages = run.run()
    assert run.counted() == {"a": 1, "b": 1}
    assert messages.set_index("source").loc["c", ["outcome", "created_s"]].tolist() == [
        "dropped_expired",
        1.9,
    ]
    assert run.network.counters("c").frames_tx == 0


def test_a_plain_nodes_message_expires_by_itself():
    run = CollectionBench(CHAIN, Plan(plain=("c",), expires_s=0.3, speaks_s={"c": 0.4}), "ieee802154")
    messages = run.run()
    assert run.counted() == {"a": 1, "b": 1}
    assert messages.set_index("source").loc["c", "outcome"] == "dropped_expired"


def test_the_books_of_what_a_program_refuses():
    run = CollectionBench(BINARY, Plan(refusing=("a",)))
    messages = run.run()
    assert run.counted() == {"b": 1, "e": 1, "f": 1}
    assert messages.set_index("source")["outcome"].to_dict() == {
        "c": "dropped_refused", "d": "dropped_refused", "e": "fused", "f": "fused", "b": "delivered"
    }  # fmt: skip
    assert broken_laws(messages, run.nodes_table()) == []


@pytest.mark.parametrize("network", NETWORKS)
def test_a_node_that_is_no_aggregator_passes_messages_on_unchanged(network):
    """a passes on what b and its own program say, each hop a message of its own."""
    run = CollectionBench(CHAIN, Plan(plain=("a",)), network)
    messages = run.run()
    assert sorted((who, tally.counts) for _, who, tally in run.programs["base"].heard) == [
        ("a", {"a": 1}), ("b", {"b": 1, "c": 1})
    ]  # fmt: skip
    up = messages[messages["source"] == "a"]
    assert len(up) == 2
    assert outcomes(messages) == {"delivered": 2, "fused": 2}
    from_b = messages[messages["source"] == "b"].iloc[0]
    onward = messages.set_index("message").loc[from_b["fused_into"]]
    assert (onward["bytes"], onward["source"]) == (from_b["bytes"], "a")
    assert onward["created_s"] == from_b["delivered_s"]
    assert broken_laws(messages, run.nodes_table()) == []


def test_bytes_that_say_nothing_are_counted_and_the_rest_goes_on():
    def spoil(datagram):
        return b"\x09" if datagram.source == "c" else datagram.data

    run = CollectionBench(BINARY, Plan(), wild(fate=lambda datagram: [0.002], spoil=spoil))
    messages = run.run()
    assert run.counted() == dict.fromkeys("abdef", 1)
    assert messages.set_index("source").loc["c", "outcome"] == "dropped_undecodable"
    assert broken_laws(messages, run.nodes_table()) == []


def test_a_message_that_arrives_twice_changes_nothing():
    """Copies come while the first waits, while it is fused, and after it has gone on."""
    run = CollectionBench(BINARY, Plan(fuse_s=0.05), wild(fate=lambda d: [0.002, 0.004, 0.03, 0.2]))
    messages = run.run()
    assert run.counted() == all_of(BINARY)
    assert len(messages) == 6
    once = CollectionBench(BINARY, Plan(fuse_s=0.05), wild(fate=lambda d: [0.002]))
    assert once.run().equals(messages)
    assert len(run.programs["base"].heard) == 2


def test_what_comes_while_the_processor_is_busy_is_fused_with_the_rest():
    """a is called for at 1.2 s with b's message, busy to 1.3 s; what d sends at 1.25 s still goes with it."""
    tree = {"base": None, "a": "base", "b": "a", "d": "a"}
    plan = Plan(speaks_s={"a": 0.01, "b": 0.2, "d": 0.25}, fuse_s=0.01)
    run = CollectionBench(tree, plan)
    run.programs["a"].awaits = lambda group, parts, below: len(parts) < 2
    run.at(1.15, lambda: run.nodes["a"].take(lambda ctx: (bench["work_s"](0.15), lambda: None)))
    run.run()
    assert run.programs["a"].fused == [(pytest.approx(1.3, abs=1e-9), ("a", "b", "d"))]
    assert run.counted() == {"a": 1, "b": 1, "d": 1}


def test_what_comes_while_it_is_fused_goes_on_after_it():
    tree = {"base": None, "a": "base", "b": "a", "d": "a"}
    run = CollectionBench(tree, Plan(speaks_s={"a": 0.1, "b": 0.2, "d": 0.25}, fuse_s=0.1))
    run.programs["a"].awaits = lambda group, parts, below: len(parts) < 2
    run.run()
    # b's came at 1.3 s; d's at 1.35 s, while a works until 1.4 s
    assert run.programs["a"].fused == [
        (pytest.approx(1.3, abs=1e-9), ("a", "b")),
        (pytest.approx(1.4, abs=1e-9), ("d",)),
    ]
    assert [tally.counts for *_, tally in run.programs["base"].heard] == [{"a": 1, "b": 1}, {"d": 1}]


def test_a_program_that_learns_that_nothing_more_comes_need_not_wait():
    """c is silent; b's program hears at 1.2 s, by a timer of its own, that it will stay so."""
    run = CollectionBench(CHAIN, Plan(silent=("c",)))
    program = run.programs["b"]
    awaits = program.awaits
    program.awaits = lambda group, parts, below: awaits(group, parts, below - {"c"} if knows else below)
    run.programs["a"].awaits = lambda group, parts, below: len(parts) < 2
    knows = []
    run.at(1.2, lambda: run.nodes["b"].take(lambda ctx: (bench["work_s"](0.0), lambda: knows.append(True))))
    run.run()
    assert program.fused == [(pytest.approx(1.2, abs=1e-9), ("b",))]
    assert [at for at, *_ in run.programs["base"].heard] == [pytest.approx(1.2, abs=1e-9)]


def test_what_waits_at_the_end_of_the_run_is_in_flight():
    run = CollectionBench(CHAIN, Plan(silent=("b",)))
    messages = run.run(1.5)
    assert messages[["source", "outcome"]].to_numpy().tolist() == [["c", "in_flight"]]
    assert messages["delivered_s"].isna().all()
    assert broken_laws(messages, run.nodes_table()) == []


@pytest.mark.parametrize("network", NETWORKS)
def test_groups_do_not_mix(network):
    """Epochs follow faster than a message climbs: each sum is of one epoch."""
    plan = Plan(epochs=8, period_s=0.04, due_s=0.5, fuse_s=0.005)
    run = CollectionBench(CHAIN, plan, network)
    run.run()
    for epoch in range(1, 9):
        assert run.counted(epoch) == all_of(CHAIN)


def test_groups_that_are_over_are_forgotten():
    run = CollectionBench(CHAIN, Plan(epochs=50, period_s=0.1, due_s=0.15))
    run.run()
    assert len(run.upward["a"]._groups) <= 3


@pytest.mark.parametrize("name", TREES)
def test_the_same_run_twice_gives_the_same_rows(name):
    runs = [
        CollectionBench(TREES[name], Plan(epochs=6, period_s=0.1, due_s=0.09), "ieee802154", seed=seed)
        for seed in (1, 1, 2)
    ]
    for run in runs:
        run.run()
    first, again, other = (repr(run.sink.rows) for run in runs)
    assert first == again
    assert first != other


@pytest.mark.parametrize(
    ("node", "send", "sentence"),
    [
        ("a", Send("b", Tally(1, {}), group=GroupKey(1)), "must be for Scope.BASE, got one for 'b'"),
        ("a", Send(Scope.TREE, Tally(1, {}), group=GroupKey(1)), "got one for Scope.TREE"),
        ("base", Send(Scope.BASE, Tally(1, {}), group=GroupKey(1)), "got one from there"),
    ],
)
@pytest.mark.parametrize("plain", [(), ("a",)])
def test_a_message_of_a_group_that_does_not_go_up_is_refused(node, send, sentence, plain):
    run = CollectionBench(CHAIN, Plan(plain=plain))
    run.programs[node].on_start = lambda ctx: Step(sends=(send,))
    with pytest.raises(SimulationError, match=f"node '{node}': the program failed: send: .*{sentence}"):
        run.run()


@pytest.mark.parametrize("method", ["due", "awaits", "aggregate"])
def test_an_aggregator_that_fails_is_named_with_time_and_node(method):
    run = CollectionBench(CHAIN, Plan(silent=("b",)))

    def fail(*args):
        raise ZeroDivisionError("by a user's aggregator")

    setattr(run.programs["b"], method, fail)
    with pytest.raises(SimulationError, match=r"t = 1\.\d+ s: node 'b': .*by a user's aggregator"):
        run.run()


def test_messages_of_no_group_travel_as_ever():
    run = CollectionBench(CHAIN, Plan(silent=("a", "b", "c")))
    run.at(1.0, lambda: run.mail.post(run.network, "c", Send(Scope.BASE, Tally(1, {"c": 1}))))
    messages = run.run()
    assert messages[["source", "destination", "hops", "outcome"]].to_numpy().tolist() == [
        ["c", "base", 3, "delivered"]
    ]
    assert [who for _, who, _ in run.programs["base"].heard] == ["c"]
