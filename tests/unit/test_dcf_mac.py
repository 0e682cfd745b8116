"""The MAC of IEEE 802.11b by itself, over a channel that a test plays by hand."""

from itertools import pairwise

import numpy as np
import pytest
import simpy

from wsnsim.net.clock import Clock
from wsnsim.net.interface import Outcome
from wsnsim.net.mac.dcf import Dcf
from wsnsim.net.mac.dcf_config import DcfConfig
from wsnsim.net.mac.frames80211 import DcfAck, DcfData, decode_frame
from wsnsim.net.phy.base import BROADCAST, Transmission
from wsnsim.net.phy.ieee80211b import Ieee80211b
from wsnsim.net.phy.radios import Radio

SIFS_NS, DIFS_NS, SLOT_NS, ACK_NS, EIFS_NS = 10_000, 50_000, 20_000, 304_000, 364_000
ACK_TIMEOUT_NS = SIFS_NS + SLOT_NS + 192_000
LATER_NS = 1_000_000_000


class Stand:
    """Medium and upper layer in one: carries nothing, writes down what the MAC of node 1 does."""

    def __init__(self, seed=5, **config):
        self.env = simpy.Environment()
        self.clock = Clock(self.env)
        self.phy = Ieee80211b()
        self.busy_until_ns = 0
        self.sent, self.modes, self.done_with, self.got = [], [], [], []
        self.silenced = False
        self.mac = Dcf(self.clock, self, self.phy, DcfConfig(**config), 1, np.random.default_rng(seed))
        self.radio = Radio(1, np.random.default_rng(6), self.mac)
        self.mac.connect(self.radio, self)

    def watch(self, radio):
        return self.env.now < self.busy_until_ns

    def unwatch(self, radio):
        pass

    def turn(self, radio):
        pass

    def silence(self, radio):
        self.silenced = True

    def transmit(self, frame):
        self.sent.append((self.env.now, decode_frame(frame.mpdu)))
        self.modes.append(frame.mode)
        air_ns = self.phy.air_time_ns(len(frame.mpdu), frame.mode)
        self.clock.call(air_ns, lambda: self.mac.sent(frame), first=True)

    def received(self, payload, source, cargo):
        self.got.append((payload, source, cargo))

    def done(self, outcome):
        self.done_with.append((self.env.now, outcome))

    def submit(self, destination=2, at_ns=0):
        self.at(at_ns, lambda: self.mac.submit(b"x", destination, (2,), None))

    def at(self, time_ns, action, first=False):
        self.clock.call(time_ns - self.env.now, action, first=first)

    def occupy(self, since_ns, until_ns, frame=None, cargo=None):
        """Let a frame of another node arrive: one for somebody, or None for one that cannot be read."""

        def begin():
            self.busy_until_ns = until_ns
            self.mac.carrier(True)

        def end():
            self.mac.carrier(False)
            if frame is None:
                self.radio.overhear(None)
                return
            ours = (frame.receiver if isinstance(frame, DcfAck) else frame.destination) in (1, BROADCAST)
            transmission = Transmission(2, frame.encode(), 1, (), "data", cargo=cargo)
            (self.mac.received if ours else self.radio.overhear)(transmission)

        self.at(since_ns, begin)
        self.at(until_ns, end, first=True)

    def run(self, until_ns=None):
        self.env.run(until=until_ns)

    def air_ns(self, payload_bytes=1):
        return self.phy.air_time_ns(36 + payload_bytes)


def data(to=1, sequence=9, retry=False, duration_us=314):
    return DcfData(sequence, to, 2, b"hello", duration_us, retry)


