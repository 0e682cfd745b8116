"""Token buckets, and what a mote's link layer does at its limit."""

import itertools
import math
import runpy
from pathlib import Path

import numpy as np
import pytest

from wsnsim.errors import ScenarioError
from wsnsim.net.budget import BudgetConfig, TokenBucket
from wsnsim.net.fragmentation import data_within, fragment
from wsnsim.net.interface import Outcome
from wsnsim.net.meshes import RoutingConfig
from wsnsim.net.routing.config import RepairConfig
from wsnsim.records import EventRow, FrameRow, MemorySink, MessageRow, NodeRow
from wsnsim.scenario.load import scenario_from_dict
from wsnsim.sim.build import build

RadioBench = runpy.run_path(str(Path(__file__).parents[1] / "radio_bench.py"))["RadioBench"]

S = 1_000_000_000


def test_a_bucket_fills_at_its_rate_and_never_over_its_brim():
    bucket = TokenBucket(rate_bps=8000, burst_bytes=500)
    assert bucket.level_bytes == 500
    bucket.spend(500, 0)
    assert bucket.level_bytes == 0
    # 1000 bytes a second: 100 bytes are there after a tenth, to the nanosecond
    assert bucket.wait_ns(100) == S // 10
    bucket.spend(0, S // 10 - 1)
    assert bucket.level_bytes == 99
    assert bucket.wait_ns(100) == 1
    bucket.spend(0, S // 10)
    assert bucket.level_bytes == 100
    bucket.spend(0, 10 * S)
    assert bucket.level_bytes == 500


def test_what_is_overdrawn_is_paid_back_first():
    bucket = TokenBucket(rate_bps=8000, burst_bytes=100)
    bucket.spend(350, S)
    assert bucket.level_bytes == -250
    assert bucket.wait_ns(100) == 350 * S // 1000


def test_no_token_is_lost_to_rounding():
    """Three bits a second, looked at every 7 ns for a while: what came is what the time was worth."""
    bucket = TokenBucket(rate_bps=3, burst_bytes=1_000)
    bucket.spend(1_000, 0)
    for look in range(1, 10_001):
        bucket.spend(0, look * 7)
    whole = 8 * S
    assert bucket.wait_ns(1) == -(-(whole - 3 * 70_000) // 3)


def test_more_than_a_burst_is_never_waited_for():
    bucket = TokenBucket(rate_bps=8, burst_bytes=10)
    assert bucket.wait_ns(10_000) == 0
    bucket.spend(1, 0)
    assert bucket.wait_ns(10_000) == S


@pytest.mark.parametrize("name", ["bandwidth_bps", "burst_bytes"])
def test_a_budget_of_nothing_is_refused(name):
    with pytest.raises(ValueError, match=f"{name}: must be at least 1, got 0"):
        BudgetConfig(**{"bandwidth_bps": 1, "burst_bytes": 1, name: 0})


@pytest.mark.parametrize(("room", "overhead"), [(111, 16), (116, 11), (40, 21)])
def test_what_may_be_said_fits_and_little_is_left(room, overhead):
    """Cut for real at every allowance, bare, narrow and wide headers alike."""
    for allowed in itertools.chain(range(0, 1000, 7), range(1000, 6000, 191)):
        size = data_within(allowed, room, overhead)
        if size == 0:
            assert allowed <= overhead
            continue
        frames = fragment(bytes(size), 0, room)
        assert sum(len(body) + overhead for body in frames) <= max(allowed, overhead)
        # never much less than could be said: a fragment's rounding to eight bytes and a header each
        assert allowed - sum(len(body) + overhead for body in frames) <= overhead + 16 + 10 * len(frames)


def scenario(at_limit="delay", bandwidth_bps=4000, burst_bytes=600, **more):
    """Return two motes that put 1,160 bytes a second on the air where they can, and may send 500."""
    return {
        "duration_s": 20,
        "seed": 1,
        "motes": {
            "layout": {"kind": "star", "nodes": 3, "radius_m": 5},
            "default": {
                "platform": "telosb",
                "budget": {"bandwidth_bps": bandwidth_bps, "burst_bytes": burst_bytes, "at_limit": at_limit},
            },
        },
        "system": {"kind": "traffic", "payload_bytes": 100, "period_s": 0.1, "drain_s": 0.5},
        "record": {"frames": True},
        **more,
    }


def rows_of(data):
    simulation = build(scenario_from_dict(data))
    sink = MemorySink()
    simulation.run(sink)
    return {kind: [row for row in sink.rows if isinstance(row, kind)] for kind in (
        MessageRow, NodeRow, EventRow, FrameRow)}  # fmt: skip


def most_beyond(rows, sender, rate_bps):
    """Return the most that a sender put on the air in any window beyond what came in meanwhile [B]."""
    sent = sorted((row.time_s, row.bytes) for row in rows[FrameRow] if row.sender == sender)
    most = beyond = 0.0
    before = sent[0][0]
    for time, size in sent:
        beyond = max(0.0, beyond - (time - before) * rate_bps / 8) + size
        most, before = max(most, beyond), time
    return most


@pytest.mark.parametrize("at_limit", ["drop", "delay", "degrade"])
def test_no_window_holds_more_than_rate_and_burst(at_limit):
    rows = rows_of(scenario(at_limit))
    assert most_beyond(rows, "n1", 4000) <= 600
    node = next(row for row in rows[NodeRow] if row.node == "n1")
    # a full bucket that nobody waits for is wasted where messages are dropped
    assert 0.8 * (20.0 * 500 + 600) < node.mac_tx_bytes <= 20.5 * 500 + 600
    reached = [event for event in rows[EventRow] if event.kind == "budget_reached"]
    assert sorted(event.node for event in reached) == ["n1", "n2"]


def test_drop_loses_what_exceeds_the_budget_and_delay_keeps_it_waiting():
    dropped, delayed = rows_of(scenario("drop")), rows_of(scenario("delay"))
    lost = [row for row in dropped[MessageRow] if row.outcome == "dropped_budget"]
    came = [row for row in dropped[MessageRow] if row.outcome == "delivered"]
    assert len(lost) + len(came) == 400
    assert len(lost) > 150
    assert max(row.delivered_s - row.created_s for row in came) < 0.05
    assert all(row.budget_waited_s == 0 for row in dropped[NodeRow])
    outcomes = {row.outcome for row in delayed[MessageRow]}
    # the outbox holds eight messages: what it has no room for is lost before it waits
    assert outcomes == {"delivered", "dropped_queue", "in_flight"}
    waits = [row.delivered_s - row.created_s for row in delayed[MessageRow] if row.delivered_s]
    assert np.median(waits) > 0.5
    for row in delayed[NodeRow]:
        assert (row.budget_waited_s > 10) == (row.role != "base")


@pytest.mark.parametrize("repair", [None, RepairConfig()], ids=["fixed", "repaired"])
def test_any_number_may_be_dropped_at_one_instant(repair):
    """Two thousand wait behind the first; when it has gone the bucket is empty."""
    budgets = {"n1": BudgetConfig(1, 200, "drop")}
    run = RadioBench.star(
        1, budgets=budgets, outbox_datagrams=2000, routing=RoutingConfig(repair), mesh_header_bytes=5
    )
    for _ in range(2000):
        run.send("n1", "n0", bytes(90))
    run.run(0.1)
    assert len(run.delivered_at) == 1
    assert [outcome for *_, outcome in run.dropped_at] == [Outcome.BUDGET] * 1999
    assert len({at for at, *_ in run.dropped_at}) == 1


@pytest.mark.parametrize("at_limit", ["drop", "delay"])
def test_the_routing_protocol_pays_from_the_budget_and_nothing_is_lost_sight_of(at_limit):
    """Ways are found from nothing, and again when a relay dies, by motes that may hardly speak."""
    places = {
        "n0": (0.0, 0.0, 0.0), "n1": (35.0, 15.0, 0.0), "n2": (35.0, -15.0, 0.0), "n3": (70.0, 0.0, 0.0)
    }  # fmt: skip
    parents = {"n0": None, "n1": "n0", "n2": "n0", "n3": "n1"}
    rate_bps, burst_bytes, until_s = 4000, 600, 25.0
    budgets = {node: BudgetConfig(rate_bps, burst_bytes, at_limit) for node in parents if node != "n0"}
    repair = RoutingConfig(RepairConfig(initial="discover"))
    run = RadioBench(
        places, parents, 3, budgets=budgets, routing=repair, queue_frames=5, outbox_datagrams=3,
    )  # fmt: skip
    meant = [
        (run.send(node, "n0", bytes(60), at_ns=at * S // 4), "n0") for at in range(8, 100) for node in budgets
    ]
    run.at(12 * S, lambda: run.network.stop_node("n1"))
    run.run(until_s)
    fates = run.fates()
    # each message has one fate; what has none yet waits somewhere
    assert set(fates) <= set(meant)
    assert set(fates.values()) == {1}
    open_yet = [message for message in meant if message not in fates]
    waiting = sum(run.network.queued(node) for node in places)
    assert len(open_yet) <= waiting
    assert bool(open_yet) == (at_limit == "delay")
    lost = {outcome for *_, outcome in run.dropped_at}
    assert (Outcome.BUDGET in lost) == (at_limit == "drop")
    assert Outcome.DEAD in lost
    # the far one found its way again
    last = {datagram.source: at for at, datagram, *_ in run.delivered_at}
    assert last["n2"] > 20 * S < last["n3"]
    for node in budgets:
        counters = run.network.counters(node)
        assert 0 < counters.control_tx_bytes < counters.mac_tx_bytes
        # all of it is charged; at the end there may be a debt for a beacon and an acknowledgement
        assert counters.mac_tx_bytes <= rate_bps / 8 * until_s + burst_bytes + 133 + 11


def test_a_budget_that_is_never_reached_changes_nothing():
    plenty, none = scenario(bandwidth_bps=10_000_000, burst_bytes=10_000), scenario()
    none["motes"]["default"]["budget"] = None
    with_budget, without = rows_of(plenty), rows_of(none)
    assert with_budget == without


def test_what_a_mote_forwards_counts_too():
    """The first of a line of three has a budget for one packet a second and passes two on."""
    data = scenario(at_limit="drop", duration_s=40)
    # 600 bytes a second are wanted, 300 allowed
    data["motes"] = {
        "layout": {"kind": "line", "nodes": 3, "spacing_m": 40},
        "nodes": [{"id": "n1", "budget": {"bandwidth_bps": 2400, "burst_bytes": 600, "at_limit": "drop"}}],
    }
    data["network"] = {"routing": {"kind": "tree", "parents": {"n1": "n0", "n2": "n1"}}}
    data["system"]["period_s"] = 0.5
    rows = rows_of(data)
    assert most_beyond(rows, "n1", 2400) <= 600
    lost = {row.source for row in rows[MessageRow] if row.outcome == "dropped_budget"}
    assert lost == {"n1", "n2"}


def test_a_saturated_source_within_a_budget_does_not_stop_time():
    for at_limit in ("drop", "delay"):
        data = scenario(at_limit)
        data["system"] |= {"saturated": True, "period_s": 0.01}
        rows = rows_of(data)
        assert most_beyond(rows, "n1", 4000) <= 600
        assert sum(row.outcome == "delivered" for row in rows[MessageRow]) > 100


def test_only_a_degraded_program_is_told_its_allowance():
    for at_limit, told in (("drop", False), ("delay", False), ("degrade", True)):
        network = build(scenario_from_dict(scenario(at_limit))).network
        assert math.isinf(network.allowance_bytes("n0"))
        assert math.isinf(network.allowance_bytes("n1")) is not told
    # of a full bucket of 600 bytes, three repeats of the longest frame and an acknowledgement are kept
    assert network.allowance_bytes("n1") == data_within(600 - 3 * 127 - 5, 111, 16)


@pytest.mark.parametrize(
    ("budget", "words"),
    [
        ({"bandwidth_bps": 0}, "motes.default.budget.bandwidth_bps: must be greater than 0, got 0"),
        ({"bandwidth_bps": -5}, "motes.default.budget.bandwidth_bps: must be greater than 0, got -5"),
        ({"bandwidth_bps": 1.5}, "motes.default.budget.bandwidth_bps: must be a whole number"),
        ({"bandwidth_bps": 9, "burst_bytes": 0}, "motes.default.budget.burst_bytes: must be greater than 0"),
        ({"bandwidth_bps": 9, "at_limit": "stop"}, 'must be "drop", "delay" or "degrade", got "stop"'),
        ({}, "motes.default.budget.bandwidth_bps: must be given"),
    ],
)
def test_budgets_that_the_schema_refuses(budget, words):
    data = scenario()
    data["motes"]["default"]["budget"] = budget
    with pytest.raises(ScenarioError) as raised:
        scenario_from_dict(data)
    assert words in str(raised.value)


def test_a_burst_must_hold_a_frame_with_its_repeats():
    with pytest.raises(ScenarioError, match=r"budget\.burst_bytes: must be at least 513, the longest frame"):
        build(scenario_from_dict(scenario(burst_bytes=512)))
    build(scenario_from_dict(scenario(burst_bytes=513)))
    build(scenario_from_dict(scenario(burst_bytes=None, bandwidth_bps=1)))


def test_an_ideal_network_has_no_budgets():
    data = scenario(network={"standard": "ideal"})
    with pytest.raises(
        ScenarioError, match=r"motes\.default\.budget: must be left out: over an ideal network"
    ):
        build(scenario_from_dict(data))
