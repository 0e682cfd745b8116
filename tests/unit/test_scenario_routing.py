"""`network.routing` and shadowing as a scenario writes them: what is built, and what is refused where."""

# ruff: noqa: E501  (an error is one line, here as on the screen)

import sys
from types import ModuleType

import numpy as np
import pytest

from wsnsim.errors import ScenarioError
from wsnsim.net.channel.links import links_between
from wsnsim.records import FrameRow, MemorySink
from wsnsim.rng import RandomStreams
from wsnsim.scenario.load import load_scenario
from wsnsim.scenario.resolved import resolved_yaml
from wsnsim.sim.build import build
from wsnsim.sim.propagations import node_propagation
from wsnsim.systems.base import Payload, Scope, Send, Step, System, SystemParams

TEXT = """\
duration_s: 1
world:
  size_m: [10, 8, 4]
  targets:
    - id: buoy
      shape: {kind: ellipsoid, semi_axes_m: [0.40, 0.28, 0.34]}
      motion: {kind: waypoints, points_m: [[3, 3, 1], [6, 5, 1]]}
cameras:
  - {id: c1, position_m: [0, 0, 3], look_at_m: [5, 4, 1]}
  - {id: c2, position_m: [10, 0, 3], look_at_m: [5, 4, 1]}
motes:
  nodes:
    - {id: relay, position_m: [17, 4, 3]}
  base: {position_m: [34, 4, 2]}
network:
  routing:
    kind: tree
    parents:
      c1: relay
      c2: relay
      relay: base
system: {kind: "quiet_tracker:SYSTEM"}
"""


class Word(Payload):
    kind, tag = "word", 1

    def encode(self):
        return b"\x01" * 50

    @classmethod
    def decode(cls, data):
        return cls()


class Talker:
    """Sends a message to the base at the start."""

    def __init__(self, node):
        self.node = node

    def on_start(self, ctx):
        return Step() if self.node == "base" else Step(sends=(Send(Scope.BASE, Word()),))

    def on_frame(self, ctx, frame):
        return Step()

    def on_payload(self, ctx, message):
        return Step()

    def on_timer(self, ctx, key):
        return Step()


@pytest.fixture(autouse=True)
def quiet_tracker(monkeypatch):
    module = ModuleType("quiet_tracker")
    module.SYSTEM = System(
        "quiet", "nobody", SystemParams, (Word,), lambda params, site, node, role: Talker(node)
    )
    monkeypatch.setitem(sys.modules, "quiet_tracker", module)


@pytest.fixture
def loaded(tmp_path):
    def load(*overrides, text=TEXT):
        file = tmp_path / "s.yaml"
        file.write_text(text)
        return load_scenario(file, overrides)

    return load


@pytest.fixture
def problems(loaded, tmp_path):
    def fail(text):
        with pytest.raises(ScenarioError) as raised:
            build(loaded(text=text))
        return [line.replace(f"{tmp_path}/", "") for line in str(raised.value).splitlines()]

    return fail


def test_a_tree_by_hand_is_taken_as_it_stands(loaded):
    assert build(loaded()).tree.parent == {"c1": "relay", "c2": "relay", "relay": "base", "base": None}
    chain = build(loaded("network.routing.parents={c1: c2, c2: relay, relay: base}"))
    assert chain.tree.depth == {"c1": 3, "c2": 2, "relay": 1, "base": 0}


def test_a_tree_by_hand_survives_being_written_out(loaded):
    first = loaded()
    again = loaded(text=resolved_yaml(first))
    assert again.scenario.network == first.scenario.network


def test_a_routing_without_a_kind_is_by_fewest_hops(loaded):
    routing = loaded("network.routing={link_success_min: 0.5}").scenario.network.routing
    assert (routing.kind, routing.link_success_min) == ("min_hop_tree", 0.5)
    assert loaded("network={}").scenario.network.routing.kind == "min_hop_tree"


def test_names_orphans_and_circles_are_told_at_once_at_their_lines(problems):
    text = TEXT.replace("c1: relay", "c1: rely").replace("c2: relay", "c2: c2")
    text = text.replace("relay: base\n", "base: c1\n      x: base\n")
    assert problems(text) == [
        's.yaml:19:11: network.routing.parents.c1: must be a node, got "rely"; did you mean "relay"?',
        "s.yaml:21:7: network.routing.parents.base: must be left out: the base station has no parent",
        's.yaml:22:7: network.routing.parents.x: must be a node, got "x"',
        's.yaml:19:7: network.routing.parents: must name the parent of every node but the base, misses "relay"',
        "s.yaml:20:11: network.routing.parents.c2: must lead to the base station, goes round in a circle: c2 -> c2",
    ]


def test_a_circle_is_told_once_with_all_its_nodes(problems):
    text = TEXT.replace("relay: base", "relay: c1")
    assert problems(text) == [
        "s.yaml:19:11: network.routing.parents.c1: must lead to the base station, goes round in a circle: c1 -> relay -> c1"
    ]


