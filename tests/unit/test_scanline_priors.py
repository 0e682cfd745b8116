"""Where the occluders' priors come from: virtual sensors, and the visual hull."""

import numpy as np
import pytest

from wsnsim.geometry.polygons import polygon_moments
from wsnsim.systems.scanline.hull import Hull, visual_hull, without_own, without_phantoms, without_small
from wsnsim.systems.scanline.measurement import MeasurementNoise, Report, ScanCamera, project
from wsnsim.systems.scanline.priors import CONSISTENT_Q, PUBLISHED_Q, VirtualSensor, sensor_for, stationary
from wsnsim.systems.scanline.regions import Rig, Room
from wsnsim.world.crowd import Crowd

SIDE = 20.0
CAMERAS = tuple(
    ScanCamera((10.0 + 10.0 * x, 10.0 + 10.0 * y), float(np.arctan2(-y, -x)), 320.0, np.pi / 2)
    for x, y in ((0, -1), (1, 0), (0, 1), (-1, 0))
)
ROOM = Room(np.zeros(2), np.full(2, SIDE))
RIG = Rig(CAMERAS, MeasurementNoise(0.1, 0.001, 1.0), ROOM)
EVERYBODY = np.ones(4, bool)


def lines(bodies, radius, cameras=CAMERAS):
    """Return exact scan lines of discs: their ends, merged."""
    blobs = []
    for camera in cameras:
        ends = []
        for body in bodies:
            way = np.asarray(body) - camera.position
            angle = np.mod(np.arctan2(way[1], way[0]) - camera.heading_rad + np.pi, 2 * np.pi) - np.pi
            half = np.arcsin(radius / np.linalg.norm(way))
            low, high = np.clip([angle - half, angle + half], -np.pi / 4, np.pi / 4)
            if low < high:
                ends.append(320.0 * np.tan([low, high]))
        merged = []
        for low, high in sorted(map(tuple, ends)):
            if merged and low <= merged[-1][1]:
                merged[-1][1] = max(high, merged[-1][1])
            else:
                merged.append([low, high])
        blobs.append(np.array(merged).reshape(-1, 2))
    return blobs


def holds(hull, point):
    """Tell whether a point is in one of the hull's pieces."""
    for polygon in hull.polygons:
        sides = np.roll(polygon, -1, axis=0) - polygon
        ways = point - polygon
        turns = sides[:, 0] * ways[:, 1] - sides[:, 1] * ways[:, 0]
        if (turns >= -1e-9).all() or (turns <= 1e-9).all():
            return True
    return False


def test_the_hull_holds_everybody(test_seed):
    generator = np.random.default_rng(test_seed)
    around = 0.8 * np.array([[np.cos(a), np.sin(a)] for a in np.linspace(0.0, 2 * np.pi, 24)])
    for _ in range(8):
        bodies = generator.uniform(1.0, 19.0, (5, 2))
        # somebody at a camera's place would fill all of its view
        bodies = bodies[[min(np.hypot(*(b - c.position)) for c in CAMERAS) > 1.0 for b in bodies]]
        hull = visual_hull(RIG, lines(bodies, 0.8), EVERYBODY)
        for body in bodies:
            assert all(holds(hull, np.clip(body + 0.999 * edge, 0.0, SIDE)) for edge in around)
        # what one camera sees free is not in it, and pieces do not overlap
        places = generator.uniform(0.0, SIDE, (225, 2))
        inside = np.array([holds(hull, place) for place in places])
        free = np.zeros(225, bool)
        for camera, blobs in zip(CAMERAS, lines(bodies, 0.8), strict=True):
            z = project(camera, places)
            in_view = np.abs(z) < camera.half_width_px
            covered = ((z[:, None] > blobs[:, 0]) & (z[:, None] < blobs[:, 1])).any(axis=1)
            free |= in_view & ~covered
        np.testing.assert_array_equal(inside, ~free)
        assert hull.area_m2 == pytest.approx(SIDE**2 * inside.mean(), abs=5.0 * SIDE**2 * 0.5 / 15.0)


def test_one_body_is_where_it_is():
    hull = visual_hull(RIG, lines([(9.0, 11.0)], 0.5), EVERYBODY)
    own = [polygon for polygon in hull.polygons if holds(Hull((polygon,)), np.array([9.0, 11.0]))]
    assert len(own) == 1
    area, mean, cov = polygon_moments(own[0])
    np.testing.assert_allclose(mean, [9.0, 11.0], atol=0.1)
    # a polygon round a circle: more than it, and less than the square
    assert np.pi * 0.25 <= area <= 1.01
    assert np.trace(cov) == pytest.approx(0.25 * 0.5 + 0.03, rel=0.3)


def test_a_camera_that_was_not_heard_cuts_nothing():
    blobs = lines([(9.0, 11.0)], 0.5)
    some = visual_hull(RIG, blobs, np.array([True, False, True, True]))
    assert some.area_m2 > visual_hull(RIG, blobs, EVERYBODY).area_m2
    nobody = visual_hull(RIG, blobs, np.zeros(4, bool))
    assert nobody.area_m2 == pytest.approx(SIDE**2)


