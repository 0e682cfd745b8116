"""TDMA by itself: slots, clocks and beacons of one node, over a channel that a test plays by hand."""

import runpy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from wsnsim.errors import DecodeError
from wsnsim.hardware.clocks import DriftingClock
from wsnsim.net.channel.links import Links
from wsnsim.net.config import RadioConfig
from wsnsim.net.interface import Outcome
from wsnsim.net.mac.beacons import BEACON_BYTES, MacBeacon, decode_beacon
from wsnsim.net.mac.frames import MacAck, decode_frame
from wsnsim.net.mac.slots import timetable
from wsnsim.net.mac.tdma import Tdma
from wsnsim.net.mac.tdma_config import TdmaConfig
from wsnsim.net.mac.tdma_family import TdmaFamily
from wsnsim.net.phy.base import BROADCAST
from wsnsim.net.phy.ieee802154 import air_time_ns
from wsnsim.net.routing.tree import tree_from_parents

BENCH = runpy.run_path(str(Path(__file__).parents[1] / "sleep_bench.py"))
Stand, data_for, tdma = BENCH["Stand"], BENCH["data_for"], BENCH["tdma"]
RadioBench = runpy.run_path(str(Path(__file__).parents[1] / "radio_bench.py"))["RadioBench"]
MS = 1_000_000
START_UP, TURN, GUARD, SYNC = 860_000, 192_000, 1 * MS, 192_000
BEGIN = START_UP + TURN + GUARD
SLOT = BEGIN + air_time_ns(127) + 864_000 + GUARD
FRAME = 4 * SLOT
"""A chain of base 0, node 1 and node 2: two turns up (node 2 first), two down (the base first)."""
CHAIN = tree_from_parents({"n0": None, "n1": "n0", "n2": "n1"})
HEARS_CHILD, SENDS_UP, HEARS_PARENT, SENDS_DOWN = 0, SLOT, 2 * SLOT, 3 * SLOT
STEADY = TdmaConfig(drift_ppm=0.0, resync_s=1000.0, proportional=False)


def stand_with(config=STEADY):
    links = Links.from_matrix(np.full((3, 3), -60.0))
    table = timetable(CHAIN, ("n0", "n1", "n2"), links, -95.0)
    return Stand(lambda clock, medium, address, rng: Tdma(clock, medium, config, table, address, rng))


def test_the_slots_of_a_chain():
    stand = stand_with()
    slots = [(duty.slot, duty.part.value) for duty in stand.mac._duties]
    assert slots == [(0, "hear_child"), (1, "send_up"), (2, "hear_parent"), (3, "send_down")]
    assert STEADY.slot_ns == SLOT


def test_a_node_without_traffic_wakes_for_others_slots_only_and_listens_for_two_guards():
    stand = stand_with()
    stand.run(2 * FRAME)
    wakes = [at for at, state in stand.states if state == "start"]
    heard = [TURN + begin for begin in (HEARS_CHILD, HEARS_PARENT)]
    assert wakes == heard + [FRAME + at for at in heard]
    spent = stand.spent_ns(2 * FRAME)
    assert spent == {
        "listen": 4 * (2 * GUARD + SYNC),
        "start": 4 * START_UP,
        "sleep": 2 * FRAME - 4 * (2 * GUARD + SYNC + START_UP),
    }
    assert not stand.sent


@pytest.mark.parametrize(("to", "slot"), [(0, SENDS_UP), (2, SENDS_DOWN), (BROADCAST, SENDS_DOWN)])
def test_a_frame_goes_in_the_slot_of_its_direction_one_guard_after_receivers_are_ready(to, slot):
    stand = stand_with()
    stand.run(MS)
    stand.mac.submit(b"x", to, (to,), None)
    begun, frame = stand.until_sent()
    assert begun == slot + BEGIN
    assert frame.address == to
    if to == BROADCAST:
        ends = begun + air_time_ns(12)
    else:
        ends = stand.acknowledge(begun, frame)
    stand.run(ends + 1)
    assert stand.done_with == [(ends, None)]
    assert stand.asleep
    wakes = [at for at, state in stand.states if state == "start"]
    assert wakes[-1] == begun - START_UP - TURN
    stand.run(3 * FRAME)
    assert len(stand.sent) == 1


def test_an_unanswered_frame_is_sent_again_in_the_next_slots_and_given_up_after_four():
    stand = stand_with()
    stand.mac.submit(b"x", 0, (0,), None)
    stand.run(6 * FRAME)
    assert [at for at, _ in stand.sent] == [SENDS_UP + BEGIN + k * FRAME for k in range(4)]
    assert len({frame.mpdu for _, frame in stand.sent}) == 1
    assert [frame.attempt for _, frame in stand.sent] == [1, 2, 3, 4]
    assert stand.done_with == [(stand.sent[-1][0] + air_time_ns(12) + 864_000, Outcome.NO_ACK)]
    counters = stand.mac.counters
    assert (counters.attempts, counters.attempts_failed, counters.frames_retried) == (4, 4, 3)


