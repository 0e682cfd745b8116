"""What is written is read again as it was: YAML text, and whole scenarios."""

import contextlib
import json
import math
import sys
from types import ModuleType

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from wsnsim.errors import ScenarioError
from wsnsim.scenario.load import load_scenario, scenario_from_dict
from wsnsim.scenario.overrides import apply_overrides, parse_override
from wsnsim.scenario.resolved import resolved_yaml, scenario_hash
from wsnsim.scenario.yaml_marks import read_yaml_text
from wsnsim.scenario.yaml_write import yaml_text
from wsnsim.systems.base import System, SystemParams

TRICKY = [
    *[
        "off",
        "yes",
        "n",
        "null",
        "~",
        "1e6",
        "12:30",
        "1_000",
        "0o17",
        "0x1F",
        "007",
        ".5",
        "3.",
        "1.0e+3",
        ".inf",
        "-.Inf",
        ".nan",
        "nan",
        "true",
        "False",
    ],
    *[
        "<<",
        "=",
        "#",
        "'",
        "\\",
        "---",
        "...",
        "@a",
        "`",
        "%x",
        "!x",
        "&a",
        "*a",
        "|",
        ">",
        "[",
        "{}",
        "2024-01-01",
        "+1",
        "-",
        "?",
        "x:",
        '"',
        "ü",
    ],
    *["", " ", "- a", "a: b", "a #b", "\n", "a\n\n b", "\t", "a" * 300, "1" * 30],
    *["\x85", "\u2028", "\ufeff", "\x7f", "\x00", "\U0001f600", "\ufffe"],
]
texts = st.one_of(st.sampled_from(TRICKY), st.text(st.characters(exclude_categories=["Cs"]), max_size=12))
floats = st.floats(allow_nan=False, allow_infinity=False)
scalars = st.one_of(st.none(), st.booleans(), st.integers(), floats, texts)
trees = st.recursive(
    scalars,
    lambda inner: st.one_of(st.lists(inner, max_size=4), st.dictionaries(texts, inner, max_size=4)),
    max_leaves=20,
)


def same(a, b):
    """Equal, with types and the sign of zero."""
    return json.dumps(a) == json.dumps(b)


@settings(deadline=None, max_examples=300)
@given(st.dictionaries(texts, trees, max_size=4))
def test_yaml_text_is_read_again(data):
    document = read_yaml_text(yaml_text(data))
    assert document.problems == ()
    assert same(document.data, data)


@settings(deadline=None, max_examples=150)
@given(st.dictionaries(texts, st.one_of(texts, floats, st.booleans(), st.none()), max_size=4))
def test_other_yaml_readers_agree(data):
    assert same(yaml.safe_load(yaml_text(data)), data)


@settings(deadline=None, max_examples=200)
@given(trees)
def test_every_value_has_a_mark(tree):
    document = read_yaml_text(yaml_text({"top": tree}))
    paths = {()}

    def walk(value, path):
        paths.add(path)
        steps = range(len(value)) if isinstance(value, list) else value if isinstance(value, dict) else ()
        for step in steps:
            walk(value[step], (*path, step))

    walk({"top": tree}, ())
    assert set(document.values) == paths
    assert set(document.keys) == {path for path in paths if path and isinstance(path[-1], str)}


@settings(deadline=None, max_examples=200)
@given(scalars)
def test_overrides_carry_any_scalar(value):
    text = yaml_text({"k": value}).removeprefix("k: ").removesuffix("\n")
    overridden = apply_overrides({}, [parse_override(f"a.b={text}")])
    assert same(overridden.data, {"a": {"b": value}})


@settings(deadline=None, max_examples=300)
@given(st.text(max_size=40), st.sampled_from(["{}", "[{}", "a: {}", "- {}\n- {}", "a: &x {}\nb: *x"]))
def test_any_text_is_data_or_a_scenario_error(text, frame):
    with contextlib.suppress(ScenarioError):
        read_yaml_text(frame.replace("{}", text))


class FakeParams(SystemParams):
    note: str
    gain: float
    depth: int = 3
    maybe: str | None = None


@pytest.fixture(autouse=True, scope="module")
def fakes():
    with pytest.MonkeyPatch.context() as patch:
        tracker = ModuleType("fake_tracker")
        tracker.SYSTEM = System("fake", "nobody", FakeParams, (), lambda params, site, node, role: None)
        patch.setitem(sys.modules, "fake_tracker", tracker)
        photos = ModuleType("wsnsim.vision.photos")
        photos.PHOTO_NAMES = ("photo/coffee", "photo/brick")
        patch.setitem(sys.modules, "wsnsim.vision.photos", photos)
        yield


