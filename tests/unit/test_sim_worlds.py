"""The world as built from a scenario: who is where, and what is refused before anything moves."""

# ruff: noqa: E501  (an error is one line, here as on the screen)

import sys
from types import ModuleType

import numpy as np
import pytest
from scipy.stats import kstest

from wsnsim.errors import ScenarioError
from wsnsim.geometry.rotations import quaternion_from_axis_angle
from wsnsim.rng import RandomStreams
from wsnsim.scenario.load import load_scenario
from wsnsim.sim.worlds import build_world
from wsnsim.systems.base import System, SystemParams
from wsnsim.world.solids import contains

GOOD = """\
duration_s: 10
world:
  size_m: [20, 10, 4]
  occluders:
    - {id: wall, kind: wall, from_m: [10, 2], to_m: [10, 8], thickness_m: 0.2}
    - {id: desk, kind: box, centre_m: [4, 8, 0.4], size_m: [2, 1, 0.8], yaw_deg: 30, texture: {colour: [90, 60, 30]}}
    - {id: post, kind: pillar, centre_m: [15, 5], radius_m: 0.3, height_m: 4, texture: {kind: patches, seed: 3}}
  targets:
    - id: box
      shape: {kind: box, semi_axes_m: [0.4, 0.3, 0.2]}
      motion: {kind: waypoints, points_m: [[2, 2, 1], [8, 2, 1]], speed_mps: 0.5}
  people:
    - id: crowd
      count: 30
      shape: {kind: cylinder, semi_axes_m: [0.25, 0.2, 0.85], texture: {kind: plain, colour: [200, 30, 30]}}
      motion: {kind: random_waypoint, speed_mps: [0.5, 1.5], pause_s: 1}
    - id: guard
      shape: {kind: ellipsoid, semi_axes_m: [0.25, 0.2, 0.85]}
      motion: {kind: gauss_markov, area_m: [[19, 9, 0.9], [11, 1, 0.9]]}
cameras:
  - {id: c1, position_m: [0, 0, 3], look_at_m: [16, 9, 1], rate_hz: 4}
motes:
  nodes: [{id: relay, position_m: [10, 1, 3]}]
  base: {position_m: [16, 0, 2]}
system: {kind: "fake_tracker:SYSTEM"}
"""


@pytest.fixture(autouse=True)
def tracker(monkeypatch):
    module = ModuleType("fake_tracker")
    module.SYSTEM = System("fake", "nobody", SystemParams, (), lambda params, site, node, role: None)
    monkeypatch.setitem(sys.modules, "fake_tracker", module)


@pytest.fixture
def world(tmp_path, monkeypatch):
    """Build the world of a text with overrides."""
    monkeypatch.chdir(tmp_path)

    def make(*overrides, text=GOOD, seed=0):
        (tmp_path / "s.yaml").write_text(text)
        loaded = load_scenario("s.yaml", overrides, seed)
        return build_world(loaded, RandomStreams(loaded.scenario.seed))

    return make


@pytest.fixture
def problems(world, tmp_path):
    """Build a world that cannot be built, and return the lines of the error."""

    def make(*overrides, text=GOOD):
        with pytest.raises(ScenarioError) as caught:
            world(*overrides, text=text)
        return [line.replace(f"{tmp_path}/", "") for line in str(caught.value).splitlines()]

    return make


def replaced(old, new):
    assert old in GOOD
    return GOOD.replace(old, new)


def test_all_bodies(world):
    built = world()
    assert [placed.id for placed in built.scenery] == ["wall", "desk", "post"]
    assert [placed.body.form for placed in built.scenery] == ["box", "box", "cylinder"]
    np.testing.assert_array_equal(built.scenery[1].body.texture.colours, [[90, 60, 30]])
    assert len(built.scenery[2].body.texture.colours) == 18
    assert [mover.id for mover in built.people] == [*(f"crowd-{n}" for n in range(1, 31)), "guard"]
    assert built.targets[0].body.form == "box"
    assert built.people[0].body.form == "cylinder"
    assert len(built.moving_at(3.0)) == len(built.moving_bodies) == 32


def test_crowds_start_on_the_floor_outside_the_occluders_and_part(world):
    built = world("world.people[crowd].count=300")
    starts = np.array([mover.motion.at(0.0).position for mover in built.people[:300]])
    assert (starts[:, 2] == 0.85).all()
    assert (starts[:, :2] >= 0.25).all()
    assert (starts[:, :2] <= [19.75, 9.75]).all()
    assert not any(contains(placed.body, placed.pose, starts).any() for placed in built.scenery)
    assert len(np.unique(starts[:, 0])) == 300
    assert kstest(starts[:, 0], "uniform", args=(0.25, 19.5)).pvalue > 1e-4
    guard = np.array([built.people[-1].motion.at(t).position for t in np.arange(0.0, 10.0, 0.1)])
    assert (guard >= [11, 1, 0.9]).all()
    assert (guard <= [19, 9, 0.9]).all()


