"""Links from files: TOSSIM topologies, reception ratios and k7 traces, and runs over them.

Real data: TOSSIM's mica2 grid (Zuniga, Krishnamachari); Grenoble, 50 motes (6TiSCH simulator).
"""

# ruff: noqa: E501  (an error is one line, here as on the screen)

import gzip
import json
import math
import re

import numpy as np
import pytest
import simpy
from scipy.stats import binomtest, chi2

from wsnsim.errors import ScenarioError
from wsnsim.net.channel.recorded import ConstantLosses, RecordedLosses, Track
from wsnsim.net.clock import Clock
from wsnsim.net.config import RadioConfig
from wsnsim.net.phy.base import Transmission
from wsnsim.net.phy.ieee802154 import O_QPSK
from wsnsim.net.phy.medium import Medium
from wsnsim.net.routing.linkquality import weakest_usable_dbm
from wsnsim.rng import RandomStreams
from wsnsim.scenario.load import load_scenario, scenario_from_dict
from wsnsim.sim.build import build
from wsnsim.sim.channels import run_channel, run_links
from wsnsim.sim.link_files import read_gains, read_k7, read_noise, read_ratios

NODES = ("a", "b", "base")
GAINS = """\
# a chain
gain 0 1 -60
gain\tb\ta\t-61.5
gain 1 2 -70.0

gain 2 1 -72
noise 0 -105.5 4.0
noise base -100 0
"""
RATIOS = """\
from,to,prr
0,1,0.75
b,a,1
1,base,0.5
2,1,0.25
a,base,0
"""
HEADER = '{"node_count": 3, "channels": [11, 26]}\ndatetime,src,dst,channel,mean_rssi,pdr,tx_count\n'
RECORDS = """\
2018-01-11T16:32:22.0,0,1,26,-70.0,1.0,100
2018-01-11T16:32:22.0,0,1,11,-99.0,0.1,100
2018-01-11T16:32:22.0,1,2,26,-94.0,0.5,100
2018-01-11T16:42:22.0,0,1,26,-72.0,0.75,100
2018-01-11T16:52:22.0,0,1,26,-74.0,0.5,100
2018-01-11T16:52:22.0,1,2,26,nan,0.25,100
2018-01-11T16:52:22.0,1,0,26,-80.0,nan,100
2018-01-11T17:02:22.0,0,1,26,-76.0,0.0,100
"""
"""A round every ten minutes; the link from 1 to 2 is silent in the second and the last."""
ALPHA = 1e-3


@pytest.fixture
def write(tmp_path):
    def make(content, name="links.txt"):
        path = tmp_path / name
        path.write_text(content)
        return path

    return make


def scenario(propagation, **network):
    nodes = [{"id": name, "position_m": [10.0 * at, 0, 1]} for at, name in enumerate(NODES[:-1])]
    return {
        "duration_s": 5,
        "motes": {"nodes": nodes, "base": {"position_m": [20, 0, 1]}},
        "network": {"propagation": propagation, **network},
        "system": {"kind": "traffic", "payload_bytes": 20},
    }


def links_of(loaded):
    return run_links(loaded.scenario, dict.fromkeys(NODES, (0.0, 0.0, 1.0)), RandomStreams(0))


def lines(call, *arguments):
    """Return what an error says, without the folder."""
    with pytest.raises(ScenarioError) as raised:
        call(*arguments)
    return [str(problem).rpartition("/")[2] for problem in raised.value.problems]


def test_gains_by_hand(write):
    table = read_gains(write(GAINS), NODES, None)
    found = dict(
        zip(zip(table.senders.tolist(), table.receivers.tolist(), strict=True), table.gain_db, strict=True)
    )
    assert found == {(0, 1): -60.0, (1, 0): -61.5, (1, 2): -70.0, (2, 1): -72.0}
    assert np.array_equal(table.floors_dbm, [-105.5, np.nan, -100.0], equal_nan=True)
    assert np.array_equal(table.noise_sd_db, [4.0, np.nan, 0.0], equal_nan=True)


