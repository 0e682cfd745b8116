"""Images against what geometry, Lambert's law and the noise model say."""

import os

import numpy as np
import pytest

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.geometry.quadrics import ellipsoid_outlines
from wsnsim.geometry.rotations import IDENTITY, normalise, quaternion_from_axis_angle, quaternion_multiply
from wsnsim.rng import RandomStreams
from wsnsim.vision.renderer import Renderer, look
from wsnsim.world.bodies import Body, PatchTexture
from wsnsim.world.motion import Pose

SEED = int(os.environ.get("WSNSIM_TEST_SEED", "0"))
QVGA = (320, 240)
CAMERA = PinholeCamera.look_at((0.0, 0.0, 2.0), (4.0, 0.0, 2.0), 300.0, QVGA)
BOX = np.array([0.40, 0.28, 0.34])
WHITE = PatchTexture(np.array([[0.0, 0.0, 1.0]]), np.array([[240.0, 240.0, 240.0]]))
RED = PatchTexture(np.array([[0.0, 0.0, 1.0]]), np.array([[200.0, 0.0, 0.0]]))
BACK = np.array([-1.0, 0.0, 0.0])
"""Towards the camera: the light of a flash."""


def grey(level, resolution=QVGA):
    return np.full((resolution[1], resolution[0], 3), level, np.uint8)


def make(noise_sd=0.0, gain_jitter=0.0, seed=SEED, camera_id="c1", ambient=1.0, light=BACK, level=100):
    return Renderer(
        CAMERA, camera_id, grey(level), noise_sd, gain_jitter, light, ambient, RandomStreams(seed)
    )


def standing(x, y=0.0, z=2.0, orientation=IDENTITY):
    return Pose(np.array([x, y, z]), np.zeros(3), orientation)


def test_area_is_that_of_the_outline():
    generator = np.random.default_rng(SEED)
    body = Body(BOX, WHITE)
    errors = []
    for _ in range(60):
        distance = generator.uniform(2.0, 9.0)
        aside = distance * generator.uniform(-0.25, 0.25, 2)
        pose = standing(distance, aside[0], 2.0 + aside[1], normalise(generator.normal(size=4)))
        outline = ellipsoid_outlines(CAMERA, pose.position[None], pose.orientation, BOX)
        area = np.pi / np.sqrt(np.linalg.det(outline.shapes[0]))
        errors.append(make().visible_pixels([body], [pose])[0] / area - 1.0)
    # The number of lattice points in a disc of radius r (in sample spacings, here 35 to 160)
    # scatters by about 0.7 √r (Kendall 1948): at most 0.1 %.
    errors = np.array(errors)
    assert abs(errors).max() < 4e-3
    assert np.sqrt((errors**2).mean()) < 1e-3


def test_area_of_a_body_smaller_than_a_pixel():
    body = Body(np.full(3, 0.05), WHITE)
    generator = np.random.default_rng(SEED)
    pixel = 40.0 / 300.0
    shifts = generator.uniform(-2 * pixel, 2 * pixel, (400, 2))
    areas = [make().visible_pixels([body], [standing(40.0, y, 2.0 + z)])[0] for y, z in shifts]
    expected = np.pi * (300 * 0.05 / 40.0) ** 2
    standard_error = np.std(areas) / np.sqrt(len(areas))
    assert np.mean(areas) == pytest.approx(expected, abs=5 * standard_error)


