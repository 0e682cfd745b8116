"""Scenarios that are fine: what they become, where their files are, what identifies them."""

import json
import math
import subprocess
import sys
from types import ModuleType

import numpy as np
import pytest

from wsnsim.errors import ScenarioError
from wsnsim.scenario.expectations import parse_comparison
from wsnsim.scenario.load import load_scenario, scenario_from_dict
from wsnsim.scenario.nodes import placed_nodes
from wsnsim.scenario.registry import BUILT_IN, find_system
from wsnsim.scenario.resolved import resolved_yaml, scenario_hash
from wsnsim.scenario.schema_motes import Capacity, Mains, TwoAa
from wsnsim.systems.base import Role, System, SystemParams


class FakeParams(SystemParams):
    particles: int = 100
    spread: tuple[float, float] = (0.1, 1e-7)
    note: str = "off"


SYSTEM = System("fake", "nobody", FakeParams, (), lambda params, site, node, role: None)

WALK = {
    "duration_s": 9,
    "world": {
        "size_m": [32, 22, 6],
        "targets": [
            {
                "id": "walker",
                "shape": {"kind": "ellipsoid", "semi_axes_m": [0.3, 0.2, 0.9]},
                "motion": {"kind": "recorded", "file": "tracks/walk.csv"},
            },
            {
                "id": "box",
                "shape": {"kind": "ellipsoid", "semi_axes_m": [0.4, 0.28, 0.34]},
                "motion": {"kind": "waypoints", "points_m": [[1, 2, 1]], "orientation": [1, 1, 0, 0]},
            },
        ],
    },
    "cameras": [
        {"id": "c1", "position_m": [0, 0, 3], "look_at_m": [16, 11, 1], "background": "wall.png"},
        {"id": "c2", "position_m": [9, 0, 3], "look_at_m": [16, 11, 1]},
    ],
    "motes": {
        "default": {"battery": {"kind": "capacity", "capacity_j": 5}},
        "nodes": [
            {"id": "r1", "position_m": [5, 5, 3], "battery": {"kind": "two_aa"}},
            {"id": "c2", "platform": "imote2_104"},
        ],
        "base": {"position_m": [16, 0, 2]},
    },
    "system": {"kind": "fake_tracker:SYSTEM"},
    "expect": {"lost_fraction": "== 0"},
}


@pytest.fixture(autouse=True)
def fakes(monkeypatch):
    tracker = ModuleType("fake_tracker")
    tracker.SYSTEM = SYSTEM
    monkeypatch.setitem(sys.modules, "fake_tracker", tracker)
    photos = ModuleType("wsnsim.vision.photos")
    photos.PHOTO_NAMES = ("photo/coffee",)
    monkeypatch.setitem(sys.modules, "wsnsim.vision.photos", photos)


@pytest.fixture
def folder(tmp_path):
    """A folder with the scenario WALK and the files it names."""
    home = tmp_path / "home"
    (home / "tracks").mkdir(parents=True)
    (home / "tracks" / "walk.csv").write_text("time_s,x_m,y_m\n0,0,0\n")
    (home / "wall.png").write_bytes(b"pixels")
    (home / "My walk (2).yaml").write_text(json.dumps(WALK))
    return home


@pytest.fixture
def walk(folder):
    return load_scenario(folder / "My walk (2).yaml")


def test_defaults_and_the_name_of_the_file(walk):
    scenario = walk.scenario
    assert scenario.name == "My-walk-2"
    assert scenario.seed == 0
    assert scenario.duration_s == 9.0
    assert scenario.network.mac.max_be == 5
    assert scenario.system == {
        "kind": "fake_tracker:SYSTEM",
        "particles": 100,
        "spread": [0.1, 1e-7],
        "note": "off",
    }
    assert walk.system is SYSTEM
    assert walk.system_params == FakeParams(kind="fake_tracker:SYSTEM")


def test_orientation_is_made_a_unit_quaternion(walk):
    half = math.sqrt(0.5)
    assert walk.scenario.world.targets[1].motion.orientation == pytest.approx((half, half, 0, 0), rel=1e-15)


@pytest.mark.parametrize(
    "q", [[1e-200, 0, 0, -1e-200], [1e6, 1e6, 1e6, 1e6], [5e-324, 0, 0, 0], [0.1, 0.2, 0.3, 0.4]]
)
def test_any_length_of_a_quaternion_will_do(folder, q):
    (folder / "q.yaml").write_text(json.dumps(WALK))
    loaded = load_scenario(folder / "q.yaml", [f"world.targets[box].motion.orientation={q}"])
    unit = loaded.scenario.world.targets[1].motion.orientation
    assert math.hypot(*unit) == pytest.approx(1, abs=1e-15)
    largest = max(map(abs, q))
    direction = [c / largest for c in q]
    assert unit == pytest.approx([c / math.hypot(*direction) for c in direction], abs=1e-15)


