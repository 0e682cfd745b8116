"""Low-power listening by itself, over a channel that a test plays by hand."""

import runpy
from itertools import pairwise
from pathlib import Path

import pytest

from wsnsim.net.interface import Outcome
from wsnsim.net.mac.frames import MacAck, decode_frame
from wsnsim.net.mac.lpl import Lpl
from wsnsim.net.mac.lpl_config import LplConfig, quiet_ns, step_ns
from wsnsim.net.mac.lpl_family import LplFamily
from wsnsim.net.phy.base import BROADCAST
from wsnsim.net.phy.ieee802154 import air_time_ns

BENCH = runpy.run_path(str(Path(__file__).parents[1] / "sleep_bench.py"))
Stand, data_for = BENCH["Stand"], BENCH["data_for"]
MS = 1_000_000
START_UP, CHECK, AFTER, INTERVAL = 860_000, 5_500_000, 20 * MS, 100 * MS
TURN, ACK_WAIT, ACK_AIR, BACKOFF = 192_000, 864_000, 352_000, 320_000
AIR = air_time_ns(12)


def stand_with(**config):
    return Stand(lambda clock, medium, address, rng: Lpl(clock, medium, LplConfig(**config), address, rng))


def first_look(stand):
    """Run to the first wake-up and return its time."""
    while stand.asleep:
        stand.env.step()
    return stand.env.now - START_UP


def test_a_quiet_node_is_awake_for_start_up_and_check_once_an_interval():
    stand = stand_with()
    stand.run(10 * INTERVAL)
    changes = stand.states
    phase = changes[2][0]
    assert 0 <= phase < INTERVAL
    expected = [(0, "listen"), (0, "sleep")]
    for look in range(10):
        begin = phase + look * INTERVAL
        expected += [(begin, "start"), (begin + START_UP, "listen"), (begin + START_UP + CHECK, "sleep")]
    assert changes == [change for change in expected if change[0] < 10 * INTERVAL]
    spent = stand.spent_ns(10 * INTERVAL)
    assert spent["start"] == 10 * START_UP
    assert spent["listen"] == 10 * CHECK
    assert sum(spent.values()) == 10 * INTERVAL


def test_energy_at_the_end_of_a_check_keeps_a_node_awake_for_the_delay_after_receive():
    stand = stand_with()
    noticed = first_look(stand) + START_UP + CHECK - 1
    stand.at(noticed, lambda: stand.mac.carrier(True))
    stand.run(noticed + AFTER)
    assert not stand.asleep
    stand.run(noticed + AFTER + 1)
    assert stand.asleep


def test_energy_there_at_once_keeps_a_node_awake_and_its_next_look_keeps_to_the_grid():
    stand = stand_with(after_receive_s=0.15)
    stand.is_busy = True
    look = first_look(stand)
    stand.run(look + START_UP + 1)
    stand.is_busy = False
    stand.run(look + START_UP + 150 * MS)
    # the look of 100 ms later fell into the waking time
    assert not stand.asleep
    stand.run(look + 2 * INTERVAL + START_UP)
    assert stand.asleep
    stand.run(look + 2 * INTERVAL + START_UP + 1)
    assert not stand.asleep


def test_each_frame_prolongs_the_waking_time_is_answered_each_time_and_passed_up_once():
    stand = stand_with()
    begin = first_look(stand) + START_UP
    times = [begin + 3 * MS + k * 15 * MS for k in range(3)]
    for number, time in enumerate(times):
        stand.hear(time, data_for(1, 9), cargo=number)
    stand.hear(times[-1] + MS, data_for(1, 10), cargo="new")
    stand.run(times[-1] + MS + AFTER)
    assert [(at, decode_frame(frame.mpdu)) for at, frame in stand.sent] == [
        *((time + TURN, MacAck(9)) for time in times),
        (times[-1] + MS + TURN, MacAck(10)),
    ]
    assert stand.got == [(b"hello", 2, 0), (b"hello", 2, "new")]
    assert not stand.asleep
    stand.run(times[-1] + MS + AFTER + 1)
    assert stand.asleep