def test_an_acknowledgement_of_another_frame_is_none():
    stand = stand_with()
    stand.mac.submit(b"x", 0, (0,), None)
    stand.acknowledge(*stand.until_sent(), wrong=1)
    stand.run(FRAME)
    assert not stand.done_with


def test_a_childs_frame_is_answered_and_passed_up_once_and_the_radio_sleeps_after_it():
    stand = stand_with()
    ends = BEGIN + air_time_ns(16)
    for number in range(3):
        stand.hear(number * FRAME + ends, data_for(1, 7), cargo=number)
    stand.run(3 * FRAME)
    assert [(at, decode_frame(frame.mpdu)) for at, frame in stand.sent] == [
        (number * FRAME + ends + TURN, MacAck(7)) for number in range(3)
    ]
    assert stand.got == [(b"hello", 2, 0)]
    assert (ends + TURN + air_time_ns(5), "sleep") in stand.states


def test_energy_of_others_keeps_a_receiver_up_until_its_slot_is_over():
    stand = stand_with()
    stand.is_busy = True
    stand.run(FRAME // 2)
    assert (SLOT, "sleep") in stand.states


def test_a_frame_of_the_parent_sets_the_clock_and_all_slots_after_it():
    stand = stand_with()
    late = 300_000
    ends = HEARS_PARENT + BEGIN + air_time_ns(16) + late
    stand.hear(ends, data_for(1, 7, source=0))
    stand.run(ends + 1)
    assert stand.mac.time.shown_ns(ends) == ends - late
    stand.mac.submit(b"x", 2, (2,), None)
    begun, frame = stand.until_sent(2)
    assert begun == SENDS_DOWN + BEGIN + late
    stand.acknowledge(begun, frame)
    # a child's frame tells nothing
    stand.hear(FRAME + BEGIN + air_time_ns(16) + 777, data_for(1, 8))
    stand.run(FRAME + SENDS_UP)
    assert stand.mac.time.shown_ns(stand.env.now) == stand.env.now - late


def test_a_node_sets_its_clock_by_beacons_and_passes_nothing_up():
    stand = stand_with()
    ends = HEARS_PARENT + BEGIN + air_time_ns(BEACON_BYTES) - 500
    stand.hear(ends, MacBeacon(3, 0xCAFE, 0).encode(), address=BROADCAST, kind="beacon")
    stand.run(FRAME)
    assert stand.mac.time.shown_ns(FRAME) == FRAME + 500
    assert not stand.got
    assert stand.mac.counters.mac_rx_bytes == BEACON_BYTES


def test_a_beacon_is_read_as_it_was_written_and_nothing_else_is_one():
    beacon = MacBeacon(200, 0xCAFE, 0x1234)
    mpdu = beacon.encode()
    assert len(mpdu) == BEACON_BYTES
    # frame control 0x8000, number, PAN, source, no superframe of the standard, no slots, nothing pending
    assert mpdu[:-2].hex() == "0080c8feca3412ff000000"
    assert decode_beacon(mpdu) == beacon
    assert decode_beacon(data_for(1, 3)) is None
    assert decode_beacon(MacAck(3).encode()) is None
    for broken in (mpdu[:-1] + b"x", mpdu[:-2]):
        with pytest.raises(DecodeError, match="beacon: must have 13 B and a right check sequence"):
            decode_beacon(broken)


def test_a_beacon_goes_down_when_nothing_else_did_for_a_while():
    stand = stand_with(replace(STEADY, resync_s=10 * FRAME / 1e9))
    for at in (0, 14 * FRAME):
        stand.at(at, lambda: stand.mac.submit(b"to all", BROADCAST, (2,), None))
    stand.run(40 * FRAME)
    sent = [(frame.kind, (at - SENDS_DOWN - BEGIN) / FRAME) for at, frame in stand.sent]
    assert sent == [("broadcast", 0), ("beacon", 10), ("broadcast", 14), ("beacon", 24), ("beacon", 34)]
    beacon = decode_beacon(stand.sent[1][1].mpdu)
    assert (beacon.pan, beacon.source) == (0xCAFE, 1)


def test_beacons_that_are_always_due_leave_every_other_slot_to_what_waits():
    stand = stand_with(replace(STEADY, resync_s=1e-3))
    stand.run(2 * FRAME)
    stand.mac.submit(b"x", 2, (2,), None)
    stand.run(8 * FRAME)
    kinds = [frame.kind for _, frame in stand.sent]
    assert kinds == ["beacon", "beacon", "data", "beacon", "data", "beacon", "data", "beacon"]


@pytest.mark.parametrize("part", [HEARS_CHILD, SENDS_UP, HEARS_PARENT, SENDS_DOWN])
@pytest.mark.parametrize("after_us", [0, 300, 1_100, 2_100, 2_700, 3_300, 5_000])
def test_after_stop_nothing_happens(part, after_us):
    """Asleep, starting, listening, turning, sending, waiting for an acknowledgement, answering."""
    stand = stand_with()
    to = BROADCAST if part == SENDS_DOWN else 0
    stand.at(1, lambda: stand.mac.submit(b"x", to, (to,), None))
    stand.hear(part + BEGIN + 200_000, data_for(1, 1))
    stand.run(part + after_us * 1000 + 2)
    stand.mac.stop()
    sent, done, got = len(stand.sent), len(stand.done_with), len(stand.got)
    stand.run(5 * FRAME)
    assert stand.silent
    assert (len(stand.sent), len(stand.done_with), len(stand.got)) == (sent, done, got)
    assert not stand.mac.awaits_ack


@pytest.mark.parametrize(("drift_ppm", "heard"), [(400.0, True), (-400.0, True), (900.0, False)])
def test_a_clock_within_the_guard_is_set_again_and_one_beyond_it_is_lost(drift_ppm, heard):
    """Beacons come every 2 s, in which 400 ppm make 0.8 ms and 900 ppm 1.8 ms; the guard is 1 ms."""
    bench = RadioBench.line(2, family=tdma(drift_ppm=0.0, resync_s=2.0), record_frames=True)
    mac = bench.network._macs["n1"]
    mac.time = DriftingClock(drift_ppm)
    for k in range(8):
        bench.send("n1", "n0", bytes(20), at_ns=(4 + k) * 1_000_000_000)
    # until then no clock is off by a whole superframe of 16 ms, with which it would be in time again
    bench.run(12.0)
    assert len(bench.delivered_at) == (8 if heard else 0)
    beacons = [row.outcome for row in bench.frames if row.kind == "beacon"]
    assert set(beacons) == ({"received"} if heard else {"missed"})
    off_ns = abs(mac.time.shown_ns(bench.env.now) - bench.env.now)
    assert off_ns <= 1.02 * abs(drift_ppm) * 1e-6 * (2.05e9 if heard else 12e9)
    assert heard or [outcome for *_, outcome in bench.dropped_at] == [Outcome.NO_ACK] * 8


def test_proportional_slots_carry_what_equal_ones_cannot():
    """A line of 6 whose nodes all speak: the last hop carries five times what the first does."""
    shares = {}
    for proportional in (False, True):
        bench = RadioBench.line(6, family=tdma(proportional=proportional))
        period_s = bench.network._stack.family.superframe_ns / 1e9 if proportional else None
        period_s = period_s or 0.164
        for node in range(1, 6):
            for k in range(60):
                bench.send(f"n{node}", "n0", bytes(100), at_ns=round((k + node / 10) * period_s * 1e9))
        bench.run(70 * period_s)
        shares[proportional] = len(bench.delivered_at) / 300
    assert shares[True] == 1.0
    assert shares[False] < 0.6


def test_a_family_needs_a_tree_first():
    with pytest.raises(ValueError, match="TDMA: slots come from a tree; call on_tree first"):
        _ = TdmaFamily().table


def test_a_hop_takes_a_superframe_for_each_frame_and_a_slot():
    links = Links.from_matrix(np.full((3, 3), -60.0))
    family = TdmaFamily(STEADY).on_tree(CHAIN, ("n0", "n1", "n2"), links, RadioConfig())
    assert family.superframe_ns == FRAME
    assert family.service_ns([100, 20], 7) == 2 * FRAME + SLOT


@pytest.mark.parametrize(
    ("config", "words"),
    [
        ({"guard_s": 0.0}, "guard_s: must be positive, got 0.0"),
        (
            {"slot_s": 0.005},
            "slot_s: must be at least 0.008172 s for start-up, two guards of 0.001 s, the longest",
        ),
        ({"drift_ppm": -1.0}, "drift_ppm: must not be negative"),
        ({"resync_s": 0.0}, "resync_s: must be positive"),
        (
            {"drift_ppm": 40.0, "resync_s": 30.0},
            "guard_s: must be at least 0.0024 s, by which clocks of 40 ppm",
        ),
        ({"max_frame_retries": -1}, "max_frame_retries: must be at least 0"),
        ({"pan_id": -1}, "pan_id: must be 0 to 65534"),
    ],
)
def test_impossible_parameters_are_refused(config, words):
    with pytest.raises(ValueError, match=words):
        TdmaConfig(**config)


def test_a_guard_too_short_for_a_deep_tree_is_refused():
    links = Links.from_matrix(np.full((3, 3), -60.0))
    family = TdmaFamily(TdmaConfig(drift_ppm=40.0, resync_s=10.0))
    with pytest.raises(ValueError, match=r"guard_s: must be at least 0\.0016.* over 2 hops"):
        family.on_tree(CHAIN, ("n0", "n1", "n2"), links, RadioConfig())
