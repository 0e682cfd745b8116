"""What a person reads who made mistakes: every one at once, each at its place, in plain words."""

# ruff: noqa: E501  (an error is one line, here as on the screen)

import sys
from types import ModuleType, SimpleNamespace
from typing import Annotated, Literal

import pytest
from pydantic import BaseModel, Field

from wsnsim.errors import ScenarioError
from wsnsim.scenario.load import load_scenario, scenario_from_dict
from wsnsim.systems.base import System, SystemParams

GOOD = """\
duration_s: 9
world:
  size_m: [32, 22, 6]
  targets:
    - id: box
      shape: {kind: ellipsoid, semi_axes_m: [0.40, 0.28, 0.34]}
      motion: {kind: waypoints, points_m: [[1, 2, 1], [4, 5, 1]]}
cameras:
  - {id: c1, position_m: [0, 0, 3], look_at_m: [16, 11, 1]}
motes:
  base: {position_m: [16, 0, 2]}
system: {kind: "fake_tracker:SYSTEM"}
"""


class Near(BaseModel, extra="forbid", frozen=True):
    kind: Literal["near"]
    radius_m: float = Field(gt=0, description="how far [m]")


class Far(BaseModel, extra="forbid", frozen=True):
    kind: Literal["far"]
    ranges_m: tuple[float, float]


class FakeParams(SystemParams):
    particles: int = Field(100, ge=1)
    gate: Annotated[Near | Far, Field(discriminator="kind")] | None = None
    limit: int | Literal["none"] = "none"


@pytest.fixture(autouse=True)
def fakes(monkeypatch):
    """A tracking system and a set of photographs that no other room changes."""
    tracker = ModuleType("fake_tracker")
    tracker.SYSTEM = System("fake", "nobody", FakeParams, (), lambda params, site, node, role: None)
    tracker.OTHER = 3
    monkeypatch.setitem(sys.modules, "fake_tracker", tracker)
    photos = ModuleType("wsnsim.vision.photos")
    photos.PHOTO_NAMES = ("photo/brick", "photo/coffee")
    monkeypatch.setitem(sys.modules, "wsnsim.vision.photos", photos)
    hardware = ModuleType("wsnsim.hardware.profiles")
    hardware.PLATFORMS = dict.fromkeys(["imote2_104", "imote2_416", "workstation"])
    hardware.RADIOS = dict.fromkeys(["cc2420", "cc2538"], SimpleNamespace(standard="ieee802154"))
    monkeypatch.setitem(sys.modules, "wsnsim.hardware.profiles", hardware)


@pytest.fixture
def problems(tmp_path, monkeypatch):
    """Load text as s.yaml and return the lines of its error."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "track.csv").write_text("time_s,x_m,y_m\n0,0,0\n")

    def load(text, overrides=(), seed=None):
        (tmp_path / "s.yaml").write_text(text)
        with pytest.raises(ScenarioError) as caught:
            load_scenario("s.yaml", overrides, seed)
        return [
            line.replace(f"{tmp_path}/", "HERE/").replace(str(tmp_path), "ROOT")
            for line in str(caught.value).splitlines()
        ]

    return load


def edited(old, new):
    assert old in GOOD
    return GOOD.replace(old, new)


def test_the_good_one_is_good(tmp_path):
    (tmp_path / "s.yaml").write_text(GOOD)
    assert load_scenario(tmp_path / "s.yaml").scenario.name == "s"


def test_every_error_at_once_sorted_by_line(problems):
    text = """\
name: "my scenario"
seed: -1
duraton_s: 9
duration_s: .nan
world:
  size_m: [32, 22]
  light: {ambient: 1.5, direction: [0, 0, 0]}
  targets:
    - id: box
      shape: {kind: ellipsoide, semi_axes_m: [0.40, 0.28, 0.34]}
      motion: {kind: waypoints, points_m: [], speed: 2}
    - id: box
      shape: {kind: ellipsoid, semi_axes_m: [0.40, 0, 0.34], texture: {colours: 19}}
      motion: {kind: recorded, file: trak.csv}
    - shape: {kind: ellipsoid, semi_axes_m: 3}
      motion: {points_m: [[1, 2, 3]], file: x}
