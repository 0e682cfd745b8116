"""A crowd as a scenario asks for it: who belongs to it, what is in its way, and what is refused."""

import sys
from types import ModuleType

import numpy as np
import pytest

from wsnsim.errors import ScenarioError
from wsnsim.rng import RandomStreams
from wsnsim.scenario.load import load_scenario, scenario_from_dict
from wsnsim.scenario.resolved import resolved_yaml, scenario_hash
from wsnsim.scenario.yaml_marks import read_yaml_text
from wsnsim.sim.worlds import build_world
from wsnsim.systems.base import System, SystemParams
from wsnsim.world.footprints import footprints
from wsnsim.world.solids import contains

GOOD = """\
duration_s: 80
world:
  size_m: [12, 10, 3]
  crowd: {speed_mps: 1.2, noise_sd_m: 0.04}
  occluders:
    - {id: block, kind: box, centre_m: [6, 5, 1], size_m: [3, 2, 2], yaw_deg: 30}
    - {id: wall, kind: wall, from_m: [2, 7], to_m: [4, 9], height_m: 3}
    - {id: post, kind: pillar, centre_m: [9.5, 2], radius_m: 0.3, height_m: 3}
    - {id: corner, kind: prism, corners_m: [[0, 0], [2, 0], [0, 2]]}
    - {id: shelf, kind: box, centre_m: [6, 5, 2.6], size_m: [12, 10, 0.4]}
  targets:
    - {id: it, shape: {kind: cylinder, semi_axes_m: [0.25, 0.2, 0.85]}, motion: {kind: crowd}}
  people:
    - id: walker
      count: 9
      shape: {kind: ellipsoid, semi_axes_m: [0.2, 0.3, 0.9]}
      motion: {kind: crowd}
    - id: guard
      shape: {kind: ellipsoid, semi_axes_m: [0.2, 0.2, 0.9]}
      motion: {kind: random_waypoint}
cameras:
  - {id: c1, position_m: [0, 5, 2.9], look_at_m: [6, 5, 1], rate_hz: 5}
motes:
  base: {position_m: [12, 0, 2.9]}
system: {kind: "fake_tracker:SYSTEM"}
"""
STANDING = "world.targets[0].motion={kind: waypoints, points_m: [[1, 5, 1]]}"
FAR_M = 0.6
"""Twice the largest horizontal semi-axis."""


@pytest.fixture(autouse=True)
def tracker(monkeypatch):
    module = ModuleType("fake_tracker")
    module.SYSTEM = System("fake", "nobody", SystemParams, (), lambda params, site, node, role: None)
    monkeypatch.setitem(sys.modules, "fake_tracker", module)


@pytest.fixture
def world(tmp_path):
    """Build the world of a text with overrides."""

    def make(*overrides, seed=0, text=GOOD):
        file = tmp_path / "s.yaml"
        file.write_text(text)
        loaded = load_scenario(file, overrides, seed)
        return build_world(loaded, RandomStreams(loaded.scenario.seed))

    return make


def members(world):
    """Return everybody but the guard."""
    return [mover for mover in (*world.targets, *world.people) if mover.id != "guard"]


def walked(world, times):
    """Return the places (t, n, 3) of the crowd."""
    return np.array([[mover.motion.at(time).position for mover in members(world)] for time in times])


def test_all_walk_together_and_meet_nothing(world, test_seed):
    built = world(seed=test_seed)
    assert [mover.id for mover in members(built)] == ["it", *(f"walker-{n}" for n in range(1, 10))]
    places = walked(built, np.arange(401) / 5)
    np.testing.assert_allclose(places[..., 2], [[0.85] + [0.9] * 9] * 401)
    flat = places[..., :2]
    apart = np.linalg.norm(flat[:, :, None] - flat[:, None], axis=3) + 1e9 * np.eye(10)
    # places are exact at the steps but for the rounding of an instant
    assert apart.min() >= FAR_M - 1e-9
    assert flat.min() >= FAR_M / 2 - 1e-9
    assert (flat <= np.array([12.0, 10.0]) - FAR_M / 2 + 1e-9).all()
    for mover, path in zip(members(built), np.moveaxis(places, 1, 0), strict=True):
        at_ease = path + np.array([0.0, 0.0, -mover.body.semi_axes_m[2] + 1.0])
        for placed in built.scenery[:4]:
            assert not contains(placed.body, placed.pose, at_ease).any()
    assert all(mover.motion.at(3.3).velocity[2] == 0.0 for mover in members(built))


