import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation, Slerp

from wsnsim.geometry.rotations import IDENTITY, quaternion_from_axis_angle, quaternion_to_matrix
from wsnsim.world.bodies import Body, PatchTexture
from wsnsim.world.motion import ConstantVelocity, Spinning, TimedPath, Waypoints, jittered, slerp
from wsnsim.world.world import Target, World

CORNER = np.array([[0.0, 0.0, 1.0], [3.0, 0.0, 1.0], [3.0, 4.0, 1.0]])


@pytest.mark.parametrize(
    ("time", "position", "velocity"),
    [
        (-1.0, [0, 0, 1], [0, 0, 0]),
        (0.0, [0, 0, 1], [2, 0, 0]),
        (1.0, [2, 0, 1], [2, 0, 0]),
        (1.5, [3, 0, 1], [0, 2, 0]),
        (2.5, [3, 2, 1], [0, 2, 0]),
        (3.5, [3, 4, 1], [0, 0, 0]),
        (99.0, [3, 4, 1], [0, 0, 0]),
    ],
)
def test_legs_by_hand(time, position, velocity):
    motion = Waypoints(CORNER, 2.0)
    pose = motion.at(time)
    np.testing.assert_allclose(pose.position, position)
    np.testing.assert_allclose(pose.velocity, velocity)
    np.testing.assert_array_equal(pose.orientation, IDENTITY)
    assert motion.length_m == pytest.approx(7.0)


@settings(max_examples=60, deadline=None)
@given(
    arrays(np.float64, (5, 3), elements=st.floats(-20.0, 20.0)),
    st.floats(0.1, 5.0),
    st.floats(0.0, 1.0),
)
def test_speed_is_constant_and_the_path_is_on_time(points, speed, share):
    # of a leg that is shorter than the rounding of its ends nobody can tell the speed
    assume((np.linalg.norm(np.diff(points, axis=0), axis=1) > 1e-6).all())
    motion = Waypoints(points, speed)
    arrival = motion.length_m / speed
    time = share * arrival
    pose = motion.at(time)
    if time < arrival * (1 - 1e-9) - 1e-9:
        assert np.linalg.norm(pose.velocity) == pytest.approx(speed, rel=1e-3)
    step = 1e-6 * max(arrival, 1.0)
    moved = np.linalg.norm(motion.at(time + step).position - pose.position)
    assert moved <= speed * step * (1 + 1e-6) + 1e-9
    np.testing.assert_allclose(motion.at(arrival + 1e-9).position, points[-1], atol=1e-6)


@pytest.mark.parametrize("points", [[[1.0, 2.0, 3.0]], [[1.0, 2.0, 3.0]] * 3])
def test_a_single_place_is_a_target_that_stands(points):
    motion = Waypoints(np.array(points), 1.0)
    for time in (0.0, 5.0):
        np.testing.assert_array_equal(motion.at(time).position, [1.0, 2.0, 3.0])
        np.testing.assert_array_equal(motion.at(time).velocity, np.zeros(3))


def test_repeated_points_cost_no_time():
    motion = Waypoints(np.repeat(CORNER, 2, axis=0), 2.0)
    np.testing.assert_allclose(motion.at(2.5).position, [3.0, 2.0, 1.0])


@pytest.mark.parametrize(
    ("points", "speed", "message"),
    [
        (np.zeros((0, 3)), 1.0, "points: must have shape"),
        (np.zeros((2, 2)), 1.0, "points: must have shape"),
        (np.full((2, 3), np.nan), 1.0, "points: must be finite"),
        (CORNER, 0.0, "speed_mps: must be above 0"),
        (CORNER, np.nan, "speed_mps: must be above 0"),
    ],
)
def test_impossible_paths_are_refused(points, speed, message):
    with pytest.raises(ValueError, match=message):
        Waypoints(points, speed)


def test_jitter_moves_a_copy_by_its_standard_deviation():
    points = np.zeros((4000, 3))
    moved = jittered(points, np.random.default_rng(1), 0.2)
    assert not points.any()
    # Standard error of a standard deviation: sd / √(2 n).
    assert moved.std() == pytest.approx(0.2, abs=5 * 0.2 / np.sqrt(2 * moved.size))
    np.testing.assert_array_equal(jittered(CORNER, np.random.default_rng(1), 0.0), CORNER)


