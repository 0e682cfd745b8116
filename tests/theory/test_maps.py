"""Maps before a run: views, sizes and margins that can be worked out by hand."""

import math

import numpy as np
import pytest

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.net.channel.propagation import LogDistance
from wsnsim.net.config import RadioConfig
from wsnsim.net.phy.ieee802154 import O_QPSK
from wsnsim.net.routing.linkquality import expected_transmissions, weakest_usable_dbm
from wsnsim.net.routing.search import radio_links
from wsnsim.net.routing.tree import tree_from_parents
from wsnsim.sim.maps import Grid, Links, coverage_of, reach_of
from wsnsim.world.bodies import Body, PatchTexture
from wsnsim.world.motion import Pose
from wsnsim.world.solids import contains
from wsnsim.world.world import Placed, Target, World

TEXTURE = PatchTexture(np.array([[0.0, 0.0, 1.0]]), np.array([[10.0, 20.0, 30.0]]))
LEVEL = np.array([1.0, 0.0, 0.0, 0.0])
RADIUS_M = 0.3


class Still:
    """A motion that is none."""

    def __init__(self, place):
        self.place = np.array(place, dtype=np.float64)

    def at(self, time):
        return Pose(self.place, np.zeros(3), LEVEL)


def thing(name, form, centre, semi_axes, orientation=LEVEL):
    pose = Pose(np.array(centre, dtype=np.float64), np.zeros(3), np.array(orientation))
    return Placed(name, Body(np.array(semi_axes), TEXTURE, form), pose)


def room(*scenery, size_m=(20.0, 16.0, 6.0)):
    ball = Target("ball", Body(np.full(3, RADIUS_M), TEXTURE), Still((5.0, 5.0, 1.0)))
    return World(np.array(size_m), (ball,), np.array([0.0, 0.0, 1.0]), 0.5, scenery)


def overhead(height_m=6.0, focal_px=200.0):
    """A camera over the middle of the room that looks straight down: image x along x, y against y."""
    return PinholeCamera.look_at((10.0, 8.0, height_m), (10.0, 8.0, 0.0), focal_px, (320, 240))


def test_a_camera_that_looks_down_sees_a_rectangle_of_known_size():
    coverage = coverage_of({"c": overhead()}, room(), 1.0)
    width, depth = 5.0 * 320 / 200, 5.0 * 240 / 200
    x, y = np.meshgrid(coverage.grid.x, coverage.grid.y)
    expected = (np.abs(x - 10.0) <= width / 2) & (np.abs(y - 8.0) <= depth / 2)
    assert np.array_equal(coverage.seen[0], expected)
    # a cell at most is wrong along each edge
    cell_m = 20.0 / 150
    edge = cell_m * (width + depth) / (20.0 * 16.0)
    assert coverage.floor_share(coverage.seen[0]) == pytest.approx(width * depth / (20.0 * 16.0), abs=edge)


def test_a_box_casts_its_central_shadow():
    """The top of a box at height 2 m, seen from 6 m, hides four thirds of its size at 3 m below the top."""
    top_m, low_m, half_m = 4.0, 1.0, 0.5
    crate = thing("crate", "box", (10.0, 8.0, 3.75), (half_m, half_m, 0.25))
    free = coverage_of({"c": overhead()}, room(), low_m)
    hidden = coverage_of({"c": overhead()}, room(crate), low_m)
    scale = (6.0 - low_m) / (6.0 - top_m)
    x, y = np.meshgrid(free.grid.x, free.grid.y)
    shadow = (np.abs(x - 10.0) <= scale * half_m) & (np.abs(y - 8.0) <= scale * half_m)
    assert np.array_equal(hidden.seen, free.seen & ~shadow)
    assert not hidden.solid.any()


def test_the_share_of_a_ball_is_that_of_its_circle():
    coverage = coverage_of({"c": overhead()}, room(size_m=(20.2, 16.2, 6.0)), 1.0, cells=101)
    camera = overhead()
    at = tuple(
        int(np.argmin(np.abs(axis - middle)))
        for axis, middle in ((coverage.grid.y, 8), (coverage.grid.x, 10))
    )
    place = np.array([coverage.grid.x[at[1]], coverage.grid.y[at[0]], 1.0])
    off_axis = np.linalg.norm(place[:2] - camera.position[:2])
    assert off_axis < 0.2
    radius_px = 200.0 * RADIUS_M / math.sqrt(5.0**2 - RADIUS_M**2)
    # off the axis by 2 degrees at most, the circle is an ellipse, larger by less than (1 + tan^2)^(3/2)
    expected = math.pi * radius_px**2 / (320 * 240)
    growth = (1 + (off_axis / 5.0) ** 2) ** 1.5
    assert expected * 0.999 <= coverage.shares[(0, *at)] <= expected * growth * 1.001
    assert coverage.largest_share[at] == coverage.mean_share[at] == coverage.shares[(0, *at)]


