"""What makes no sense is refused by name, and what is only unlucky is not."""

import numpy as np
import pytest

from wsnsim.systems.scanline.filter import FilterParams
from wsnsim.systems.scanline.hull import visual_hull
from wsnsim.systems.scanline.measurement import MeasurementNoise, ScanCamera
from wsnsim.systems.scanline.motion import WaypointWalk
from wsnsim.systems.scanline.priors import VirtualSensor
from wsnsim.systems.scanline.regions import Rig, Room

SQUARE = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]])
ROOM = Room(np.zeros(2), np.full(2, 10.0))
CAMERA = ScanCamera((0.0, 5.0), 0.0, 320.0, 1.5)


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: ScanCamera((0.0, np.nan), 0.0, 320.0, 1.5), "position, heading_rad: must be finite"),
        (lambda: ScanCamera((0.0, 0.0), 0.0, 0.0, 1.5), "focal_px: must be above 0"),
        (lambda: ScanCamera((0.0, 0.0), 0.0, 320.0, np.pi), "fov_rad: must be above 0 and below π"),
        (lambda: MeasurementNoise(-1.0), "noise: must be finite, at least 0"),
        (lambda: MeasurementNoise(0.0, 0.0, 0.0), "noise: must be finite, at least 0"),
        (lambda: Room(np.zeros(2), np.array([10.0, 0.0])), "low: must be below high"),
        (lambda: Room(np.zeros(2), np.full(2, 10.0), (SQUARE[[0, 2, 1, 3]],)), r"walls\[0\]: must be convex"),
        (lambda: Rig((), MeasurementNoise(), ROOM), "cameras: must be 1 to 62, got 0"),
        (lambda: Rig((CAMERA,) * 63, MeasurementNoise(), ROOM), "cameras: must be 1 to 62, got 63"),
        (lambda: WaypointWalk(ROOM, noise_sd=0.0), "speed, noise_sd: must be above 0"),
        (lambda: WaypointWalk(ROOM, memory=1.5), "memory: must be 0 to 1"),
        (lambda: WaypointWalk(ROOM, reached=(0.9, 0.2)), "must be probabilities of sum at most 1"),
        (lambda: VirtualSensor(0.0), "sd_m, acceleration_variance: must be above 0"),
        (lambda: FilterParams(particles=0), "particles: must be at least 1"),
        (lambda: FilterParams(visibility_floor=1.0), "visibility_floor: must be 0 to 1"),
        (lambda: FilterParams(first_stage_floor=-0.1), "first_stage_floor: must be 0 to 1"),
    ],
)
def test_refusals(build, message):
    with pytest.raises(ValueError, match=message):
        build()


def test_a_camera_inside_a_wall_sees_nothing():
    room = Room(
        np.zeros(2), np.full(2, 10.0), (np.array([[-1.0, 4.0], [1.0, 4.0], [1.0, 6.0], [-1.0, 6.0]]),)
    )
    places = np.random.default_rng(0).uniform(0.0, 10.0, (500, 2))
    assert not Rig((CAMERA,), MeasurementNoise(), room).masks(places).any()
    assert Rig((CAMERA,), MeasurementNoise(), ROOM).masks(places).any()


def test_a_wall_that_fills_the_room_leaves_nothing_to_see():
    room = Room(np.zeros(2), np.full(2, 10.0), (SQUARE,))
    places = np.random.default_rng(0).uniform(0.0, 10.0, (500, 2))
    assert not Rig((CAMERA,), MeasurementNoise(), room).masks(places).any()
    assert not room.within(places).any()


def test_within_a_room():
    room = Room(np.zeros(2), np.full(2, 10.0), (np.array([[4.0, 4.0], [6.0, 4.0], [5.0, 6.0]]),))
    places = np.array([[5.0, 4.5], [5.0, 3.5], [0.5, 5.0], [-0.1, 5.0], [9.0, 9.0]])
    np.testing.assert_array_equal(room.within(places), [False, True, True, False, True])
    np.testing.assert_array_equal(room.within(places, 0.8), [False, False, False, False, True])


def test_a_hull_of_too_many_pieces_is_refused():
    generator = np.random.default_rng(0)
    places, headings = generator.uniform(-5.0, 15.0, (4, 2)), generator.uniform(0.0, 6.0, 4)
    cameras = [ScanCamera((x, y), a, 320.0, 3.0) for (x, y), a in zip(places, headings, strict=True)]
    ends = np.arange(-4000.0, 4000.0, 40.0)
    blobs = [np.stack([ends, ends + 20.0], axis=1)] * 4
    with pytest.raises(ValueError, match="blobs: must cut the room into at most 4096 pieces"):
        visual_hull(Rig(cameras, MeasurementNoise(), ROOM), blobs, np.ones(4, bool))
