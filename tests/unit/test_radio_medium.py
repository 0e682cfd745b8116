"""The channel by itself: scripted frames, one at a time or over each other."""

import math

import numpy as np
import pytest
import simpy

from wsnsim.net.channel.channel import Channel as Ether
from wsnsim.net.channel.links import Links
from wsnsim.net.channel.propagation import to_mw
from wsnsim.net.clock import Clock
from wsnsim.net.config import RadioConfig
from wsnsim.net.phy.base import BROADCAST, Transmission
from wsnsim.net.phy.ieee802154 import BIT_NS, O_QPSK
from wsnsim.net.phy.interference import survival
from wsnsim.net.phy.medium import Medium

AIR_NS = 3_744_000
"""Of a frame of 111 B."""


def log_success(sinr, bits):
    return O_QPSK.log_success(sinr, 0, round(bits * BIT_NS))


class Ear:
    awaits_ack = False

    def __init__(self, log, name):
        self.log, self.name = log, name

    def received(self, transmission):
        self.log.append((self.name, transmission.sender))

    def sent(self, transmission):
        self.log.append((self.name, "sent"))


class Channel:
    """Three radios, all within hearing at `power_dbm` unless a link is given."""

    def __init__(self, power_dbm=-60.0, links=None, nodes=3, **config):
        self.env = simpy.Environment()
        self.clock = Clock(self.env)
        power = np.full((nodes, nodes), power_dbm)
        for (one, other), dbm in (links or {}).items():
            power[one, other] = power[other, one] = dbm
        self.reports, self.heard = [], []
        config = RadioConfig(**{"noise_dbm": -107.0} | config)
        self.medium = Medium(
            self.clock, O_QPSK, config, Ether(Links.from_matrix(power)), lambda *row: self.reports.append(row)
        )
        self.radios = []
        for at in range(nodes):
            self.radios.append(self.medium.add(np.random.default_rng(at), Ear(self.heard, at)))

    def spent(self, at):
        """Return the nanoseconds that a node has spent in each state, those without any left out."""
        times = self.medium.times(self.radios[at]).spent_ns(self.env.now)
        assert sum(times.values()) == self.env.now
        return {state: spent for state, spent in times.items() if spent}

    def at(self, time_ns, action):
        self.env.timeout(time_ns - self.env.now).callbacks.append(lambda _: action())

    def frame(self, time_ns, sender, to, length=111):
        def begin():
            self.medium.turn(self.radios[sender])
            meant = (to,) if to != BROADCAST else ()
            self.medium.transmit(Transmission(sender, bytes(length), to, meant, "data"))

        self.at(time_ns, begin)

    def busy(self, time_ns, at):
        answers = []
        self.at(time_ns, lambda: answers.append(self.medium.busy(self.radios[at])))
        self.env.run()
        return answers[0]


def outcome(channel):
    channel.env.run()
    return {(frame.sender, at): what for frame, at, _, what in channel.reports}


def test_a_lone_frame_arrives_and_the_states_tell_of_it():
    channel = Channel()
    channel.frame(1000, 0, 1)
    assert outcome(channel) == {(0, 1): "received"}
    assert channel.heard == [(1, 0), (0, "sent")]
    assert channel.env.now == 1000 + AIR_NS
    assert channel.spent(0) == {"listen": 1000, "transmit": AIR_NS}
    for at in (1, 2):
        assert channel.spent(at) == {"listen": 1000, "receive": AIR_NS}


def test_too_weak_a_frame_is_not_noticed():
    channel = Channel(links={(0, 1): -95.1})
    channel.frame(0, 0, 1)
    assert outcome(channel) == {(0, 1): "missed"}


