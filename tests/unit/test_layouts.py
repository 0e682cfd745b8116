"""Many motes at once: layouts from JSON files and by rule, and what they stand for."""

import itertools
import json
import math

import pytest

from wsnsim.errors import ScenarioError
from wsnsim.scenario.load import load_scenario, scenario_from_dict
from wsnsim.scenario.resolved import resolved_yaml, scenario_hash

SQUARE = {
    "n": 4,
    "xy": [[0, 0], [10, 0], [10, 10], [0, 10, 2.5]],
    "sink": 2,
    "parent": [1, 2, -1, 2],
    "tx_dbm": -5.0,
    "path_loss": {"model": "log-distance", "d0_m": 2.0, "pl0_db": 50.0, "exponent": 2.5},
    "hop": [2, 1, 0, 1],
}


@pytest.fixture
def loaded(tmp_path):
    """Return a loader of a traffic scenario over a layout, written into a file beside it."""

    def load(layout=SQUARE, motes=None, network=None, overrides=(), seed=None):
        text = layout if isinstance(layout, str) else json.dumps(layout)
        (tmp_path / "places.json").write_text(text)
        data = {
            "duration_s": 10,
            "system": {"kind": "traffic"},
            "motes": {"layout": "places.json", **(motes or {})},
            **({} if network is None else {"network": network}),
        }
        path = tmp_path / "scenario.yaml"
        path.write_text(json.dumps(data))
        return load_scenario(path, overrides, seed)

    return load


def complaint(loaded, **changes):
    with pytest.raises(ScenarioError) as raised:
        loaded({**SQUARE, **changes})
    return str(raised.value)


def test_a_file_gives_places_tree_power_and_path_loss(loaded):
    scenario = loaded().scenario
    assert scenario.motes.layout is None
    assert {entry.id: entry.position_m for entry in scenario.motes.nodes} == {
        "n0": (0, 0, 0),
        "n1": (10, 0, 0),
        "n3": (0, 10, 2.5),
    }
    assert (scenario.motes.base.id, scenario.motes.base.position_m) == ("n2", (10, 10, 0))
    assert scenario.network.routing.parents == {"n0": "n1", "n1": "n2", "n3": "n2"}
    assert scenario.network.tx_power_dbm == -5.0
    loss = scenario.network.propagation
    assert (loss.exponent, loss.reference_loss_db, loss.reference_distance_m) == (2.5, 50.0, 2.0)


def test_what_the_scenario_says_comes_first(loaded):
    scenario = loaded(
        motes={
            "nodes": [{"id": "n1", "battery": {"kind": "mains"}}, {"id": "n3", "position_m": [1, 9, 0]}],
            "base": {"id": "sink", "platform": "telosb"},
        },
        network={"tx_power_dbm": 0, "propagation": {"shadowing_db": 3.0, "exponent": 4.0}},
    ).scenario
    entries = {entry.id: entry for entry in scenario.motes.nodes}
    assert entries["n1"].battery.kind == "mains"
    assert entries["n1"].position_m == (10, 0, 0)
    assert entries["n3"].position_m == (1, 9, 0)
    assert (scenario.motes.base.platform, scenario.motes.base.position_m) == ("telosb", (10, 10, 0))
    assert scenario.network.routing.parents == {"n0": "n1", "n1": "sink", "n3": "sink"}
    assert scenario.network.tx_power_dbm == 0
    loss = scenario.network.propagation
    assert (loss.exponent, loss.shadowing_db, loss.reference_loss_db) == (4.0, 3.0, 50.0)
    other = loaded(network={"routing": {"kind": "etx_tree"}}).scenario
    assert other.network.routing.kind == "etx_tree"


def test_a_file_with_places_alone_is_enough(loaded):
    scenario = loaded({"xy": SQUARE["xy"]}).scenario
    assert scenario.motes.base.id == "n0"
    assert scenario.network.routing.kind == "min_hop_tree"
    assert scenario.network.tx_power_dbm == 0.0