def first_backoff(seed, **config):
    """Return how many slots the MAC of that seed draws first."""
    stand = Stand(seed, **config)
    stand.occupy(0, 1_000_000, DcfAck(7))
    stand.submit(at_ns=10)
    stand.run(LATER_NS // 100)
    slots, rest = divmod(stand.sent[0][0] - 1_000_000 - DIFS_NS, SLOT_NS)
    assert rest == 0
    return slots


def test_a_frame_goes_out_at_once_where_the_channel_has_been_idle():
    stand = Stand()
    stand.submit(at_ns=123_456)
    stand.run(500_000)
    ((start, frame),) = stand.sent
    assert start == 123_456
    assert frame.duration_us == 314
    assert not frame.retry


def test_a_first_backoff_is_uniform_over_the_window():
    drawn = [first_backoff(seed) for seed in range(400)]
    assert min(drawn) == 0
    assert max(drawn) == 31
    # the mean of 0 to 31, within 3.5 standard errors
    assert np.mean(drawn) == pytest.approx(15.5, abs=3.5 * np.sqrt((32**2 - 1) / 12 / len(drawn)))


def test_a_frame_that_comes_less_than_difs_after_another_backs_off():
    slots = first_backoff(5)
    stand = Stand()
    stand.occupy(0, 400_000, DcfAck(7))
    stand.submit(at_ns=400_000 + DIFS_NS - 1)
    stand.run(LATER_NS // 100)
    assert stand.sent[0][0] == 400_000 + DIFS_NS + slots * SLOT_NS

    stand = Stand()
    stand.occupy(0, 400_000, DcfAck(7))
    stand.submit(at_ns=400_000 + DIFS_NS)
    stand.run(LATER_NS // 100)
    assert stand.sent[0][0] == 400_000 + DIFS_NS


def test_the_count_of_slots_freezes_while_the_channel_is_busy():
    seed = next(seed for seed in range(100) if first_backoff(seed) > 10)
    slots = first_backoff(seed)
    stand = Stand(seed)
    stand.occupy(0, 1_000_000, DcfAck(7))
    stand.submit(at_ns=10)
    # three slots and a half pass, then four more, then one that is over as the next frame begins
    first = 1_000_000 + DIFS_NS + 3 * SLOT_NS + SLOT_NS // 2
    stand.occupy(first, first + 700_000, DcfAck(7))
    second = first + 700_000 + DIFS_NS + 4 * SLOT_NS + 1
    stand.occupy(second, second + 300_000, DcfAck(7))
    third = second + 300_000 + DIFS_NS + SLOT_NS
    stand.occupy(third, third + 300_000, DcfAck(7))
    # this one leaves less than DIFS: nothing passes
    fourth = third + 300_000 + DIFS_NS - 1
    stand.occupy(fourth, fourth + 300_000, DcfAck(7))
    stand.run(LATER_NS // 100)
    assert stand.sent[0][0] == fourth + 300_000 + DIFS_NS + (slots - 3 - 4 - 1) * SLOT_NS


def test_who_is_due_at_the_instant_a_frame_begins_cannot_have_sensed_it():
    slots = first_backoff(5)
    assert slots > 0
    due = 1_000_000 + DIFS_NS + slots * SLOT_NS
    for begin, goes in ((due, due), (due - 1, due - 1 + 300_000 + DIFS_NS + SLOT_NS)):
        stand = Stand()
        stand.occupy(0, 1_000_000, DcfAck(7))
        stand.submit(at_ns=10)
        stand.occupy(begin, begin + 300_000, DcfAck(7))
        stand.run(LATER_NS // 100)
        assert stand.sent[0][0] == goes


def test_who_gets_a_frame_as_another_begins_cannot_have_sensed_that_either():
    stand = Stand()
    stand.occupy(1_000_000, 1_300_000, DcfAck(7))
    stand.submit(at_ns=1_000_000)
    stand.run(LATER_NS // 100)
    assert stand.sent[0][0] == 1_000_000

    # the one before that is less than DIFS ago, and was sensed
    stand = Stand()
    stand.occupy(0, 1_000_000, DcfAck(7))
    stand.occupy(1_040_000, 1_300_000, DcfAck(7))
    stand.submit(at_ns=1_040_000)
    stand.run(LATER_NS // 100)
    assert stand.sent[0][0] == 1_300_000 + DIFS_NS + first_backoff(5) * SLOT_NS


def acknowledged_stand(seed):
    """Return a stand whose first frame was acknowledged, and when."""
    stand = Stand(seed)
    stand.submit()
    begins = stand.air_ns() + SIFS_NS
    stand.occupy(begins, begins + ACK_NS, DcfAck(1))
    return stand, begins + ACK_NS


def backoff_after_a_frame(seed):
    """Return how many slots a node lets pass after a frame before it sends the next one."""
    stand, acknowledged = acknowledged_stand(seed)
    stand.submit(at_ns=acknowledged + 1)
    stand.run(LATER_NS // 100)
    return (stand.sent[1][0] - acknowledged - DIFS_NS) // SLOT_NS


def test_a_backoff_that_is_not_over_counts_for_a_frame_that_comes_as_another_begins():
    seed = next(seed for seed in range(100) if backoff_after_a_frame(seed) > 5)
    slots = backoff_after_a_frame(seed)
    stand, acknowledged = acknowledged_stand(seed)
    begins = acknowledged + DIFS_NS + (slots - 1) * SLOT_NS
    stand.occupy(begins, begins + 300_000, DcfAck(7))
    stand.submit(at_ns=begins)
    stand.run(LATER_NS // 100)
    assert stand.sent[1][0] == begins + 300_000 + DIFS_NS + SLOT_NS


@pytest.mark.parametrize("seed", range(5))
def test_what_began_while_the_node_sent_keeps_the_next_frame_back(seed):
    stand = Stand(seed)
    stand.submit(BROADCAST)
    ends = 192_000 + 37 * 8_000
    stand.busy_until_ns = ends + 1_000_000
    stand.submit(at_ns=ends)
    stand.at(ends + 1_000_000, lambda: stand.mac.carrier(False), first=True)
    stand.run(LATER_NS // 100)
    slots, rest = divmod(stand.sent[1][0] - stand.busy_until_ns - DIFS_NS, SLOT_NS)
    assert rest == 0
    assert 0 <= slots <= 31


def test_a_frame_for_others_reserves_the_channel():
    """The NAV of 5000 µs counts from the end of the frame; DIFS comes after it."""
    slots = first_backoff(5)
    stand = Stand()
    stand.occupy(0, 1_000_000, data(to=3, duration_us=5_000))
    stand.submit(at_ns=2_000_000)
    # a shorter claim does not shorten it
    stand.occupy(3_000_000, 3_400_000, data(to=3, duration_us=314))
    stand.run(LATER_NS // 100)
    assert stand.sent[0][0] == 6_000_000 + DIFS_NS + slots * SLOT_NS


def test_after_a_frame_that_cannot_be_read_the_space_is_longer_until_one_can():
    slots = first_backoff(5)
    stand = Stand()
    stand.occupy(0, 1_000_000)
    stand.submit(at_ns=10)
    stand.run(LATER_NS // 100)
    assert stand.sent[0][0] == 1_000_000 + EIFS_NS + slots * SLOT_NS

    stand = Stand()
    stand.occupy(0, 1_000_000)
    stand.submit(at_ns=10)
    stand.occupy(1_010_000, 1_010_000 + ACK_NS, DcfAck(7))
    stand.run(LATER_NS // 100)
    assert stand.sent[0][0] == 1_010_000 + ACK_NS + DIFS_NS + slots * SLOT_NS


def test_an_unanswered_frame_is_sent_seven_times_with_growing_windows():
    waits = []
    for seed in range(150):
        stand = Stand(seed)
        stand.submit()
        stand.run()
        starts = [start for start, _ in stand.sent]
        assert [outcome for _, outcome in stand.done_with] == [Outcome.NO_ACK]
        assert stand.done_with[0][0] == starts[-1] + stand.air_ns() + ACK_TIMEOUT_NS
        assert [frame.retry for _, frame in stand.sent] == [False] + [True] * 6
        assert len({frame.sequence for _, frame in stand.sent}) == 1
        assert stand.mac.counters.attempts_failed == stand.mac.counters.attempts == 7
        # the channel has been idle for DIFS when the timeout comes
        waits.append([(b - a - stand.air_ns() - ACK_TIMEOUT_NS) / SLOT_NS for a, b in pairwise(starts)])
    waits = np.array(waits)
    assert waits.shape == (150, 6)
    assert np.all(waits == np.round(waits))
    windows = np.array([63, 127, 255, 511, 1023, 1023])
    assert np.all(waits.max(axis=0) <= windows)
    standard_errors = np.sqrt(((windows + 1.0) ** 2 - 1) / 12 / len(waits))
    assert np.all(np.abs(waits.mean(axis=0) - windows / 2) < 3.5 * standard_errors)


def test_after_a_frame_the_node_backs_off_though_nothing_waits():
    drawn = [backoff_after_a_frame(seed) for seed in range(100)]
    assert min(drawn) <= 1
    assert 30 <= max(drawn) <= 31

    # long after the backoff is over nothing keeps a frame back
    stand, acknowledged = acknowledged_stand(5)
    late = acknowledged + DIFS_NS + 31 * SLOT_NS + 7
    stand.submit(at_ns=late)
    stand.run(LATER_NS // 100)
    assert stand.done_with[0] == (acknowledged, None)
    assert stand.sent[1][0] == late


def test_a_broadcast_is_sent_once_at_the_basic_rate_and_waits_for_nobody():
    stand = Stand()
    stand.submit(BROADCAST)
    stand.run()
    ((_, frame),) = stand.sent
    assert (frame.destination, frame.duration_us) == (BROADCAST, 0)
    assert stand.modes == [stand.phy.control_mode]
    assert stand.done_with == [(192_000 + 37 * 8_000, None)]


def test_an_acknowledgement_under_way_at_the_timeout_is_waited_for():
    stand = Stand(retry_limit=1)
    stand.submit()
    sent = stand.air_ns()
    assert SIFS_NS < ACK_TIMEOUT_NS < SIFS_NS + ACK_NS
    stand.occupy(sent + SIFS_NS, sent + SIFS_NS + ACK_NS, DcfAck(1))
    stand.run()
    assert stand.done_with == [(sent + SIFS_NS + ACK_NS, None)]
    assert stand.mac.counters.attempts_failed == 0


@pytest.mark.parametrize("frame", [None, data(to=3), DcfAck(3)])
def test_anything_else_instead_of_the_acknowledgement_fails_the_attempt(frame):
    stand = Stand(retry_limit=1)
    stand.submit()
    sent = stand.air_ns()
    stand.occupy(sent + SIFS_NS, sent + 400_000, frame)
    stand.run()
    assert stand.done_with == [(sent + 400_000, Outcome.NO_ACK)]


def test_a_frame_is_answered_after_sifs_and_passed_up_once():
    stand = Stand()
    for repeat in range(3):
        end = 1_000_000 + repeat * 10_000_000
        stand.occupy(end - 500_000, end, data(retry=repeat > 0), cargo=repeat)
    stand.run()
    assert stand.got == [(b"hello", 2, 0)]
    assert stand.sent == [(1_000_000 + r * 10_000_000 + SIFS_NS, DcfAck(2)) for r in range(3)]
    assert set(stand.modes) == {stand.phy.control_mode}

    # the same number without the retry bit is a new frame, and so is another number with it
    stand.occupy(40_000_000, 40_500_000, data(), cargo="new")
    stand.occupy(50_000_000, 50_500_000, data(sequence=10, retry=True), cargo="newer")
    stand.run()
    assert [cargo for *_, cargo in stand.got] == [0, "new", "newer"]


def test_a_frame_for_us_is_answered_first_and_the_count_goes_on_after_it():
    seed = next(seed for seed in range(100) if first_backoff(seed) > 5)
    slots = first_backoff(seed)
    stand = Stand(seed)
    stand.occupy(0, 1_000_000, DcfAck(7))
    stand.submit(at_ns=10)
    begin = 1_000_000 + DIFS_NS + 2 * SLOT_NS
    stand.occupy(begin, begin + 600_000, data())
    stand.run(LATER_NS // 100)
    answered = begin + 600_000 + SIFS_NS
    assert stand.sent[0] == (answered, DcfAck(2))
    assert stand.sent[1][0] == answered + ACK_NS + DIFS_NS + (slots - 2) * SLOT_NS


def test_broadcasts_are_not_answered():
    stand = Stand()
    stand.occupy(0, 1_000_000, data(to=BROADCAST, duration_us=0))
    stand.run()
    assert stand.got
    assert not stand.sent


def test_after_stop_nothing_happens():
    stand = Stand()
    stand.occupy(0, 500_000, data())
    stand.submit(at_ns=100)
    stand.at(505_000, stand.mac.stop)
    stand.run()
    assert stand.silenced
    assert not stand.sent
    assert not stand.done_with


@pytest.mark.parametrize(
    ("config", "words"),
    [
        ({"cw_min": 63, "cw_max": 31}, "cw_max: must be at least 63"),
        ({"retry_limit": 0}, "retry_limit: must be at least 1"),
    ],
)
def test_windows_and_limits_out_of_range(config, words):
    with pytest.raises(ValueError, match=words):
        DcfConfig(**config)