@pytest.mark.parametrize(("overlap_ns", "arrives"), [(0, True), (1, False), (AIR_NS // 2, False)])
def test_destructive_overlap_kills_however_short(overlap_ns, arrives):
    channel = Channel(collision="destructive")
    channel.frame(0, 0, 2)
    channel.frame(AIR_NS - overlap_ns, 1, BROADCAST)
    assert outcome(channel)[0, 2] == ("received" if arrives else "corrupted")


def test_destructive_needs_a_frame_that_could_be_heard():
    channel = Channel(links={(1, 2): -96.0}, collision="destructive")
    channel.frame(0, 0, 2)
    channel.frame(100_000, 1, BROADCAST)
    assert outcome(channel)[0, 2] == "received"


def test_the_first_frame_keeps_the_receiver():
    channel = Channel(links={(0, 2): -60.0, (1, 2): -63.0})
    channel.frame(0, 1, 2)
    channel.frame(1000, 0, 2)
    assert outcome(channel) == {(1, 2): "corrupted", (0, 2): "missed"}
    channel = Channel(links={(0, 2): -60.0, (1, 2): -63.0})
    channel.frame(0, 0, 2)
    channel.frame(1000, 1, 2)
    assert outcome(channel) == {(0, 2): "received", (1, 2): "missed"}


def test_a_frame_drowned_at_its_beginning_is_not_locked_on():
    channel = Channel(links={(1, 2): -80.0})
    channel.at(0, lambda: channel.medium.turn(channel.radios[2]))
    channel.frame(10, 2, BROADCAST, length=5)
    channel.frame(20, 0, 2)
    # node 2 hears again 192 µs after its short frame, while node 0's is still on the air
    channel.frame(1_000_000, 1, 2)
    assert outcome(channel) == {(0, 2): "missed", (1, 2): "missed"}
    assert "receive" not in channel.spent(2)


def test_stretches_multiply():
    """Half a frame at 0 dB: the success of 468 bits, within its standard error."""
    tries, arrived = 400, 0
    channel = Channel(links={(0, 2): -60.0, (1, 2): -60.0})
    for k in range(tries):
        channel.frame(k * 10_000_000, 0, 2)
        channel.frame(k * 10_000_000 + AIR_NS // 2, 1, BROADCAST)
    channel.env.run()
    arrived = sum(what == "received" for frame, _, _, what in channel.reports if frame.sender == 0)
    expected = math.exp(log_success(to_mw(-60) / (to_mw(-60) + to_mw(-107)), 468))
    assert abs(arrived / tries - expected) < 3.5 * math.sqrt(expected * (1 - expected) / tries)
    assert all(sinr == pytest.approx(0.0, abs=1e-3) for f, _, sinr, _ in channel.reports if f.sender == 0)


def test_a_radio_is_deaf_while_it_turns_back():
    for gap_ns, arrives in ((191_999, False), (192_000, True)):
        channel = Channel()
        channel.frame(0, 0, 1)
        channel.frame(AIR_NS + gap_ns, 1, 0)
        assert outcome(channel)[1, 0] == ("received" if arrives else "missed")


def test_a_radio_that_turns_gives_up_what_it_was_receiving():
    channel = Channel()
    channel.frame(0, 0, 1)
    channel.at(1_000_000, lambda: channel.medium.turn(channel.radios[1]))
    assert outcome(channel) == {(0, 1): "corrupted"}


@pytest.mark.parametrize(
    ("end_ns", "whole", "at_end"),
    [
        (-1, False, False),
        (0, False, False),
        (1, True, False),
        (127_999, True, False),
        (128_000, True, True),
    ],
)
def test_carrier_sense_of_a_frame_that_ends(end_ns, whole, at_end):
    """The window runs from 4 ms to 4.128 ms; the frame ends at 4 ms + `end_ns`."""
    for cca, busy in (("whole_window", whole), ("end_of_window", at_end)):
        channel = Channel(cca=cca)
        channel.frame(4_000_000 + end_ns - AIR_NS, 0, BROADCAST)
        assert channel.busy(4_128_000, 2) == busy


@pytest.mark.parametrize("cca", ["whole_window", "end_of_window"])
@pytest.mark.parametrize(("begin_ns", "busy"), [(0, True), (127_999, True), (128_000, False)])
def test_carrier_sense_of_a_frame_that_begins(cca, begin_ns, busy):
    channel = Channel(cca=cca)
    channel.frame(4_000_000 + begin_ns, 0, BROADCAST)
    assert channel.busy(4_128_000, 2) == busy


def test_carrier_sense_by_energy_alone():
    """A frame that began while the node was deaf counts by its power only."""
    for power_dbm, busy in ((-76.9, True), (-77.1, False)):
        channel = Channel(links={(0, 2): power_dbm})
        channel.frame(0, 2, BROADCAST, length=5)
        channel.frame(10_000, 0, BROADCAST)
        assert channel.busy(2_000_000, 2) == busy


def test_a_reception_in_progress_makes_the_channel_busy_at_any_power():
    channel = Channel(power_dbm=-90.0)
    channel.frame(0, 0, BROADCAST)
    assert channel.busy(2_000_000, 2)


@pytest.mark.parametrize("cca", ["whole_window", "end_of_window"])
def test_power_of_several_frames_adds_up(cca):
    """Two frames of -79 dBm are -76 dBm; the node was deaf as they began, so energy alone counts."""
    channel = Channel(links={(0, 2): -79.0, (1, 2): -79.0}, cca=cca)
    channel.frame(0, 2, BROADCAST, length=5)
    channel.frame(10_000, 0, BROADCAST)
    channel.frame(1_000_000, 1, BROADCAST)
    alone, both = [], []
    for time_ns, answers in ((900_000, alone), (1_100_000, both)):
        channel.at(time_ns, lambda answers=answers: answers.append(channel.medium.busy(channel.radios[2])))
    channel.env.run()
    assert (alone, both) == ([False], [True])


def test_survival_models():
    noise, loud = to_mw(-107), to_mw(-95)
    stretch = (400_000, 800_000, 0)
    sinr, destructive, capture = (
        survival(RadioConfig(collision=model, capture_db=3.0), O_QPSK)
        for model in ("sinr", "destructive", "capture")
    )
    assert sinr(1e-9, noise, 1e-9, True, stretch) == pytest.approx(log_success(1e-9 / (noise + 1e-9), 100.0))
    assert destructive(1e-3, noise, loud, True, stretch) == -math.inf
    assert destructive(1e-9, noise, loud, False, stretch) == sinr(1e-9, noise, loud, False, stretch)
    assert capture(1.99 * loud, noise, loud, True, stretch) == -math.inf
    assert capture(2.0 * loud, noise, loud, True, stretch) == sinr(2.0 * loud, noise, loud, True, stretch)
    assert capture(loud, noise, loud, False, stretch) == sinr(loud, noise, loud, False, stretch)


def test_a_silenced_sender_cuts_its_frame():
    channel = Channel()
    channel.frame(0, 0, 1)
    channel.at(1_000_000, lambda: channel.medium.silence(channel.radios[0]))
    channel.frame(1_000_000, 2, 1)
    assert outcome(channel) == {(0, 1): "corrupted", (2, 1): "received"}
    assert (0, "sent") not in channel.heard
    assert channel.spent(0) == {"transmit": 1_000_000, "sleep": AIR_NS}


@pytest.mark.parametrize(("stronger_db", "arrives"), [(2.9, False), (3.1, True)])
def test_in_capture_the_first_frame_survives_if_it_is_enough_stronger(stronger_db, arrives):
    channel = Channel(links={(0, 2): -60.0, (1, 2): -60.0 - stronger_db}, collision="capture")
    channel.frame(0, 0, 2)
    channel.frame(1_000_000, 1, 2)
    assert outcome(channel) == {(0, 2): "received" if arrives else "corrupted", (1, 2): "missed"}


@pytest.mark.parametrize(
    ("later_ns", "stronger_db", "takes_over"),
    [(0, 3.1, True), (160_000, 3.1, True), (160_001, 3.1, False), (160_000, 2.9, False)],
)
def test_in_capture_a_stronger_frame_takes_over_a_receiver_at_the_preamble(later_ns, stronger_db, takes_over):
    """The synchronisation header of 10 symbols is 160 us."""
    channel = Channel(links={(0, 2): -60.0, (1, 2): -60.0 + stronger_db}, collision="capture")
    channel.frame(1000, 0, 2)
    channel.frame(1000 + later_ns, 1, 2)
    what = ("corrupted", "received") if takes_over else ("corrupted", "missed")
    assert outcome(channel) == {(0, 2): what[0], (1, 2): what[1]}
    assert channel.spent(2)["receive"] == AIR_NS + (later_ns if takes_over else 0)


def test_capture_asks_for_more_than_the_sum_of_all_others():
    """4 dB above each of two is 1 dB above both."""
    links = {(0, 3): -60.0, (1, 3): -64.0, (2, 3): -64.0}
    for others, arrives in (((1,), True), ((1, 2), False)):
        channel = Channel(links=links, nodes=4, collision="capture")
        channel.frame(0, 0, 3)
        for other in others:
            channel.frame(1_000_000, other, BROADCAST)
        assert outcome(channel)[0, 3] == ("received" if arrives else "corrupted")


def test_who_watches_the_channel_hears_when_it_becomes_busy_and_idle():
    """Two frames overlap: busy from the begin of the first to the end of the second."""
    channel = Channel()
    told = []
    channel.radios[2].listener.carrier = lambda busy: told.append((channel.env.now, busy))
    assert channel.medium.watch(channel.radios[2]) is False
    channel.frame(1000, 0, BROADCAST)
    channel.frame(500_000, 1, BROADCAST)
    channel.frame(10_000_000, 1, BROADCAST)
    channel.at(9_000_000, lambda: channel.medium.unwatch(channel.radios[2]))
    channel.env.run()
    assert told == [(1000, True), (500_000 + AIR_NS, False)]


def test_a_sleeping_radio_hears_nothing_and_its_crystal_start_has_an_account_of_its_own():
    channel = Channel()
    radio = channel.radios[2]
    for time_ns, action in ((0, "sleep"), (4_000_000, "start"), (4_860_000, "wake")):
        channel.at(time_ns, lambda action=action: getattr(channel.medium, action)(radio))
    channel.frame(1000, 0, 2)
    channel.frame(4_859_999, 1, 2)
    channel.frame(9_000_000, 0, 2)
    channel.env.run()
    assert [what for *_, what in channel.reports] == ["missed", "missed", "received"]
    listened = 9_000_000 - 4_860_000
    assert channel.spent(2) == {
        "sleep": 4_000_000, "start": 860_000, "listen": listened, "receive": AIR_NS
    }  # fmt: skip