coordinates = st.floats(-1e6, 1e6)
positions = st.tuples(coordinates, coordinates, coordinates)
extents = st.floats(0, 1e6, exclude_min=True)
directions = st.tuples(*[st.floats(-1e6, 1e6)] * 3).filter(lambda v: math.hypot(*v) >= 1e-6)
half_axes = st.floats(1e-3, 1e3)
names = st.one_of(
    st.sampled_from(["off", "null", "yes", "e1", "true", "y", "_1e6", "é"]),
    st.from_regex(r"[A-Za-z_äß][A-Za-z0-9_.-]{0,10}", fullmatch=True),
)
orientations = st.tuples(coordinates, coordinates, coordinates, coordinates).filter(any)
speeds = st.floats(1e-9, 1000)
areas = st.one_of(st.none(), st.tuples(positions, positions))
motions = st.one_of(
    st.fixed_dictionaries(
        {"kind": st.just("waypoints"), "points_m": st.lists(positions, min_size=1, max_size=3)},
        optional={"orientation": orientations, "speed_mps": speeds},
    ),
    st.fixed_dictionaries(
        {
            "kind": st.just("constant_velocity"),
            "start_m": positions,
            "velocity_mps": st.tuples(*[st.floats(-1000, 1000)] * 3),
        },
        optional={"spin": st.fixed_dictionaries({"axis": directions, "rate_radps": st.floats(-1e4, 1e4)})},
    ),
)
drawn_motions = st.one_of(
    st.fixed_dictionaries(
        {"kind": st.just("random_waypoint")},
        optional={
            "area_m": areas,
            "start_m": st.one_of(st.none(), positions),
            "speed_mps": st.tuples(speeds, speeds).map(sorted),
            "pause_s": st.floats(0, 1e7),
        },
    ),
    st.fixed_dictionaries(
        {"kind": st.just("gauss_markov")},
        optional={
            "area_m": areas,
            "mean_speed_mps": st.floats(0, 1000),
            "heading_deg": st.one_of(st.none(), st.floats(-360, 360)),
            "memory": st.floats(0, 1),
            "interval_s": st.floats(1e-3, 1e6),
            "orientation": orientations,
        },
    ),
)
grey_levels = st.floats(0, 255)
textures = st.one_of(
    st.fixed_dictionaries({}, optional={"kind": st.just("plain"), "colour": st.tuples(*[grey_levels] * 3)}),
    st.fixed_dictionaries({"kind": st.just("patches"), "colours": st.integers(1, 18)}),
)
occluders = st.one_of(
    st.fixed_dictionaries(
        {
            "kind": st.just("wall"),
            "from_m": st.tuples(coordinates, st.floats(-1e6, 0)),
            "to_m": st.tuples(coordinates, st.floats(1e-3, 1e6)),
        },
        optional={"thickness_m": extents, "height_m": extents, "texture": textures},
    ),
    st.fixed_dictionaries(
        {"kind": st.just("box"), "centre_m": positions, "size_m": st.tuples(extents, extents, extents)},
        optional={"yaw_deg": st.floats(-360, 360), "texture": textures},
    ),
    st.fixed_dictionaries(
        {"kind": st.just("pillar"), "centre_m": st.tuples(coordinates, coordinates), "radius_m": extents},
        optional={"base_m": coordinates, "texture": textures},
    ),
    st.builds(
        lambda count, radius, way: {
            "kind": "prism",
            "corners_m": [
                (radius * math.cos(way * turn), radius * math.sin(way * turn))
                for turn in (2 * math.pi * k / count for k in range(count))
            ],
        },
        st.integers(3, 32),
        st.floats(0.1, 1e6),
        st.sampled_from([-1, 1]),
    ),
)
crowds = st.fixed_dictionaries(
    {},
    optional={
        "speed_mps": speeds,
        "noise_sd_m": st.floats(0, 1e3),
        "step_s": st.one_of(st.none(), st.floats(1e-3, 1e4)),
        "area_m": st.one_of(st.none(), st.tuples(*[st.tuples(coordinates, coordinates)] * 2)),
    },
)

drifts = st.one_of(
    st.none(),
    st.builds(
        lambda amplitude, phase: {"kind": "sinusoid", "amplitude": amplitude, "phase_deg": phase},
        st.floats(0, 1, exclude_max=True),
        st.one_of(st.none(), st.floats(-360, 360)),
    ),
    st.builds(lambda sd: {"kind": "ornstein_uhlenbeck", "sd": sd}, st.floats(0, 2)),
)
pictures = st.builds(
    lambda source, decoys: {"kind": "picture", "source": source, "clutter": decoys},
    st.sampled_from(["photo/coffee", "photo/brick"]),
    st.one_of(st.none(), st.builds(lambda count: {"decoys": count}, st.integers(0, 1000))),
)
optics = st.fixed_dictionaries(
    {},
    optional={
        "background": st.one_of(st.just("photo/brick"), pictures),
        "illumination_drift": drifts,
        "fov_deg": st.floats(0.01, 175),
        # none of these leaves a corner of the widest image without its ray
        "distortion": st.tuples(st.floats(0, 100), st.floats(0, 100)),
    },
)