def test_gains_become_links_and_noise_of_a_run(write):
    network = {"noise": {"kind": "link_table"}, "tx_power_dbm": -5.0, "noise_dbm": -101.0}
    loaded = scenario_from_dict(scenario({"kind": "link_table", "file": str(write(GAINS))}, **network))
    links = links_of(loaded)
    assert [links.arriving_dbm(*pair) for pair in ((0, 1), (1, 0), (2, 1), (0, 2))] == [
        -65.0,
        -66.5,
        -77.0,
        -math.inf,
    ]
    assert build(loaded).tree.parent == {"a": "b", "b": "base", "base": None}
    channel = run_channel(loaded.scenario, dict.fromkeys(NODES, (0.0, 0.0, 1.0)), RandomStreams(0))
    assert 10 * math.log10(channel.noise.level_mw(2, 10**9)) == pytest.approx(-100.0)
    # a node without a line has the scenario's noise
    assert 10 * math.log10(channel.noise.level_mw(1, 10**9)) == pytest.approx(-101.0)
    assert channel.noise.level_mw(0, 0) != channel.noise.level_mw(0, 10**6)


def test_nodes_may_be_some_of_a_files_motes(write):
    labels = {"base": "1", "a": "0", "b": "2"}
    table = read_gains(
        write(GAINS.replace("b\ta", "1\t0").replace("base", "2") + "gain 7 1 -50\n"), NODES, labels
    )
    ends = set(zip(table.senders.tolist(), table.receivers.tolist(), strict=True))
    assert ends == {(0, 2), (2, 0), (2, 1), (1, 2)}
    assert (
        lines(read_gains, write(GAINS), NODES, {"a": "0", "b": "b", "base": "x9"})[-1]
        == 'links.txt: must have a mote "x9", has none'
    )


def test_labels_must_be_those_of_nodes_each_of_another(write):
    file = write(GAINS)
    propagation = {"kind": "link_table", "file": str(file), "nodes": {"a": 0, "b": "1", "base": 2}}
    loaded = scenario_from_dict(
        scenario({**propagation, "file": str(write(GAINS.replace("b", "1").replace("1ase", "2")))})
    )
    assert links_of(loaded).arriving_dbm(0, 1) == -60.0
    labels = {"a": 0, "bb": 1, "base": "0"}
    assert lines(read_gains, file, NODES, labels) == [
        'network.propagation.nodes.bb: must be the name of a node, got "bb"; did you mean "b"?',
        'network.propagation.nodes.base: must be another mote than that of "a", got 0',
    ]


def test_what_is_wrong_with_gains_is_told_with_its_place(write):
    text = "gain 0 1 -60\ngain 0 1 -61\ngain 0 9 -60\ngain 1 1 -3\ngain 1 0 5\ngain 1 2 nan\nwall 1 2 3\nnoise 0 -100 -1\ngain 2 0\n"
    unknown = "; if the file has more motes than the run, say under network.propagation.nodes which of them are its nodes"
    assert lines(read_gains, write(text), NODES, None) == [
        "links.txt:2:1: must be given once, stands in line 1 too",
        f'links.txt:3:8: must be a node by its name, or by its place from 0, got "9"{unknown}',
        "links.txt:4:1: must lead from one node to another, got one to itself",
        "links.txt:5:10: gain: must be 0 dB or less, got 5",
        "links.txt:6:10: gain: must be a finite number, got 'nan'",
        'links.txt:7:1: must be `gain FROM TO DB` or `noise NODE FLOOR SD`, got "wall 1 2 3"',
        "links.txt:8:14: SD: must be 0 dB or more, got -1",
        'links.txt:9:1: must be `gain FROM TO DB` or `noise NODE FLOOR SD`, got "gain 2 0"',
    ]
    assert lines(read_gains, write("# nothing\n"), NODES, None) == [
        "links.txt: must have a gain between nodes of the run, got none"
    ]


