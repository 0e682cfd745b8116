import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.geometry.rotations import quaternion_from_axis_angle, quaternion_multiply, quaternion_to_matrix

points = arrays(np.float64, 3, elements=st.floats(-50.0, 50.0))


def camera_at(position=(0.0, 0.0, 2.0), target=(10.0, 0.0, 2.0), resolution=(320, 240)):
    return PinholeCamera.look_at(position, target, 300.0, resolution)


def test_axes_are_right_down_forward():
    # Looking along +x: the world's -y is to the right, its -z is down.
    rotation = camera_at().rotation
    np.testing.assert_allclose(rotation, [[0, -1, 0], [0, 0, -1], [1, 0, 0]], atol=1e-15)


def test_projection_by_hand():
    pixels, depths = camera_at().project(np.array([[10.0, 0.0, 2.0], [10.0, -1.0, 2.0], [10.0, 0.0, 3.0]]))
    np.testing.assert_allclose(depths, 10.0)
    np.testing.assert_allclose(pixels, [[159.5, 119.5], [189.5, 119.5], [159.5, 89.5]])


def test_points_behind_have_no_pixel():
    pixels, depths = camera_at().project(np.array([[-1.0, 0.0, 2.0], [0.0, 5.0, 2.0]]))
    np.testing.assert_allclose(depths, [-1.0, 0.0])
    assert np.isnan(pixels).all()


@pytest.mark.parametrize(("target", "up_in_image"), [((1.0, 2.0, -5.0), 1.0), ((1.0, 2.0, 9.0), -1.0)])
def test_straight_down_and_up_keep_east_to_the_right(target, up_in_image):
    camera = PinholeCamera.look_at((1.0, 2.0, 3.0), target, 300.0, (320, 240))
    np.testing.assert_allclose(camera.rotation[0], [1.0, 0.0, 0.0])
    np.testing.assert_allclose(camera.rotation[1], [0.0, -up_in_image, 0.0])


@given(points, points)
def test_look_at_centres_its_target_with_a_level_horizon(position, target):
    assume(np.linalg.norm(target - position) > 1e-3)
    camera = PinholeCamera.look_at(position, target, 300.0, (321, 241))
    np.testing.assert_allclose(camera.rotation @ camera.rotation.T, np.eye(3), atol=1e-9)
    assert np.linalg.det(camera.rotation) == pytest.approx(1.0)
    assert camera.rotation[0, 2] == pytest.approx(0.0, abs=1e-12)
    assert camera.rotation[1, 2] <= 1e-12
    pixels, _ = camera.project(target[None])
    np.testing.assert_allclose(pixels, [[160.0, 120.0]], atol=1e-5)


@given(points, points, points)
def test_matrix_projects_like_project(position, target, point):
    assume(np.linalg.norm(target - position) > 1e-3)
    camera = PinholeCamera.look_at(position, target, 300.0, (320, 240))
    pixels, depths = camera.project(point[None])
    assume(depths[0] > 0.01)
    homogeneous = camera.matrix @ np.append(point, 1.0)
    assert homogeneous[2] == pytest.approx(depths[0], rel=1e-9)
    np.testing.assert_allclose(homogeneous[:2] / homogeneous[2], pixels[0], rtol=1e-8, atol=1e-6)


def test_coinciding_points_are_refused():
    with pytest.raises(ValueError, match="look_at: must differ"):
        PinholeCamera.look_at((1.0, 2.0, 3.0), (1.0, 2.0, 3.0), 300.0, (320, 240))


@pytest.mark.parametrize("focal", [0.0, -1.0, np.nan, np.inf])
def test_focal_length_must_be_positive(focal):
    with pytest.raises(ValueError, match="focal_px: must be above 0"):
        PinholeCamera(focal, (320, 240), np.eye(3), np.zeros(3))


def test_resolution_must_be_positive():
    with pytest.raises(ValueError, match="resolution_px: must be at least"):
        PinholeCamera(300.0, (320, 0), np.eye(3), np.zeros(3))


angles = st.floats(-np.pi, np.pi)


@pytest.mark.parametrize(
    ("yaw_deg", "pitch_deg", "roll_deg", "rows"),
    [
        (0, 0, 0, [[0, -1, 0], [0, 0, -1], [1, 0, 0]]),
        (90, 0, 0, [[1, 0, 0], [0, 0, -1], [0, 1, 0]]),
        (0, 90, 0, [[0, -1, 0], [1, 0, 0], [0, 0, 1]]),
        # Rolled by a quarter turn clockwise as seen from behind: what was right is now down.
        (0, 0, 90, [[0, 0, -1], [0, 1, 0], [1, 0, 0]]),
    ],
)
def test_angles_by_hand(yaw_deg, pitch_deg, roll_deg, rows):
    turns = np.radians([yaw_deg, pitch_deg, roll_deg])
    camera = PinholeCamera.at_angles((1.0, 2.0, 3.0), *turns, 300.0, (320, 240))
    np.testing.assert_allclose(camera.rotation, rows, atol=1e-15)
    np.testing.assert_array_equal(camera.position, (1.0, 2.0, 3.0))


@given(angles, st.floats(-1.5, 1.5), angles)
def test_angles_are_turns_about_the_axes_one_after_the_other(yaw, pitch, roll):
    camera = PinholeCamera.at_angles(np.zeros(3), yaw, pitch, roll, 300.0, (320, 240))
    # Camera axes in the world: first the roll about x, then the pitch about -y, then the yaw about z.
    turned = quaternion_multiply(
        quaternion_from_axis_angle((0, 0, 1), yaw),
        quaternion_multiply(
            quaternion_from_axis_angle((0, -1, 0), pitch), quaternion_from_axis_angle((1, 0, 0), roll)
        ),
    )
    level = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
    np.testing.assert_allclose(camera.rotation, level @ quaternion_to_matrix(turned).T, atol=1e-12)


@given(points, points)
def test_looking_at_a_point_is_yaw_and_pitch_without_roll(position, target):
    ahead = target - position
    assume(np.hypot(*ahead[:2]) > 1e-3)
    camera = PinholeCamera.look_at(position, target, 300.0, (320, 240))
    yaw, pitch = np.arctan2(ahead[1], ahead[0]), np.arctan2(ahead[2], np.hypot(*ahead[:2]))
    same = PinholeCamera.at_angles(position, yaw, pitch, 0.0, 300.0, (320, 240))
    np.testing.assert_allclose(camera.rotation, same.rotation, atol=1e-9)


def test_a_clockwise_roll_turns_the_image_anticlockwise():
    rolled = PinholeCamera.at_angles((0.0, 0.0, 2.0), 0.0, 0.0, np.radians(10.0), 300.0, (320, 240))
    pixels, _ = rolled.project(np.array([[10.0, -1.0, 2.0]]))  # to the right of the axis
    x, y = pixels[0] - rolled.principal_point
    assert np.degrees(np.arctan2(-y, x)) == pytest.approx(10.0)


@settings(deadline=None)  # the first call compiles
@given(st.floats(0.0, 319.0), st.floats(0.0, 239.0), st.sampled_from([(0.0, 0.0), (-0.3, 0.1), (0.2, -0.05)]))
def test_rays_undo_projection(x, y, distortion):
    camera = PinholeCamera.at_angles((1.0, 2.0, 3.0), 0.4, -0.2, 0.1, 250.0, (320, 240), distortion)
    rays = camera.rays(np.array([[x, y]]))
    assert rays[0, 2] == 1.0
    pixels, _ = camera.project(camera.position + 7.0 * rays @ camera.rotation)
    np.testing.assert_allclose(pixels, [[x, y]], atol=1e-9)
