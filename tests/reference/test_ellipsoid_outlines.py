"""Outlines against the projections of points on the ellipsoid's surface."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.geometry.quadrics import Box, Outlines, ellipsoid_outlines, outline_box, outline_boxes
from wsnsim.geometry.rotations import quaternion_from_axis_angle, quaternion_to_matrix

CAMERA = PinholeCamera.look_at((0.0, 0.0, 2.0), (5.0, 0.0, 1.0), 300.0, (320, 240))
SEMI_AXES = np.array([0.40, 0.28, 0.34])
TILTED = quaternion_from_axis_angle((1.0, 2.0, 3.0), 0.8)


def surface(position, orientation, semi_axes, count):
    """Points all over the surface, dense enough that their hull is the outline within 1e-4 or so."""
    k = np.arange(count) + 0.5
    polar, turn = np.arccos(1 - 2 * k / count), np.pi * (1 + np.sqrt(5)) * k
    unit = np.stack((np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)), axis=1)
    return position + (semi_axes * unit) @ quaternion_to_matrix(orientation).T


def distances(outlines, i, pixels):
    offset = pixels - outlines.centres[i]
    return np.einsum("ni,ij,nj->n", offset, outlines.shapes[i], offset)


@settings(max_examples=40, deadline=None)
@given(
    st.floats(1.5, 30.0),
    st.floats(-0.9, 0.9),
    st.floats(-0.9, 0.9),
    st.floats(0.0, 6.3),
    st.tuples(*[st.floats(0.1, 1.0)] * 3),
)
def test_surface_points_fill_the_outline_and_stay_inside(depth, right, down, turn, semi_axes):
    position = CAMERA.position + depth * CAMERA.rotation.T @ np.array([right, down, 1.0])
    orientation = quaternion_from_axis_angle((1.0, -2.0, 0.5), turn)
    outlines = ellipsoid_outlines(CAMERA, position[None], orientation, np.array(semi_axes))
    assert outlines.visible[0]
    pixels, _ = CAMERA.project(surface(position, orientation, np.array(semi_axes), 20_000))
    d = distances(outlines, 0, pixels)
    assert d.max() <= 1.0 + 1e-9
    # Points touch the outline in every direction: the extents agree.
    spread = np.linalg.inv(outlines.shapes[0])
    for angle in np.linspace(0.0, np.pi, 7):
        direction = np.array([np.cos(angle), np.sin(angle)])
        along = (pixels - outlines.centres[0]) @ direction
        reach = np.sqrt(direction @ spread @ direction)
        assert along.max() == pytest.approx(reach, rel=2e-3)
        assert along.min() == pytest.approx(-reach, rel=2e-3)


def test_matches_the_dual_conic_written_out():
    positions = np.array([[4.0, 0.5, 1.2], [9.0, -2.0, 0.4]])
    outlines = ellipsoid_outlines(CAMERA, positions, TILTED, SEMI_AXES)
    for i, position in enumerate(positions):
        pose = np.eye(4)
        pose[:3, :3] = quaternion_to_matrix(TILTED)
        pose[:3, 3] = position
        dual_quadric = pose @ np.diag([*SEMI_AXES**2, -1.0]) @ pose.T
        conic = np.linalg.inv(CAMERA.matrix @ dual_quadric @ CAMERA.matrix.T)
        centre = -np.linalg.solve(conic[:2, :2], conic[:2, 2])
        level = centre @ conic[:2, :2] @ centre - conic[2, 2]
        np.testing.assert_allclose(outlines.centres[i], centre, rtol=1e-9)
        np.testing.assert_allclose(outlines.shapes[i], conic[:2, :2] / level, rtol=1e-7)


def test_centre_is_not_the_projected_centre():
    position = np.array([[2.0, 0.9, 1.2]])
    outlines = ellipsoid_outlines(CAMERA, position, TILTED, SEMI_AXES)
    pixels, _ = CAMERA.project(position)
    assert np.linalg.norm(outlines.centres - pixels) > 1.0


def test_sphere_on_the_axis_has_a_circle_of_known_radius():
    position = CAMERA.position + 4.0 * CAMERA.rotation[2]
    outlines = ellipsoid_outlines(CAMERA, position[None], TILTED, np.full(3, 0.5))
    radius = 300.0 * 0.5 / np.sqrt(4.0**2 - 0.5**2)
    np.testing.assert_allclose(outlines.shapes[0], np.eye(2) / radius**2, rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(outlines.centres[0], CAMERA.principal_point)


@pytest.mark.parametrize("depth", [-5.0, -0.3, 0.0, 0.1, 0.2, 0.3])
def test_behind_or_cut_by_the_camera_plane_is_not_visible(depth):
    position = CAMERA.position + CAMERA.rotation.T @ np.array([1.0, 0.5, depth])
    outlines = ellipsoid_outlines(CAMERA, position[None], TILTED, np.full(3, 0.3))
    assert not outlines.visible[0]
    assert np.isfinite(outlines.centres).all()
    assert np.linalg.det(outlines.shapes[0]) > 0.0


def test_one_bad_position_spoils_no_other():
    good = np.array([4.0, 0.5, 1.2])
    positions = np.array([good, [np.nan, 0.0, 0.0], [np.inf, 0.0, 0.0], [-4.0, 0.0, 1.0], good])
    outlines = ellipsoid_outlines(CAMERA, positions, TILTED, SEMI_AXES)
    assert outlines.visible.tolist() == [True, False, False, False, True]
    alone = ellipsoid_outlines(CAMERA, good[None], TILTED, SEMI_AXES)
    np.testing.assert_array_equal(outlines.centres[4], alone.centres[0])
    np.testing.assert_array_equal(outlines.shapes[4], alone.shapes[0])


def test_no_positions_give_no_outlines():
    outlines = ellipsoid_outlines(CAMERA, np.empty((0, 3)), TILTED, SEMI_AXES)
    assert len(outlines.centres) == 0
    assert outline_box(outlines, 320, 240) == Box(0, 0, 0, 0)


def circles(centres, radii, visible=None):
    shapes = np.eye(2) / np.array(radii)[:, None, None] ** 2
    visible = np.ones(len(radii), bool) if visible is None else np.array(visible)
    return Outlines(np.array(centres, dtype=float), shapes, visible)


@pytest.mark.parametrize(
    ("centre", "radius", "box"),
    [
        ((50.0, 60.0), 2.5, (48, 58, 53, 63)),
        ((0.0, 0.0), 2.0, (0, 0, 3, 3)),
        ((318.6, 100.0), 3.2, (316, 97, 320, 104)),
        ((-10.0, 100.0), 5.0, (0, 0, 0, 0)),
        ((50.5, 60.5), 0.3, (0, 0, 0, 0)),
    ],
)
def test_box_holds_the_pixel_centres_inside(centre, radius, box):
    outlines = circles([centre], [radius])
    assert tuple(outline_boxes(outlines, 320, 240)[0]) == box
    assert outline_box(outlines, 320, 240) == Box(*box)


def test_box_of_many_leaves_out_what_is_not_visible():
    outlines = circles([(50, 60), (100, 20), (300, 200)], [5, 5, 5], [True, True, False])
    assert outline_box(outlines, 320, 240) == Box(45, 15, 106, 66)
