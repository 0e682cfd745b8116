"""Whole networks of IEEE 802.11b: times to the nanosecond, who hears whom, energy, frames to all."""

import runpy
from itertools import pairwise
from pathlib import Path

import pytest

from wsnsim.net.interface import Outcome
from wsnsim.net.mac.dcf_config import DcfConfig
from wsnsim.net.mac.dcf_family import DcfFamily
from wsnsim.net.phy.ieee80211b import Ieee80211b

RadioBench = runpy.run_path(str(Path(__file__).parents[1] / "radio_bench.py"))["RadioBench"]

CARD = {"tx_power_dbm": 15.0, "noise_dbm": -89.0, "sensitivity_dbm": -91.0, "cca_threshold_dbm": -80.0}
SIFS_NS, DIFS_NS, SLOT_NS, ACK_NS, EIFS_NS = 10_000, 50_000, 20_000, 304_000, 364_000


def bench(places, parents, seed=0, record_frames=True, dcf=None, **config):
    """Return a network of cards on the x axis."""
    family = DcfFamily(DcfConfig(**({} if dcf is None else dcf)))
    positions = {node: (x, 0.0, 0.0) for node, x in places.items()}
    radio = CARD | {"mesh_header_bytes": 0} | config
    return RadioBench(
        positions, parents, seed, family=lambda *_: family, record_frames=record_frames, **radio
    )


def pair(**config):
    return bench({"n0": 0.0, "n1": 10.0}, {"n0": None, "n1": "n0"}, **config)


def starts(network, kind, sender=None):
    return [
        round(row.time_s * 1e9) for row in network.frames if row.kind == kind and sender in (None, row.sender)
    ]


@pytest.mark.parametrize(
    ("payload_bytes", "dcf", "air_us"),
    [
        (10, {}, 192 + 34),
        (100, {}, 192 + 99),
        (1000, {}, 192 + 754),
        (1000, {"preamble": "short"}, 96 + 754),
        (100, {"rate_mbps": 5.5}, 192 + 198),
        (100, {"rate_mbps": 2, "preamble": "short"}, 96 + 544),
        (100, {"rate_mbps": 1, "preamble": "short"}, 192 + 1088),
    ],
)
def test_one_hop_takes_the_frame_and_the_answer_comes_314_us_later(payload_bytes, dcf, air_us):
    network = pair(dcf=dcf)
    sent_ns = [5_000_000 + k * 20_000_000 for k in range(20)]
    for at_ns in sent_ns:
        network.send("n1", "n0", bytes(payload_bytes), at_ns=at_ns)
    network.run(0.5)
    assert [at for at, *_ in network.delivered_at] == [at + 1000 * air_us for at in sent_ns]
    assert starts(network, "ack") == [at + 1000 * air_us + SIFS_NS for at in sent_ns]
    assert all(row.outcome == "received" for row in network.frames)


def test_the_mesh_header_costs_five_octets_on_the_air():
    network = pair(mesh_header_bytes=5)
    network.send("n1", "n0", bytes(100))
    network.run(0.01)
    assert network.delivered_at[0][0] == (192 + 103) * 1000


def test_a_datagram_travels_in_one_frame_up_to_the_longest_msdu():
    network = pair(mesh_header_bytes=5)
    assert [network.network.fragments(size) for size in (100, 2291, 2292, 10_000)] == [1, 1, 2, 5]
    data = bytes(range(256)) * 40
    network.send("n1", "n0", data[:2291])
    network.send("n1", "n0", data)
    network.run(0.1)
    assert [datagram.data for _, datagram, *_ in network.delivered_at] == [data[:2291], data]
    assert max(row.bytes for row in network.frames) <= 2332


def test_a_hop_takes_as_long_as_it_is_taken_to():
    """DIFS, 15.5 slots, frame, SIFS and ACK; and once more with a backoff twice as long."""
    network = pair()
    once_us = 50 + 310 + 946 + 10 + 304
    again_us = 50 + 620 + 946 + 10 + 304
    assert network.network.hop_service_s(1000, "n1") == pytest.approx((once_us + again_us) * 1e-6)