def test_the_resolved_scenario_needs_the_file_no_more(loaded, tmp_path):
    first = loaded()
    resolved = tmp_path / "elsewhere" / "scenario.yaml"
    resolved.parent.mkdir()
    resolved.write_text(resolved_yaml(first, resolved.parent))
    (tmp_path / "places.json").unlink()
    again = load_scenario(resolved)
    # the name of a scenario without one is its file's
    assert again.scenario == first.scenario
    assert scenario_hash(again) == scenario_hash(first)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"n": 0, "xy": [], "parent": []}, "n: must be at least 2, a base station and a mote, got 0"),
        ({"n": 1, "xy": [[0, 0]], "parent": [-1], "sink": 0}, "n: must be at least 2"),
        ({"n": 5}, "xy: must have a place for each of the 5 nodes of n, got 4"),
        ({"n": "4"}, 'n: must be a whole number, got "4"'),
        ({"xy": None}, "xy: must be a list with the place of each node"),
        ({"xy": [[0, 0], [10, 0], [10, math.nan], [0, 10]]}, "xy[2][1]: must be a finite number, got nan"),
        ({"xy": [[0, 0], [10, 0], [2e6, 0], [0, 10]]}, "xy[2][0]: must lie within 1e+06 m of the origin"),
        ({"xy": [[0, 0], [10, 0], [10], [0, 10]]}, "xy[2]: must be x and y, or x, y and z, in metres"),
        (
            {"xy": [[0, 0], [10, 0], [0, 0.0], [0, 10]]},
            "xy[2]: must be a place of its own, got that of node 0",
        ),
        ({"sink": 4}, "sink: must be the number of a node, 0 to 3, got 4"),
        ({"sink": 1}, "parent[1]: must be -1, as that of the sink, got 2"),
        ({"parent": [1, 2, -1]}, "parent: must have a number for each of the 4 nodes, got 3"),
        ({"parent": [1, 2, -1, -1]}, "parent[3]: must be the number of another node, 0 to 3, got -1"),
        ({"parent": [0, 2, -1, 2]}, "parent[0]: must be the number of another node, 0 to 3, got 0"),
        (
            {"parent": [1, 3, -1, 0]},
            "parent[0]: must lead to the sink, goes round in a loop: 0 -> 1 -> 3 -> 0",
        ),
        ({"tx_dbm": "0"}, 'tx_dbm: must be a finite number, got "0"'),
        ({"path_loss": {"model": "friis"}}, 'path_loss.model: must be "log-distance", got "friis"'),
        ({"path_loss": {"model": "log-distance", "d0_m": 1}}, 'path_loss: must have "pl0_db"'),
    ],
)
def test_what_is_wrong_with_a_file_is_told_with_its_place(loaded, tmp_path, changes, words):
    said = complaint(loaded, **changes)
    assert words in said
    assert "scenario.yaml:1:" in said
    assert "motes.layout: must be a file with a layout" in said
    assert str(tmp_path / "places.json") in said


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('{"n": 2, "xy": [[0, 0] [1, 1]]}', "line 1, column 24: must be JSON"),
        ("[1, 2]", "must hold an object with n and xy, got a list of 2"),
        ("", "line 1, column 1: must be JSON"),
    ],
)
def test_what_is_no_layout_at_all(loaded, text, words):
    with pytest.raises(ScenarioError) as raised:
        loaded(text)
    assert words in str(raised.value)


def test_a_distance_below_zero_in_a_file_is_the_networks_fault(loaded):
    said = complaint(loaded, path_loss={"model": "log-distance", "d0_m": -1, "pl0_db": 40, "exponent": 3})
    assert "network.propagation.reference_distance_m: must be greater than 0, got -1" in said


def by_rule(layout, seed=0, **more):
    data = {"duration_s": 1, "seed": seed, "system": {"kind": "traffic"}, "motes": {"layout": layout}, **more}
    return scenario_from_dict(data).scenario