def test_border_of_the_image_cuts_a_body_in_half():
    body = Body(np.full(3, 0.4), WHITE)
    whole = make().visible_pixels([body], [standing(4.0)])[0]
    # A sphere's outline at the border is a little wider; its centre must lie on the border.
    for low, high in [(1.9, 2.5)]:
        for _ in range(40):
            aside = 0.5 * (low + high)
            outline = ellipsoid_outlines(CAMERA, np.array([[4.0, aside, 2.0]]), IDENTITY, body.semi_axes_m)
            low, high = (aside, high) if outline.centres[0, 0] > -0.5 else (low, aside)
    area = np.pi / np.sqrt(np.linalg.det(outline.shapes[0]))
    half = make().visible_pixels([body], [standing(4.0, aside)])[0]
    assert half == pytest.approx(area / 2, rel=4e-3)
    assert whole < area


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_the_nearer_body_hides_the_farther(order):
    bodies = [Body(np.full(3, 0.4), RED), Body(np.full(3, 0.2), WHITE)]
    poses = [standing(5.0), standing(3.0)]
    bodies, poses = [bodies[i] for i in order], [poses[i] for i in order]
    alone = [make().visible_pixels([body], [pose])[0] for body, pose in zip(bodies, poses, strict=True)]
    areas = make().visible_pixels(bodies, poses)
    far, near = order.index(0), order.index(1)
    assert areas[near] == alone[near]
    assert areas[far] == pytest.approx(alone[far] - alone[near], abs=1e-9)
    image = make().render(1, bodies, poses)
    assert image[119, 159].tolist() == [240, 240, 240]
    # 22 px from the middle: inside the far outline of 24 px, outside the near one of 20 px.
    assert image[119, 181].tolist() == [200, 0, 0]
    assert image[119, 190].tolist() == [100, 100, 100]


def test_a_body_in_the_shadow_of_a_larger_one_is_hidden():
    bodies = [Body(np.full(3, 0.2), RED), Body(np.full(3, 0.4), WHITE)]
    assert make().visible_pixels(bodies, [standing(5.0), standing(3.0)])[0] == 0.0