def test_sight_lines_agree_with_points_tried_along_them(test_seed):
    rng = np.random.default_rng(test_seed)
    turned = np.array([np.cos(0.3), 0.0, 0.0, np.sin(0.3)])
    scenery = (
        thing("crate", "box", (7.0, 9.0, 1.0), (1.5, 0.7, 1.0), turned),
        thing("post", "cylinder", (12.0, 6.0, 1.5), (0.6, 0.6, 1.5)),
        thing("bush", "ellipsoid", (14.0, 11.0, 0.8), (1.0, 2.0, 0.8)),
    )
    world = room(*scenery)
    cameras = {
        "a": PinholeCamera.look_at((0.5, 0.5, 2.5), (10.0, 8.0, 1.0), 250.0, (320, 240)),
        "b": PinholeCamera.look_at((19.5, 15.0, 3.0), (10.0, 8.0, 1.0), 250.0, (320, 240)),
    }
    coverage = coverage_of(cameras, world, 1.0)
    along = np.linspace(0.0, 1.0, 4001)[:, None]
    hidden = 0
    for _ in range(150):
        row, column = (int(rng.integers(n)) for n in coverage.grid.shape)
        point = np.array([coverage.grid.x[column], coverage.grid.y[row], 1.0])
        for number, camera in enumerate(cameras.values()):
            pixel, depth = camera.project(point[None])
            shown = depth[0] > 0 and bool(np.all((pixel[0] >= -0.5) & (pixel[0] <= (319.5, 239.5))))
            line = camera.position + along * (point - camera.position)
            met = any(contains(each.body, each.pose, line).any() for each in scenery)
            hidden += shown and met
            assert coverage.seen[number, row, column] == (shown and not met)
        inside = any(contains(each.body, each.pose, point[None])[0] for each in scenery)
        assert coverage.solid[row, column] == inside
    assert hidden > 10


def test_the_floor_is_counted_without_what_stands_on_it():
    crate = thing("crate", "box", (5.0, 8.0, 1.0), (5.0, 8.0, 1.0))
    coverage = coverage_of({"c": overhead()}, room(crate), 1.0)
    # the left half is solid; of the right half the camera sees 4 m by 6 m
    assert coverage.floor_share(~coverage.solid) == 1.0
    assert coverage.floor_share(coverage.seen_by >= 1) == pytest.approx(24 / 160, abs=0.02)


def linked(places, **radio):
    config = RadioConfig(**radio)
    arriving = radio_links(places, LogDistance(), config)
    power = arriving.matrix(arriving.power_dbm, -np.inf)
    tree = tree_from_parents({node: None if node == "base" else "base" for node in places})
    return Links(
        tuple(places),
        np.array(list(places.values()), dtype=np.float64),
        power,
        arriving.matrix(expected_transmissions(arriving, O_QPSK, config, 127, 5), np.inf),
        weakest_usable_dbm(O_QPSK, config, 0.9),
        0.9,
        tree,
    )


def test_margins_are_path_loss_and_sensitivity():
    places = {"base": (0.0, 0.0, 2.0), "a": (10.0, 0.0, 2.0), "b": (0.0, 40.0, 2.0)}
    links = linked(places)
    assert links.weakest_dbm == -95.0
    assert links.margin_db[0, 1] == pytest.approx(95.0 - 40.05 - 30.0)
    assert links.margin_db[2, 0] == pytest.approx(95.0 - 40.05 - 30.0 * math.log10(40.0))
    assert links.in_tree("a", "base")
    assert links.in_tree("base", "a")
    assert not links.in_tree("a", "b")


def test_the_weaker_direction_counts():
    links = linked({"base": (0.0, 0.0, 0.0), "a": (10.0, 0.0, 0.0)})
    links.power_dbm[0, 1] -= 7.0
    assert links.margin_db[0, 1] == links.margin_db[1, 0] == pytest.approx(95.0 - 70.05 - 7.0)


def test_one_more_mote_hears_the_nearest_best(test_seed):
    places = {"base": (2.0, 3.0, 2.0), "a": (30.0, 5.0, 3.0), "b": (12.0, 20.0, 1.0)}
    links = linked(places)
    reach = reach_of(links, np.array([20.0, 16.0, 6.0]), LogDistance(), 0.0)
    assert (reach.grid.x[0], reach.grid.x[-1]) < (0.0, 32.0)
    assert reach.grid.x[-1] > 30.0
    assert reach.grid.height_m == 2.0
    rng = np.random.default_rng(test_seed)
    for _ in range(50):
        row, column = (int(rng.integers(n)) for n in reach.grid.shape)
        here = (reach.grid.x[column], reach.grid.y[row], 2.0)
        pair = np.array([0]), np.array([1])
        losses = [LogDistance().loss_db(np.array([here, place]), *pair)[0] for place in places.values()]
        assert reach.best[row, column] == int(np.argmin(losses))
        assert reach.margin_db[row, column] == pytest.approx(95.0 - min(losses))


def test_a_grid_has_equal_cells_whose_middles_are_its_points():
    grid = Grid.over(np.array([0.0, 2.0]), np.array([9.0, 5.0]), 1.5, 18)
    assert grid.shape == (6, 18)
    assert np.allclose(grid.x, 0.25 + 0.5 * np.arange(18))
    assert np.allclose(grid.y, 2.25 + 0.5 * np.arange(6))
    assert grid.points[19].tolist() == [grid.x[1], grid.y[1], 1.5]
    assert Grid.over(np.zeros(2), np.array([100.0, 0.1]), 0.0, 10).shape == (1, 10)