def test_walls_leave_what_is_behind_them_open():
    wall = np.array([[8.0, 8.0], [12.0, 8.0], [12.0, 9.0], [8.0, 9.0]])
    rig = Rig(CAMERAS[:1], RIG.noise, Room(ROOM.low, ROOM.high, (wall,)))
    hull = visual_hull(rig, [np.empty((0, 2))], EVERYBODY[:1])
    assert holds(hull, np.array([10.0, 15.0]))
    assert not holds(hull, np.array([10.0 + 6.0, 15.0]))


def test_the_objects_own_piece_goes():
    object_, other = np.array([9.0, 11.0]), np.array([13.0, 8.0])
    hull = visual_hull(RIG, lines([object_, other], 0.5), EVERYBODY)
    values = np.array([float(project(camera, object_)) for camera in CAMERAS])
    rest = without_own(hull, RIG, Report(values, EVERYBODY), 1.0)
    assert len(rest.polygons) == len(hull.polygons) - 1
    assert not holds(rest, object_)
    assert holds(rest, other)
    # one camera cannot tell how far away it is
    single = np.where([True, False, False, False], values, np.nan)
    assert without_own(hull, RIG, Report(single, EVERYBODY), 1.0) is hull


def test_phantoms_and_crumbs_go():
    """Two cameras at right angles and two bodies: four crossings, two of them empty."""
    rig = Rig(CAMERAS[:2], RIG.noise, ROOM)
    bodies = [(9.0, 9.0), (11.5, 11.0)]
    blobs = lines(bodies, 0.5, CAMERAS[:2])
    hull = visual_hull(rig, blobs, EVERYBODY[:2])
    middles = [polygon for polygon in hull.polygons if polygon_moments(polygon)[0] < 3.0]
    assert len(middles) >= 4
    kept = without_phantoms(hull, rig, blobs)
    assert len(kept.polygons) < len(hull.polygons)
    # with all four cameras nothing is left to doubt: both bodies are proven
    blobs = lines(bodies, 0.5)
    kept = without_phantoms(visual_hull(RIG, blobs, EVERYBODY), RIG, blobs)
    assert all(holds(kept, np.array(body)) for body in bodies)
    assert without_small(hull, 0.9).area_m2 <= hull.area_m2
    assert not without_small(Hull((np.array([[0.0, 0.0], [9.0, 0.0], [9.0, 0.1]]),)), 1.0).polygons
    means, covs = Hull(()).priors()
    assert means.shape == (0, 2)
    assert covs.shape == (0, 2, 2)
    assert not without_phantoms(Hull(()), RIG, blobs).polygons


@pytest.mark.parametrize(
    ("variance", "nees", "rmse"),
    [(CONSISTENT_Q, (0.85, 1.1), 5.0), (PUBLISHED_Q, (0.7, 0.9), 6.5), (0.001, (2.0, 9.0), 8.1)],
)
def test_how_sure_the_filter_is(test_seed, variance, nees, rmse):
    """NEES / 2 about 1 for the paper's crowd at σ_v = 8; less noise is overconfident, more too cautious."""
    generator = np.random.default_rng(test_seed)
    paths = Crowd(40, 3.33, np.zeros(2), np.full(2, 100.0), 1.0, 0.33, 1.0).paths(generator, 1500)
    sensor = VirtualSensor(8.0, variance)
    tracks, squares = sensor.start(generator, paths[0]), []
    for places in paths[1:]:
        tracks = sensor.step(generator, tracks, places)
        squares.append(((tracks.places - places) ** 2).sum(axis=1).mean())
    found = np.mean(squares) / (2.0 * tracks.covs[0, 0, 0])
    assert nees[0] < found < nees[1]
    assert np.sqrt(np.mean(squares)) == pytest.approx(rmse, rel=0.05)
    assert sensor.rmse_m == pytest.approx(np.sqrt(np.mean(squares) / found), rel=0.01)


def test_the_steady_state_solves_riccatis_equation():
    sensor = VirtualSensor(8.0, 0.5)
    cov = sensor.steady_cov
    order = np.array([[1.0, 1.0], [0.0, 1.0]])
    predicted = order @ cov @ order.T + 0.5 * np.array([[0.25, 0.5], [0.5, 1.0]])
    posterior = np.linalg.inv(np.linalg.inv(predicted) + np.diag([1.0 / 64.0, 0.0]))
    np.testing.assert_allclose(posterior, cov, rtol=1e-9)
    assert sensor_for(sensor.rmse_m, 0.5).sd_m == pytest.approx(8.0, rel=1e-6)


def test_a_filters_first_belief_is_as_good_as_it_says(test_seed):
    generator = np.random.default_rng(test_seed + 1)
    sensor = VirtualSensor(8.0)
    tracks = sensor.start(generator, np.zeros((100_000, 2)))
    sample = np.cov(tracks.places[:, 0], tracks.velocities[:, 0])
    np.testing.assert_allclose(sample, sensor.steady_cov, rtol=0.05)


def test_stationary_priors():
    means, covs = stationary(3, np.array([50.0, 40.0]), 21.3)
    np.testing.assert_array_equal(means, [[50.0, 40.0]] * 3)
    np.testing.assert_allclose(covs, [21.3**2 * np.eye(2)] * 3)
