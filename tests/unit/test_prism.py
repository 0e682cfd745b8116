"""Prisms: convex polygons that stand upright, against boxes, closed answers and plain geometry."""

import sys
from types import ModuleType

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wsnsim.errors import ScenarioError
from wsnsim.geometry.camera import PinholeCamera
from wsnsim.geometry.polygons import is_convex, polygon_moments
from wsnsim.geometry.rotations import normalise
from wsnsim.report.floorplan import footprint as outline
from wsnsim.rng import RandomStreams
from wsnsim.scenario.load import load_scenario
from wsnsim.sim.propagations import place_propagation
from wsnsim.sim.worlds import build_world
from wsnsim.systems.base import System, SystemParams
from wsnsim.vision.renderer import Renderer
from wsnsim.world import occluders
from wsnsim.world.bodies import Body, PatchTexture
from wsnsim.world.footprints import footprint, footprints
from wsnsim.world.motion import Pose
from wsnsim.world.solids import blocks, contains
from wsnsim.world.world import Placed

GREY = PatchTexture.plain((128.0, 120.0, 110.0))
LIGHT = np.array([-0.48, 0.36, 0.8])


def polygon(generator, count=None):
    """Return the corners of a convex polygon: places on an ellipse, in either order."""
    count = int(generator.integers(3, 12)) if count is None else count
    # no two corners so near that the side between them is lost in rounding
    shares = np.cumsum(generator.uniform(0.3, 1.0, count))
    angles = 2 * np.pi * shares / (shares[-1] + generator.uniform(0.3, 1.0)) + generator.uniform(0, 2 * np.pi)
    corners = np.column_stack([np.cos(angles), np.sin(angles)]) * generator.uniform(0.5, 2.0, 2)
    corners = corners @ normalised_turn(generator) + generator.normal(scale=3.0, size=2)
    return corners[:: generator.choice([-1, 1])]


def normalised_turn(generator):
    turn = generator.uniform(0, 2 * np.pi)
    return np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])


def inside(corners, points):
    """Tell which points (n, 2) are in a convex polygon: on one side of all of its sides."""
    sides = np.roll(corners, -1, axis=0) - corners
    way = points[:, None] - corners
    turns = sides[:, 0] * way[..., 1] - sides[:, 1] * way[..., 0]
    return (turns >= 0).all(axis=1) | (turns <= 0).all(axis=1)


def box_and_prism(generator, yaw=None, texture=GREY):
    """Return the same solid twice."""
    centre, size = generator.normal(size=3), generator.uniform(0.4, 2.0, 3)
    yaw = float(generator.uniform(-np.pi, np.pi)) if yaw is None else yaw
    box = occluders.box(centre, size, yaw, texture)
    corners = footprint(Placed("box", *box))
    prism = occluders.prism(np.roll(corners, 2, axis=0), size[2], centre[2] - size[2] / 2, texture)
    return box, prism


def test_a_prism_stands_on_its_corners():
    corners = np.array([[1.0, 1.0], [4.0, 1.0], [1.0, 4.0]])
    body, pose = occluders.prism(corners, 2.0, 0.5, GREY)
    np.testing.assert_allclose(pose.position, [2.0, 2.0, 1.5])
    np.testing.assert_allclose(body.semi_axes_m, [2.0, 2.0, 1.0])
    points = np.array(
        [
            [1.1, 1.1, 0.51],
            [2.49, 2.49, 2.49],
            [2.51, 2.51, 1.0],
            [2.0, 2.0, 0.49],
            [2.0, 2.0, 2.51],
            [0.99, 2.0, 1],
        ]
    )
    assert contains(body, pose, points).tolist() == [True, True, False, False, False, False]


@settings(deadline=None, max_examples=100)
@given(st.integers(0, 2**31))
def test_what_is_inside_is_over_the_polygon_and_between_the_heights(seed):
    generator = np.random.default_rng(seed)
    corners = polygon(generator)
    body, pose = occluders.prism(corners, 1.5, -0.4, GREY)
    points = np.column_stack(
        [corners.mean(axis=0) + generator.normal(size=(400, 2)), generator.uniform(-1, 2, 400)]
    )
    expected = inside(corners, points[:, :2]) & (points[:, 2] >= -0.4) & (points[:, 2] <= 1.1)
    np.testing.assert_array_equal(contains(body, pose, points), expected)
    np.testing.assert_allclose(
        np.sort(footprint(Placed("p", body, pose)), axis=0), np.sort(corners, axis=0), atol=1e-12
    )


