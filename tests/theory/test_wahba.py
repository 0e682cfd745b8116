"""Orientations from directions against scipy, closed forms and the law of large numbers."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from wsnsim.estimation.attitude import angle_between, mean_quaternion, minimal_rotation, towards, wahba
from wsnsim.geometry.rotations import (
    conjugate,
    matrix_to_quaternion,
    normalise,
    quaternion_from_axis_angle,
    quaternion_multiply,
    quaternion_to_matrix,
    rotation_vector,
)
from wsnsim.rng import RandomStreams

quaternions = (
    arrays(np.float64, 4, elements=st.floats(-1.0, 1.0))
    .filter(lambda q: np.linalg.norm(q) > 1e-3)
    .map(normalise)
)
directions = (
    arrays(np.float64, 3, elements=st.floats(-1.0, 1.0))
    .filter(lambda v: np.linalg.norm(v) > 1e-3)
    .map(lambda v: v / np.linalg.norm(v))
)
IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])


def unit_vectors(generator: np.random.Generator, count: int) -> np.ndarray:
    vectors = generator.standard_normal((count, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def angle_of(matrix: np.ndarray) -> float:
    return float(Rotation.from_matrix(matrix).magnitude())


@given(quaternions, directions, directions)
def test_two_directions_that_are_not_parallel_decide_a_rotation(
    q: np.ndarray, first: np.ndarray, second: np.ndarray
) -> None:
    sine = np.linalg.norm(np.cross(first, second))
    if sine < 0.1:
        return
    rotation, body = quaternion_to_matrix(q), np.array([first, second])
    found = wahba(body @ rotation.T, body, np.array([1.0, 0.3]))
    # rounding of 1e-16 grows with the inverse of the smaller singular value, about sine²
    np.testing.assert_allclose(found, rotation, atol=1e-14 / sine**2)


@pytest.mark.parametrize("seed", range(20))
def test_the_least_squares_rotation_is_scipys(seed: int) -> None:
    generator = RandomStreams(seed).stream("wahba")
    count = int(generator.integers(2, 9))
    observed, body = unit_vectors(generator, count), unit_vectors(generator, count)
    weights = generator.uniform(0.1, 3.0, count)
    peer, _ = Rotation.align_vectors(observed, body, weights=weights)
    np.testing.assert_allclose(wahba(observed, body, weights), peer.as_matrix(), atol=1e-9)


@pytest.mark.parametrize(
    ("body", "weights"),
    [
        (np.eye(3)[:1], np.ones(1)),
        (np.eye(3)[[0, 0, 0]], np.ones(3)),
        (np.array([[1.0, 0, 0], [-1.0, 0, 0]]), np.ones(2)),
        (np.eye(3), np.zeros(3)),
        (np.eye(3)[:2], np.ones(2)),
    ],
)
def test_the_answer_is_always_a_proper_rotation(body: np.ndarray, weights: np.ndarray) -> None:
    """One direction, several of one line, nothing at all: open, but never a mirror image."""
    turn = quaternion_to_matrix(normalise([0.3, -0.5, 0.7, 0.2]))
    found = wahba(body @ turn.T, body, weights)
    np.testing.assert_allclose(found @ found.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(found) == pytest.approx(1.0, abs=1e-12)
    np.testing.assert_allclose(weights @ (body @ found.T), weights @ (body @ turn.T), atol=1e-12)


def test_mirrored_directions_are_matched_by_a_rotation_not_by_the_mirror() -> None:
    generator = RandomStreams(3).stream("mirror")
    body = unit_vectors(generator, 6)
    found = wahba(body * [1.0, 1.0, -1.0], body, np.ones(6))
    assert np.linalg.det(found) == pytest.approx(1.0, abs=1e-12)


def test_the_error_falls_with_the_root_of_the_number_of_directions() -> None:
    """n directions, noise σ across each: the information is σ⁻² Σ (I − v vᵀ), 2n/3 of it on each axis.

    So the squared angle has the mean 3 · 3σ²/(2n). Over 400 trials the mean of squares of three
    normals has a relative standard error of √(2/3)/√400 = 4 %; the bound is five of them.
    """
    generator = RandomStreams(4).stream("noise")
    sd, trials = 0.02, 400
    for count in (8, 32, 128):
        squares = []
        for _ in range(trials):
            body = unit_vectors(generator, count)
            observed = body + sd * generator.standard_normal(body.shape)
            observed /= np.linalg.norm(observed, axis=1, keepdims=True)
            squares.append(angle_of(wahba(observed, body, np.ones(count))) ** 2)
        # with few directions of random places the information of each trial varies: 1/n beyond the mean
        expected = 4.5 * sd**2 / count
        assert np.mean(squares) == pytest.approx(expected, rel=5 * 0.041 + 1.5 / count)


@given(quaternions)
def test_a_matrix_gives_its_quaternion_back(q: np.ndarray) -> None:
    back = matrix_to_quaternion(quaternion_to_matrix(q))
    assert back[0] >= 0.0
    assert abs(float(back @ q)) == pytest.approx(1.0, abs=1e-14)
    np.testing.assert_allclose(quaternion_to_matrix(back), quaternion_to_matrix(q), atol=1e-13)


@pytest.mark.parametrize("axis", [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, -1, 1]])
@pytest.mark.parametrize("angle", [0.0, 1e-9, 1.0, np.pi - 1e-9, np.pi])
def test_quaternions_of_turns_up_to_a_half_keep_their_digits(axis: list[float], angle: float) -> None:
    q = quaternion_from_axis_angle(axis, angle)
    back = matrix_to_quaternion(quaternion_to_matrix(q))
    np.testing.assert_allclose(back * np.sign(back @ q), q, atol=1e-15)


@given(quaternions)
def test_rotation_vectors_are_scipys(q: np.ndarray) -> None:
    ours, peer = rotation_vector(q), Rotation.from_quat(q, scalar_first=True).as_rotvec()
    assert np.linalg.norm(ours) <= np.pi + 1e-12
    if np.linalg.norm(peer) > np.pi - 1e-9:
        # a half turn has two axes
        ours, peer = ours * np.sign(ours @ peer), peer
    np.testing.assert_allclose(ours, peer, atol=1e-8)


@given(quaternions)
def test_the_conjugate_is_the_inverse(q: np.ndarray) -> None:
    np.testing.assert_allclose(quaternion_multiply(q, conjugate(q)), IDENTITY, atol=1e-15)
    np.testing.assert_array_equal(rotation_vector(IDENTITY), np.zeros(3))


@given(quaternions, quaternions)
def test_the_angle_between_is_that_of_the_turn_from_one_to_the_other(
    first: np.ndarray, second: np.ndarray
) -> None:
    turn = np.linalg.norm(rotation_vector(quaternion_multiply(second, conjugate(first))))
    # the arc cosine keeps half of the digits near 1
    assert angle_between(first, second) == pytest.approx(turn, abs=1e-7)
    assert angle_between(first, -second) == angle_between(first, second)


@given(arrays(np.float64, (5, 4), elements=st.floats(-0.2, 0.2)), quaternions, st.integers(0, 31))
def test_the_mean_does_not_depend_on_signs(offsets: np.ndarray, centre: np.ndarray, flips: int) -> None:
    near = np.array([normalise(centre + offset) for offset in offsets])
    signs = np.where(np.array([flips >> bit & 1 for bit in range(5)]), -1.0, 1.0)
    weights = np.array([1.0, 2.0, 0.5, 1.0, 3.0])
    mean, other = mean_quaternion(near, weights), mean_quaternion(signs[:, None] * near, weights)
    assert abs(float(mean @ other)) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("half_angle", [0.01, 0.4, 1.2])
def test_the_mean_of_two_is_halfway(half_angle: float) -> None:
    axis = [0.2, -1.0, 0.4]
    one, other = quaternion_from_axis_angle(axis, -half_angle), quaternion_from_axis_angle(axis, half_angle)
    assert angle_between(mean_quaternion(np.array([one, -other]), np.ones(2)), IDENTITY) < 1e-7


@given(directions, directions)
def test_the_smallest_rotation_turns_one_direction_into_the_other(start: np.ndarray, end: np.ndarray) -> None:
    q = minimal_rotation(start, end)
    # nearly opposite, any half turn stands in
    np.testing.assert_allclose(quaternion_to_matrix(q) @ start, end, atol=3e-6)
    between = np.arctan2(np.linalg.norm(np.cross(start, end)), start @ end)
    assert np.linalg.norm(rotation_vector(q)) == pytest.approx(between, abs=3e-6)


@pytest.mark.parametrize("off", [0.0, 1e-15, 1e-9, 1e-7, 1e-6, 1e-3])
@pytest.mark.parametrize("start", [[0, 0, 1], [1, 0, 0], [0.6, -0.8, 0]])
def test_nearly_opposite_directions_have_a_half_turn(start: list[float], off: float) -> None:
    """Below an angle of 1.4e-6 from opposite any half turn stands in, so far from the end at most."""
    direction = np.array(start, dtype=float)
    aside = np.cross(direction, [0.3, 0.5, 0.8])
    end = -direction + off * aside / np.linalg.norm(aside)
    end /= np.linalg.norm(end)
    q = minimal_rotation(direction, end)
    assert np.linalg.norm(q) == pytest.approx(1.0, abs=1e-12)
    assert np.linalg.norm(quaternion_to_matrix(q) @ direction - end) < 3e-6
    # the cross product keeps 1e-16 / off of its direction
    assert np.linalg.norm(rotation_vector(q)) == pytest.approx(np.pi - off, abs=3e-6)


@given(quaternions, quaternions)
def test_towards_goes_from_one_end_to_the_other_by_the_shorter_way(
    start: np.ndarray, end: np.ndarray
) -> None:
    whole = angle_between(start, end)
    if whole > np.pi - 1e-3:
        return
    assert angle_between(towards(start, end, 0.0), start) < 1e-7
    assert angle_between(towards(start, end, 1.0), end) < 1e-7
    half = towards(start, end, 0.5)
    assert angle_between(half, start) == pytest.approx(0.5 * whole, abs=1e-7)
    ways = [angle_between(start, towards(start, end, share)) for share in (0.0, 0.25, 0.5, 0.75, 1.0)]
    assert (np.diff(ways) >= -1e-7).all()
    one, other = towards(start, end, 0.3), towards(start, -end, 0.3)
    assert angle_between(one, other) < 1e-7


def test_towards_goes_the_share_of_a_small_turn() -> None:
    """tan(θ'/2) = α sin(θ/2) / (1 − α + α cos(θ/2)): α θ for small angles."""
    for angle, share in ((0.01, 0.3), (1.0, 0.5), (2.0, 0.25)):
        end = quaternion_from_axis_angle([0, 0, 1], angle)
        half = np.arctan2(share * np.sin(angle / 2), 1 - share + share * np.cos(angle / 2))
        assert angle_between(towards(IDENTITY, end, share), IDENTITY) == pytest.approx(2 * half, abs=1e-9)
