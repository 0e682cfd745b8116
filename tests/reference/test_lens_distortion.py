"""Radial distortion against OpenCV, against the polynomial itself, and what it does to outlines."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.geometry.extents import box_of_points, box_of_rays
from wsnsim.geometry.lens import distort, distortion_jacobians, farthest_image, turning_radius, undistort
from wsnsim.geometry.quadrics import ellipsoid_outlines
from wsnsim.geometry.rotations import normalise, quaternion_to_matrix

SEMI_AXES = np.array([0.40, 0.28, 0.34])
LENSES = [(-0.27, -0.04), (0.3, -1.0), (-0.17, -0.11), (0.1, 0.2), (-0.3, 0.09)]
"""The first three as calibrated from OpenCV's sample pictures, to two digits."""

coefficients = st.floats(-1.0, 1.0)


def camera_with(distortion, focal=300.0):
    return PinholeCamera.at_angles((1.0, 2.0, 3.0), 0.3, -0.2, 0.4, focal, (320, 240), distortion)


@pytest.mark.parametrize("distortion", LENSES)
def test_projection_is_opencvs(distortion):
    cv2 = pytest.importorskip("cv2")
    camera = camera_with(distortion, 530.0)
    generator = np.random.default_rng(3)
    rays = np.column_stack((generator.uniform(-0.4, 0.4, (500, 2)), np.ones(500)))
    points = camera.position + generator.uniform(0.5, 9.0, (500, 1)) * rays @ camera.rotation
    pixels, _ = camera.project(points)
    turn, _ = cv2.Rodrigues(camera.rotation)
    coefficients = np.array([*distortion, 0.0, 0.0])
    expected, _ = cv2.projectPoints(
        points, turn, -camera.rotation @ camera.position, camera.intrinsics, coefficients
    )
    within = np.linalg.norm(rays[:, :2], axis=1) < turning_radius(distortion)
    assert within.sum() > 400
    np.testing.assert_allclose(pixels[within], expected[within, 0], atol=1e-9)
    # OpenCV folds what lies beyond back into the image.
    assert np.isnan(pixels[~within]).all()


@settings(deadline=None)
@given(coefficients, coefficients, st.floats(0.0, 3.0), st.floats(0.0, 6.3))
def test_what_the_lens_did_is_undone_or_has_no_ray(k1, k2, radius, turn):
    distortion = (k1, k2)
    point = radius * np.array([[np.cos(turn), np.sin(turn)]])
    bent = distort(point, distortion)
    if radius > turning_radius(distortion):
        assert np.isnan(bent).all()
        return
    assert np.linalg.norm(bent) <= farthest_image(distortion) * (1 + 1e-12)
    back = undistort(bent, distortion)
    # Near the turning radius the slope is 0 and half of the digits are lost.
    slope = abs(1 + 3 * k1 * radius**2 + 5 * k2 * radius**4)
    np.testing.assert_allclose(back, point, atol=1e-7 if slope < 1e-6 else 1e-13 / slope + 1e-13)


@given(coefficients, coefficients)
def test_the_turning_radius_is_where_the_polynomial_first_stops_growing(k1, k2):
    limit = turning_radius((k1, k2))
    r = np.linspace(0.0, min(0.999 * limit, 50.0), 2000)
    slope = 1.0 + 3.0 * k1 * r**2 + 5.0 * k2 * r**4
    assert (slope > 0.0).all()
    if np.isfinite(limit):
        assume(limit < 1e3)
        terms = 1.0 + 3.0 * abs(k1) * limit**2 + 5.0 * abs(k2) * limit**4
        assert abs(1.0 + 3.0 * k1 * limit**2 + 5.0 * k2 * limit**4) < 1e-12 * terms


def test_nothing_folds_back_into_the_image():
    camera = camera_with((-0.3, 0.0))
    # r (1 - 0.3 r²) is greatest, 0.70, at r = 1.05; at r = 1.6 it is back at 0.37, inside the image.
    for radius, seen in [(0.5, True), (1.05, True), (1.06, False), (1.6, False), (1.9, False)]:
        point = camera.position + np.array([radius, 0.0, 1.0]) @ camera.rotation
        pixels, depths = camera.project(point[None])
        assert np.isfinite(pixels).all() == seen
        assert depths[0] == pytest.approx(1.0)


def test_the_jacobian_is_the_derivative():
    generator = np.random.default_rng(0)
    points, step = generator.uniform(-0.5, 0.5, (20, 2)), 1e-6
    for distortion in LENSES:
        found = distortion_jacobians(points, distortion)
        for axis in (0, 1):
            shift = step * np.eye(2)[axis]
            difference = distort(points + shift, distortion) - distort(points - shift, distortion)
            np.testing.assert_allclose(found[:, :, axis], difference / (2 * step), atol=1e-8)


def surface(position, orientation, count=40_000):
    k = np.arange(count) + 0.5
    polar, turn = np.arccos(1 - 2 * k / count), np.pi * (1 + np.sqrt(5)) * k
    unit = np.stack((np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)), axis=1)
    return position + (SEMI_AXES * unit) @ quaternion_to_matrix(orientation).T