@settings(deadline=None, max_examples=100)
@given(st.integers(0, 2**31))
def test_a_prism_that_is_a_box_holds_and_blocks_what_the_box_does(seed):
    generator = np.random.default_rng(seed)
    box, prism = box_and_prism(generator)
    points = box[1].position + generator.normal(size=(500, 3))
    np.testing.assert_array_equal(contains(*prism, points), contains(*box, points))
    ends = box[1].position + generator.normal(scale=2.0, size=(500, 3))
    ends[:100, :2] = points[:100, :2]  # upright lines, along all sides at once
    np.testing.assert_array_equal(blocks(*prism, points, ends), blocks(*box, points, ends))


@settings(deadline=None, max_examples=25)
@given(st.integers(0, 2**31))
def test_lines_against_points_along_them(seed):
    generator = np.random.default_rng(seed)
    body, pose = occluders.prism(polygon(generator), 1.5, -0.7, GREY)
    origins, ends = pose.position + generator.normal(scale=2.0, size=(2, 200, 3))
    shares = np.linspace(0.0, 1.0, 201)[:, None, None]
    points = origins + shares * (ends - origins)
    met = contains(body, pose, points.reshape(-1, 3)).reshape(201, 200).any(axis=0)
    blocked = blocks(body, pose, origins, ends)
    assert blocked[met].all()
    # a line may pass through an edge between two points: fewer than one in twenty
    assert (blocked & ~met).sum() <= 10
    np.testing.assert_array_equal(blocked, blocks(body, pose, ends, origins))


def test_a_line_along_a_side_of_a_prism():
    body, pose = occluders.prism(np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]), 2.0, 0.0, GREY)
    begins = np.array([[-1.0, 1.999999, 1.0], [-1.0, 2.000001, 1.0], [-1.0, 1.0, 2.000001], [1.0, 1.0, 1.0]])
    ends = begins + [[4.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 0.0, 0.0]]
    assert blocks(body, pose, begins, ends).tolist() == [True, False, False, True]


def photo(camera, scenery, bodies=(), poses=()):
    width, height = camera.resolution_px
    background = np.random.default_rng(0).integers(0, 256, (height, width, 3), dtype=np.uint8)
    view = Renderer(camera, "c", background, 0.0, 0.0, LIGHT, 0.4, RandomStreams(0), scenery)
    return view.render(1, bodies, poses), view.visible_pixels(bodies, poses)


@pytest.mark.parametrize("distortion", [(0.0, 0.0), (-0.25, 0.05)])
@pytest.mark.parametrize("moving", [False, True])
def test_a_prism_that_is_a_box_looks_like_it(moving, distortion, test_seed):
    generator = np.random.default_rng(test_seed)
    differing, seen = 0, 0.0
    for _ in range(6):
        # a box that is not turned has the prism's axes, so that patches lie alike
        pair = box_and_prism(generator, 0.0, PatchTexture.random(generator))
        side = generator.normal(size=3) * [1, 1, 0.4]
        eye = pair[0][1].position + 4.0 * side / np.linalg.norm(side)
        camera = PinholeCamera.look_at(eye, pair[0][1].position, 100.0, (120, 90), distortion)
        ball = Body(generator.uniform(0.15, 0.35, 3), PatchTexture.random(generator))
        before = Pose(
            0.5 * (eye + pair[0][1].position) + 0.3, np.zeros(3), normalise(generator.normal(size=4))
        )
        (box, box_areas), (prism, prism_areas) = (
            photo(camera, [], [ball, each[0]], [before, each[1]])
            if moving
            else photo(camera, [Placed("it", *each)], [ball], [before])
            for each in pair
        )
        # the same to rounding: a sample on an edge, or on the border of two patches, may go either way
        np.testing.assert_allclose(prism_areas, box_areas, atol=0.25)
        differing += (np.abs(prism.astype(int) - box.astype(int)).max(axis=2) > 1).sum()
        seen += box_areas[-1]
    assert differing <= 6
    assert seen > 1000.0


def test_a_turned_prism_is_lit_like_the_box(test_seed):
    generator = np.random.default_rng(test_seed + 1)
    for _ in range(6):
        box, prism = box_and_prism(generator)
        eye = box[1].position + [4.0, 1.0, 2.5]
        camera = PinholeCamera.look_at(eye, box[1].position, 100.0, (120, 90))
        first, second = (photo(camera, [Placed("it", *each)])[0] for each in (box, prism))
        assert (np.abs(first.astype(int) - second.astype(int)).max(axis=2) > 1).sum() <= 2