def test_they_keep_half_a_diameter_from_every_footprint(world, test_seed):
    built = world(seed=test_seed)
    flat = walked(built, np.arange(401) / 5)[..., :2].reshape(-1, 2)
    for polygon in footprints(built.scenery[:4], 0.0, 1.8):
        corners = np.array(polygon)
        sides = np.roll(corners, -1, axis=0) - corners
        along = np.clip(((flat[:, None] - corners) * sides).sum(axis=2) / (sides**2).sum(axis=1), 0.0, 1.0)
        distances = np.linalg.norm(corners + along[..., None] * sides - flat[:, None], axis=2)
        assert distances.min() >= FAR_M / 2 - 1e-9


def test_speed_noise_and_step(world, test_seed):
    built = world(
        "world.crowd.noise_sd_m=0", "world.crowd.step_s=0.5", "world.people[0].count=0", seed=test_seed
    )
    (it,) = members(built)
    np.testing.assert_allclose(it.motion.times, 0.5 * np.arange(161))
    lengths = np.linalg.norm(np.diff(it.motion.points, axis=0), axis=1)
    # alone and without noise nobody ever takes another length; who cannot go on stands for a step
    assert np.all(np.isclose(lengths, 0.6) | (lengths == 0.0))
    assert (lengths > 0.0).mean() > 0.9
    noisy = world("world.crowd.noise_sd_m=0.04", "world.people[0].count=0", seed=test_seed)
    steps = np.linalg.norm(np.diff(members(noisy)[0].motion.points, axis=0), axis=1)
    assert len(steps) == 400
    walking = steps[steps > 0.0]
    # a step of 0.24 m with noise of 0.04 m on each axis
    bound = 4 * 0.04 / np.sqrt(len(walking))
    assert walking.mean() == pytest.approx(np.sqrt(0.24**2 + 0.04**2), abs=bound)
    assert walking.std() == pytest.approx(0.04, rel=4 / np.sqrt(2 * len(walking)))


def test_a_longer_run_goes_on_where_a_shorter_one_ends(world):
    times = np.arange(401) / 5
    np.testing.assert_array_equal(walked(world(), times), walked(world("duration_s=300"), times))
    assert not np.array_equal(walked(world(), times), walked(world(seed=1), times))


def test_who_walks_alone_walks_as_without_the_crowd(world):
    changes = ["world.crowd=null", STANDING, "world.people[0].motion={kind: random_waypoint}"]
    for time in (0.0, 7.3, 80.0):
        np.testing.assert_array_equal(
            world().people[-1].motion.at(time).position, world(*changes).people[-1].motion.at(time).position
        )


@pytest.mark.parametrize(("count", "names"), [(0, []), (1, ["walker"]), (2, ["walker-1", "walker-2"])])
def test_a_study_over_the_crowd_begins_with_nobody(world, count, names):
    built = world(f"world.people[0].count={count}")
    assert [each.id for each in built.people] == [*names, "guard"]
    assert built.targets[0].motion.at(80.0).position[2] == 0.85
    without_target = world(f"world.people[0].count={count}", STANDING)
    assert [each.id for each in without_target.people] == [*names, "guard"]


@pytest.mark.parametrize("motion", ["waypoints, points_m: [[1, 5, 1]]", "random_waypoint", "crowd"])
def test_nobody_at_all(world, motion):
    built = world(f"world.people[1].motion={{kind: {motion}}}", "world.people[1].count=0")
    assert [each.id for each in built.people] == [f"walker-{n}" for n in range(1, 10)]


