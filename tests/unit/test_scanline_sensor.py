"""Measurements without pixels: who is seen, where, and what the further sensors say."""

from types import SimpleNamespace

import numpy as np
import pytest

from wsnsim.errors import ScenarioError
from wsnsim.geometry.camera import PinholeCamera
from wsnsim.geometry.rotations import IDENTITY
from wsnsim.rng import RandomStreams
from wsnsim.systems.base import Belief, Floor, Site, TrackedTarget
from wsnsim.systems.scanline.lines import LineOfSight
from wsnsim.systems.scanline.measurement import ScanCamera, displaced, project, variance
from wsnsim.systems.scanline.params import ScanlineParams
from wsnsim.systems.scanline.regions import Room
from wsnsim.systems.scanline.sensor import make_sensors
from wsnsim.systems.scanline.stage import stage_of
from wsnsim.world.motion import Pose

SIDE = 20.0
BLOCK = np.array([[8.0, 8.0], [12.0, 9.0], [11.0, 12.0]])
CAMERAS = {"west": (0.0, 10.0), "south": (10.0, 0.0), "corner": (20.0, 20.0)}


def standing(*place):
    return SimpleNamespace(at=lambda time: Pose(np.array([*place, 0.9]), np.zeros(3), IDENTITY))


def site(people=(), rate_hz=7.5, steps=50, seed=0, target=(5.0, 6.0)):
    cameras = {
        name: PinholeCamera.look_at((*place, 1.5), (10.0, 10.0, 1.5), 320.0, (640, 480))
        for name, place in CAMERAS.items()
    }
    start = Belief(np.array([*target, 0.9]), np.zeros(3), IDENTITY)
    tracked = TrackedTarget("object", np.array([0.3, 0.3, 0.9]), start, lambda side: None)
    floor = Floor(np.array([SIDE, SIDE, 4.0]), (), len(people), 0.333)
    return Site(cameras, (tracked,), rate_hz, steps, RandomStreams(seed), floor=floor)


def world(target=(5.0, 6.0), people=()):
    motion = standing(*target)
    return SimpleNamespace(
        at=lambda time: (motion.at(time),),
        people=tuple(SimpleNamespace(motion=standing(*place)) for place in people),
    )


def params(**keys):
    return ScanlineParams(kind="scanline", **keys)


def readings(keys, people=(), target=(5.0, 6.0), steps=400, **others):
    """Return z of each step and camera (steps, n)."""
    sensors = make_sensors(params(**keys), site(people, target=target, **others), world(target, people))
    return np.array(
        [
            [sensor.measured(step, step / 7.5).reading.value_px for sensor in sensors.values()]
            for step in range(1, steps + 1)
        ]
    )


def test_errors_are_those_of_eq_2():
    """4,000 readings: the mean within 4 standard errors, the variance within 4 of its own."""
    keys = {"noise": {"position_sd_m": 0.2, "angle_sd_rad": 0.01, "read_sd_px": 2.0}}
    values = readings(keys, steps=4000)
    stage = stage_of(params(**keys), site())
    for camera, z in zip(stage.rig.cameras, values.T, strict=True):
        point = np.array([[5.0, 6.0]])
        expected = float(variance(camera, point, stage.rig.noise)[0])
        assert abs(z.mean() - project(camera, point)[0]) < 4.0 * np.sqrt(expected / 4000)
        assert z.var() / expected == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / 4000))


def test_a_bias_stays_for_the_run_and_is_another_with_another_seed():
    keys = {"front_end": {"kind": "measurement", "pose_error": "bias"}, "noise": {"read_sd_px": 0.001}}
    first, second = readings(keys, steps=20), readings(keys, steps=20, seed=1)
    assert (np.ptp(first, axis=0) < 0.01).all()
    assert (abs(first[0] - second[0]) > 0.1).all()
    again = readings(keys, steps=20)
    assert (again == first).all()


def test_a_camera_that_stands_elsewhere_is_hidden_by_who_stands_before_it_there():
    keys = {
        "front_end": {"kind": "measurement", "pose_error": "bias"},
        "noise": {"position_sd_m": 2.0, "angle_sd_rad": 0.01, "read_sd_px": 1.0},
    }
    stage = stage_of(params(**keys), site())
    believed = stage.rig.cameras[1]
    real = displaced(believed, stage.rig.noise, RandomStreams(0).stream("scanline.pose", "south"))
    for camera, hides in ((real, True), (believed, False)):
        people = [tuple(0.5 * (np.add(camera.position, (5.0, 6.0))))]
        assert np.isnan(readings(keys, people, steps=2)[:, 1]).all() == hides


def test_who_stands_before_the_object_hides_it_from_that_camera_alone():
    people = [(2.5, 8.0)]  # on the line from the west camera to the object
    values = readings({}, people, steps=3)
    assert np.isnan(values[:, 0]).all()
    assert not np.isnan(values[:, 1:]).any()
    sensors = make_sensors(params(), site(people), world(people=people))
    assert [bool(sensor.in_view(1.0)) for sensor in sensors.values()] == [False, True, True]


def test_measurements_are_the_same_whatever_is_known_of_the_occluders(test_seed):
    people = [(3.0, 9.0), (15.0, 4.0), (6.0, 14.0)]
    kinds = [{"kind": "none"}, {"kind": "perfect"}, {"kind": "kalman"}, {"kind": "hull"}]
    first, *others = [
        readings({"priors": kind}, people, steps=30, seed=test_seed, target=(9.0, 4.0)) for kind in kinds
    ]
    for other in others:
        np.testing.assert_array_equal(first, other)