@pytest.mark.parametrize("count", [3, 5, 32])
def test_the_outline_in_the_image_is_that_of_the_corners(count, test_seed):
    """From straight above at a distance: the area of the polygon, times f² / z²."""
    generator = np.random.default_rng(test_seed + count)
    corners = polygon(generator, count) if count < 32 else 2 * circle(32)
    body, pose = occluders.prism(corners, 0.01, 0.0, GREY)
    eye = pose.position + [0.0, 0.0, 20.0]
    camera = PinholeCamera.look_at(eye, pose.position + [1e-3, 0, 0], 900.0, (400, 400))
    _, (area,) = photo(camera, [], [body], [pose])
    assert area == pytest.approx(polygon_moments(corners)[0] * (900 / 19.995) ** 2, rel=0.01)


def circle(count):
    angles = 2 * np.pi * np.arange(count) / count
    return np.column_stack([np.cos(angles), np.sin(angles)])


def test_a_camera_inside_a_prism_sees_past_it():
    corners = np.array([[0.0, 0.0], [4.0, 0.0], [0.0, 4.0]])
    body, pose = occluders.prism(corners, 2.0, 0.0, GREY)
    for place, seen in (([1.0, 1.0, 1.0], False), ([3.0, 3.0, 1.0], True)):
        camera = PinholeCamera.look_at(place, (0.0, 0.5, 0.9), 60.0, (80, 60))
        assert (photo(camera, [], [body], [pose])[1][0] > 0) == seen


def test_footprints_of_walls_boxes_and_pillars():
    wall = Placed("w", *occluders.wall(np.array([1.0, 2.0]), np.array([4.0, 6.0]), 0.2, 2.5, 0.5, GREY))
    across = 0.1 * np.array([-0.8, 0.6])
    ends = [end + side for end in ([1.0, 2.0], [4.0, 6.0]) for side in (across, -across)]
    np.testing.assert_allclose(sorted(footprint(wall).tolist()), sorted(map(list, ends)), atol=1e-12)
    pillar = Placed("p", *occluders.pillar(np.array([3.0, 4.0]), 0.5, 3.0, 1.0, GREY))
    about = footprint(pillar)
    assert about.shape == (24, 2)
    middles = 0.5 * (about + np.roll(about, -1, axis=0))
    np.testing.assert_allclose(np.hypot(*(middles - [3.0, 4.0]).T), 0.5)
    np.testing.assert_allclose(np.hypot(*(about - [3.0, 4.0]).T), 0.5 * 1.00863, rtol=1e-5)
    assert polygon_moments(about)[0] == pytest.approx(np.pi * 0.25 * 1.0057, rel=1e-4)
    assert is_convex(about)
    # the wall from 0.5 to 3, the pillar from 1 to 4
    assert [len(footprints((wall, pillar), height)) for height in (0.4, 0.5, 1.0, 3.0, 4.0)] == [
        0,
        1,
        2,
        1,
        0,
    ]
    assert [len(footprints((wall, pillar), 0.0, top)) for top in (0.4, 0.7, 1.2)] == [0, 1, 2]


@settings(deadline=None, max_examples=50)
@given(st.integers(0, 2**31))
def test_footprints_hold_what_their_things_cover(seed):
    generator = np.random.default_rng(seed)
    made = (
        occluders.prism(polygon(generator), 1.0, 0.0, GREY),
        occluders.box(generator.normal(size=3), generator.uniform(0.3, 2, 3), generator.uniform(-3, 3), GREY),
        occluders.pillar(generator.normal(size=2), 0.7, 1.0, 0.0, GREY),
    )
    for body, pose in made:
        corners = footprint(Placed("it", body, pose))
        assert is_convex(corners)
        points = pose.position + np.column_stack([generator.normal(size=(500, 2)), np.zeros(500)])
        covered = contains(body, pose, points)
        assert inside(corners, points[covered, :2]).all()
        # as drawn in reports, of a pillar with 48 corners on the circle
        drawn = outline(body, pose)
        assert inside(corners, drawn + 1e-9 * (corners.mean(axis=0) - drawn)).all()
        # 48 corners on the circle and 24 about it: 24 sin(π/24) r² and 24 tan(π/24) r²
        lost = np.cos(np.pi / 24) if body.form == "cylinder" else 1.0
        assert polygon_moments(drawn[:-1])[0] == pytest.approx(lost * polygon_moments(corners)[0], rel=1e-9)


@pytest.mark.parametrize(
    "corners",
    [
        [[0, 0], [1, 0]],
        [[0, 0], [2, 0], [2, 2], [1, 0.5], [0, 2]],
        [[0, 0], [1, 0], [2, 0], [0, 2]],
        [[0, 0]] * 4,
    ],
)
def test_bodies_that_are_no_prisms(corners):
    with pytest.raises(ValueError, match="corners_m: must make a convex polygon with an area"):
        Body(np.ones(3), GREY, "prism", np.array(corners, dtype=float))