def test_links_that_carry_nothing_are_refused_at_their_line(problems):
    text = TEXT.replace("routing:", "tx_power_dbm: -10\n  routing:").replace("c1: relay", "c1: base")
    (line,) = problems(text)
    # 10 + 40.05 + 30 log10 of 34.25 m
    distance = np.hypot(np.hypot(34, 4), 1)
    assert line == (
        's.yaml:20:11: network.routing.parents.c1: must be a node that hears "c1" and is heard by it, got "base": '
        f"{distance:.1f} m away, {-50.05 - 30 * np.log10(distance):.1f} dBm arrive and -95.0 dBm are needed; "
        "choose another, add relays, or raise the transmit power"
    )


def test_links_are_not_probed_longer_than_the_run_takes(problems, loaded):
    tree = TEXT[TEXT.index("    kind: tree") : TEXT.index("system:")]
    (line,) = problems(TEXT.replace(tree, "    kind: etx_tree\n    estimate: probes\n    probes: 2\n"))
    assert line == (
        "s.yaml:19:13: network.routing.probes: must be over before the run is: 2 probes every 0.5 s take 1 s, "
        "got 1 s of duration_s"
    )
    assert loaded("network.routing={kind: etx_tree, estimate: probes, probes: 1}")


def test_an_unknown_kind_and_missing_parents_are_told(loaded):
    for routing, words in (
        ("{kind: etx}", '"etx_tree", "min_energy_tree" or "tree", got "etx"; did you mean "etx_tree"?'),
        ("{kind: tree}", "network.routing.parents: must be given (next node on the way to the base station"),
        ("{kind: etx_tree, frame_bytes: 200}", "frame_bytes: must be at most 127 in IEEE 802.15.4, got 200"),
        ("{kind: tree, parents: {c1: 3}}", "network.routing.parents.c1: must be text, got 3"),
    ):
        with pytest.raises(ScenarioError) as raised:
            loaded(f"network.routing={routing}")
        assert words in str(raised.value)


@pytest.mark.parametrize("kind", ["min_hop_tree", "etx_tree"])
def test_an_ideal_network_and_a_radio_have_the_same_shadowed_tree(loaded, kind):
    trees = set()
    for seed in range(8):
        options = (
            f"network.routing={{kind: {kind}}}",
            "network.propagation={shadowing_db: 8, asymmetry_db: 3}",
            "network.tx_power_dbm=-5",
            f"seed={seed}",
        )
        try:
            radio = build(loaded(*options)).tree
        except ScenarioError:
            with pytest.raises(ScenarioError):
                build(loaded(*options, "network.standard=ideal"))
            continue
        assert build(loaded(*options, "network.standard=ideal")).tree == radio
        trees.add(tuple(radio.parent.items()))
    # the shadowing is by seed
    assert len(trees) > 1


def test_nodes_out_of_reach_are_told_of_the_shadowing(loaded):
    options = ["network.routing={kind: min_hop_tree}", "network.tx_power_dbm=-20"]
    with pytest.raises(ScenarioError) as plain:
        build(loaded(*options))
    assert "this seed is" not in str(plain.value)
    with pytest.raises(ScenarioError) as shadowed:
        build(loaded(*options, "network.propagation.shadowing_db=0.5", "seed=7"))
    assert "better or worse than their distance, by the run's seed; this seed is 7" in str(shadowed.value)


def test_without_shadowing_the_path_loss_is_the_plain_one(loaded):
    scenario = loaded("network.propagation={exponent: 2.5}").scenario
    places = {"a": (0.0, 0.0, 0.0), "b": (100.0, 0.0, 0.0)}
    loss = node_propagation(scenario, places, RandomStreams(0))
    assert loss.loss_db(np.array(list(places.values())), np.array([0]), np.array([1])) == [40.05 + 50.0]


def test_frames_arrive_with_the_shadowed_power(loaded):
    scenario = loaded(
        "network.propagation={shadowing_db: 4, asymmetry_db: 2}", "record.frames=true", "duration_s=0.25"
    )
    simulation, sink = build(scenario), MemorySink()
    simulation.run(sink)
    positions = simulation.positions
    loss = node_propagation(scenario.scenario, positions, RandomStreams(scenario.scenario.seed))
    links = links_between(np.array(list(positions.values())), loss, 0.0)
    at = {node: number for number, node in enumerate(positions)}
    frames = [row for row in sink.rows if isinstance(row, FrameRow)]
    assert {(row.sender, row.receiver) for row in frames} >= {("c1", "relay"), ("relay", "base")}
    for row in frames:
        assert row.rssi_dbm == pytest.approx(links.arriving_dbm(at[row.sender], at[row.receiver]), abs=1e-9)
    differing = {row.rssi_dbm for row in frames}
    assert len(differing) >= 4
