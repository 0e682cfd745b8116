"""The MAC by itself, over a channel that a test plays by hand."""

from itertools import pairwise

import numpy as np
import pytest
import simpy

from wsnsim.net.clock import Clock
from wsnsim.net.interface import Outcome
from wsnsim.net.mac.csma_ca import CsmaCa, CsmaCaConfig
from wsnsim.net.mac.frames import MacAck, MacData, decode_frame
from wsnsim.net.phy.base import BROADCAST, Transmission
from wsnsim.net.phy.ieee802154 import air_time_ns
from wsnsim.net.phy.radios import Radio

CCA_NS, TURN_NS, SLOT_NS, ACK_WAIT_NS = 128_000, 192_000, 320_000, 864_000


class Stand:
    """Medium and upper layer in one: carries nothing, writes down what the MAC of node 1 does."""

    def __init__(self, busy=False, **config):
        self.env = simpy.Environment()
        self.clock = Clock(self.env)
        self.is_busy = busy
        self.assessed, self.sent, self.done_with, self.got, self.turned = [], [], [], [], []
        self.mac = CsmaCa(self.clock, self, CsmaCaConfig(**config), 1, np.random.default_rng(5))
        self.radio = Radio(1, np.random.default_rng(6), self.mac)
        self.mac.connect(self.radio, self)

    def busy(self, radio):
        self.assessed.append(self.env.now)
        return self.is_busy

    def turn(self, radio):
        self.turned.append(self.env.now)
        radio.deaf_until_ns = 2**63

    def transmit(self, frame):
        self.sent.append((self.env.now, decode_frame(frame.mpdu)))

        def end():
            self.radio.deaf_until_ns = self.env.now + TURN_NS
            self.mac.sent(frame)

        self.clock.call(air_time_ns(len(frame.mpdu)), end, first=True)

    def silence(self, radio):
        pass

    def received(self, payload, source, cargo):
        self.got.append((payload, source, cargo))

    def done(self, outcome):
        self.done_with.append((self.env.now, outcome))

    def hear(self, time_ns, frame, cargo=None):
        address = frame.destination if isinstance(frame, MacData) else 1
        kind = "data" if isinstance(frame, MacData) else "ack"
        transmission = Transmission(2, frame.encode(), address, (), kind, cargo=cargo)
        self.clock.call(time_ns - self.env.now, lambda: self.mac.received(transmission), first=True)


def for_us(sequence, to=1, ack_request=True):
    return MacData(sequence, 0xCAFE, to, 2, b"hello", ack_request)


def test_a_channel_that_stays_busy_is_tried_five_times_with_growing_backoffs():
    stand, waits = Stand(busy=True), []
    for _ in range(300):
        start, before = stand.env.now, len(stand.assessed)
        stand.mac.submit(b"x", 2, (2,), None)
        stand.env.run()
        waits.append((np.diff([start, *stand.assessed[before:]]) - CCA_NS) / SLOT_NS)
    assert [outcome for _, outcome in stand.done_with] == [Outcome.CHANNEL] * 300
    assert not stand.sent
    waits = np.array(waits)
    assert waits.shape == (300, 5)
    assert np.all(waits == np.round(waits))
    assert waits.min(axis=0).tolist() == [0] * 5
    assert waits.max(axis=0).tolist() == [7, 15, 31, 31, 31]


def test_an_unanswered_frame_is_sent_four_times():
    stand = Stand()
    stand.mac.submit(b"x", 2, (2,), None)
    stand.env.run()
    assert [outcome for _, outcome in stand.done_with] == [Outcome.NO_ACK]
    assert [frame.sequence for _, frame in stand.sent] == [stand.sent[0][1].sequence] * 4
    air = air_time_ns(12)
    for (first, _), (second, _) in pairwise(stand.sent):
        slots = (second - first - air - ACK_WAIT_NS - CCA_NS - TURN_NS) / SLOT_NS
        assert slots in range(8)
    assert stand.done_with[0][0] == stand.sent[-1][0] + air + ACK_WAIT_NS


def test_a_broadcast_is_sent_once_and_waits_for_nobody():
    stand = Stand()
    stand.mac.submit(b"x", BROADCAST, (), None)
    stand.env.run()
    ((start, frame),) = stand.sent
    assert frame.destination == BROADCAST
    assert not frame.ack_request
    assert stand.done_with == [(start + air_time_ns(12), None)]


@pytest.mark.parametrize("right", [True, False])
def test_an_acknowledgement_of_another_frame_fails_the_attempt_at_once(right):
    stand = Stand(max_frame_retries=0)
    stand.mac.submit(b"x", 2, (2,), None)
    while not stand.sent:
        stand.env.step()
    start, frame = stand.sent[0]
    answered = start + air_time_ns(12) + TURN_NS + 352_000
    stand.hear(answered, MacAck(frame.sequence if right else (frame.sequence + 1) % 256))
    stand.env.run()
    assert stand.done_with == [(answered, None if right else Outcome.NO_ACK)]


def test_a_frame_is_answered_after_the_turnaround_and_passed_up_once():
    stand = Stand()
    for repeat in range(3):
        stand.hear(1_000_000 + repeat * 10_000_000, for_us(9), cargo=repeat)
    stand.env.run()
    assert stand.got == [(b"hello", 2, 0)]
    assert stand.sent == [(1_000_000 + r * 10_000_000 + TURN_NS, MacAck(9)) for r in range(3)]
    stand.hear(stand.env.now + 600_000_000, for_us(9), cargo="new")
    stand.env.run()
    assert stand.got[1:] == [(b"hello", 2, "new")]


def test_broadcasts_are_not_answered():
    stand = Stand()
    stand.hear(1000, for_us(9, to=BROADCAST, ack_request=False))
    stand.env.run()
    assert stand.got
    assert not stand.sent


def test_a_frame_heard_during_backoff_is_answered_first_and_csma_begins_anew():
    stand = Stand(min_be=5, max_be=5, busy=True)
    stand.mac.submit(b"x", 2, (2,), None)
    while len(stand.assessed) < 4:
        stand.env.step()
    stand.is_busy = False
    heard = stand.env.now + 1
    stand.hear(heard, for_us(3))
    while not stand.sent:
        stand.env.step()
    assert stand.sent == [(heard + TURN_NS, MacAck(3))]
    answered = heard + TURN_NS + 352_000
    stand.is_busy = True
    stand.env.run()
    # five more assessments: the count of busy channels began anew, after the way back to receiving
    assert len(stand.assessed) == 4 + 5
    assert (stand.assessed[4] - answered - TURN_NS - CCA_NS) % SLOT_NS == 0
    assert [outcome for _, outcome in stand.done_with] == [Outcome.CHANNEL]


def test_a_frame_heard_while_waiting_for_an_acknowledgement_costs_the_attempt():
    stand = Stand(max_frame_retries=1)
    stand.mac.submit(b"x", 2, (2,), None)
    while not stand.sent:
        stand.env.step()
    heard = stand.sent[0][0] + air_time_ns(12) + 800_000
    stand.hear(heard, for_us(3))
    stand.env.run()
    kinds = [type(frame).__name__ for _, frame in stand.sent]
    assert kinds == ["MacData", "MacAck", "MacData"]
    assert [outcome for _, outcome in stand.done_with] == [Outcome.NO_ACK]
    assert stand.mac.counters.frames_retried == 1


def test_after_stop_nothing_happens():
    stand = Stand()
    stand.mac.submit(b"x", 2, (2,), None)
    stand.hear(50, for_us(3))
    stand.clock.call(60, stand.mac.stop)
    stand.env.run()
    assert not stand.sent
    assert not stand.done_with
