"""What is for all, or for the neighbours: repetition, duplicates, one hop; and queues that overflow."""

import runpy
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from wsnsim.net.interface import Outcome
from wsnsim.net.mac.lpl_family import LplFamily
from wsnsim.net.meshes import RoutingConfig
from wsnsim.net.routing.config import DisseminationConfig
from wsnsim.net.routing.tree import RoutingError

RadioBench = runpy.run_path(str(Path(__file__).parents[1] / "radio_bench.py"))["RadioBench"]

SECOND = 10**9
LINE = {f"n{i}": (40.0 * i, 0.0, 0.0) for i in range(5)}
LINE_TREE = {f"n{i}": f"n{i - 1}" if i else None for i in range(5)}
BELOW = tuple(f"n{i}" for i in range(1, 5))


def spread(**kwargs):
    return RoutingConfig(spread=DisseminationConfig(**kwargs))


def frames_tx(run):
    return [run.network.counters(node).frames_tx for node in LINE]


def test_each_broadcast_goes_out_as_often_as_asked_and_every_copy_too_many_is_thrown_away():
    run = RadioBench(LINE, LINE_TREE, routing=spread(repeats=2))
    run.send("n0", BELOW, bytes(50), disseminate=True)
    run.run(3.0)
    assert [(receiver, hops) for *_, receiver, hops in run.delivered_at] == [
        (n, i + 1) for i, n in enumerate(BELOW)
    ]
    # the last of the row has nobody below
    assert frames_tx(run) == [3, 3, 3, 3, 0]
    assert [run.network.counters(node).duplicates for node in LINE] == [0, 2, 2, 2, 2]


def test_from_anyone_also_the_last_one_spreads_and_echoes_are_known():
    run = RadioBench(LINE, LINE_TREE, routing=spread(accept="anyone"))
    run.send("n0", BELOW, bytes(50), disseminate=True)
    run.run(3.0)
    assert len(run.delivered_at) == 4
    assert frames_tx(run) == [1, 1, 1, 1, 1]
    # all but the last hear the next one's echo; the source knows its own
    assert [run.network.counters(node).duplicates for node in LINE] == [1, 1, 1, 1, 0]


def test_any_node_may_spread_where_all_take_from_all():
    run = RadioBench(LINE, LINE_TREE, routing=spread(accept="anyone"))
    others = tuple(node for node in LINE if node != "n3")
    run.send("n3", others, bytes(10), disseminate=True)
    run.run(3.0)
    assert {receiver: hops for *_, receiver, hops in run.delivered_at} == {"n0": 3, "n1": 2, "n2": 1, "n4": 1}
    strict = RadioBench(LINE, LINE_TREE, routing=spread(repeats=1))
    with pytest.raises(RoutingError, match="goes down the tree"):
        strict.send("n3", ("n0",), bytes(10), disseminate=True)