def test_ratios_by_hand_become_losses_and_clear_links(write):
    file = write(RATIOS, "links.csv")
    table = read_ratios(file, NODES, None)
    assert table.ratios.tolist() == [0.75, 1.0, 0.5, 0.25, 0.0]
    loaded = scenario_from_dict(scenario({"kind": "link_table", "file": str(file), "power_dbm": -99.0}))
    channel = run_channel(loaded.scenario, dict.fromkeys(NODES, (0.0, 0.0, 1.0)), RandomStreams(0))
    links = channel.links
    # too weak a power is raised to what the radio receives without errors; a ratio of 0 is no link
    clear_dbm = weakest_usable_dbm(O_QPSK, RadioConfig(), 1.0 - 1e-6)
    assert set(links.power_dbm.tolist()) == {clear_dbm}
    assert links.delivery.tolist() == [0.75, 1.0, 0.5, 0.25]
    assert channel.losses.log_success(0, 1, 5) == math.log(0.75)
    assert channel.losses.log_success(1, 0, 5) == 0.0


def test_routes_know_the_ratios(write):
    good = "from,to,prr\n" + "".join(f"{i},{j},0.95\n{j},{i},0.95\n" for i, j in ((0, 1), (1, 2)))
    file = write(good + "0,2,0.6\n2,0,0.6\n", "links.csv")
    propagation = {"kind": "link_table", "file": str(file)}
    chain = {"a": "b", "b": "base", "base": None}
    assert build(scenario_from_dict(scenario(propagation))).tree.parent == chain
    least = {"kind": "min_hop_tree", "link_success_min": 0.5}
    star = {"a": "base", "b": "base", "base": None}
    assert build(scenario_from_dict(scenario(propagation, routing=least))).tree.parent == star
    # 1 / 0.6² is more than 2 / 0.95²
    assert build(scenario_from_dict(scenario(propagation, routing={"kind": "etx_tree"}))).tree.parent == chain


def test_isolated_motes_are_named(write):
    propagation = {"kind": "link_table", "file": str(write("from,to,prr\n0,1,1\n1,0,1\n", "links.csv"))}
    (line,) = lines(build, scenario_from_dict(scenario(propagation)))
    assert "every node must reach the base 'base' over links that carry 90% of the longest frames" in line
    assert "node 'a' cannot: the nearest node that does is 'base'" in line
    assert "links are those of the file, wherever nodes stand" in line


def test_wrong_labels_are_told_with_their_place_in_the_scenario(write, tmp_path):
    data = scenario({"kind": "link_table", "file": str(write(GAINS)), "nodes": {"a": 0, "bb": 1}})
    file = tmp_path / "scenario.yaml"
    file.write_text(json.dumps(data), encoding="utf-8")
    (line,) = lines(build, load_scenario(file))
    assert re.match(r"scenario\.yaml:1:\d+: network\.propagation\.nodes\.bb: must be the name", line)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("", "links.csv: must begin with the columns from,to,prr, got nothing more"),
        ("a,b\n", 'links.csv:1:1: must be the columns from,to,prr, got "a,b"'),
        ("from,to,prr\n0,1,1.5\n", "links.csv:2:5: prr: must be 0 to 1, got 1.5"),
        ("from,to,prr\n0,1,-0.5\n", "links.csv:2:5: prr: must be 0 to 1, got -0.5"),
        ("from,to,prr\n0,1,\n", "links.csv:2:5: prr: must be a finite number, got ''"),
        ("from,to,prr\n0,1,inf\n", "links.csv:2:5: prr: must be a finite number, got 'inf'"),
        ("from,to,prr\n", "links.csv: must have a link between nodes of the run, got none"),
    ],
)
def test_ratios_that_are_none(write, text, found):
    assert lines(read_ratios, write(text, "links.csv"), NODES, None) == [found]


def test_noise_by_the_table_needs_one():
    message = "network: noise by link_table needs a propagation of that kind, whose file gives it"
    assert lines(scenario_from_dict, scenario({}, noise={"kind": "link_table"})) == [message]


def test_a_noise_trace_of_a_run(write):
    levels = np.random.default_rng(0).integers(-98, -90, 500)
    file = write("\n".join(map(str, levels)), "noise.txt")
    loaded = scenario_from_dict(scenario({}, noise={"kind": "trace", "file": str(file)}))
    channel = run_channel(loaded.scenario, dict.fromkeys(NODES, (0.0, 0.0, 1.0)), RandomStreams(0))
    found = {round(10 * math.log10(channel.noise.level_mw(0, at * 10**6)), 6) for at in range(2000)}
    assert found <= {float(each) for each in levels}
    assert lines(read_noise, write("-98\n\n-97\n", "noise.txt")) == [
        "noise.txt: must have more than 20 samples of noise, got 2"
    ]
    assert lines(read_noise, write("-98\n\nx\n", "noise.txt")) == [
        "noise.txt:3:1: noise: must be a finite number, got 'x'"
    ]