SCENARIO = """\
duration_s: 5
world:
  size_m: [10, 10, 4]
  occluders:
    - {id: block, kind: prism, corners_m: [[3, 3], [6, 3], [7, 5], [4, 6]], height_m: 2, attenuation_db: 7}
  targets:
    - id: it
      shape: {kind: box, semi_axes_m: [0.2, 0.2, 0.2]}
      motion: {kind: waypoints, points_m: [[1, 1, 1]]}
cameras:
  - {id: c1, position_m: [0, 0, 3], look_at_m: [5, 5, 1]}
motes:
  base: {position_m: [9, 9, 1]}
system: {kind: "fake_tracker:SYSTEM"}
"""


@pytest.fixture
def build(tmp_path, monkeypatch):
    """Build the world of the scenario with overrides."""
    module = ModuleType("fake_tracker")
    module.SYSTEM = System("fake", "nobody", SystemParams, (), lambda params, site, node, role: None)
    monkeypatch.setitem(sys.modules, "fake_tracker", module)
    (tmp_path / "s.yaml").write_text(SCENARIO)

    def make(*overrides):
        return build_world(load_scenario(tmp_path / "s.yaml", overrides), RandomStreams(0))

    return make


def test_a_scenario_with_a_prism(build):
    (block,) = build().scenery
    expected = [[3, 3], [6, 3], [7, 5], [4, 6]]
    np.testing.assert_allclose(footprint(block), expected, atol=1e-12)
    assert block.pose.position[2] == 1.0
    backwards = build("world.occluders[0].corners_m=[[4, 6], [7, 5], [6, 3], [3, 3]]").scenery[0]
    points = np.random.default_rng(0).uniform(0, 8, (1000, 3))
    np.testing.assert_array_equal(
        contains(block.body, block.pose, points), contains(backwards.body, backwards.pose, points)
    )


def test_links_through_a_prism_lose_what_it_costs(tmp_path, build):
    build()
    among, free = (
        place_propagation(load_scenario(tmp_path / "s.yaml", [f"network.propagation.walls={walls}"]).scenario)
        for walls in ("{loss_db: 5}", "null")
    )
    places = np.array([[0.0, 4.0, 1.0], [9.0, 4.0, 1.0], [9.0, 0.0, 1.0], [9.0, 4.0, 5.0]])
    links = np.zeros(3, dtype=np.int64), np.array([1, 2, 3])
    np.testing.assert_allclose(among.loss_db(places, *links) - free.loss_db(places, *links), [7, 0, 0])


@pytest.mark.parametrize(
    ("corners", "expected"),
    [
        ("[[3, 3], [6, 3]]", "corners_m: must have at least 3 items, got 2"),
        (str([[k, k * k] for k in range(33)]), "corners_m: must have at most 32 items, got 33"),
        (
            "[[3, 3], [6, 3], [7, 5], [5, 4], [4, 6]]",
            "corners_m: must make a convex polygon, got one that turns back at [5.0, 4.0] (corner 4) [m]",
        ),
        (
            "[[3, 3], [5, 3], [6, 3], [4, 6]]",
            "corners_m: must turn at each corner, got a straight one at [5.0, 3.0] (corner 2) [m]",
        ),
        (
            "[[0.1, 0.1], [0.2, 0.2], [0.3, 0.3]]",
            "corners_m: must make a polygon with an area, got one that folds back at [0.1, 0.1]",
        ),
        (
            "[[3, 3], [6, 3], [4, 3]]",
            "corners_m: must make a polygon with an area, got one that folds back at [3.0, 3.0]",
        ),
        (
            "[[3, 3], [6, 3], [6, 3], [4, 6]]",
            "corners_m: must have sides of 0.001 m or more, got two corners at [6.0, 3.0]",
        ),
        (
            "[[3, 3], [6, 3], [4, 6], [3, 3]]",
            "corners_m: must have sides of 0.001 m or more, got two corners at [3.0, 3.0]",
        ),
        (
            "[[5, 9], [6, 3], [2, 7], [8, 7], [3, 3]]",
            "corners_m: must go round once, got a polygon that crosses itself",
        ),
        ("[[3, 3], [6, 3, 1], [4, 6]]", "corners_m[1]: must have exactly 2 items, got 3"),
    ],
)
def test_what_is_refused(build, corners, expected):
    with pytest.raises(ScenarioError) as caught:
        build(f"world.occluders[0].corners_m={corners}")
    assert f"world.occluders[0].{expected}" in str(caught.value)


def test_nobody_stands_in_a_prism(build):
    with pytest.raises(ScenarioError, match=r'inside world.occluders\[0\] \("block"\)'):
        build("world.targets[0].motion.points_m=[[5, 4, 1]]")
    with pytest.raises(ScenarioError, match=r"cameras\[0\].*must be outside the occluders"):
        build("cameras[c1].position_m=[5, 4, 1.9]")