def test_what_is_not_recognised_is_not_seen():
    values = readings({"detected": 0.7}, steps=1500)
    seen = (~np.isnan(values)).mean(axis=0)
    assert (abs(seen - 0.7) < 4.0 * np.sqrt(0.7 * 0.3 / 1500)).all()


@pytest.mark.parametrize(("priors", "sd_m"), [({"kind": "perfect"}, 0.0), ({"kind": "kalman"}, 1.6)])
def test_each_occluder_is_measured_by_the_nearest_mote_alone(priors, sd_m):
    generator = np.random.default_rng(3)
    people = [tuple(place) for place in generator.uniform(1.0, 19.0, (60, 2))]
    sensors = make_sensors(params(priors=priors), site(people), world(people=people))
    said = [sensor.measured(1, 1 / 7.5).occluders for sensor in sensors.values()]
    ids = np.concatenate([each.ids for each in said])
    assert sorted(ids) == list(range(60))
    for each, camera in zip(said, CAMERAS.values(), strict=True):
        for number in each.ids:
            own = np.hypot(*(np.subtract(people[number], camera)))
            assert own == min(np.hypot(*np.subtract(people[number], other)) for other in CAMERAS.values())
    places = np.concatenate([each.places for each in said])
    errors = places - np.array(people)[ids]
    assert np.sqrt((errors**2).mean()) == pytest.approx(sd_m, rel=4.0 / np.sqrt(240.0), abs=1e-12)


def plain_pixels(camera, centres, radius, walls):
    """Return which pixels show a disc, each by its own ray."""
    edge = camera.half_width_px
    count = round(2 * edge)
    shown = np.zeros(count, bool)
    for pixel in range(count):
        z = -edge + (pixel + 0.5) * 2 * edge / count
        angle = camera.heading_rad + np.arctan(z / camera.focal_px)
        ray = np.array([np.cos(angle), np.sin(angle)])
        reach = min((hit(np.array(camera.position), ray, wall) for wall in walls), default=np.inf)
        for centre in centres:
            way = centre - camera.position
            along, across = way @ ray, abs(way @ [-ray[1], ray[0]])
            if along > 0.0 and across <= radius and np.hypot(*way) < reach:
                shown[pixel] = True
    return shown


def hit(start, ray, polygon):
    """Return how far along a ray a polygon's nearest side is."""
    nearest = np.inf
    for a, b in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        matrix = np.column_stack([ray, a - b])
        if abs(np.linalg.det(matrix)) > 1e-12:
            along, share = np.linalg.solve(matrix, a - start)
            if along > 0.0 and 0.0 <= share <= 1.0:
                nearest = min(nearest, along)
    return nearest


def test_blobs_are_the_pixels_that_show_somebody_before_the_walls(test_seed):
    generator = np.random.default_rng(test_seed)
    room = Room(np.zeros(2), np.full(2, SIDE), (BLOCK,))
    for _ in range(12):
        place = generator.uniform(0.0, 7.0, 2)
        camera = ScanCamera(tuple(place), float(generator.uniform(0, 1.5)), 60.0, np.pi / 2)
        centres = generator.uniform(0.0, SIDE, (8, 2))
        centres = centres[np.hypot(*(centres - place).T) > 1.0]
        expected = plain_pixels(camera, centres, 0.4, room.walls)
        blobs = LineOfSight(camera, room).blobs(camera, centres, 0.4)
        pixels = np.arange(120) - 59.5
        found = ((pixels[:, None] > blobs[:, 0]) & (pixels[:, None] < blobs[:, 1])).any(axis=1)
        np.testing.assert_array_equal(found, expected)
        assert (np.diff(blobs.ravel()) > 0.0).all()


def test_virtual_occluders_walk_alike_for_all_cameras_and_hide_what_is_real():
    keys = {"virtual_occluders": {"count": 30, "diameter_m": 0.6, "blocks_m": [BLOCK.tolist()]}}
    one, two = (make_sensors(params(**keys), site(), world()) for _ in range(2))
    seen = np.zeros((50, 3), bool)
    for step in range(1, 51):
        for number, name in enumerate(CAMERAS):
            measured = one[name].measured(step, step / 7.5)
            assert measured.hidden == two[name].measured(step, step / 7.5).hidden
            assert measured.hidden == np.isnan(measured.reading.value_px)
            seen[step - 1, number] = not measured.hidden
    # the block stands between the object and the far corner; people come and go before the others
    assert not seen[:, 2].any()
    assert 0 < seen[:, :2].sum() < 100
    crowded = params(virtual_occluders={"count": 1000, "diameter_m": 2.0})
    with pytest.raises(ScenarioError, match="virtual_occluders"):
        make_sensors(crowded, site(), world())


def test_whole_lines_have_the_object_and_those_about_it():
    people = [(15.0, 12.0)]
    keys = {"priors": {"kind": "scan_lines"}, "noise": {"position_sd_m": 0.0, "angle_sd_rad": 0.0}}
    sensors = make_sensors(params(**keys), site(people), world(people=people))
    reading = sensors["west"].measured(1, 1 / 7.5).reading
    assert len(reading.blobs) == 2
    middles = reading.blobs.mean(axis=1)
    # blobs ascend to the left: the person stands beyond on the left, the object on the right
    assert middles[0] == pytest.approx(reading.value_px, abs=12.0)
    assert middles[1] == pytest.approx(320.0 * 2.0 / 15.0, abs=8.0)