def test_a_recording_by_hand(write):
    records = read_k7(write(HEADER + RECORDS, "t.k7"), NODES, None, 26)
    assert set(records) == {(0, 1), (1, 2)}
    assert records[0, 1].times_s.tolist() == [0.0, 600.0, 1200.0, 1800.0]
    assert records[0, 1].ratios.tolist() == [1.0, 0.75, 0.5, 0.0]
    assert records[1, 2].times_s.tolist() == [0.0, 1200.0]
    assert np.array_equal(records[1, 2].rssi_dbm, [-94.0, np.nan], equal_nan=True)


def test_the_nearest_record_holds_and_the_recording_goes_round(write):
    file = write(HEADER + RECORDS, "t.k7")
    loaded = scenario_from_dict(scenario({"kind": "recorded", "file": str(file), "start_s": 600.0}))
    channel = run_channel(loaded.scenario, dict.fromkeys(NODES, (0.0, 0.0, 1.0)), RandomStreams(0))

    def ratio(time_s, sender=0, receiver=1):
        return math.exp(channel.losses.log_success(sender, receiver, round((time_s - 600.0) * 1e9)))

    # rounds of 600 s, so that the recording is 2400 s long
    for time_s, expected in [
        (600, 0.75),
        (299, 1),
        (301, 0.75),
        (900, 0.75),
        (901, 0.5),
        (1499, 0.5),
        (1800, 0),
    ]:
        assert ratio(time_s + 2400.0) == pytest.approx(expected)
        assert ratio(time_s + 4800.0) == pytest.approx(expected)
    # the end is nearer to the beginning than to the last record
    assert ratio(2099.0) == 0.0
    assert ratio(2101.0) == 1.0
    # nothing was heard of the other link in the second and the last round: half a round from its records it is gone
    for time_s, expected in [
        (0, 0.5),
        (329, 0.5),
        (331, 0),
        (600, 0),
        (869, 0),
        (871, 0.25),
        (1529, 0.25),
        (1531, 0),
        (1800, 0),
    ]:
        assert ratio(time_s + 2400.0, 1, 2) == pytest.approx(expected)
    # what was never recorded is no link
    assert ratio(3000.0, 2, 0) == 0.0
    links = channel.links
    assert links.arriving_dbm(0, 1) == pytest.approx(-73.0)
    # -94 dBm, its only RSSI, is raised to what the radio receives without errors
    assert links.arriving_dbm(1, 2) == weakest_usable_dbm(O_QPSK, RadioConfig(), 1.0 - 1e-6)
    assert links.arriving_dbm(1, 2) > -93.9
    assert links.arriving_dbm(1, 0) == -math.inf
    assert links.delivery.tolist() == pytest.approx([0.5625, 0.375])


def test_a_longer_gap_may_be_bridged(write):
    file = write(HEADER + RECORDS, "t.k7")
    propagation = {"kind": "recorded", "file": str(file), "gap_s": 1e5}
    channel = run_channel(
        scenario_from_dict(scenario(propagation)).scenario,
        dict.fromkeys(NODES, (0.0, 0.0, 1.0)),
        RandomStreams(0),
    )
    assert math.exp(channel.losses.log_success(1, 2, 599 * 10**9)) == pytest.approx(0.5)
    assert math.exp(channel.losses.log_success(1, 2, 601 * 10**9)) == pytest.approx(0.25)