def test_world_tells_the_poses_in_the_order_of_its_targets():
    body = Body(np.full(3, 0.3), PatchTexture(np.array([[1.0, 0, 0]]), np.zeros((1, 3))))
    turn = quaternion_from_axis_angle((0, 0, 1), 1.0)
    targets = (
        Target("a", body, Waypoints(CORNER, 1.0)),
        Target("b", body, Waypoints(CORNER[::-1], 1.0, turn)),
    )
    world = World(np.array([10.0, 10.0, 3.0]), targets, np.array([0.0, 0.0, 1.0]), 0.3)
    first, second = world.at(1.0)
    np.testing.assert_allclose(first.position, [1.0, 0.0, 1.0])
    np.testing.assert_allclose(second.position, [3.0, 3.0, 1.0])
    np.testing.assert_array_equal(second.orientation, turn)


def test_constant_velocity_has_no_ends():
    motion = ConstantVelocity(np.array([1.0, 2.0, 3.0]), np.array([0.5, 0.0, -1.0]))
    np.testing.assert_array_equal(motion.at(-2.0).position, [0.0, 2.0, 5.0])
    np.testing.assert_array_equal(motion.at(4.0).position, [3.0, 2.0, -1.0])
    np.testing.assert_array_equal(motion.at(4.0).velocity, [0.5, 0.0, -1.0])


def test_a_spin_turns_about_an_axis_of_the_world():
    start = quaternion_from_axis_angle((1, 0, 0), np.pi / 2)  # the body's z is the world's −y
    motion = Spinning(Waypoints(CORNER, 2.0, start), np.array([0.0, 0.0, 3.0]), np.pi / 4)
    np.testing.assert_array_equal(motion.at(0.0).orientation, start)
    for time, up in ((2.0, [1, 0, 0]), (4.0, [0, 1, 0]), (-2.0, [-1, 0, 0])):
        pose = motion.at(time)
        np.testing.assert_allclose(quaternion_to_matrix(pose.orientation)[:, 2], up, atol=1e-12)
    still = Waypoints(CORNER, 2.0, start).at(1.0)
    np.testing.assert_array_equal(motion.at(1.0).position, still.position)
    np.testing.assert_array_equal(motion.at(1.0).velocity, still.velocity)


def test_timed_path_turns_at_a_constant_rate_the_shorter_way():
    quarter = quaternion_from_axis_angle((0, 0, 1), np.pi / 2)
    path = TimedPath(np.array([1.0, 3.0, 5.0]), CORNER, np.array([IDENTITY, -quarter, -quarter]))
    for time, angle in (
        (0.0, 0.0),
        (1.0, 0.0),
        (1.5, np.pi / 8),
        (2.0, np.pi / 4),
        (4.0, np.pi / 2),
        (9.0, np.pi / 2),
    ):
        expected = quaternion_to_matrix(quaternion_from_axis_angle((0, 0, 1), angle))
        found = path.at(time).orientation
        np.testing.assert_allclose(quaternion_to_matrix(found), expected, atol=1e-12)
        assert np.linalg.norm(found) == pytest.approx(1.0, abs=1e-12)
    np.testing.assert_allclose(path.at(2.0).velocity, [1.5, 0.0, 0.0])


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0.0, 1.0))
def test_slerp_against_scipy(seed, share):
    both = Rotation.random(2, random_state=np.random.default_rng(seed))
    # SciPy writes the scalar last
    first, second = np.roll(both.as_quat(), 1, axis=1)
    between = Rotation.from_quat(np.roll(slerp(first, second, share), -1))
    assert (Slerp([0.0, 1.0], both)(share).inv() * between).magnitude() < 1e-7


def test_slerp_between_the_same():
    np.testing.assert_array_equal(slerp(IDENTITY, IDENTITY, 0.3), IDENTITY)
    np.testing.assert_allclose(slerp(IDENTITY, -IDENTITY, 0.3), IDENTITY)


@pytest.mark.parametrize(
    ("times", "points", "turns", "message"),
    [
        (np.zeros(0), np.zeros((0, 3)), np.zeros((1, 4)), "points: must have shape"),
        (np.zeros(2), np.zeros((3, 3)), np.zeros((1, 4)), "points: must have shape"),
        (np.zeros(3), np.zeros((3, 3)), np.zeros((2, 4)), "orientations: must have shape"),
    ],
)
def test_impossible_timed_paths_are_refused(times, points, turns, message):
    with pytest.raises(ValueError, match=message):
        TimedPath(times, points, turns)
