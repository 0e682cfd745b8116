"""Saturated senders round a base by a second hand: the protocol alone, without medium, radios or event clock.

Everybody hears everybody, whatever overlaps is lost, and the channel is assessed over the whole window. Times
in microseconds; senders begin at random instants, so that no two events of different senders fall together.
"""

import heapq

import numpy as np
import pytest

from wsnsim.claims.network.runs import Case, run

BACKOFF, CCA, TURN, AIR, ACK_AIR, ACK_WAIT, LIFS = 320, 128, 192, 3744, 352, 864, 640
MIN_BE, MAX_BE, MAX_BACKOFFS, MAX_RETRIES = 3, 5, 4, 3


class Sender:
    def __init__(self):
        self.tries = self.busy = 0
        self.exponent = MIN_BE
        self.arrived = False


class Star:
    """Senders round a base that always have a packet of 100 B."""

    def __init__(self, senders, seed):
        self.rng = np.random.default_rng(seed)
        self.senders = [Sender() for _ in range(senders)]
        self.events, self.count = [], 0
        self.air = []  # [begin, end, spoiled] of what is or was lately on the air
        self.base_deaf_until = 0.0
        self.looked = self.found_busy = self.attempts = self.failed = self.delivered = 0
        for sender in self.senders:
            self.contend(sender, self.rng.uniform(0, 10_000))

    def at(self, time, action, *given):
        self.count += 1
        heapq.heappush(self.events, (time, self.count, action, given))

    def run(self, until):
        while self.events[0][0] < until:
            time, _, action, given = heapq.heappop(self.events)
            action(time, *given)

    def contend(self, sender, time):
        sender.busy, sender.exponent = 0, MIN_BE
        self.back_off(sender, time)

    def back_off(self, sender, time):
        periods = int(self.rng.integers(1 << sender.exponent))
        self.at(time + periods * BACKOFF + CCA, self.assess, sender)

    def assess(self, time, sender):
        self.air = [frame for frame in self.air if frame[1] > time - 2 * AIR]
        self.looked += 1
        if not any(begin < time and end > time - CCA for begin, end, _ in self.air):
            self.at(time + TURN, self.send, sender)
            return
        self.found_busy += 1
        sender.busy += 1
        if sender.busy > MAX_BACKOFFS:
            self.next_packet(sender, time)
        else:
            sender.exponent = min(sender.exponent + 1, MAX_BE)
            self.back_off(sender, time)

    def put(self, time, length):
        frame = [time, time + length, False]
        for other in self.air:
            if other[1] > time:
                other[2] = frame[2] = True
        self.air.append(frame)
        return frame

    def send(self, time, sender):
        self.attempts += 1
        sender.tries += 1
        heard = time >= self.base_deaf_until
        self.at(time + AIR, self.sent, sender, self.put(time, AIR), heard)

    def sent(self, time, sender, frame, heard):
        if heard and not frame[2]:
            if not sender.arrived:
                self.delivered += 1
            sender.arrived = True
            self.base_deaf_until = time + TURN + ACK_AIR + TURN
            self.at(time + TURN, self.answer, sender)
        else:
            self.at(time + ACK_WAIT, self.unanswered, sender)

    def answer(self, time, sender):
        self.at(time + ACK_AIR, self.answered, sender, self.put(time, ACK_AIR))

    def answered(self, time, sender, ack):
        if ack[2]:
            self.at(time - TURN - ACK_AIR + ACK_WAIT, self.unanswered, sender)
        else:
            self.next_packet(sender, time + LIFS)

    def unanswered(self, time, sender):
        self.failed += 1
        if sender.tries > MAX_RETRIES:
            self.next_packet(sender, time)
        else:
            self.contend(sender, time)

    def next_packet(self, sender, time):
        sender.tries, sender.arrived = 0, False
        self.contend(sender, time)


def oracle(senders, seconds, seeds):
    """Return throughput [kbit/s], busy assessments and failed attempts, one row a seed."""
    rows = []
    for seed in range(seeds):
        star = Star(senders, seed)
        star.run(seconds * 1e6)
        kbps = 0.8 * star.delivered / seconds
        rows.append((kbps, star.found_busy / star.looked, star.failed / star.attempts))
    return np.array(rows)


@pytest.mark.parametrize(
    ("senders", "seconds", "kbps", "busy", "fails"),
    [
        (1, 5.0, 125.63, 0.0, 0.0),
        (2, 10.0, 122.2, 0.547, 0.168),
        (5, 10.0, 113.6, 0.797, 0.412),
        (10, 6.0, 97.2, 0.879, 0.629),
        (20, 3.0, 66.0, 0.920, 0.845),
    ],
)
def test_it_is_the_known_monte_carlo(senders, seconds, kbps, busy, fails):
    """One standard error of eight runs is at most .6 kbit/s, .0025 and .005."""
    ours = oracle(senders, seconds, 8).mean(axis=0)
    assert ours[0] == pytest.approx(kbps, abs=1.5)
    assert ours[1] == pytest.approx(busy, abs=0.0075)
    assert ours[2] == pytest.approx(fails, abs=0.015)


@pytest.mark.parametrize("senders", [3, 7])
def test_the_simulator_agrees_where_nobody_has_looked(senders):
    # how senders' clocks stand to each other holds for a run: many short ones tell more
    seeds, seconds = 20, 1.5
    theirs = oracle(senders, seconds, seeds)
    case = Case(f"star_n{senders}", None, seconds, "destructive", "whole_window")
    runs = [run(case, seed) for seed in range(seeds)]
    ours = np.array(
        [[each[key] for key in ("throughput_kbps", "cca_busy", "attempt_fails")] for each in runs]
    )
    standard_error = np.hypot(ours.std(axis=0, ddof=1), theirs.std(axis=0, ddof=1)) / np.sqrt(seeds)
    # Student's 0.1 % of some thirty degrees of freedom
    assert np.all(np.abs(ours.mean(axis=0) - theirs.mean(axis=0)) < 3.7 * standard_error)
    assert np.all(3.7 * standard_error < [6.0, 0.03, 0.06])