def test_a_link_that_was_recorded_once_is_always_like_that(write):
    text = HEADER + "2018-01-11T16:32:22.0,0,1,26,-70.0,0.5,100\n"
    loaded = scenario_from_dict(scenario({"kind": "recorded", "file": str(write(text, "t.k7"))}))
    channel = run_channel(loaded.scenario, dict.fromkeys(NODES, (0.0, 0.0, 1.0)), RandomStreams(0))
    for now_ns in (0, 10**8, 10**13 + 7):
        assert channel.losses.log_success(0, 1, now_ns) == math.log(0.5)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("", 't.k7:1:1: must begin with a line of JSON, got ""'),
        ("[1]\n", 't.k7:1:1: must begin with a line of JSON, got "[1]"'),
        (
            "{}\n",
            "t.k7: must begin with the columns datetime,src,dst,channel,mean_rssi,pdr,tx_count, got nothing more",
        ),
        (HEADER, "t.k7: must have a record between nodes of the run, got none"),
        (
            HEADER + RECORDS.replace(",26,", ",15,"),
            "t.k7: must hold records on channel 26, got channels 11, 15",
        ),
        (HEADER + "2018-01-11T16:32:22.0,0,1,26,-70.0,1.2,100\n", "t.k7:3:36: pdr: must be 0 to 1, got 1.2"),
        (
            HEADER + "yesterday,0,1,26,-70.0,1,100\n",
            't.k7:3:1: datetime: must be an ISO 8601 time, got "yesterday"',
        ),
        (
            HEADER + "2018-01-11T16:32:22.0,0,1,26,x,1,100\n",
            "t.k7:3:30: mean_rssi: must be a finite number, got 'x'",
        ),
    ],
)
def test_recordings_that_are_none(write, text, found):
    assert lines(read_k7, write(text, "t.k7"), NODES, None, 26) == [found]


def test_a_file_that_is_not_packed_is_told(write):
    (line,) = lines(read_k7, write("plain", "t.k7.gz"), NODES, None, 26)
    assert line.startswith("t.k7.gz: must be a readable k7 trace, got: ")


class Ear:
    awaits_ack = False

    def __init__(self, at, counts):
        self.at, self.counts = at, counts

    def received(self, transmission):
        self.counts[transmission.sender, self.at] += 1

    def sent(self, transmission):
        pass


def replayed(channel, frames, seed):
    """Return how many of `frames` get through on each link, one frame on the air at a time."""
    env = simpy.Environment()
    clock = Clock(env)
    pairs = list(zip(channel.links.senders.tolist(), channel.links.receivers.tolist(), strict=True))
    counts = dict.fromkeys(pairs, 0)
    medium = Medium(clock, O_QPSK, RadioConfig(), channel)
    streams = RandomStreams(seed)
    radios = [medium.add(streams.stream("ear", at), Ear(at, counts)) for at in range(channel.links.nodes)]

    def send(number):
        sender, receiver = pairs[number % len(pairs)]
        medium.turn(radios[sender])
        medium.transmit(Transmission(sender, bytes(20), receiver, (receiver,), "data"))
        if number + 1 < frames * len(pairs):
            clock.call(2_000_000, lambda: send(number + 1))

    clock.call(0, lambda: send(0))
    env.run()
    return counts


def check_replay(counts, ratios, frames):
    """Make sure that each link's count is within its binomial interval, and all together are as they must be.

    One link in a thousand runs may be outside (Bonferroni over all links); the squared deviations of
    links that are neither always nor never there have a chi-square law.
    """
    squares, random = 0.0, 0
    for pair, ratio in ratios.items():
        if ratio in (0.0, 1.0):
            assert counts[pair] == ratio * frames
            continue
        assert binomtest(counts[pair], frames, ratio).pvalue > ALPHA / len(ratios), pair
        if min(ratio, 1.0 - ratio) * frames >= 5.0:
            squares += (counts[pair] - frames * ratio) ** 2 / (frames * ratio * (1.0 - ratio))
            random += 1
    # the variance of such a square is 2 + (1 - 6 p q) / (n p q), up to a tenth more here
    assert chi2.ppf(ALPHA / 10, random) < squares < chi2.ppf(1 - ALPHA / 10, random)
    return random


def made_up(motes, rounds, seed):
    """Return a k7 trace of ratios of every kind, and the ratios (rounds, motes, motes)."""
    ratios = np.random.default_rng(seed).choice(
        [0.0, 0.02, 0.3, 0.5, 0.77, 0.96, 1.0], (rounds, motes, motes)
    )
    rows = [
        f"2018-01-{11 + step:02d}T00:00:00.0,{i},{j},26,-70,{ratios[step, i, j]},100\n"
        for step in range(rounds)
        for i in range(motes)
        for j in range(motes)
        if i != j
    ]
    return HEADER + "".join(rows), ratios