def test_files_are_found_from_the_scenarios_folder(walk, folder, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    again = load_scenario("home/My walk (2).yaml").scenario
    assert again == walk.scenario
    assert again.world.targets[0].motion.file == str(folder / "tracks" / "walk.csv")
    assert again.cameras[0].background == str(folder / "wall.png")
    assert walk.resolve_path("wall.png") == folder / "wall.png"


def test_the_resolved_scenario_runs_from_anywhere(walk, tmp_path):
    (tmp_path / "out").mkdir()
    file = tmp_path / "out" / "scenario.yaml"
    text = resolved_yaml(walk)
    file.write_text(text)
    again = load_scenario(file)
    assert again.scenario == walk.scenario
    assert again.system_params == walk.system_params
    assert scenario_hash(again) == scenario_hash(walk)
    assert resolved_yaml(again) == text


def test_the_resolved_scenario_has_the_schemas_order_and_every_default(walk):
    keys = [line.split(":")[0] for line in resolved_yaml(walk).splitlines() if line[0] not in "# -"]
    assert keys == [
        "name",
        "seed",
        "duration_s",
        "world",
        "cameras",
        "motes",
        "network",
        "system",
        "record",
        "expect",
    ]
    assert "  reassembly_timeout_s: 10.0\n" in resolved_yaml(walk)
    assert '  note: "off"\n' in resolved_yaml(walk)
    assert "  spread: [0.1, 1.0e-07]\n" in resolved_yaml(walk)


def test_files_inside_the_target_folder_move_with_it(walk, folder):
    text = resolved_yaml(walk, folder)
    assert "file: ./tracks/walk.csv" not in text  # a dot in front needs quotes
    assert 'file: "./tracks/walk.csv"' in text
    moved = folder.rename(folder.parent / "moved")
    (moved / "scenario.yaml").write_text(text)
    again = load_scenario(moved / "scenario.yaml")
    assert again.scenario.cameras[0].background == str(moved / "wall.png")
    assert scenario_hash(again) == scenario_hash(load_scenario(moved / "My walk (2).yaml"))


def test_the_hash_sees_values_and_contents_and_not_the_form(folder, walk):
    first = scenario_hash(walk)
    file = folder / "My walk (2).yaml"
    file.write_text(json.dumps({**dict(reversed(WALK.items())), "seed": 0}, indent=1))
    assert scenario_hash(load_scenario(file)) == first
    assert scenario_hash(load_scenario(file, seed=1)) != first
    assert scenario_hash(load_scenario(file, ["system.particles=101"])) != first
    (folder / "tracks" / "walk.csv").write_text("time_s,x_m,y_m\n0,0,1\n")
    assert scenario_hash(load_scenario(file)) != first


def test_overrides_and_seed(folder):
    loaded = load_scenario(
        folder / "My walk (2).yaml", ["cameras[c2].focal_px=250", "seed=3", "record.frames=true"], seed=7
    )
    assert loaded.scenario.cameras[1].focal_px == 250.0
    assert loaded.scenario.record.frames is True
    assert loaded.scenario.seed == 7


def test_python_data_of_any_kind(folder, walk):
    data = {**WALK, "name": "My-walk-2"}
    data["world"] = {**WALK["world"], "size_m": np.array([32.0, 22.0, 6.0])}
    data["cameras"] = (
        {**WALK["cameras"][0], "background": folder / "wall.png", "focal_px": np.float64(300)},
        {**WALK["cameras"][1], "noise_sd": np.int64(5)},
    )
    loaded = scenario_from_dict(data, folder)
    assert loaded.scenario == walk.scenario
    assert loaded.path is None
    assert scenario_from_dict({**WALK, "duration_s": np.float32(9)}, folder).scenario.name == "scenario"


def test_nodes(walk):
    nodes = placed_nodes(walk.scenario)
    rows = [(n.id, n.role, n.position_m, n.platform, n.radio, n.battery, n.camera) for n in nodes]
    c1, c2 = walk.scenario.cameras
    assert rows == [
        ("c1", Role.CAMERA, (0.0, 0.0, 3.0), "imote2_416", "cc2420", Capacity(capacity_j=5), c1),
        ("c2", Role.CAMERA, (9.0, 0.0, 3.0), "imote2_104", "cc2420", Capacity(capacity_j=5), c2),
        ("r1", Role.RELAY, (5.0, 5.0, 3.0), "imote2_416", "cc2420", TwoAa(), None),
        ("base", Role.BASE, (16.0, 0.0, 2.0), "workstation", "cc2420", Mains(), None),
    ]


def test_values_are_frozen(walk):
    with pytest.raises(ValueError, match="frozen"):
        walk.scenario.seed = 3
    with pytest.raises(AttributeError):
        walk.path = None


@pytest.mark.parametrize(
    ("text", "value", "holds"),
    [
        ("< 0.12", 0.11, True),
        ("< 0.12", 0.12, False),
        ("<= 0.12", 0.12, True),
        (" > -1e-3", 0.0, True),
        (">=0", 0.0, True),
        ("== 0", 0.0, True),
        ("!= 0", 0.0, False),
        ("> .5", math.nan, False),
        ("!= .5", math.nan, False),
    ],
)
def test_comparisons(text, value, holds):
    assert parse_comparison(text).holds(value) is holds


@pytest.mark.parametrize("text", ["", "0.12", "=< 3", "< x", "< nan", "< inf", "< 1 2", "< 1e999", "< ٣"])
def test_what_is_no_comparison(text):
    with pytest.raises(ValueError, match="must"):
        parse_comparison(text)


@pytest.mark.parametrize("kind", BUILT_IN)
def test_the_packages_own_systems_are_there(kind):
    assert find_system(kind).name == kind


def test_an_unknown_system_is_an_error():
    with pytest.raises(ScenarioError, match=r'system\.kind: must be "multiview".*did you mean "multiview"\?'):
        find_system("multi-view")


def test_loading_imports_nothing_heavy():
    code = "import sys, wsnsim.scenario.load; print(*sys.modules)"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    heavy = {"pandas", "plotly", "numba", "networkx", "scipy", "simpy", "PIL", "numpy"}
    assert not heavy & set(out.split())