def test_a_person_more_changes_nobody_else(world):
    fewer, more = world(), world("world.people[crowd].count=31", "world.occluders[post].radius_m=0.31")
    for before, after in zip(fewer.people[:30], more.people[:30], strict=True):
        np.testing.assert_array_equal(before.motion.at(7.0).position, after.motion.at(7.0).position)
    other = world(seed=1)
    assert not np.array_equal(
        fewer.people[0].motion.at(7.0).position, other.people[0].motion.at(7.0).position
    )


def test_spin_by_override(world):
    still = world().targets[0].motion.at(2.0)
    turned = world("world.targets[box].motion.spin.rate_radps=0.5").targets[0].motion.at(2.0)
    np.testing.assert_array_equal(still.orientation, [1, 0, 0, 0])
    np.testing.assert_allclose(turned.orientation, quaternion_from_axis_angle((0, 0, 1), 1.0))
    np.testing.assert_array_equal(turned.position, still.position)


def test_a_given_start_and_heading(world):
    motion = (
        "{kind: gauss_markov, start_m: [1, 5, 0.2], mean_speed_mps: 0.5, heading_deg: 60, sd_mps: [0, 0, 0]}"
    )
    built = world(f"world.targets[box].motion={motion}")
    pose = built.targets[0].motion.at(4.0)
    np.testing.assert_allclose(pose.position, [2.0, 5.0 + np.sqrt(3.0), 0.2])
    np.testing.assert_allclose(pose.velocity, [0.25, 0.25 * np.sqrt(3.0), 0.0])


def test_constant_velocity(world):
    motion = "{kind: constant_velocity, start_m: [1, 5, 0.5], velocity_mps: [0.5, -0.25, 0.1]}"
    pose = world(f"world.targets[box].motion={motion}").targets[0].motion.at(4.0)
    np.testing.assert_allclose(pose.position, [3.0, 4.0, 0.9])


def test_who_leaves_is_named_with_time_and_place(problems, world):
    text = replaced("speed_mps: 0.5}\n", "speed_mps: 8}\n").replace("[8, 2, 1]]", "[18, 2, 1], [18, 12, 1]]")
    assert problems(text=text) == [
        "s.yaml:11:15: world.targets[0].motion: must stay inside the world's size_m [20.0, 10.0, 4.0], but is at "
        "[18, 12, 1] m after 3.25 s; change motion or size_m, or set world.leaving: allow"
    ]
    assert world("world.leaving=allow", text=text).targets[0].motion.at(9.0).position[1] == 12.0


def test_the_last_image_counts_and_what_comes_later_does_not(problems, world):
    moving = (
        "world.targets[box].motion={kind: constant_velocity, start_m: [10.5, 5, 1], velocity_mps: [%s, 0, 0]}"
    )
    world(moving % 0.95)  # at the wall exactly at the last image
    (line,) = problems(moving % 0.951)
    assert "[20.01, 5, 1] m after 10 s" in line


def test_the_seed_of_a_jitter_is_told(problems):
    (line,) = problems("world.targets[box].motion.jitter_m=5")
    assert " s with seed 0; change motion" in line


def test_starts_outside_the_world(problems, world):
    outside = "world.people[guard].motion={kind: waypoints, points_m: [[-1, 5, 1], [1, 5, 1]]}"
    (line,) = problems(outside)
    assert line.startswith("--set world.people[guard].motion=")
    assert "world.people[1].motion: must stay inside the world's size_m" in line
    assert "[-1, 5, 1] m after 0 s" in line
    world(outside, "world.leaving=allow")


def test_nobody_and_nothing_in_a_wall(problems):
    text = GOOD.replace("position_m: [0, 0, 3]", "position_m: [10, 5, 2]")
    text = text.replace("position_m: [10, 1, 3]", "position_m: [15.1, 5.1, 3]")
    text = text.replace("base: {position_m: [16, 0, 2]}", "base: {position_m: [4, 8, 0.5]}")
    text = text.replace("points_m: [[2, 2, 1]", "points_m: [[4, 8, 0.7]")
    inside = "must be outside the occluders, got"
    assert problems(text=text) == [
        f's.yaml:21:26: cameras[0].position_m: {inside} [10.0, 5.0, 2.0], inside world.occluders[0] ("wall")',
        f's.yaml:23:35: motes.nodes[0].position_m: {inside} [15.1, 5.1, 3.0], inside world.occluders[2] ("post")',
        f's.yaml:24:22: motes.base.position_m: {inside} [4.0, 8.0, 0.5], inside world.occluders[1] ("desk")',
        "s.yaml:11:15: world.targets[0].motion: must start outside the occluders, got [4, 8, 0.7] m, "
        'inside world.occluders[1] ("desk")',
    ]