def channel_of(file, motes, **keys):
    names = [f"m{at}" for at in range(motes - 1)]
    data = scenario({"kind": "recorded", "file": str(file), **keys})
    data["motes"]["nodes"] = [{"id": name, "position_m": [at, 0, 1]} for at, name in enumerate(names)]
    loaded = scenario_from_dict(data)
    return run_channel(loaded.scenario, dict.fromkeys([*names, "base"], (0.0, 0.0, 1.0)), RandomStreams(0))


@pytest.mark.parametrize("step", [0, 2])
def test_replayed_links_deliver_what_was_recorded(write, step, test_seed):
    motes, frames = 12, 150
    text, ratios = made_up(motes, 3, test_seed)
    channel = channel_of(write(text, "t.k7"), motes, start_s=step * 86_400.0)
    pairs = zip(channel.links.senders.tolist(), channel.links.receivers.tolist(), strict=True)
    expected = {pair: float(ratios[(step, *pair)]) for pair in pairs}
    counts = replayed(channel, frames, test_seed)
    assert check_replay(counts, expected, frames) > 50
    # the round before would not pass for this one
    others = {pair: float(ratios[(step - 1, *pair)]) for pair in expected}
    with pytest.raises(AssertionError):
        check_replay(counts, others, frames)


def test_the_recorded_motes_of_grenoble(shared, test_seed):
    file, motes, frames = shared / "data/k7/grenoble_sim.k7.gz", 50, 60
    start_s = 7 * 9060.0
    channel = channel_of(file, motes, channel=20, start_s=start_s)
    with gzip.open(file, "rt") as text:
        rows = [line.split(",") for line in list(text)[2:]]
    times = np.array([np.datetime64(row[0]) for row in rows if row[3] == "20"])
    ends = [(int(row[1]), int(row[2])) for row in rows if row[3] == "20"]
    found = np.array([float(row[5]) for row in rows if row[3] == "20"])
    seconds = (times - times.min()) / np.timedelta64(1, "s")
    expected = {}
    for pair in dict.fromkeys(ends):
        own = np.array([each == pair for each in ends])
        apart = np.abs(seconds[own] - start_s)
        # within half a round, or nobody heard anything
        expected[pair] = float(found[own][apart.argmin()]) if apart.min() < 0.55 * 9060.0 else 0.0
    assert len(expected) > 300
    counts = replayed(channel, frames, test_seed)
    check_replay(counts, expected, frames)


def test_the_grid_of_tossim(shared):
    """Zuniga's generator: exponent 3, 4 dB of shadowing, and hardware with variances of 6.0 and 3.7 dB²."""
    file = shared / "data/tossim/topologies/15-15-tight-mica2-grid.txt"
    table = read_gains(file, [f"n{at}" for at in range(225)], None)
    assert len(table.senders) == 225 * 224
    assert table.noise_sd_db.tolist() == [4.0] * 225
    assert table.floors_dbm.mean() == pytest.approx(-105.0, abs=4 * math.sqrt(3.7 / 225))
    gains = np.zeros((225, 225))
    gains[table.senders, table.receivers] = table.gain_db
    # both directions share the shadowing; what differs is the sum of four offsets at most
    differences = (gains - gains.T)[np.triu_indices(225, 1)]
    assert 1.0 < differences.std() < 5.0


def test_losses_by_hand():
    losses = ConstantLosses.of(np.array([0, 1]), np.array([1, 0]), np.array([0.5, 0.0]))
    assert losses.log_success(0, 1, 0) == math.log(0.5)
    assert losses.log_success(1, 0, 0) == -math.inf
    assert losses.log_success(5, 6, 0) == 0.0
    track = RecordedLosses({(0, 1): Track([10, 20], [0.25, 0.75])}, length_ns=40, gap_ns=8)
    # of two as near the earlier counts; 28 is the last and 2 the first instant near enough
    found = [track.ratio(0, 1, now) for now in (0, 1, 2, 10, 15, 16, 28, 29, 42, 55)]
    assert found == [0.0, 0.0, 0.25, 0.25, 0.25, 0.75, 0.75, 0.0, 0.25, 0.25]
