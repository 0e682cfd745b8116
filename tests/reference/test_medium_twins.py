"""The compiled radio channel against its plain twin: random traffic, step by step, in all modes."""

import itertools
import os
import runpy
from pathlib import Path

import numpy as np
import pytest
import simpy

from wsnsim.net.channel.channel import Channel
from wsnsim.net.channel.links import Links
from wsnsim.net.clock import Clock
from wsnsim.net.config import RadioConfig
from wsnsim.net.phy.base import BROADCAST, Transmission
from wsnsim.net.phy.ieee802154 import O_QPSK
from wsnsim.net.phy.medium import Medium
from wsnsim.rng import RandomStreams

PlainMedium = runpy.run_path(str(Path(__file__).parent / "plain_medium.py"))["PlainMedium"]
SEED = int(os.environ.get("WSNSIM_TEST_SEED", "0"))
NODES, ACTIONS, TICK_NS = 9, 500, 16_000
CONFIG = {"noise_dbm": -100.0, "sensitivity_dbm": -97.0, "cca_threshold_dbm": -82.0}


class Blocks:
    """Fading: a factor for each link and half a millisecond, between -15 and +7 dB."""

    def gains(self, sender, receivers, now_ns):
        draws = [np.random.default_rng((sender, at, now_ns // 500_000)) for at in receivers.tolist()]
        return np.array([10 ** draw.uniform(-1.5, 0.7) for draw in draws])


class Steps:
    """Noise: a level for each receiver and millisecond; asked for in the order of time."""

    step_ns = 1_000_000

    def __init__(self):
        self.asked_ns = {}

    def level_mw(self, receiver, now_ns):
        assert now_ns >= self.asked_ns.get(receiver, 0)
        self.asked_ns[receiver] = now_ns
        return 10 ** np.random.default_rng((receiver, now_ns // self.step_ns)).uniform(-10.5, -7.5)


class Lossy:
    """Losses: a link fails half the time, or never."""

    def log_success(self, sender, receiver, now_ns):
        return np.log(0.5) if (sender + receiver) % 2 else 0.0


class Ear:
    def __init__(self, log, at):
        self.log, self.at, self.awaits_ack = log, at, False

    def received(self, frame):
        self.log("received", self.at, frame.sender, frame.kind)
        if frame.kind == "ack":
            self.awaits_ack = False

    def sent(self, frame):
        self.log("sent", self.at)
        self.awaits_ack = frame.kind == "data"

    def carrier(self, busy):
        self.log("carrier", self.at, busy)

    def overhear(self, frame):
        self.log("overheard", self.at, None if frame is None else frame.sender)


class Player:
    """Plays a script to a channel, and writes down what it does and says."""

    def __init__(self, kind, script, links, overhears, models, **config):
        self.env = simpy.Environment()
        self.clock, self.lines = Clock(self.env), []
        channel = Channel(links, *(None if model is None else model() for model in models))
        self.medium = kind(
            self.clock, O_QPSK, RadioConfig(**CONFIG | config), channel,
            lambda frame, at, sinr, what: self.log("frame", at, frame.sender, pytest.approx(sinr, 1e-5), what)
        )  # fmt: skip
        self.radios = []
        for at in range(NODES):
            ear = Ear(self.log, at)
            radio = self.medium.add(np.random.default_rng((SEED, at)), ear)
            if at in overhears:
                radio.overhear = ear.overhear
            self.radios.append(radio)
        for time_ns, *action in script:
            self.clock.call(time_ns, lambda action=action: self.play(*action))
        self.env.run()

    def log(self, *words):
        self.lines.append((self.clock.now, *words))

    def play(self, verb, at, to, length, kind):
        radio, medium = self.radios[at], self.medium
        if not radio.on or (radio.sending is not None and verb not in ("silence", "watch")):
            return
        if radio.asleep:
            if verb == "start":
                medium.start(radio)
            elif verb == "wake":
                medium.wake(radio)
            return
        if verb == "send":
            medium.turn(radio)
            medium.transmit(Transmission(at, bytes(length), to, (to,) if to != BROADCAST else (), kind))
        elif verb == "turn":
            medium.turn(radio)
        elif verb in ("busy", "watch"):
            self.log(verb, at, getattr(medium, verb)(radio))
        elif verb in ("sleep", "listen", "silence", "unwatch"):
            getattr(medium, verb)(radio)


def scripted(rng, gap_ns):
    """Return actions at random times, many at the very instants where frames begin, end and are assessed."""
    verbs = ["send", "busy", "turn", "listen", "sleep", "wake", "start", "watch", "unwatch", "silence"]
    odds = np.array([38, 30, 4, 6, 4, 8, 2, 5, 2, 0.15])
    ticks = np.cumsum(rng.geometric(TICK_NS / gap_ns, ACTIONS) - 1)
    script = []
    for tick in ticks.tolist():
        verb = str(rng.choice(verbs, p=odds / odds.sum()))
        at, other = (int(node) for node in rng.choice(NODES, 2, replace=False))
        kind = ("data", "data", "ack", "broadcast")[rng.integers(4)]
        to = BROADCAST if kind == "broadcast" else other
        length = 5 if kind == "ack" else int(rng.integers(5, 60))
        off_ns = int(rng.choice([0, 0, 0, 0, -1, 1]))
        script.append((max(0, tick * TICK_NS + off_ns), verb, at, to, length, kind))
    return script


def linked(rng):
    """Return links that are there or not, far and near, some of them of equal power."""
    power_dbm = rng.choice([-98.5, -96.5, -85.0, -83.0, -60.0], (NODES, NODES)) + rng.choice(
        [0.0, 0.37, 1.91], (NODES, NODES)
    )
    power_dbm[rng.random((NODES, NODES)) < 0.25] = -150.0
    return Links.from_matrix(power_dbm, -140.0)


MODES = list(itertools.product(("sinr", "destructive", "capture"), ("whole_window", "end_of_window")))
MODELS = [(None, None, None), (Blocks, None, None), (None, Steps, None), (None, None, Lossy)]


@pytest.mark.parametrize("gap_ns", [60_000, 400_000], ids=["dense", "sparse"])
@pytest.mark.parametrize(("collision", "cca"), MODES)
@pytest.mark.parametrize("models", MODELS, ids=["fixed", "fading", "noise", "losses"])
def test_both_channels_do_and_say_the_same(models, collision, cca, gap_ns):
    rng = RandomStreams(SEED).stream("tests.medium", len(collision), len(cca), gap_ns)
    seen = set()
    for _ in range(2):
        script, links = scripted(rng, gap_ns), linked(rng)
        overhears = (2, 5) if rng.random() < 0.5 else ()
        setting = {"collision": collision, "cca": cca}
        fast, plain = (
            Player(kind, script, links, overhears, models, **setting) for kind in (Medium, PlainMedium)
        )
        assert fast.lines == plain.lines
        now = fast.env.now
        for one, other in zip(fast.radios, plain.radios, strict=True):
            times = fast.medium.times(one).spent_ns(now)
            assert times == other.spent_ns(now)
            assert sum(times.values()) == now
            assert one.deaf_until_ns == other.deaf_until_ns
        seen |= {line[-1] for line in fast.lines} | {line[1] for line in fast.lines}
    assert {"corrupted", "missed", "carrier", "busy", True, False} <= seen
    assert "received" in seen or gap_ns < 100_000


@pytest.mark.parametrize("cca", ["whole_window", "end_of_window"])
@pytest.mark.parametrize("cut_ns", [0, 1, 64_000, 128_000])
@pytest.mark.parametrize("other_ns", [-1_000_000, -64_000, -1, 0, 1, 64_000])
@pytest.mark.parametrize("first_dbm", [-70.0, -84.0], ids=["alone", "together"])
def test_both_assess_a_frame_that_is_cut_off_alike(first_dbm, other_ns, cut_ns, cca):
    """A sender dies within the window, or at the very instant it begins; another frame is there too."""
    power_dbm = np.full((NODES, NODES), -150.0)
    power_dbm[0, 2], power_dbm[1, 2] = first_dbm, -84.0
    begin = 2_000_000
    script = [
        (0, "turn", 2, None, None, None),
        (begin + other_ns, "send", 1, BROADCAST, 40, "broadcast"),
        (begin, "send", 0, BROADCAST, 40, "broadcast"),
        (begin + cut_ns, "silence", 0, None, None, None),
    ]
    edges = {begin, begin + cut_ns, begin + other_ns, begin + other_ns + 192_000 + 40 * 32_000}
    for edge, shift, off in itertools.product(sorted(edges), (0, 128_000), (-1, 0, 1)):
        script.append((edge + shift + off, "busy", 2, None, None, None))
    script.sort(key=lambda action: action[0])
    links = Links.from_matrix(power_dbm, -140.0)
    setting = {"cca": cca, "cca_threshold_dbm": -82.0}
    fast, plain = (
        Player(kind, script, links, (), (None, None, None), **setting) for kind in (Medium, PlainMedium)
    )
    assert fast.lines == plain.lines
    heard = {line[-1] for line in fast.lines if line[1] == "busy"}
    assert heard == {False, True} or cut_ns == 0 or first_dbm < -82.0


def test_power_on_the_air_leaves_no_residue():
    """After any traffic, the sums of power are nothing again."""
    rng = RandomStreams(SEED).stream("tests.residue")
    player = Player(Medium, scripted(rng, 60_000), linked(rng), (), (Blocks, None, None))
    assert all(player.medium._states.arriving(at) == (0, 0) for at in range(NODES))