def test_broadcasts_are_not_answered():
    stand = stand_with()
    stand.hear(first_look(stand) + START_UP + MS, data_for(BROADCAST, 4), address=BROADCAST)
    stand.run(stand.env.now + INTERVAL)
    assert stand.got
    assert not stand.sent


def test_an_unanswered_frame_is_repeated_for_an_interval_and_the_train_three_times():
    stand = stand_with()
    stand.run(500_000)
    stand.mac.submit(b"x", 2, (2,), None)
    stand.run(1_000 * MS)
    ((_, outcome),) = stand.done_with
    assert outcome is Outcome.NO_ACK
    step = step_ns(12)
    assert step == AIR + ACK_WAIT + TURN
    assert len({frame.mpdu for _, frame in stand.sent}) == 1
    begins = [at for at, _ in stand.sent]
    gaps = [later - sooner for sooner, later in pairwise(begins)]
    trains = [0, *(at + 1 for at, gap in enumerate(gaps) if gap != step), len(begins)]
    # copies may begin up to an interval, a start-up and two steps after the first
    copies = (INTERVAL + START_UP + 2 * step) // step + 1
    assert [until - since for since, until in pairwise(trains)] == [copies] * 4
    waits = [gap - AIR - ACK_WAIT - quiet_ns() - TURN for gap in gaps if gap != step]
    # a random part of an interval, and a backoff
    assert all(0 <= wait < INTERVAL + 16 * BACKOFF for wait in waits)
    assert max(waits) > 16 * BACKOFF
    first = begins[0] - 500_000 - START_UP - quiet_ns() - TURN
    assert first % BACKOFF == 0
    assert 0 <= first // BACKOFF < 16
    assert stand.mac.counters.frames_tx == 4 * copies
    assert stand.mac.counters.frames_retried == 4 * copies - 1
    assert stand.mac.counters.copies == 4 * (copies - 1)
    assert stand.mac.counters.attempts_failed == stand.mac.counters.attempts == 4 * copies


def test_an_acknowledgement_ends_the_train_at_once_and_only_the_right_one():
    stand = stand_with()
    stand.mac.submit(b"x", 2, (2,), None)
    stand.acknowledge(*stand.until_sent(2), wrong=1)
    answered = stand.acknowledge(*stand.until_sent(3))
    stand.run(answered + AFTER)
    assert stand.done_with == [(answered, None)]
    assert len(stand.sent) == 3
    assert not stand.asleep
    stand.run(answered + AFTER + 1)
    assert stand.asleep


def test_a_broadcast_fills_the_interval_and_waits_for_nobody():
    stand = stand_with()
    stand.mac.submit(bytes(30), BROADCAST, (), None)
    stand.run(300 * MS)
    begins = [at for at, _ in stand.sent]
    air = air_time_ns(41)
    # a long interframe space after each copy
    assert {later - sooner for sooner, later in pairwise(begins)} == {air + 640_000}
    assert INTERVAL + START_UP <= begins[-1] - begins[0] <= INTERVAL + START_UP + 2 * step_ns(41)
    assert stand.done_with == [(begins[-1] + air, None)]
    assert stand.mac.counters.copies == len(begins) - 1
    assert stand.mac.counters.frames_retried == 0


def test_a_sender_waits_until_the_channel_is_quiet_for_longer_than_a_train_is():
    stand = stand_with()
    stand.is_busy = True
    stand.mac.submit(b"x", 2, (2,), None)
    # once when the radio is ready, then before each train
    while len(stand.watched) < 6:
        stand.env.step()
    assert not stand.sent
    stand.is_busy = False
    while len(stand.watched) < 7:
        stand.env.step()
    hushed = stand.env.now
    # a copy of somebody else's train begins in the last microsecond
    stand.at(hushed + quiet_ns() - 1000, lambda: stand.mac.carrier(True))
    begun, _ = stand.until_sent()
    assert begun > hushed + quiet_ns() + TURN
    assert begun == stand.watched[7] + quiet_ns() + TURN
    assert stand.mac.counters.cca_busy == 6
    assert stand.mac.counters.cca_total == 7