def test_two_who_begin_at_the_same_instant_collide_and_then_get_through():
    places, parents = {"n0": 0.0, "n1": 10.0, "n2": -10.0}, {"n0": None, "n1": "n0", "n2": "n0"}
    network = bench(places, parents, collision="destructive")
    for node in ("n1", "n2"):
        network.send(node, "n0", bytes(500), at_ns=1_000_000)
    network.run(0.1)
    first, second = starts(network, "data", "n1"), starts(network, "data", "n2")
    assert first[0] == second[0] == 1_000_000
    assert len(network.delivered_at) == 2
    outcomes = [row.outcome for row in network.frames if row.time_s == 1e-3]
    assert set(outcomes) == {"corrupted", "missed"}


def failed_share(distance_m, payload_bytes=1000, seed=0):
    """Return the share of failed attempts of two senders that far on either side of their receiver."""
    places = {"n0": 0.0, "n1": distance_m, "n2": -distance_m}
    network = bench(places, {"n0": None, "n1": "n0", "n2": "n0"}, seed, False, collision="destructive")
    network.saturate(["n1", "n2"], bytes(payload_bytes), [0, 333_333])
    network.run(2.0)
    counters = [network.network.counters(node) for node in ("n1", "n2")]
    return sum(each.attempts_failed for each in counters) / sum(each.attempts for each in counters)


def test_hidden_nodes_collide():
    """Of a node 60 m away -78 dBm arrive, of one 180 m away -93 dBm, which is below the sensitivity."""
    assert failed_share(30.0) < 0.1
    assert failed_share(90.0) > 0.35


def test_a_node_that_does_not_hear_the_answer_keeps_clear_of_it():
    """n2 hears n1's frame to n0, but not n0; the frame's duration field keeps n2 silent for the answer."""
    places = {"n0": 0.0, "n1": 60.0, "n2": 120.0}
    parents = {"n0": None, "n1": "n0", "n2": "n1"}
    # -78 dBm arrive over 60 m, -87 dBm over 120 m
    deaf = {"sensitivity_dbm": -82.0}
    for seed in range(20):
        network = bench(places, parents, seed, **deaf)
        network.send("n1", "n0", bytes(1000), at_ns=1_000_000)
        network.send("n2", "n1", bytes(1000), at_ns=1_500_000)
        network.run(0.1)
        ends_ns = 1_000_000 + 946_000
        (begins_ns,) = starts(network, "data", "n2")
        slots, rest = divmod(begins_ns - (ends_ns + SIFS_NS + ACK_NS) - DIFS_NS, SLOT_NS)
        assert rest == 0
        assert 0 <= slots <= 31
        assert len(network.delivered_at) == 2


def test_a_sender_that_dies_in_the_middle_of_its_frame_frees_the_channel():
    """Its frame has begun and was not received well: those who heard it wait for EIFS (sec. 9.2.10)."""
    places, parents = {"n0": 0.0, "n1": 10.0, "n2": -10.0}, {"n0": None, "n1": "n0", "n2": "n0"}
    network = bench(places, parents)
    network.send("n1", "n0", bytes(2000), at_ns=1_000_000)
    network.send("n2", "n0", bytes(100), at_ns=1_200_000)
    network.at(1_500_000, lambda: network.network.stop_node("n1"))
    network.run(0.1)
    (begins_ns,) = starts(network, "data", "n2")
    slots, rest = divmod(begins_ns - 1_500_000 - EIFS_NS, SLOT_NS)
    assert rest == 0
    assert 0 <= slots <= 31
    assert [outcome for *_, outcome in network.dropped_at] == [Outcome.DEAD]


def test_a_receiver_that_is_gone_costs_seven_attempts():
    network = pair()
    network.network.stop_node("n0")
    network.send("n1", "n0", bytes(100), at_ns=1_000_000)
    network.run(1.0)
    counters = network.network.counters("n1")
    assert (counters.frames_tx, counters.frames_retried, counters.attempts_failed) == (7, 6, 7)
    assert [outcome for *_, outcome in network.dropped_at] == [Outcome.NO_ACK]


