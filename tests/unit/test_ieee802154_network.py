"""The assembled network: what arrives, what is lost and why, and what a death does."""

import re
import runpy
from pathlib import Path

import pytest

from wsnsim.net.interface import Outcome
from wsnsim.net.routing.tree import RoutingError

RadioBench = runpy.run_path(str(Path(__file__).parents[1] / "radio_bench.py"))["RadioBench"]

PLACES = {
    "base": (0.0, 0.0, 2.0),
    "relay": (50.0, 0.0, 2.0),
    "near": (0.0, 40.0, 2.0),
    "far": (100.0, 0.0, 2.0),
    "farther": (95.0, 20.0, 2.0),
}
PARENTS = {"base": None, "relay": "base", "near": "base", "far": "relay", "farther": "relay"}
MOTES = ("relay", "near", "far", "farther")


def bench(seed=0, **config):
    return RadioBench(PLACES, PARENTS, seed, **config)


def text(length):
    return bytes(k * 7 % 251 for k in range(length))


@pytest.mark.parametrize("mesh_header_bytes", [0, 5])
@pytest.mark.parametrize(
    ("source", "destination", "hops"),
    [
        ("far", "base", 2),
        ("far", "relay", 1),
        ("base", "farther", 2),
        ("far", "near", 3),
        ("base", "base", 0),
    ],
)
@pytest.mark.parametrize("length", [0, 60, 1000])
def test_a_datagram_arrives_as_it_was_sent(source, destination, hops, length, mesh_header_bytes):
    tree = bench(mesh_header_bytes=mesh_header_bytes)
    tree.send(source, destination, text(length), at_ns=1000)
    tree.run(2.0)
    ((at, datagram, receiver, took),) = tree.delivered_at
    assert (datagram.source, receiver, took, datagram.data) == (source, destination, hops, text(length))
    assert not tree.dropped_at
    assert at >= 1000


def test_several_long_datagrams_at_once_keep_apart():
    tree = bench()
    for source in MOTES:
        for k in range(3):
            tree.send(source, "base", text(150 + k), at_ns=k * 500_000_000)
    tree.run(5.0)
    got = {(d.source, len(d.data)) for _, d, _, _ in tree.delivered_at}
    assert len(tree.delivered_at) == len(got)
    assert len(got) + len(tree.dropped_at) == 12
    assert all(d.data == text(len(d.data)) for _, d, _, _ in tree.delivered_at)
    assert len(got) >= 9


def test_counters_count_what_is_on_the_air():
    tree = bench(mesh_header_bytes=5)
    tree.send("far", "base", text(60))
    tree.run(1.0)
    data, ack = 60 + 5 + 11, 5
    far, relay, base, near = (tree.network.counters(n) for n in ("far", "relay", "base", "near"))
    assert (far.frames_tx, far.mac_tx_bytes, far.mac_rx_bytes) == (1, data, ack)
    assert (relay.frames_tx, relay.mac_tx_bytes, relay.mac_rx_bytes) == (2, data + ack, data + ack)
    assert (base.frames_tx, base.mac_tx_bytes, base.mac_rx_bytes) == (1, ack, data)
    assert (near.frames_tx, near.mac_tx_bytes, near.mac_rx_bytes) == (0, 0, 0)
    assert far.frames_retried == far.frames_dropped == 0


def test_frames_a_datagram_takes():
    assert [bench().network.fragments(n) for n in (0, 111, 112, 8006)] == [1, 1, 2, 77]
    assert bench(mesh_header_bytes=0).network.fragments(116) == 1


def test_dissemination_reaches_all_below_in_as_many_hops_as_the_tree_has():
    tree = bench()
    tree.send("base", MOTES, text(80), disseminate=True)
    tree.run(1.0)
    assert {(r, h) for _, _, r, h in tree.delivered_at} == {
        ("relay", 1),
        ("near", 1),
        ("far", 2),
        ("farther", 2),
    }
    # one broadcast by each node that has children, and nothing else
    assert {n: tree.network.counters(n).frames_tx for n in PLACES} == {
        "base": 1, "relay": 1, "near": 0, "far": 0, "farther": 0
    }  # fmt: skip


def test_dissemination_in_fragments():
    tree = bench()
    tree.send("base", MOTES, text(300), disseminate=True)
    tree.run(1.0)
    assert {r for _, _, r, _ in tree.delivered_at} == set(MOTES)
    assert all(d.data == text(300) for _, d, _, _ in tree.delivered_at)