def test_a_channel_that_is_never_quiet_ends_the_wait():
    stand = stand_with(patience_intervals=2)
    stand.is_busy = True
    stand.mac.submit(b"x", 2, (2,), None)
    stand.run(400 * MS)
    ((at, outcome),) = stand.done_with
    assert outcome is Outcome.CHANNEL
    assert 2 * INTERVAL < at <= 2 * INTERVAL + START_UP + 63 * BACKOFF + quiet_ns()
    assert not stand.sent


def test_a_frame_heard_before_the_train_is_answered_first():
    stand = stand_with(min_be=8, max_be=8)
    stand.mac.submit(b"x", 2, (2,), None)
    stand.hear(2 * MS, data_for(1, 3))
    stand.until_sent(2)
    (answered, answer), (begun, frame) = stand.sent
    assert (answered, decode_frame(answer.mpdu)) == (2 * MS + TURN, MacAck(3))
    assert frame.kind == "data"
    wait = begun - (answered + ACK_AIR + TURN) - quiet_ns() - TURN
    assert wait >= 0
    assert wait % BACKOFF == 0


def test_in_its_own_train_a_node_takes_no_data_for_itself():
    stand = stand_with()
    stand.mac.submit(b"x", 2, (2,), None)
    begun, frame = stand.until_sent()
    stand.hear(begun + AIR + 800_000, data_for(1, 3))
    again, _ = stand.until_sent(2)
    assert again == begun + step_ns(12)
    assert not stand.got
    stand.acknowledge(again, frame)
    stand.run(again + 10 * MS)
    assert [outcome for _, outcome in stand.done_with] == [None]


@pytest.mark.parametrize("after_us", [0, 500, 2_000, 4_000, 6_000, 20_000, 90_000])
@pytest.mark.parametrize("to", [2, BROADCAST])
def test_after_stop_nothing_happens(after_us, to):
    """Asleep, starting, in backoff, hushed, sending, waiting for an acknowledgement: wherever it is."""
    stand = stand_with()
    stand.mac.submit(b"x", to, (2,), None)
    stand.run(max(1, after_us * 1000))
    stand.mac.stop()
    sent = len(stand.sent)
    stand.mac.carrier(True)
    stand.run(2_000 * MS)
    assert stand.silent
    assert len(stand.sent) == sent
    assert not stand.done_with
    assert not stand.mac.awaits_ack


@pytest.mark.parametrize(
    ("config", "words"),
    [
        (
            {"wake_interval_s": 0.011},
            "wake_interval_s: must be at least 11.672 ms, start-up, check and a copy",
        ),
        ({"check_s": 0.001}, "check_s: must be at least 1.184 ms, the gap between two copies"),
        ({"after_receive_s": 0.01}, "after_receive_s: must be at least 10.624 ms, two copies"),
        ({"max_be": 2}, "max_be: must be at least 4, got 2"),
        ({"patience_intervals": 0}, "patience_intervals: must be at least 1, got 0"),
        ({"max_frame_retries": -1}, "max_frame_retries: must be at least 0, got -1"),
        ({"pan_id": 0xFFFF}, "pan_id: must be 0 to 65534"),
        ({"duplicate_margin_s": -1.0}, "duplicate_margin_s: must not be negative"),
    ],
)
def test_impossible_parameters_are_refused(config, words):
    with pytest.raises(ValueError, match=words):
        LplConfig(**config)


def test_the_service_of_a_hop_is_an_interval_and_half_a_one_for_each_contender_more():
    family = LplFamily(LplConfig())
    backoff, overhead = 15 * BACKOFF // 2, quiet_ns() + TURN
    exchange = backoff + overhead + air_time_ns(111) + TURN + ACK_AIR
    assert family.service_ns([100], 1) == START_UP + INTERVAL + exchange
    assert family.service_ns([100, 100], 3) == START_UP + 2 * INTERVAL + 6 * exchange