def directions_of_view(at):
    """Return a point other than the camera's own, or one or more angles."""
    angles = {
        "yaw_deg": st.floats(-360, 360),
        "pitch_deg": st.floats(-90, 90),
        "roll_deg": st.floats(-360, 360),
    }
    points = st.builds(lambda point: {"look_at_m": point}, positions.filter(lambda p: p != at))
    return st.one_of(points, st.fixed_dictionaries({}, optional=angles).filter(bool))


@st.composite
def scenarios(draw):
    ids = draw(st.lists(names, min_size=6, max_size=8, unique=True))
    target, base, relay, person, occluder, *cameras = ids
    camera_positions = [draw(positions) for _ in cameras]
    semi_axes = draw(st.tuples(half_axes, half_axes, half_axes))
    motion = draw(st.one_of(drawn_motions, st.just({"kind": "crowd"})))
    return {
        "name": draw(
            st.sampled_from(["off", "1e6", "null", "12", "0x1f", "a-b", "1_000", "true", "2024-01-01"])
        ),
        "seed": draw(st.integers(0, 2**63 - 1)),
        "duration_s": draw(st.floats(1, 1e7)),
        "world": {
            "size_m": draw(st.tuples(extents, extents, extents)),
            "light": {"ambient": draw(st.floats(0, 1)), "direction": draw(directions)},
            "targets": [
                {
                    "id": target,
                    "shape": {
                        "kind": draw(st.sampled_from(["ellipsoid", "box", "cylinder"])),
                        "semi_axes_m": semi_axes,
                    },
                    "motion": draw(st.one_of(motions, drawn_motions)),
                }
            ],
            "occluders": [{"id": occluder, **draw(occluders)}],
            "people": [
                {
                    "id": person,
                    "count": draw(st.integers(0, 10_000)),
                    "shape": {"kind": "cylinder", "semi_axes_m": semi_axes},
                    "motion": motion,
                }
            ],
            "crowd": draw(crowds) if motion["kind"] == "crowd" else None,
        },
        "cameras": [
            {"id": name, "position_m": at, **draw(directions_of_view(at)), **draw(optics)}
            for name, at in zip(cameras, camera_positions, strict=True)
        ],
        "motes": {
            "nodes": [{"id": relay, "position_m": draw(positions)}],
            "base": {"id": base, "position_m": draw(positions)},
        },
        "system": {
            "kind": "fake_tracker:SYSTEM",
            "note": draw(texts),
            "gain": draw(floats),
            "maybe": draw(st.one_of(st.none(), texts)),
        },
        "expect": draw(st.dictionaries(texts, st.sampled_from(["< 0.12", ">= 0", "== 1e-3"]), max_size=2)),
    }


@settings(deadline=None, max_examples=120, suppress_health_check=[HealthCheck.too_slow])
@given(data=scenarios())
def test_a_resolved_scenario_is_the_same_scenario(tmp_path_factory, data):
    loaded = scenario_from_dict(data)
    file = tmp_path_factory.getbasetemp() / "resolved.yaml"
    file.write_text(resolved_yaml(loaded), encoding="utf-8")
    again = load_scenario(file)
    assert again.scenario == loaded.scenario
    assert again.system_params == loaded.system_params
    assert scenario_hash(again) == scenario_hash(loaded)
    assert math.isclose(math.hypot(*loaded.scenario.world.targets[0].motion.orientation), 1, abs_tol=1e-12)


@st.composite
def damaged(draw):
    """A good scenario in which one value was replaced by any other or a key was renamed."""
    data = json.loads(json.dumps(draw(scenarios())))
    node = data
    while True:
        step = draw(st.sampled_from(sorted(node) if isinstance(node, dict) else range(len(node))))
        inner = node[step]
        if not isinstance(inner, dict | list) or not inner or draw(st.booleans()):
            break
        node = inner
    if isinstance(node, dict) and draw(st.booleans()):
        node[draw(texts)] = node.pop(step)
    else:
        node[step] = draw(st.one_of(trees, st.just(10**400), st.just(math.nan), st.just(-math.inf)))
    return data


@settings(deadline=None, max_examples=250, suppress_health_check=[HealthCheck.too_slow])
@given(data=damaged())
def test_any_damage_is_a_scenario_error_or_harmless(data):
    problems = ()
    try:
        scenario_from_dict(data)
    except ScenarioError as error:
        problems = error.problems
    assert all(problem.message and "Input" not in problem.message for problem in problems)