def test_lambert_shading_of_a_sphere():
    # Far away, so that rays are parallel: at a share s of the radius n·l = √(1 - s²).
    camera = PinholeCamera.look_at((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 100_000.0, (201, 201))
    body = Body(np.full(3, 1.0), WHITE)
    pose = Pose(np.array([1250.0, 0.0, 0.0]), np.zeros(3), IDENTITY)
    radius = 100_000.0 / 1250.0
    for light, ambient in ((BACK, 0.25), (-BACK, 0.25), (np.array([0.0, 0.0, 1.0]), 0.4)):
        renderer = Renderer(camera, "c", grey(0, (201, 201)), 0.0, 0.0, light, ambient, RandomStreams(0))
        image = renderer.render(1, [body], [pose])
        for across, down in ((0, 0), (40, 0), (0, -60), (30, 50), (-48, 55)):
            normal = np.array([0.0, -across / radius, -down / radius])
            normal[0] = -np.sqrt(1 - normal @ normal)
            expected = 240.0 * (ambient + (1 - ambient) * max(normal @ light, 0.0))
            assert image[100 + down, 100 + across, 0] == pytest.approx(expected, abs=1.0)


def test_edges_are_blended_with_the_background():
    image = make(level=0).render(1, [Body(np.full(3, 0.4), WHITE)], [standing(4.0)])
    levels = np.unique(image[:, :, 0])
    # Sixteen samples a pixel: sixteenths of 240.
    assert {0, 240} <= set(levels.tolist())
    assert not (levels % 15).any()
    assert len(levels) > 8


def test_texture_turns_with_the_body():
    generator = np.random.default_rng(SEED + 1)
    body = Body(BOX, PatchTexture.random(generator))
    standing_up = normalise(generator.normal(size=4))
    turn = quaternion_from_axis_angle((0.0, 0.0, 1.0), 0.9)
    rotation = np.array([[np.cos(0.9), -np.sin(0.9), 0.0], [np.sin(0.9), np.cos(0.9), 0.0], [0.0, 0.0, 1.0]])
    place = np.array([3.0, 1.0, 0.7])
    first = PinholeCamera.look_at(place, np.zeros(3), 300.0, QVGA)
    second = PinholeCamera.look_at(rotation @ place, np.zeros(3), 300.0, QVGA)
    light = np.array([0.6, 0.0, 0.8])
    image, coverage = look(body, standing_up, first, light, 0.3)
    turned, _ = look(body, quaternion_multiply(turn, standing_up), second, rotation @ light, 0.3)
    assert abs(image.astype(int) - turned).max() <= 1
    unturned, _ = look(body, standing_up, second, rotation @ light, 0.3)
    assert abs(image.astype(int) - unturned).max() > 50
    assert image[0, 0].tolist() == [128, 128, 128]
    assert coverage.max() == 1.0
    outline = ellipsoid_outlines(first, np.zeros((1, 3)), standing_up, BOX)
    assert coverage.sum() == pytest.approx(np.pi / np.sqrt(np.linalg.det(outline.shapes[0])), rel=4e-3)


def test_images_depend_on_seed_camera_and_step_only():
    body = Body(BOX, PatchTexture.random(np.random.default_rng(1)))
    pose = standing(4.0)
    renderer = make(5.0, 0.02)
    forwards = [renderer.render(step, [body], [pose]) for step in (1, 2, 3)]
    again = make(5.0, 0.02)
    again.visible_pixels([body], [pose])
    backwards = [again.render(step, [body], [pose]) for step in (3, 2, 1)]
    for image, same in zip(forwards, reversed(backwards), strict=True):
        np.testing.assert_array_equal(image, same)
    for other in (make(5.0, 0.02, seed=SEED + 1), make(5.0, 0.02, camera_id="c2")):
        assert (other.render(1, [body], [pose]) != forwards[0]).mean() > 0.5
    assert (forwards[0] != forwards[1]).mean() > 0.5


def test_noise_is_white_and_of_the_asked_strength():
    noise = make(noise_sd=5.0, level=128).render(1, [], []) - 128.0
    count = noise.size
    variance = 5.0**2 + 1 / 12  # and that of rounding
    assert noise.mean() == pytest.approx(0.0, abs=5 * np.sqrt(variance / count))
    assert noise.var() == pytest.approx(variance, abs=5 * variance * np.sqrt(2 / count))
    for one, other in (
        (noise[:, 1:], noise[:, :-1]),
        (noise[1:], noise[:-1]),
        (noise[..., 0], noise[..., 1]),
        (noise, make(noise_sd=5.0, level=128).render(2, [], []) - 128.0),
    ):
        assert (one * other).mean() == pytest.approx(0.0, abs=5 * variance / np.sqrt(one.size))


def test_gain_varies_from_frame_to_frame_only():
    renderer = make(gain_jitter=0.03, level=150)
    frames = np.array([renderer.render(step, [], [])[::60, ::80] for step in range(600)]) / 150.0
    assert np.ptp(frames, axis=(1, 2, 3)).max() == 0.0
    gains = frames[:, 0, 0, 0]
    assert gains.mean() == pytest.approx(1.0, abs=5 * 0.03 / np.sqrt(600))
    assert gains.std() == pytest.approx(0.03, abs=5 * 0.03 / np.sqrt(1200))


@pytest.mark.parametrize(("level", "limit"), [(0, 0), (255, 255)])
def test_black_and_white_are_clipped(level, limit):
    image = make(noise_sd=20.0, level=level).render(1, [], [])
    # Half of the noise is cut off.
    assert (image == limit).mean() == pytest.approx(0.5, abs=0.02)


def test_without_bodies_noise_and_jitter_the_photograph_comes_through():
    np.testing.assert_array_equal(make().render(1, [], []), grey(100))
    assert make().visible_pixels([], []).shape == (0,)


def test_background_must_fit_the_camera():
    with pytest.raises(ValueError, match=r"background: must have the camera's shape \(240, 320, 3\)"):
        Renderer(CAMERA, "c1", grey(1, (240, 320)), 0.0, 0.0, BACK, 1.0, RandomStreams(0))
