"""What a node knows of its neighbours: link estimates, beacons in bytes, and when to talk."""

from math import comb, inf

import numpy as np
import pytest
import simpy

from wsnsim.errors import DecodeError
from wsnsim.net.clock import Clock
from wsnsim.net.routing.control import (
    Beacon,
    decode_beacon,
    decode_broadcast,
    decode_cost,
    decode_join,
    decode_route,
    encode_broadcast,
    encode_cost,
    encode_join,
    encode_route,
)
from wsnsim.net.routing.neighbours import Neighbour, NeighbourTable
from wsnsim.net.routing.trickle import Trickle


def test_the_first_beacons_are_judged_by_the_rule_of_succession():
    entry = Neighbour(3)
    assert entry.link_etx == 2.0  # nothing known: (0 + 2) / (0 + 1)
    entry.beacon(7, 0)
    assert entry.link_etx == pytest.approx(3 / 2)
    entry.beacon(9, 0)  # one was missed
    # a full window of three, of which two arrived
    assert entry.etx == entry.link_etx == pytest.approx(3 / 2)


def test_beacons_enter_by_a_mean_of_means():
    """Fonseca et al.: quality is averaged first, its inverse after it; both with weight 0.9 for the old."""
    entry = Neighbour(3)
    for sequence in (1, 2, 3):
        entry.beacon(sequence, 0)
    assert entry.etx == 1.0
    entry.beacon(6, 0)  # 4 and 5 were missed: one of three
    quality = 0.9 * 1.0 + 0.1 / 3
    assert entry.etx == pytest.approx(0.9 * 1.0 + 0.1 / quality)


def test_sequence_numbers_wrap():
    entry = Neighbour(3)
    for sequence in (254, 255, 0):
        entry.beacon(sequence, 0)
    assert entry.etx == 1.0


def test_data_counts_transmissions_for_each_acknowledgement():
    entry = Neighbour(3, etx=1.0)
    entry.sent(3, True, 5)
    assert entry.etx == 1.0  # the window of five is not full
    entry.sent(3, True, 6)  # the window ends before the last of these: one of five was acknowledged
    assert entry.etx == pytest.approx(0.9 + 0.1 * 5)
    assert entry.heard_ns == 6


def test_silence_costs_all_transmissions_since_the_last_acknowledgement():
    entry = Neighbour(3, etx=1.0)
    for _ in range(3):
        entry.sent(4, False, 0)
    # windows end after 5 and after 10
    assert entry.etx == pytest.approx(0.9 * (0.9 + 0.1 * 5) + 0.1 * 10)
    assert entry.failed_in_row == 3


@pytest.mark.parametrize("success", [0.3, 0.6, 0.9])
def test_the_estimate_settles_where_the_link_is(success, test_seed):
    """The mean sample of a window of five: 5 / k with k acknowledgements, binomial; with none, all
    transmissions since the last one, the geometric number before the window among them.
    """
    rng = np.random.default_rng((test_seed, int(success * 10)))
    entry, seen = Neighbour(3), []
    for frame in range(6000):
        attempts = 1
        while rng.random() > success:
            attempts += 1
        entry.sent(attempts, True, 0)
        if frame > 500:
            seen.append(entry.etx)
    fail = 1 - success
    mean = sum(comb(5, k) * success**k * fail ** (5 - k) * 5 / k for k in range(1, 6))
    mean += fail**5 * (5 + fail / success)
    # one frame in `success` windows of five; single samples have a spread of about their mean
    error = mean / np.sqrt(6000 / success / 5)
    assert np.mean(seen) == pytest.approx(mean, abs=4 * error)


def test_a_lost_neighbour_comes_back_as_a_bad_one():
    entry = Neighbour(3, cost=1.0, parent=9, etx=1.0)
    entry.give_up(10.0)
    assert entry.lost
    assert entry.cost == inf
    entry.beacon(1, 4)
    assert not entry.lost
    assert entry.link_etx == 10.0


def test_the_table_forgets_who_is_silent():
    table = NeighbourTable()
    table.meet(1).heard_ns = 10
    table.meet(2).heard_ns = 20
    assert table.forget_before(20) == [1]
    assert [entry.address for entry in table] == [2]
    assert table.get(1) is None
    assert table.meet(2) is table.get(2)


@pytest.mark.parametrize("pull", [False, True])
@pytest.mark.parametrize("parent", [None, 0, 513])
def test_beacons_round_trip_in_seven_bytes(parent, pull):
    beacon = Beacon(200, parent, 3.5, pull)
    assert len(beacon.encode()) == 7
    assert beacon.encode()[0] >> 6 == 0  # not a LoWPAN frame (RFC 4944, sec. 5.1)
    assert decode_beacon(beacon.encode()) == beacon
    assert decode_beacon(Beacon(1, parent, inf).encode()).cost == inf


def test_costs_keep_seven_binary_places():
    for cost in np.linspace(0, 500, 1001):
        assert decode_cost(encode_cost(cost)) == pytest.approx(cost, abs=0.5 / 128)
    assert encode_cost(1e9) == 0xFFFE


def test_joins_and_headers_round_trip():
    assert decode_join(encode_join((1, 0x7FFF, 300))) == (1, 0x7FFF, 300)
    assert decode_route(encode_route(2.5, 77) + b"rest") == (2.5, 77, b"rest")
    assert decode_broadcast(encode_broadcast(9) + b"rest") == (9, b"rest")


@pytest.mark.parametrize(
    ("decode", "packet"),
    [(decode_beacon, b"\x01\x00"), (decode_join, b"\x02\x02\x00"), (decode_join, b""),
     (decode_route, b"\x00"), (decode_broadcast, b"\x41\x00"), (decode_broadcast, b"")],
)  # fmt: skip
def test_what_is_cut_short_is_refused(decode, packet):
    with pytest.raises(DecodeError):
        decode(packet)


class Talker:
    """A Trickle timer that writes down when it talks."""

    def __init__(self, seed=0, redundancy=0, doublings=4):
        self.env = simpy.Environment()
        self.at = []
        self.timer = Trickle(
            Clock(self.env), 0.1, doublings, redundancy, np.random.default_rng(seed), self.talk
        )
        self.timer.start()

    def talk(self):
        self.at.append(self.env.now / 1e9)

    def run(self, until_s):
        self.env.run(until=round(until_s * 1e9))


def test_trickle_talks_once_in_the_second_half_of_each_interval(test_seed):
    talker = Talker(test_seed)
    talker.run(0.1 * 31 + 1.6 * 3)
    begin, length = 0.0, 0.1
    for at in talker.at:
        assert begin + length / 2 <= at < begin + length
        begin, length = begin + length, min(2 * length, 1.6)
    assert len(talker.at) == 5 + 3


def test_trickle_begins_anew_with_news_but_never_faster():
    talker = Talker()
    talker.timer.reset()
    assert talker.timer.interval_ns == 100_000_000
    talker.run(2.0)
    assert talker.timer.interval_ns == 1_600_000_000
    talker.timer.reset()
    before = len(talker.at)
    talker.run(2.1)
    assert len(talker.at) == before + 1


def test_trickle_is_silent_where_enough_others_have_spoken():
    talker = Talker(redundancy=2)
    for _ in range(2):
        talker.timer.consistent()
    talker.run(0.1)
    assert talker.at == []
    talker.timer.consistent()
    talker.run(0.3)
    assert len(talker.at) == 1
    talker.timer.stop()
    talker.run(100.0)
    assert len(talker.at) == 1
