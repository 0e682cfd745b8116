import numpy as np
import pytest

from wsnsim.geometry.rotations import quaternion_to_matrix
from wsnsim.world import occluders
from wsnsim.world.bodies import PatchTexture
from wsnsim.world.solids import blocks, contains

GREY = PatchTexture.plain((128.0, 128.0, 128.0))


def corners(body, pose):
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).T.reshape(-1, 3)
    return pose.position + (signs * body.semi_axes_m) @ quaternion_to_matrix(pose.orientation).T


def test_a_wall_stands_on_its_line():
    body, pose = occluders.wall(np.array([1.0, 2.0]), np.array([4.0, 6.0]), 0.2, 2.5, 0.5, GREY)
    assert body.form == "box"
    across = 0.1 * np.array([-0.8, 0.6])
    expected = [
        [*(end + side), z]
        for end in (np.array([1.0, 2.0]), np.array([4.0, 6.0]))
        for side in (across, -across)
        for z in (0.5, 3.0)
    ]
    found = corners(body, pose)
    np.testing.assert_allclose(sorted(found.round(9).tolist()), sorted(np.round(expected, 9).tolist()))


def test_a_wall_along_x_is_not_turned():
    body, pose = occluders.wall(np.array([1.0, 2.0]), np.array([4.0, 2.0]), 0.2, 2.5, 0.0, GREY)
    np.testing.assert_array_equal(pose.orientation, [1, 0, 0, 0])
    np.testing.assert_allclose(body.semi_axes_m, [1.5, 0.1, 1.25])
    assert blocks(body, pose, np.array([[2.0, 0.0, 1.0]]), np.array([[2.0, 4.0, 1.0]])).all()
    assert not blocks(body, pose, np.array([[2.0, 0.0, 2.6]]), np.array([[2.0, 4.0, 2.6]])).any()
    assert not blocks(body, pose, np.array([[4.2, 0.0, 1.0]]), np.array([[4.2, 4.0, 1.0]])).any()


def test_a_box_turns_from_x_towards_y():
    body, pose = occluders.box(np.array([5.0, 5.0, 1.0]), np.array([4.0, 1.0, 2.0]), np.pi / 6, GREY)
    along = np.array([np.cos(np.pi / 6), np.sin(np.pi / 6), 0.0])
    ends = pose.position + np.outer([1.99, 2.01], along)
    assert contains(body, pose, ends).tolist() == [True, False]


def test_a_pillar_is_round_and_stands_on_its_base():
    body, pose = occluders.pillar(np.array([3.0, 4.0]), 0.5, 3.0, 1.0, GREY)
    assert body.form == "cylinder"
    points = np.array(
        [[3.35, 4.35, 1.1], [3.36, 4.36, 1.1], [3.0, 4.0, 0.9], [3.0, 4.0, 3.99], [3.0, 4.0, 4.01]]
    )
    assert contains(body, pose, points).tolist() == [True, False, False, True, False]


def test_plain_texture_is_one_colour():
    np.testing.assert_array_equal(PatchTexture.plain((1.0, 2.0, 3.0)).colours, [[1.0, 2.0, 3.0]])
    with pytest.raises(ValueError, match="must lie in 0–255"):
        PatchTexture.plain((1.0, 2.0, 300.0))