def worst_reach_px(distance):
    """Return the largest error of an outline's extent in any direction, of a dozen ellipsoids."""
    generator = np.random.default_rng(1)
    camera = camera_with((-0.3, 0.06))
    worst = 0.0
    for _ in range(12):
        ray = camera.rays(generator.uniform((30.0, 30.0), (290.0, 210.0))[None])
        position = camera.position + distance * (ray @ camera.rotation)[0]
        orientation = normalise(generator.normal(size=4))
        outlines = ellipsoid_outlines(camera, position[None], orientation, SEMI_AXES)
        assert outlines.visible[0]
        pixels, _ = camera.project(surface(position, orientation))
        spread = np.linalg.inv(outlines.shapes[0])
        for angle in np.linspace(0.0, 2 * np.pi, 8, endpoint=False):
            direction = np.array([np.cos(angle), np.sin(angle)])
            reach = ((pixels - outlines.centres[0]) @ direction).max()
            worst = max(worst, abs(reach - np.sqrt(direction @ spread @ direction)))
    return worst


def test_the_outline_is_right_to_first_order():
    # 3.0, 0.72 and 0.17 px for outlines of 48, 24 and 12 px: the lens's second derivative, at most
    # 6 |k1| r, times half the outline's squared radius, 0.4 m (1 + r²) / distance; r here is 0.62 at most.
    errors = [worst_reach_px(distance) for distance in (2.5, 5.0, 10.0)]
    for distance, error in zip((2.5, 5.0, 10.0), errors, strict=True):
        assert error < 300.0 * 0.5 * (6 * 0.3 * 0.62) * (0.4 * (1 + 0.62**2) / distance) ** 2
    # Of second order: four times less at half the size.
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.1)


def test_a_lens_without_distortion_changes_no_bit():
    plain = PinholeCamera.look_at((0.0, 0.0, 2.0), (5.0, 0.0, 1.0), 300.0, (320, 240))
    points = np.random.default_rng(0).uniform(1.0, 8.0, (100, 3))
    for camera in (plain, replace(plain, distortion=(0.0, 0.0))):
        seen = camera.to_camera_axes(points)
        expected = 300.0 * seen[:, :2] / seen[:, 2:]
        np.testing.assert_array_equal(camera.project(points)[0], expected + np.array([159.5, 119.5]))


def test_outlines_beyond_the_lens_are_not_visible():
    camera = camera_with((-0.3, 0.0))
    position = camera.position + 4.0 * np.array([1.3, 0.0, 1.0]) @ camera.rotation
    outlines = ellipsoid_outlines(
        camera,
        np.array([position, camera.position + 4.0 * camera.rotation[2]]),
        np.array([1.0, 0, 0, 0]),
        SEMI_AXES,
    )
    assert outlines.visible.tolist() == [False, True]
    assert np.isfinite(outlines.centres).all()
    assert np.isfinite(outlines.shapes).all()


@pytest.mark.parametrize("distortion", [(-1.0, 0.0), (0.3, -9.0), (-0.8, 0.1)])
def test_corners_without_a_ray_are_refused(distortion):
    with pytest.raises(ValueError, match=r"distortion: a ray must reach the corners.*0\.667 focal lengths"):
        camera_with(distortion)
    assert np.isnan(undistort(np.array([[0.6, 0.3]]), distortion)).all()


@pytest.mark.parametrize("distortion", [(np.nan, 0.0), (0.0, np.inf)])
def test_coefficients_must_be_finite(distortion):
    with pytest.raises(ValueError, match="distortion: must be two finite numbers"):
        camera_with(distortion)


@settings(deadline=None)
@given(
    st.sampled_from([(0.0, 0.0), *LENSES[3:], (-0.27, -0.04)]),
    st.tuples(st.floats(-1.2, 1.2), st.floats(-1.2, 1.2)),
    st.tuples(st.floats(0.0, 1.5), st.floats(0.0, 1.5)),
)
def test_boxes_of_rays_hold_every_pixel_that_a_ray_reaches(distortion, low, extent):
    camera = camera_with(distortion)
    low = np.array(low)
    high = low + np.array(extent)
    x0, y0, x1, y1 = box_of_rays(camera, low, high)
    grid = np.stack(np.meshgrid(*np.linspace(low, high, 25).T), axis=-1).reshape(-1, 2)
    pixels, _ = camera.project(
        camera.position + np.column_stack((grid, np.ones(len(grid)))) @ camera.rotation
    )
    pixels = pixels[np.isfinite(pixels).all(axis=1)]
    corner = np.array(camera.resolution_px) - 0.5
    inside = ((pixels > -0.5) & (pixels < corner)).all(axis=1)
    # A pixel reaches half a pixel to each side of its centre; a ray may run along the border.
    first, end = np.array([x0, y0]) - 0.5 - 1e-9, np.array([x1, y1]) - 0.5 + 1e-9
    assert ((pixels[inside] >= first) & (pixels[inside] <= end)).all()


def test_boxes_of_points_before_behind_and_across_the_camera_plane():
    camera = PinholeCamera.look_at((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 100.0, (100, 80))
    cube = np.stack(np.meshgrid(*[(-1.0, 1.0)] * 3), axis=-1).reshape(-1, 3)
    # The near face is 4 m away and 50 px wide about (49.5, 39.5).
    assert tuple(box_of_points(camera, cube + (5.0, 0.0, 0.0))) == (24, 14, 76, 66)
    assert tuple(box_of_points(camera, cube + (0.5, 3.0, 0.0))) == (0, 0, 100, 80)
    assert tuple(box_of_points(camera, cube + (-5.0, 0.0, 0.0))) == (0, 0, 0, 0)
    assert tuple(box_of_points(camera, cube + (5.0, 9.0, 0.0))) == (0, 0, 0, 0)