def test_areas_of_no_use(problems):
    motion = "world.people[guard].motion"
    (line,) = problems(f"{motion}.area_m=[[1, 1, 0.9], [21, 9, 0.9]]")
    assert (
        "world.people[1].motion.area_m: must lie inside the world's size_m [20.0, 10.0, 4.0], got [[1.0"
        in line
    )
    (line,) = problems(f"{motion}.start_m=[1, 1, 0.9]")
    assert (
        "motion.start_m: must lie in the area, [11.0, 1.0, 0.9] to [19.0, 9.0, 0.9], got [1.0, 1.0, 0.9]"
        in line
    )
    (line,) = problems(f"{motion}={{kind: random_waypoint, area_m: [[1, 1, 1], [1, 1, 1]]}}")
    assert "world.people[1].motion.area_m: must have an extent" in line
    (line,) = problems(f"{motion}={{kind: random_waypoint, area_m: [[10, 3, 1], [10, 7, 1]]}}")
    assert "motion.area_m: must hold a place outside the occluders, but none of 1024" in line
    (line,) = problems(
        "world.people[guard].motion.area_m=null", "world.people[guard].shape.semi_axes_m=[6, 6, 1]"
    )
    assert "motion.area_m: must be given: the body does not fit into the world's size_m" in line
    (line,) = problems("duration_s=2500", f"{motion}.interval_s=0.001")
    assert "motion.interval_s: must give at most 2000000 intervals in 2500 s, got 0.001 s" in line


def test_a_crowd_fails_once(problems):
    lines = problems("world.people[crowd].motion.area_m=[[10, 3, 1], [10, 7, 1]]")
    assert len(lines) == 1


def test_names_are_told_apart(problems):
    text = GOOD.replace("id: guard", "id: crowd-7").replace("id: post", "id: box")
    assert problems(text=text) == [
        's.yaml:7:12: world.occluders[2].id: must be a name of its own, got "box", which world.targets[0].id has too',
        's.yaml:17:11: world.people[1].id: must be a name of its own, got "crowd-7", '
        "which one of the crowd world.people[0] has too",
    ]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "kind: pillar",
            "kind: piller",
            'world.occluders[2].kind: must be "wall", "box", "pillar" or "prism", got "piller"; did you mean "pillar"?',
        ),
        (
            "kind: plain, colour",
            "kind: plane, colour",
            'world.people[0].shape.texture.kind: must be "patches" or "plain", got "plane"; did you mean "plain"?',
        ),
        ("[90, 60, 30]", "[90, 60]", "world.occluders[1].texture.colour: must have exactly 3 items, got 2"),
        (
            "[90, 60, 30]",
            "[90, 60, 300]",
            "world.occluders[1].texture.colour[2]: must be at most 255, got 300",
        ),
        ("to_m: [10, 8]", "to_m: [10, 2]", "world.occluders[0]: must be 0.001 m long or more"),
        ("radius_m: 0.3", "radius: 0.3", 'world.occluders[2].radius: unknown key; did you mean "radius_m"?'),
        ("yaw_deg: 30", "yaw_deg: .inf", "world.occluders[1].yaw_deg: must be a finite number, got inf"),
        ("count: 30", "count: -1", "world.people[0].count: must be at least 0, got -1"),
        (
            "{kind: random_waypoint, speed_mps: [0.5, 1.5], pause_s: 1}",
            "{kind: waypoints, points_m: [[1, 1, 1]]}",
            "world.people[0]: a count of 30 must have a motion that is drawn for each (waypoints: with jitter_m), "
            "got waypoints",
        ),
        ("[0.5, 1.5]", "[1.5, 0.5]", "speed_mps must name the least speed first, got 1.5 and 0.5"),
        ("[0.5, 1.5]", "[0, 0.5]", "world.people[0].motion.speed_mps[0]: must be greater than 0, got 0"),
        (
            "kind: gauss_markov",
            "kind: gaus_markov",
            'got "gaus_markov"; did you mean "gauss_markov"?',
        ),
    ],
)
def test_what_a_person_reads(problems, old, new, message):
    lines = problems(text=replaced(old, new))
    assert any(message in line for line in lines), lines
    assert all(line.startswith("s.yaml:") for line in lines)
