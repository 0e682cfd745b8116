"""What is inside a body and what it blocks, against points along the line and against closed answers."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wsnsim.geometry.rotations import IDENTITY, normalise
from wsnsim.world.bodies import Body, PatchTexture
from wsnsim.world.motion import Pose
from wsnsim.world.solids import any_blocks, blocks, contains

FORMS = ("ellipsoid", "box", "cylinder")
PLAIN = PatchTexture.plain((0.0, 0.0, 0.0))


def upright(form, semi_axes=(1.0, 1.0, 1.0), place=(0.0, 0.0, 0.0)):
    return Body(np.array(semi_axes), PLAIN, form), Pose(np.array(place), np.zeros(3), IDENTITY)


def drawn(generator, form):
    body = Body(generator.uniform(0.7, 2.0, 3), PLAIN, form)
    return body, Pose(generator.normal(size=3), np.zeros(3), normalise(generator.normal(size=4)))


@pytest.mark.parametrize(
    ("form", "inside"),
    # a corner of the cube, the rim of the cylinder, the pole; a point beyond the ball, within the cylinder
    [
        ("ellipsoid", [False, False, True, False]),
        ("cylinder", [False, True, True, True]),
        ("box", [True, True, True, True]),
    ],
)
def test_points_by_hand(form, inside):
    body, pose = upright(form, (2.0, 1.0, 3.0), (10.0, 20.0, 30.0))
    units = np.array([[1.0, 1.0, 1.0], [0.6, 0.8, 1.0], [0.0, 0.0, 1.0], [0.6, 0.6, 0.9]])
    assert contains(body, pose, pose.position + 0.999999 * units * body.semi_axes_m).tolist() == inside
    assert not contains(body, pose, pose.position + 1.000001 * units[:3] * body.semi_axes_m).any()


@pytest.mark.parametrize("form", FORMS)
def test_volumes(form, test_seed):
    generator = np.random.default_rng(test_seed)
    body, pose = drawn(generator, form)
    reach = float(np.linalg.norm(body.semi_axes_m))
    n = 200_000
    points = pose.position + generator.uniform(-reach, reach, (n, 3))
    share = {"ellipsoid": 4 / 3 * np.pi, "cylinder": 2 * np.pi, "box": 8.0}[form]
    expected = share * body.semi_axes_m.prod() / (2 * reach) ** 3
    # standard error of a share: √(p (1 − p) / n)
    bound = 5 * np.sqrt(expected * (1 - expected) / n)
    assert contains(body, pose, points).mean() == pytest.approx(expected, abs=bound)


@pytest.mark.parametrize("form", FORMS)
def test_lines_against_points_along_them(form, test_seed):
    generator = np.random.default_rng(test_seed)
    body, pose = drawn(generator, form)
    origins, ends = generator.normal(scale=2.0, size=(2, 1500, 3))
    shares = np.linspace(0.0, 1.0, 801)[:, np.newaxis]
    met = np.array(
        [
            contains(body, pose, origin + shares * (end - origin)).any()
            for origin, end in zip(origins, ends, strict=True)
        ]
    )
    blocked = blocks(body, pose, origins, ends)
    assert 0.05 < met.mean() < 0.95
    assert blocked[met].all()
    # what only touches between two of the points is blocked too: a shrunken body is not met
    smaller = Body(0.95 * body.semi_axes_m, PLAIN, form)
    assert not (blocks(smaller, pose, origins, ends) & ~met).any()


@pytest.mark.parametrize(
    ("form", "origin", "end", "blocked"),
    [
        ("ellipsoid", (-3, 0, 0.999), (3, 0, 0.999), True),
        ("ellipsoid", (-3, 0, 1.001), (3, 0, 1.001), False),
        ("ellipsoid", (-3, 0, 0), (-1.001, 0, 0), False),
        ("ellipsoid", (0.1, 0, 0), (0.2, 0, 0), True),
        ("ellipsoid", (0.5, 0.5, 0), (0.5, 0.5, 0), True),
        ("ellipsoid", (0.8, 0.8, 0), (0.8, 0.8, 0), False),
        ("cylinder", (0.5, 0.5, -9), (0.5, 0.5, 9), True),
        ("cylinder", (0.8, 0.8, -9), (0.8, 0.8, 9), False),
        ("cylinder", (-9, 0, 1.001), (9, 0, 1.001), False),
        ("cylinder", (-2, 0, 0.5), (0, 0, 2.5), False),  # through the infinite cylinder, above its end
        ("box", (0.99, -9, 0.99), (0.99, 9, 0.99), True),
        ("box", (1.01, -9, 0.99), (1.01, 9, 0.99), False),
        ("box", (-2.2, 0, 0), (0, 2.2, 0), False),  # past the edge at (−1, 1)
        ("box", (-1.9, 0, 0), (0, 1.9, 0), True),
    ],
)
def test_lines_by_hand(form, origin, end, blocked):
    body, pose = upright(form)
    assert blocks(body, pose, np.array([origin], float), np.array([end], float)).tolist() == [blocked]


def test_one_eye_and_many_points():
    body, pose = upright("box", place=(5.0, 0.0, 0.0))
    ends = np.array([[9.0, 0.0, 0.0], [9.0, 9.0, 0.0], [3.0, 0.0, 0.0]])
    assert blocks(body, pose, np.zeros((1, 3)), ends).tolist() == [True, False, False]
    assert blocks(body, pose, ends, np.zeros((1, 3))).tolist() == [True, False, False]
    assert any_blocks([], [], np.zeros((1, 3)), ends).tolist() == [False] * 3


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.lists(st.sampled_from(FORMS), min_size=1, max_size=5))
def test_another_occluder_never_reveals_a_point(seed, forms):
    generator = np.random.default_rng(seed)
    bodies, poses = zip(*(drawn(generator, form) for form in forms), strict=True)
    eye, points = generator.normal(scale=4.0, size=(1, 3)), generator.normal(scale=4.0, size=(100, 3))
    fewer = any_blocks(bodies[:-1], poses[:-1], eye, points)
    more = any_blocks(bodies, poses, eye, points)
    assert not (fewer & ~more).any()
    larger = [Body(1.1 * body.semi_axes_m, PLAIN, body.form) for body in bodies]
    assert not (more & ~any_blocks(larger, poses, eye, points)).any()
    # the line there is the line back, and what is inside is hidden
    np.testing.assert_array_equal(more, any_blocks(bodies, poses, points, np.repeat(eye, 100, axis=0)))
    inside = contains(Body(0.999 * bodies[-1].semi_axes_m, PLAIN, forms[-1]), poses[-1], points)
    assert more[inside].all()


def test_lines_all_but_parallel_to_a_side():
    body, pose = upright("box")
    tiny = 1e-320
    origins = np.array([[0.5, 0.0, -3.0], [1.5, 0.0, -3.0]])
    assert blocks(body, pose, origins, origins + [[tiny, tiny, 6.0]]).tolist() == [True, False]
