import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from wsnsim.geometry.rotations import (
    IDENTITY,
    normalise,
    quaternion_from_axis_angle,
    quaternion_multiply,
    quaternion_to_matrix,
)

quaternions = (
    arrays(np.float64, 4, elements=st.floats(-1.0, 1.0))
    .filter(lambda q: np.linalg.norm(q) > 1e-3)
    .map(normalise)
)


@given(quaternions)
def test_matrix_is_scipys(q):
    expected = Rotation.from_quat(q, scalar_first=True).as_matrix()
    np.testing.assert_allclose(quaternion_to_matrix(q), expected, atol=1e-14)


@given(quaternions, quaternions)
def test_product_applies_the_right_factor_first(left, right):
    together = quaternion_to_matrix(quaternion_multiply(left, right))
    np.testing.assert_allclose(together, quaternion_to_matrix(left) @ quaternion_to_matrix(right), atol=1e-14)


def test_quarter_turn_about_z_takes_x_to_y():
    q = quaternion_from_axis_angle((0.0, 0.0, 5.0), np.pi / 2)
    np.testing.assert_allclose(q, [np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)], atol=1e-15)
    np.testing.assert_allclose(quaternion_to_matrix(q) @ [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], atol=1e-15)


def test_identity_is_no_turn_and_cannot_be_changed():
    np.testing.assert_array_equal(quaternion_to_matrix(IDENTITY), np.eye(3))
    with pytest.raises(ValueError, match="read-only"):
        IDENTITY[0] = 2.0


@pytest.mark.parametrize("bad", [[0, 0, 0, 0], [1, 0, 0], [np.nan, 0, 0, 1], [np.inf, 0, 0, 1]])
def test_what_is_no_rotation_is_refused(bad):
    with pytest.raises(ValueError, match="quaternion: must be four finite numbers"):
        normalise(bad)


@pytest.mark.parametrize("bad", [[0, 0, 0], [1, 0], [np.nan, 0, 0]])
def test_what_is_no_axis_is_refused(bad):
    with pytest.raises(ValueError, match="axis: must be three finite numbers"):
        quaternion_from_axis_angle(bad, 1.0)