def places(scenario):
    base = scenario.motes.base
    named = {entry.id: entry.position_m for entry in scenario.motes.nodes} | {base.id: base.position_m}
    return [named[f"n{number}"] for number in range(len(named))]


def test_a_grid_goes_row_by_row():
    assert places(by_rule({"kind": "grid", "nodes": 7, "spacing_m": 5, "height_m": 1})) == [
        (0, 0, 1), (5, 0, 1), (10, 0, 1), (0, 5, 1), (5, 5, 1), (10, 5, 1), (0, 10, 1),
    ]  # fmt: skip


def test_a_line_may_have_its_base_station_anywhere():
    scenario = by_rule({"kind": "line", "nodes": 3, "spacing_m": 20, "sink": 1})
    assert places(scenario) == [(0, 0, 0), (20, 0, 0), (40, 0, 0)]
    assert scenario.motes.base.id == "n1"


def test_a_star_has_its_leaves_on_a_circle():
    middle, *leaves = places(by_rule({"kind": "star", "nodes": 6, "radius_m": 10}))
    assert {round(math.dist(middle, leaf), 9) for leaf in leaves} == {10.0}
    steps = {round(math.dist(one, other), 9) for one, other in itertools.pairwise(leaves)}
    assert steps == {round(20 * math.sin(math.pi / 5), 9)}


def test_random_places_follow_the_seed():
    layout = {"kind": "random", "nodes": 40, "side_m": 50}
    one, same, other = (places(by_rule(layout, seed)) for seed in (1, 1, 2))
    assert one == same
    assert one[0] == other[0] == (25, 25, 0)
    assert one[1:] != other[1:]
    assert all(0 <= x <= 50 and 0 <= y <= 50 for x, y, _ in one)
    fixed = {**layout, "seed": 1}
    assert places(by_rule(fixed, 2)) == one


@pytest.mark.parametrize(
    ("layout", "words"),
    [
        ({"kind": "grid", "nodes": 0, "spacing_m": 5}, "motes.layout.nodes: must be at least 2, got 0"),
        (
            {"kind": "line", "nodes": 3, "spacing_m": -5},
            "motes.layout.spacing_m: must be greater than 0, got -5",
        ),
        (
            {"kind": "line", "nodes": 3, "spacing_m": 5, "sink": 3},
            "motes.layout.sink: must be the number of a node",
        ),
        ({"kind": "star", "nodes": 3}, "motes.layout.radius_m: must be given"),
        ({"kind": "star", "nodes": 3, "radius_m": 1, "sinc": 0}, "motes.layout.sinc: unknown key"),
        ({"kind": "ring"}, 'motes.layout: must be a JSON file, or a mapping of kind "grid", "line", "star"'),
        ("nowhere.json", "motes.layout: must be a file that exists"),
        (7, "motes.layout: must be a JSON file, or a mapping"),
    ],
)
def test_rules_that_make_no_layout(layout, words):
    with pytest.raises(ScenarioError) as raised:
        by_rule(layout)
    assert words in str(raised.value)
    # what else would be missing is not complained about: the layout would have had it
    assert "motes.base" not in str(raised.value)


def test_other_faults_are_told_beside_those_of_a_layout():
    with pytest.raises(ScenarioError) as raised:
        by_rule({"kind": "ring"}, network={"tx_power_dbm": 1000})
    assert "network.tx_power_dbm: must be at most 40" in str(raised.value)


def test_without_a_layout_a_base_station_is_needed():
    with pytest.raises(ScenarioError, match=r"motes\.base: must be given"):
        scenario_from_dict({"duration_s": 1, "system": {"kind": "traffic"}, "motes": {}})


def test_the_reference_layouts_can_be_read(shared):
    for name, nodes in (("rgg_n200", 200), ("hidden2", 3), ("star_n20", 21), ("line5", 5)):
        scenario = by_rule(str(shared / "reference" / "radio" / f"{name}.json"))
        assert len(scenario.motes.nodes) == nodes - 1
        assert len(scenario.network.routing.parents) == nodes - 1