@pytest.mark.parametrize("repeats", [0, 1, 2])
def test_repetition_helps_as_independent_tries_do(repeats, test_seed):
    """One lossy hop: a message of one frame is missed with (1 - p)^(repeats + 1)."""
    # 66.5 m: a frame of 50 B is received about half the time
    places = {"n0": (0.0, 0.0, 0.0), "n1": (66.5, 0.0, 0.0)}
    routing = spread(repeats=repeats, pause_s=0.02)
    run = RadioBench(places, {"n0": None, "n1": "n0"}, test_seed, routing=routing, noise_dbm=-94.0)
    count = 400
    for number in range(count):
        run.send("n0", ("n1",), bytes(50), at_ns=number * SECOND // 10, disseminate=True)
    run.run(count / 10 + 1)
    phy, sinr = run.phy, 10 ** ((-40.05 - 30 * np.log10(66.5) + 94.0) / 10)
    bytes_on_air = 11 + 5 + 2 + 50
    success = phy.frame_success(sinr, bytes_on_air)
    assert 0.2 < success < 0.9
    arrives = 1 - (1 - success) ** (repeats + 1)
    error = np.sqrt(arrives * (1 - arrives) / count)
    assert len(run.delivered_at) / count == pytest.approx(arrives, abs=4 * error)
    assert Counter(outcome for *_, outcome in run.dropped_at) == {
        Outcome.NOT_HEARD: count - len(run.delivered_at)
    }
    assert run.network.counters("n0").frames_tx == count * (repeats + 1)


def test_repetition_brings_fragments_that_collided_with_the_echo_of_the_one_before():
    """Four fragments one after the other down a row: nodes two hops apart do not hear each other."""
    arrived = {}
    for repeats in (0, 3):
        arrived[repeats] = 0
        for seed in range(5):
            run = RadioBench(
                LINE, LINE_TREE, seed, routing=spread(repeats=repeats, pause_s=0.5, accept="anyone")
            )
            run.send("n0", BELOW, bytes(350), disseminate=True)
            run.run(20.0)
            arrived[repeats] += len(run.delivered_at)
            assert len(run.delivered_at) + len(run.dropped_at) == 4
    assert arrived[0] < arrived[3]
    assert arrived[3] >= 18


@pytest.mark.parametrize("routing", [None, spread(repeats=1)], ids=["plain", "routed"])
def test_neighbours_hear_one_broadcast_and_pass_nothing_on(routing):
    run = RadioBench(LINE, LINE_TREE, routing=routing)
    assert run.network.neighbours("n2") == ("n1", "n3")
    assert run.network.neighbours("n0") == ("n1",)
    whole = run.send("n2", run.network.neighbours("n2"), bytes(50), one_hop=True)
    long = run.send("n2", run.network.neighbours("n2"), bytes(300), at_ns=SECOND, one_hop=True)
    run.run(3.0)
    assert sorted((d.number, r, hops) for _, d, r, hops in run.delivered_at) == [
        (number, receiver, 1) for number in (whole, long) for receiver in ("n1", "n3")
    ]
    assert frames_tx(run) == [0, 0, 1 + 3, 0, 0]


@pytest.mark.parametrize("routing", [None, spread(repeats=1)], ids=["plain", "routed"])
def test_each_neighbour_that_is_deaf_or_dead_is_told_by_cause(routing):
    run = RadioBench(LINE, LINE_TREE, routing=routing)
    run.network.stop_node("n3")
    run.send("n2", ("n0", "n1", "n3"), bytes(50), one_hop=True)
    run.run(1.0)
    assert [receiver for *_, receiver, _ in run.delivered_at] == ["n1"]
    assert {receiver: outcome for *_, receiver, outcome in run.dropped_at} == {
        "n0": Outcome.NOT_HEARD,
        "n3": Outcome.DEAD,
    }


@pytest.mark.parametrize("routing", [None, spread(repeats=1)], ids=["plain", "routed"])
def test_who_has_a_broadcast_passes_it_on_though_its_sender_dies_among_the_copies(routing):
    """Sleeping receivers look at different times; the source dies as soon as the first has a copy."""
    run = RadioBench(LINE, LINE_TREE, 3, family=lambda *_: LplFamily(), routing=routing)
    run.on_fate = lambda datagram: run.network.stop_node("n0")
    run.send("n0", BELOW, bytes(20), at_ns=SECOND, disseminate=True)
    run.run(5.0)
    assert [receiver for *_, receiver, _ in run.delivered_at] == list(BELOW)
    assert run.dropped_at == []


def test_a_source_is_no_receiver_of_its_broadcast():
    run = RadioBench(LINE, LINE_TREE)
    with pytest.raises(RoutingError, match="not back to its source"):
        run.send("n2", ("n1", "n2"), b"x", one_hop=True)


STAR = {"n0": (0.0, 0.0, 0.0), "n1": (10.0, 0.0, 0.0)}


@pytest.mark.parametrize("policy", ["drop_newest", "drop_oldest"])
def test_a_full_outbox_loses_the_newest_or_the_oldest_but_never_what_is_being_sent(policy):
    run = RadioBench(STAR, {"n0": None, "n1": "n0"}, queue_policy=policy, outbox_datagrams=3)
    sent = [run.send("n1", "n0", bytes(50)) for _ in range(6)]
    run.run(1.0)
    arrived = [d.number for _, d, *_ in run.delivered_at]
    assert arrived == (sent[:3] if policy == "drop_newest" else [sent[0], *sent[4:]])
    assert [outcome for *_, outcome in run.dropped_at] == [Outcome.QUEUE] * 3


def relayed(policy, seed, count=40):
    """Two children send more than their parent can pass on; return the numbers that arrived by child."""
    places = {"n0": (0.0, 0.0, 0.0), "n1": (40.0, 0.0, 0.0), "n2": (80.0, 5.0, 0.0), "n3": (80.0, -5.0, 0.0)}
    parents = {"n0": None, "n1": "n0", "n2": "n1", "n3": "n1"}
    run = RadioBench(places, parents, seed, queue_policy=policy, queue_frames=4, outbox_datagrams=100)
    for _ in range(count):
        for child in ("n2", "n3"):
            run.send(child, "n0", bytes(100))
    run.run(10.0)
    assert len(run.delivered_at) + len(run.dropped_at) == 2 * count
    lost = [d.number for _, d, _, outcome in run.dropped_at if outcome is Outcome.QUEUE]
    dropped = sum(run.network.counters(node).frames_dropped for node in places)
    assert dropped == len(run.dropped_at)
    return [d.number for _, d, *_ in run.delivered_at], lost


def test_queues_of_all_policies_lose_alike_but_not_the_same():
    found = {policy: relayed(policy, 5) for policy in ("drop_newest", "drop_oldest", "drop_random")}
    assert all(lost for _, lost in found.values())
    assert len({tuple(arrived) for arrived, _ in found.values()}) == 3
    # what arrives last of all was the last to come where the oldest go
    assert max(found["drop_oldest"][0]) == 79
    assert found["drop_random"] == relayed("drop_random", 5)