def test_an_area_holds_them(world, test_seed):
    built = world("world.crowd.area_m=[[11, 9], [7, 4]]", "world.people[0].count=4", seed=test_seed)
    flat = walked(built, np.arange(401) / 5)[..., :2]
    assert (flat >= np.array([7.3, 4.3]) - 1e-9).all()
    assert (flat <= np.array([10.7, 8.7]) + 1e-9).all()
    far = world(
        "world.crowd.area_m=[[-9, 0], [3, 10]]",
        "world.leaving=allow",
        "world.people[0].count=4",
        seed=test_seed,
    )
    assert walked(far, np.arange(401) / 5)[..., 0].min() < -5.0


def test_they_go_round_cameras_at_their_height_and_below_others(world, test_seed):
    places = [[4.0, 3.0], [8.0, 8.0], [10.0, 5.0]]
    text = GOOD.replace("duration_s: 80", "duration_s: 400")

    def nearest(height):
        cameras = ", ".join(
            f"{{id: c{n}, position_m: [{x}, {y}, {height}], look_at_m: [6, 5, 1], rate_hz: 5}}"
            for n, (x, y) in enumerate(places)
        )
        flat = walked(world(f"cameras=[{cameras}]", text=text, seed=test_seed), np.arange(2001) / 5)[..., :2]
        return np.linalg.norm(flat[:, :, None] - np.array(places), axis=3).min(axis=(0, 1))

    assert (nearest(1.0) >= FAR_M / 2).all()
    assert (nearest(2.2) < FAR_M / 2).all()


@pytest.mark.parametrize(
    ("overrides", "expected"),
    [
        (
            ["world.crowd=null", "world.people[0].motion={kind: random_waypoint}"],
            "world.targets[0].motion.kind: must have a world.crowd to walk with: write crowd: {} under world",
        ),
        (
            [STANDING, "world.people=[]"],
            "world.crowd: must have members: give targets or people motion: {kind: crowd}, or leave it out",
        ),
        (["world.crowd.speed_mps=0"], "world.crowd.speed_mps: must be greater than 0, got 0"),
        (["world.crowd.noise_sd_m=-1"], "world.crowd.noise_sd_m: must be at least 0, got -1"),
        (["world.crowd.step_s=0"], "world.crowd.step_s: must be at least 0.001, got 0"),
        (["world.crowd.pace=1"], "world.crowd.pace: unknown key"),
        (["cameras=[]"], "world.crowd.step_s: must be given: there is no camera whose frame period"),
        (
            ["world.people[0].count=2000"],
            "world.crowd: room: must hold 2001 bodies of 0.6 m beside its walls",
        ),
        (["world.occluders[0].size_m=[40, 40, 2]"], "world.crowd: room: must hold 10 bodies"),
        (["world.targets[0].shape.semi_axes_m=[6, 6, 1]"], "world.crowd: low, high: must leave room"),
        (["world.crowd.area_m=[[3, 3], [3, 9]]"], "world.crowd: low, high: must leave room"),
        (["world.crowd.area_m=[[3, 3], [13, 9]]"], "world.crowd.area_m: must lie inside the world's size_m"),
        (
            ["world.crowd.step_s=0.001", "duration_s=10000"],
            "world.crowd: step_s: must give at most 10000000 steps of all bodies in 10000 s",
        ),
    ],
)
def test_what_is_refused(world, overrides, expected):
    with pytest.raises(ScenarioError) as caught:
        world(*overrides)
    assert expected in "\n".join(f"{problem.path}: {problem.message}" for problem in caught.value.problems)


def test_a_crowd_without_room_hides_no_other_fault(world):
    with pytest.raises(ScenarioError) as caught:
        world("world.people[0].count=500", "cameras[c1].position_m=[6, 5.1, 1]")
    assert [problem.path for problem in caught.value.problems] == ["world.crowd", "cameras[0].position_m"]


def test_what_is_written_is_read_again(tmp_path):
    file = tmp_path / "s.yaml"
    file.write_text(GOOD)
    loaded = load_scenario(file)
    again = scenario_from_dict(read_yaml_text(resolved_yaml(loaded)).data)
    assert again.scenario == loaded.scenario
    assert scenario_hash(again) == scenario_hash(loaded)
    assert again.scenario.world.crowd.step_s is None
    assert again.scenario.world.occluders[3].corners_m == ((0.0, 0.0), (2.0, 0.0), (0.0, 2.0))