cameras:
  - {id: c1, position_m: [0, 0, 3], look_at_m: [1, 1, 1], resolution_px: [320.5, 240], focal_px: "300"}
  - {id: c1, position_m: [0, 0, 3], look_at_m: [0, 0, 3], rate_hz: 5}
  - {id: c3, position_m: [0, 0, 3, 4], look_at_m: [.inf, 11, 1], focal_px: 12:30, background: photo/cofee}
motes:
  default: {platform: imote2, radio: cc242, battery: {kind: two_a}}
  nodes:
    - {id: r1}
    - {id: c3, position_m: [1, 2, 3], battery: {kind: capacity}}
    - {id: 3r, position_m: [1, 2, 3]}
  base: {id: c3}
network: {standard: 802154, mac: {quue: 3}, collision: off, propagation: {exponent: yes}}
system: {kind: "fake_tracker:SYSTEM", particles: 0, gate: {kind: near, radius: 3}, limit: 1.5}
record: {frames: yes}
expect: {lost_fraction: 0, position_error_mean_m: "~ 3"}
seed: 4
1: 3
"""
    assert problems(text) == [
        's.yaml:1:7: name: must be a letter, digit or _ and then letters, digits or _ . - only, got "my scenario"',
        "s.yaml:2:7: seed: must be at least 0, got -1",
        's.yaml:3:1: duraton_s: unknown key; did you mean "duration_s"?',
        "s.yaml:4:13: duration_s: must be a finite number, got nan",
        "s.yaml:6:11: world.size_m: must have exactly 3 items, got 2",
        "s.yaml:7:20: world.light.ambient: must be at most 1, got 1.5",
        "s.yaml:7:36: world.light.direction: must be a direction of length 1e-06 or more, got [0.0, 0.0, 0.0]",
        's.yaml:10:21: world.targets[0].shape.kind: must be "ellipsoid", "box" or "cylinder", got "ellipsoide"; '
        'did you mean "ellipsoid"?',
        "s.yaml:11:43: world.targets[0].motion.points_m: must have at least 1 item, got 0",
        's.yaml:11:47: world.targets[0].motion.speed: unknown key; did you mean "speed_mps"?',
        's.yaml:12:11: world.targets[1].id: must be a name of its own, got "box", which world.targets[0].id has too',
        "s.yaml:13:52: world.targets[1].shape.semi_axes_m[1]: must be at least 0.001, got 0",
        "s.yaml:13:71: world.targets[1].shape.texture: colours must be at most patches, got 19 and 18",
        's.yaml:14:38: world.targets[1].motion.file: must be a file that exists, got "HERE/trak.csv"; '
        'did you mean "track.csv"?',
        "s.yaml:15:7: world.targets[2].id: must be given (name, unique in the world)",
        "s.yaml:15:45: world.targets[2].shape.semi_axes_m: must be a list, got 3",
        's.yaml:16:7: world.targets[2].motion.kind: must be given: "waypoints", "constant_velocity", '
        '"random_waypoint", "gauss_markov", "recorded" or "crowd"',
        "s.yaml:18:75: cameras[0].resolution_px[0]: must be a whole number, got 320.5",
        's.yaml:18:98: cameras[0].focal_px: must be a number, got "300"',
        "s.yaml:19:5: cameras[1]: must look at a point other than its own position",
        's.yaml:19:10: cameras[1].id: must be a name of its own, got "c1", which cameras[0].id has too',
        "s.yaml:19:68: cameras[1].rate_hz: must be the same for all cameras "
        "(a tracking step takes an image of each), got 5, and cameras[0].rate_hz is 4",
        "s.yaml:20:26: cameras[2].position_m: must have exactly 3 items, got 4",
        "s.yaml:20:52: cameras[2].look_at_m[0]: must be a finite number, got inf",
        's.yaml:20:76: cameras[2].focal_px: must be a number, got "12:30"',
        's.yaml:20:95: cameras[2].background: must be a known photograph: "photo/brick" or "photo/coffee", '
        'got "photo/cofee"; did you mean "photo/coffee"?',
        's.yaml:22:23: motes.default.platform: must be a known platform: "imote2_104", "imote2_416" or '
        '"workstation", got "imote2"; did you mean "imote2_104"?',
        's.yaml:22:38: motes.default.radio: must be a known radio: "cc2420" or "cc2538", got "cc242"; '
        'did you mean "cc2420"?',
        's.yaml:22:61: motes.default.battery.kind: must be "two_aa", "mains" or "capacity", got "two_a"; '
        'did you mean "two_aa"?',
        's.yaml:24:7: motes.nodes[0].position_m: must be given: no camera is named "r1", so it is a relay',
        's.yaml:25:28: motes.nodes[1].position_m: must be left out: "c3" is a camera\'s mote, '
        "and stands where it does",
        "s.yaml:25:39: motes.nodes[1].battery.capacity_j: must be given (energy when full [J])",
        's.yaml:26:12: motes.nodes[2].id: must be a letter or _ and then letters, digits or _ . - only, got "3r"',
        "s.yaml:27:3: motes.base.position_m: must be given (where it stands [m])",
        's.yaml:27:14: motes.base.id: must be a name of its own, got "c3", which cameras[2].id has too',
        's.yaml:28:21: network.standard: must be "ieee802154", "ieee80211b" or "ideal", got 802154',
        's.yaml:28:35: network.mac.quue: unknown key; did you mean "queue_frames"?',
        's.yaml:28:56: network.collision: must be "sinr", "destructive" or "capture", got "off"',
        's.yaml:28:85: network.propagation.exponent: must be a number, got "yes"',
        "s.yaml:29:50: system.particles: must be at least 1, got 0",
        "s.yaml:29:53: system.gate.radius_m: must be given (how far [m])",
        's.yaml:29:72: system.gate.radius: unknown key; did you mean "radius_m"?',
        "s.yaml:29:91: system.limit: must be a whole number, got 1.5",
        's.yaml:29:91: system.limit: must be "none", got 1.5',
        's.yaml:30:18: record.frames: must be true or false, got "yes"',
        's.yaml:31:25: expect.lost_fraction: must be a comparison such as "< 0.12", in quotes, got 0',
        's.yaml:31:51: expect.position_error_mean_m: must be a comparison such as "< 0.12", ">= 0" or "== 0", '
        'got "~ 3"',
        "s.yaml:32:1: seed: key must stand once in its mapping, got it again (first at 2:1)",
        "s.yaml:33:1: a key must be text, got 1; put it in quotes",
    ]


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("duration_s: 9\n", "", "s.yaml:1:1: duration_s: must be given (simulated time [s])"),
        ("duration_s: 9\n", "duration_s: 0\n", "s.yaml:1:13: duration_s: must be greater than 0, got 0"),
        ("duration_s: 9\n", "duration_s: true\n", "s.yaml:1:13: duration_s: must be a number, got true"),
        ("duration_s: 9\n", "duration_s:\n", "s.yaml:1:12: duration_s: must be a number, got nothing (null)"),
        (
            "duration_s: 9\n",
            f"duration_s: 1{'0' * 400}\n",
            "s.yaml:1:13: duration_s: must be a finite number, got 1",
        ),
        (
            "duration_s: 9\n",
            "duration_s: .2\n",
            "s.yaml:1:13: duration_s: must be one frame period at least (0.25 s at 4 Hz), got 0.2",
        ),
        ("cameras:\n  - {", "cameras:\n  {", "s.yaml:9:3: cameras: must be a list, got a mapping"),
        (
            "cameras:\n  - {id: c1, position_m: [0, 0, 3], look_at_m: [16, 11, 1]}\n",
            "cameras: []\n",
            "s.yaml:8:10: cameras: must have at least 1 item, got 0",
        ),
        (
            "motes:\n  base: {position_m: [16, 0, 2]}\n",
            "motes: 3\n",
            "s.yaml:10:8: motes: must be a mapping, got 3",
        ),
        ("{position_m: [16, 0, 2]}", "", "s.yaml:11:8: motes.base: must be a mapping, got nothing (null)"),
        (
            'system: {kind: "fake_tracker:SYSTEM"}',
            "system: {particles: 3}",
            's.yaml:12:1: system.kind: must be given: "multiview", "scanline" or "traffic", or your own "package.module:ATTRIBUTE"',
        ),
        (
            'system: {kind: "fake_tracker:SYSTEM"}',
            "system: T0",
            's.yaml:12:9: system: must be a mapping, got "T0"',
        ),
        (
            'kind: "fake_tracker:SYSTEM"',
            "kind: multview",
            's.yaml:12:16: system.kind: must be "multiview", "scanline" or "traffic", or your own "package.module:ATTRIBUTE", '
            'got "multview"; did you mean "multiview"?',
        ),
        (
            '"fake_tracker:SYSTEM"',
            "3",
            's.yaml:12:16: system.kind: must be "multiview", "scanline" or "traffic", or your own "package.module:ATTRIBUTE", got 3',
        ),
        (
            "fake_tracker:SYSTEM",
            "fake_tracker:SYSTM",
            's.yaml:12:16: system.kind: must name an attribute of fake_tracker, got "SYSTM"; did you mean "SYSTEM"?',
        ),
        (
            "fake_tracker:SYSTEM",
            "fake_tracker:OTHER",
            "s.yaml:12:16: system.kind: must name a wsnsim.systems.base.System, "
            'got int at "fake_tracker:OTHER"',
        ),
        (
            "fake_tracker:SYSTEM",
            "no_such_module:SYSTEM",
            's.yaml:12:16: system.kind: must name a module that can be imported, got "no_such_module:SYSTEM" '
            "(ModuleNotFoundError: No module named 'no_such_module')",
        ),
        (
            "fake_tracker:SYSTEM",
            "../x:SYSTEM",
            's.yaml:12:16: system.kind: must look like "package.module:ATTRIBUTE", got "../x:SYSTEM"',
        ),
        (
            'SYSTEM"}',
            'SYSTEM", gate: {kind: far, ranges_m: [1]}}',
            "s.yaml:12:67: system.gate.ranges_m: must have exactly 2 items, got 1",
        ),
        (
            'SYSTEM"}',
            'SYSTEM", gate: {kind: fare}}',
            's.yaml:12:52: system.gate.kind: must be "near" or "far", got "fare"; did you mean "far"?',
        ),
        (
            "points_m: [[1, 2, 1], [4, 5, 1]]",
            "points_m: [[1, 2, 1], [4, 5, 1]], orientation: [0, 0, 0, 0]",
            "s.yaml:7:80: world.targets[0].motion.orientation: must be a quaternion other than zero, got all zeros",
        ),
        (
            "[16, 11, 1]}",
            "[16, 11, 1], background: .}",
            's.yaml:9:73: cameras[0].background: must be a file, not a folder, got "ROOT"',
        ),
        (
            "[16, 11, 1]}",
            '[16, 11, 1], background: "a\\0b"}',
            's.yaml:9:73: cameras[0].background: must be a file that can be read, got "HERE/a\\u0000b" '
            "(embedded null byte)",
        ),
        (
            "  base:",
            "  nodes: [{id: c}]\n  base:",
            's.yaml:11:11: motes.nodes[0].position_m: must be given: no camera is named "c", so it is a relay; '
            'did you mean "c1"?',
        ),
        (
            "  base:",
            "  nodes: [{id: base, position_m: [0, 0, 0]}]\n  base:",
            's.yaml:12:3: motes.base.id: must be a name of its own, got "base", which motes.nodes[0].id has too',
        ),
        (
            "  base:",
            "  nodes: [{id: r, position_m: [0, 0, 0]}, {id: r, position_m: [0, 0, 0]}]\n  base:",
            's.yaml:11:48: motes.nodes[1].id: must be a name of its own, got "r", which motes.nodes[0].id has too',
        ),
        (
            "system:",
            "network: {mac: {min_be: 6}}\nsystem:",
            "s.yaml:12:16: network.mac: min_be must be at most max_be, got 6 and 5",
        ),
        (
            "system:",
            "zzz: 1\nsystem:",
            's.yaml:12:1: zzz: unknown key; must be "name", "seed", "duration_s", "world", "cameras", "motes", '
            '"network", "system", "record" or "expect"',
        ),
        (
            "system:",
            "expect: {x: '< 1e999'}\nsystem:",
            's.yaml:12:13: expect.x: must compare with a finite number, got "< 1e999"',
        ),
    ],
)
def test_one_error(problems, old, new, line):
    (found,) = problems(edited(old, new))
    if line.endswith("got 1"):
        assert found.startswith(line)
    else:
        assert found == line


def test_a_module_that_raises_is_named(problems, tmp_path, monkeypatch):
    (tmp_path / "broken_tracker.py").write_text("raise RuntimeError('no weights')")
    monkeypatch.syspath_prepend(tmp_path)
    (found,) = problems(edited("fake_tracker", "broken_tracker"))
    assert found.endswith('got "broken_tracker:SYSTEM" (RuntimeError: no weights)')


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("", "s.yaml: must hold a mapping with keys such as name and world, got an empty file"),
        ("# nothing\n", "s.yaml: must hold a mapping with keys such as name and world, got an empty file"),
        ("- 1\n", "s.yaml: must hold a mapping with keys such as name and world, got a list of 1"),
        ("a\n", 's.yaml: must hold a mapping with keys such as name and world, got "a"'),
        ("a:\n\tb: 1\n", "s.yaml:2:1: must be indented with spaces, got a tab"),
    ],
)
def test_what_is_no_scenario_at_all(problems, text, line):
    assert problems(text) == [line]


def test_faults_of_the_command_line_name_the_argument(problems):
    overrides = [
        "cameras[c1].focal_px=-3",
        "seed",
        "netwrk.mac.min_be=3",
        "cameras[c9].id=3",
        "world.light={ambient: 2}",
        "motes.nodes=[{id: r1}]",
        "duration_s=1",
    ]
    assert problems(edited("duration_s: 9", "duration_s: 0\nrecord: 1"), overrides, seed=-4) == [
        "s.yaml:2:9: record: must be a mapping, got 1",
        "--set seed: must be path=value, got no =",
        '--set cameras[c9].id=3: cameras: must have an item with the id "c9"; it has "c1"',
        "--seed -4: seed: must be at least 0, got -4",
        "--set world.light={ambient: 2}: world.light.ambient: must be at most 1, got 2",
        "--set cameras[c1].focal_px=-3: cameras[0].focal_px: must be at least 1, got -3",
        '--set netwrk.mac.min_be=3: netwrk: unknown key; did you mean "network"?',
        '--set motes.nodes=[{id: r1}]: motes.nodes[0].position_m: must be given: no camera is named "r1", '
        "so it is a relay",
    ]


def test_faults_of_python_data_have_paths_only():
    with pytest.raises(ScenarioError) as caught:
        scenario_from_dict(
            {"seed": -1, "duration_s": 1, "world": {}, "cameras": [{}], "motes": {}, "system": {}}
        )
    lines = str(caught.value).splitlines()
    assert "seed: must be at least 0, got -1" in lines
    assert "cameras[0].id: must be given (name of the camera and of the mote that carries it)" in lines


def test_odd_python_data_is_refused():
    with pytest.raises(ScenarioError) as caught:
        scenario_from_dict({"a": {1: 2}, "b": [object()], "c": "\ud800"})
    assert str(caught.value).splitlines() == [
        "a: a key must be text, got 1",
        "b[0]: must be text, a number, a list or a mapping, got object",
        "c: must be Unicode text, got half a surrogate pair",
    ]
    loop = {}
    loop["loop"] = loop
    with pytest.raises(ScenarioError, match="must be nested at most 50 deep"):
        scenario_from_dict(loop)


def test_no_message_speaks_pydantic(problems):
    """Whatever stands where a section or a number belongs, the words stay plain."""
    jargon = ("pydantic", "http", "Input", "input", "Field", "tuple", "dict", "str_", "validation", "JSON")
    for value in ["3", "x", "[]", "[1, x]", "{}", "{a: 1}", "null", "true", ".inf", "-1e300"]:
        for key in ["name", "seed", "duration_s", "world", "cameras", "motes", "network", "system", "expect"]:
            kept = "\n".join(line for line in GOOD.splitlines() if line[0] == " " or not line.startswith(key))
            try:
                found = problems(f"{key}: {value}\n" + (GOOD if kept == GOOD.strip() else ""))
            except pytest.fail.Exception:
                continue  # some of them are allowed
            assert not [line for line in found for word in jargon if word in line]