def test_who_missed_a_broadcast_is_lost_with_all_below():
    """A neighbour that drowns the relay at the right time makes it and its children miss the frame."""
    places = PLACES | {"jammer": (50.0, 1.0, 2.0)}
    parents = PARENTS | {"jammer": "relay"}
    jammed = RadioBench(places, parents, cca_threshold_dbm=0.0, min_be=0, max_be=0, collision="destructive")
    # the jammer cannot sense a carrier it was deaf for: both begin at the same instant
    jammed.send("base", ("relay", "near", "far"), text(80), at_ns=0, disseminate=True)
    jammed.send("jammer", "relay", text(80), at_ns=0)
    jammed.run(1.0)
    lost = {r: o for _, d, r, o in jammed.dropped_at if d.disseminate}
    assert lost == dict.fromkeys(("relay", "near", "far"), Outcome.NOT_HEARD)


def test_a_full_outbox_refuses_and_a_full_queue_drops():
    tree = bench(outbox_datagrams=2)
    for _ in range(5):
        tree.send("far", "base", text(10))
    assert [o for *_, o in tree.dropped_at] == [Outcome.QUEUE] * 3
    tree.run(1.0)
    assert len(tree.delivered_at) == 2

    tiny = bench(queue_frames=1)
    for k in range(8):
        tiny.send("far", "base", text(100))
        tiny.send("relay", "base", text(100), at_ns=k * 1000)
    tiny.run(2.0)
    assert Outcome.QUEUE in {o for _, d, _, o in tiny.dropped_at if d.source == "far"}
    assert all(count == 1 for count in tiny.fates().values())
    assert tiny.network.counters("relay").frames_dropped > 0


def test_a_busy_channel_and_a_silent_receiver_have_their_own_outcomes():
    tree = bench(cca_threshold_dbm=-100.0, max_csma_backoffs=0)
    for source in ("relay", "near", "far"):
        tree.send(source, PARENTS[source], text(100))
    tree.run(1.0)
    assert Outcome.CHANNEL in {o for *_, o in tree.dropped_at}

    silent = bench()
    silent.network.stop_node("base")
    silent.send("near", "base", text(10))
    silent.run(1.0)
    ((_, _, _, outcome),) = silent.dropped_at
    assert outcome is Outcome.NO_ACK
    counters = silent.network.counters("near")
    assert (counters.frames_tx, counters.frames_retried, counters.frames_dropped) == (4, 3, 1)


def test_fragments_that_wait_too_long_for_the_others():
    tree = bench(reassembly_timeout_s=0.001)
    tree.send("near", "base", text(300))
    tree.run(1.0)
    ((_, _, receiver, outcome),) = tree.dropped_at
    assert (receiver, outcome) == ("base", Outcome.REASSEMBLY)
    assert not tree.delivered_at


def test_the_first_lost_fragment_ends_a_datagram():
    tree = bench()
    tree.send("near", "base", text(8000))
    tree.at(20_000_000, lambda: tree.network.stop_node("base"))
    tree.run(2.0)
    # the base's own share of the datagram died with it
    assert [(r, o) for _, _, r, o in tree.dropped_at] == [("base", Outcome.DEAD)]
    assert tree.network.counters("near").frames_tx < 10


def test_a_dead_source_a_dead_relay_and_a_dead_child():
    tree = bench()
    tree.network.stop_node("far")
    tree.network.stop_node("far")
    tree.send("far", "base", text(10))
    tree.send("base", ("relay", "near", "far", "farther"), text(50), disseminate=True)
    tree.run(1.0)
    assert {(d.source, r, o) for _, d, r, o in tree.dropped_at} == {
        ("far", "base", Outcome.DEAD),
        ("base", "far", Outcome.DEAD),
    }
    assert {r for _, _, r, _ in tree.delivered_at} == {"relay", "near", "farther"}


def test_what_waits_at_a_dying_node_dies_with_it():
    tree = bench()
    for _ in range(3):
        tree.send("far", "base", text(500))
    tree.at(10_000_000, lambda: tree.network.stop_node("far"))
    tree.run(20.0)
    assert len(tree.dropped_at) == 3
    assert {(at, o) for at, _, _, o in tree.dropped_at} == {(10_000_000, Outcome.DEAD)}


