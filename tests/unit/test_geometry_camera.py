import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from wsnsim.geometry.camera import PinholeCamera

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