def test_messages_to_all_go_down_the_tree_at_the_basic_rate():
    places = {f"n{i}": 60.0 * i for i in range(4)}
    network = bench(places, {"n0": None, "n1": "n0", "n2": "n1", "n3": "n2"})
    network.send("n0", ("n1", "n2", "n3"), bytes(100), at_ns=1_000_000, disseminate=True)
    network.run(0.1)
    assert [receiver for _, _, receiver, _ in network.delivered_at] == ["n1", "n2", "n3"]
    air_ns = (192 + 8 * 136) * 1000
    assert network.delivered_at[0][0] == 1_000_000 + air_ns
    assert not starts(network, "ack")


def test_a_chain_relays_what_it_gets():
    places = {f"n{i}": 60.0 * i for i in range(5)}
    parents = {"n0": None} | {f"n{i}": f"n{i - 1}" for i in range(1, 5)}
    network = bench(places, parents)
    for k in range(50):
        network.send("n4", "n0", bytes(500), at_ns=k * 20_000_000)
    network.run(1.2)
    assert [hops for *_, hops in network.delivered_at] == [4] * 50
    # each relay: the frame, its answer, DIFS and a backoff of at most 31 slots
    least_ns = 4 * (192_000 + 390_000) + 3 * (SIFS_NS + ACK_NS + DIFS_NS)
    delays = [at - datagram.number * 20_000_000 for at, datagram, *_ in network.delivered_at]
    assert min(delays) >= least_ns
    assert max(delays) <= least_ns + 3 * 31 * SLOT_NS
    assert all((delay - least_ns) % SLOT_NS == 0 for delay in delays)


class Account:
    """Keeps the times of one radio's states."""

    def attend(self, times):
        self.times = times


def test_a_radio_spends_its_time_as_the_frames_say():
    accounts = {"n0": Account(), "n1": Account(), "n2": Account()}
    places, parents = {"n0": 0.0, "n1": 10.0, "n2": -10.0}, {"n0": None, "n1": "n0", "n2": "n0"}
    network = bench(places, parents, meters=accounts)
    for k in range(10):
        network.send("n1", "n0", bytes(1000), at_ns=k * 20_000_000)
    network.run(1.0)
    data_ns, ack_ns, all_ns = 10 * 946_000, 10 * ACK_NS, 1_000_000_000
    sent = {"n0": ack_ns, "n1": data_ns, "n2": 0}
    heard = {"n0": data_ns, "n1": ack_ns, "n2": data_ns + ack_ns}
    for node, account in accounts.items():
        spent = account.times.spent_ns(all_ns)
        assert sum(spent.values()) == all_ns
        assert (spent["transmit"], spent["receive"]) == (sent[node], heard[node])


def test_the_same_seed_gives_the_same_frames():
    places = {"n0": 0.0} | {f"n{i}": 5.0 * i for i in range(1, 6)}
    parents = {"n0": None} | dict.fromkeys((f"n{i}" for i in range(1, 6)), "n0")
    runs = []
    for seed in (1, 1, 2):
        network = bench(places, parents, seed)
        network.saturate(list(places)[1:], bytes(300), range(5))
        network.run(0.1)
        runs.append([(row.time_s, row.sender, row.outcome) for row in network.frames])
    assert runs[0] == runs[1]
    assert runs[0] != runs[2]


def test_frames_never_overlap_but_where_slots_end_together():
    """All hear all: every frame begins with another, or when nothing is on the air."""
    places = {"n0": 0.0} | {f"n{i}": 5.0 * i for i in range(1, 9)}
    parents = {"n0": None} | dict.fromkeys((f"n{i}" for i in range(1, 9)), "n0")
    network = bench(places, parents, collision="destructive")
    network.saturate(list(places)[1:], bytes(700), range(0, 800_000, 100_000))
    network.run(0.5)
    phy, spans = Ieee80211b(), set()
    for row in network.frames:
        begin = round(row.time_s * 1e9)
        spans.add((begin, begin + phy.air_time_ns(row.bytes, 1 if row.kind == "ack" else 0)))
    assert len(spans) > 300
    for (first, end), (second, _) in pairwise(sorted(spans)):
        assert second >= end + SIFS_NS or second == first