def test_a_dying_relay_loses_what_it_holds_for_others():
    tree = bench()
    tree.send("far", "base", text(100))
    # after the relay has the frame (by 192 + 2240 + 4256 µs at most), before it could pass it on
    tree.run(0.001)
    while not tree.network.counters("relay").mac_rx_bytes:
        tree.run(tree.env.now / 1e9 + 1e-4)
    tree.network.stop_node("relay")
    tree.run(2.0)
    ((_, _, receiver, outcome),) = tree.dropped_at
    assert (receiver, outcome) == ("base", Outcome.DEAD)
    assert not tree.delivered_at


class Meter:
    def attend(self, times):
        self.times = times


def test_meters_can_ask_for_the_times_of_every_state():
    meters = {node: Meter() for node in PLACES}
    tree = RadioBench(PLACES, PARENTS, meters=meters)
    tree.send("far", "base", text(100))
    tree.run(1.0)
    assert {meter.times.state for meter in meters.values()} == {"listen"}
    tree.network.stop_node("near")
    tree.run(1.1)
    spent = {node: meter.times.spent_ns(tree.env.now) for node, meter in meters.items()}
    data, ack = 192_000 + 32_000 * 116, 352_000
    assert spent["far"]["transmit"] == data
    assert spent["relay"]["transmit"] == data + ack
    assert spent["relay"]["receive"] == data + ack
    assert spent["near"]["sleep"] == 100_000_000
    assert meters["near"].times.state == "sleep"
    assert {sum(times.values()) for times in spent.values()} == {1_100_000_000}


def test_frames_are_recorded_where_asked_for():
    quiet, told = bench(), bench(record_frames=True)
    for tree in (quiet, told):
        tree.send("far", "base", text(60))
        tree.send("base", MOTES, text(60), disseminate=True, at_ns=500_000_000)
        tree.run(1.0)
    assert quiet.frames == []
    assert [(r.sender, r.receiver, r.kind, r.outcome) for r in told.frames] == [
        ("far", "relay", "data", "received"),
        ("relay", "far", "ack", "received"),
        ("relay", "base", "data", "received"),
        ("base", "relay", "ack", "received"),
        ("base", "relay", "broadcast", "received"),
        ("base", "near", "broadcast", "received"),
        ("relay", "far", "broadcast", "received"),
        ("relay", "farther", "broadcast", "received"),
    ]
    row = told.frames[2]
    assert row.bytes == 60 + 5 + 11
    assert row.attempt == 1
    assert row.rssi_dbm == pytest.approx(-40.05 - 30 * 1.69897, abs=1e-3)
    assert row.sinr_db == pytest.approx(row.rssi_dbm + 95.4, abs=1e-6)


@pytest.mark.parametrize(
    ("destinations", "disseminate", "words"),
    [
        (("nobody",), False, "source and receivers must be nodes, got 'nobody'"),
        (("near", "far"), False, "must have one receiver, or be disseminated"),
        (("base",), True, "dissemination goes down the tree, not to ['base']"),
    ],
)
def test_datagrams_without_a_way_are_refused(destinations, disseminate, words):
    with pytest.raises(RoutingError, match=re.escape(words)):
        bench().send("relay", destinations, b"x", disseminate=disseminate)


def test_dissemination_to_nobody_says_nothing():
    tree = bench()
    tree.send("near", (), b"x", disseminate=True)
    tree.run(0.1)
    assert tree.network.counters("near").frames_tx == 0


def test_a_tree_over_other_nodes_is_refused():
    with pytest.raises(RoutingError, match=re.escape("differs in ['far']")):
        RadioBench({n: p for n, p in PLACES.items() if n != "far"}, PARENTS)


def test_long_ways_take_the_longer_mesh_header():
    line = RadioBench.line(17, mesh_header_bytes=5)
    line.send("n16", "n0", text(110))
    line.run(2.0)
    ((_, datagram, _, hops),) = line.delivered_at
    assert (hops, datagram.data) == (16, text(110))
    assert line.network.counters("n16").mac_tx_bytes == 110 + 6 + 11
    assert line.network.counters("n1").mac_tx_bytes == 110 + 5 + 11 + 5
    assert line.network.fragments(111) == 2


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("max_be", 2),
        ("queue_frames", 0),
        ("reassembly_timeout_s", 0.0),
        ("mesh_header_bytes", 7),
        ("link_success_min", 1.0),
        ("pan_id", 0xFFFF),
    ],
)
def test_parameters_outside_their_range(field, value):
    with pytest.raises(ValueError, match=field):
        RadioBench({"a": (0, 0, 0)}, "a", **{field: value})
