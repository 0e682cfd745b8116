"""Boxes, cylinders and what stands still against plane geometry and Lambert's law."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.geometry.rotations import IDENTITY, normalise, quaternion_from_axis_angle
from wsnsim.rng import RandomStreams
from wsnsim.vision.renderer import Renderer
from wsnsim.world.bodies import Body, PatchTexture
from wsnsim.world.motion import Pose
from wsnsim.world.world import Placed

QVGA = (320, 240)
CAMERA = PinholeCamera.look_at((0.0, 0.0, 2.0), (4.0, 0.0, 2.0), 300.0, QVGA)
WHITE = PatchTexture(np.array([[0.0, 0.0, 1.0]]), np.array([[240.0, 240.0, 240.0]]))
BACK = np.array([-1.0, 0.0, 0.0])
"""Towards the camera: the light of a flash."""


def make(scenery=(), ambient=1.0, light=BACK, background=None, noise_sd=0.0):
    grey = np.full((240, 320, 3), 100, np.uint8) if background is None else background
    return Renderer(CAMERA, "c1", grey, noise_sd, 0.0, light, ambient, RandomStreams(0), scenery)


def standing(x, y=0.0, z=2.0, orientation=IDENTITY):
    return Pose(np.array([x, y, z]), np.zeros(3), orientation)


def wall(x, y=0.0, z=2.0, semi_axes=(0.05, 5.0, 5.0)):
    return Placed("wall", Body(np.array(semi_axes), WHITE, "box"), standing(x, y, z))


def test_a_box_face_on_is_a_rectangle():
    body = Body(np.array([0.5, 0.4, 0.3]), WHITE, "box")
    # Its near face, 0.8 m by 0.6 m, is 4 m away: 60 px by 45 px, whose borders fall on samples' borders.
    assert make().visible_pixels([body], [standing(4.5)])[0] == pytest.approx(60 * 45, abs=60)
    image = make().render(1, [body], [standing(4.5)])
    assert (image[100:139, 131:188] == 240).all()
    assert (image[:, :129] == 100).all()
    assert (image[:96] == 100).all()


def test_an_upright_cylinder_is_as_wide_as_its_tangents():
    body = Body(np.array([0.3, 0.3, 20.0]), WHITE, "cylinder")
    area = make().visible_pixels([body], [standing(4.0)])[0]
    # Seen from 4 m its tangents make tan α = 0.3 / √(4² - 0.3²); it fills the height of the image.
    assert area == pytest.approx(240 * 2 * 300 * 0.3 / np.sqrt(4**2 - 0.3**2), rel=0.25 / 45)


def test_a_cylinder_end_on_is_an_ellipse():
    lying = quaternion_from_axis_angle((0.0, 1.0, 0.0), np.pi / 2)
    body = Body(np.array([0.3, 0.5, 1.0]), WHITE, "cylinder")
    area = make().visible_pixels([body], [standing(5.0, orientation=lying)])[0]
    assert area == pytest.approx(np.pi * 0.3 * 0.5 * (300 / 4) ** 2, rel=4e-3)


@pytest.mark.parametrize("form", ["box", "cylinder"])
def test_flat_faces_are_lit_by_lamberts_law(form):
    lying = quaternion_from_axis_angle((0.0, 1.0, 0.0), np.pi / 2)
    body = Body(np.array([0.5, 0.3, 0.4]), WHITE, form)
    for cosine in (1.0, 0.6, -0.5):
        light = np.array([-cosine, np.sqrt(1 - cosine**2), 0.0])
        image = make(ambient=0.25, light=light).render(1, [body], [standing(4.0, orientation=lying)])
        expected = 240.0 * (0.25 + 0.75 * max(cosine, 0.0))
        assert image[120, 160, 0] == pytest.approx(expected, abs=0.51)


def test_the_side_of_a_flat_cylinder_is_lit_by_its_real_normal():
    # Semi-axes 1 and 0.5: at u = (cos φ, sin φ) the normal is (cos φ, 2 sin φ, 0) made one long.
    camera = PinholeCamera.look_at((-1000.0, 0.0, 0.0), (0.0, 0.0, 0.0), 100_000.0, (201, 201))
    body = Body(np.array([1.0, 0.5, 3.0]), WHITE, "cylinder")
    black = np.zeros((201, 201, 3), np.uint8)
    found = Renderer(camera, "c", black, 0.0, 0.0, BACK, 0.2, RandomStreams(0))
    image = found.render(1, [body], [Pose(np.zeros(3), np.zeros(3), IDENTITY)])
    for across in (-40, -20, 0, 30):  # px; 100 px are 1 m, and the image's right is -y
        sine = -across / 50
        normal = np.array([-np.sqrt(1 - sine**2), 2 * sine, 0.0])
        expected = 240.0 * (0.2 + 0.8 * (normal @ BACK) / np.linalg.norm(normal))
        assert image[100, 100 + across, 0] == pytest.approx(expected, abs=1.0)


def test_a_wall_hides_what_is_behind_it_and_nothing_else():
    body = Body(np.array([0.4, 0.4, 0.4]), WHITE)
    alone = make().visible_pixels([body], [standing(4.0)])[0]
    assert make([wall(3.0)]).visible_pixels([body], [standing(4.0)])[0] == 0.0
    assert make([wall(5.0)]).visible_pixels([body], [standing(4.0)])[0] == alone
    # A wall to the middle of the image hides half of it.
    half = make([wall(3.0, y=-5.0)]).visible_pixels([body], [standing(4.0)])[0]
    assert half == pytest.approx(alone / 2, rel=0.01)


def test_scenery_is_seen_alike_standing_and_moving():
    generator = np.random.default_rng(0)
    photo = generator.integers(0, 256, (240, 320, 3), dtype=np.uint8)
    bodies = [
        Body(generator.uniform(0.2, 0.8, 3), PatchTexture.random(generator), form)
        for form in ("ellipsoid", "box", "cylinder") * 2
    ]
    poses = [
        standing(x, y, 2 + z, normalise(generator.normal(size=4)))
        for x, y, z in generator.uniform((3.0, -1.5, -1.0), (8.0, 1.5, 1.0), (6, 3))
    ]
    things = [Placed(f"s{i}", *each) for i, each in enumerate(zip(bodies, poses, strict=True))]
    moving = make(background=photo).render(1, bodies, poses)
    still = make(things, background=photo).render(1, [], [])
    assert abs(moving.astype(int) - still).max() <= 1
    for split in (1, 3, 5):
        mixed = make(things[split:], background=photo)
        areas = mixed.visible_pixels(bodies[:split], poses[:split])
        expected = make().visible_pixels(bodies, poses)[:split]
        # bodies that run into each other meet inside a pixel, which four samples may miss
        np.testing.assert_allclose(areas, expected, atol=0.5)
        image = mixed.render(1, bodies[:split], poses[:split])
        assert np.percentile(abs(image.astype(int) - moving), 99.9) <= 2


@settings(deadline=None, max_examples=40)
@given(
    st.lists(
        st.tuples(
            st.sampled_from(["box", "cylinder", "ellipsoid"]),
            st.tuples(st.floats(0.5, 9.0), st.floats(-3.0, 3.0), st.floats(0.0, 4.0)),
            st.tuples(*[st.floats(0.05, 1.5)] * 3),
            st.floats(0.0, 3.0),
        ),
        min_size=1,
        max_size=4,
    )
)
def test_one_more_thing_never_reveals_a_pixel(things):
    bodies = [Body(np.array([0.4, 0.28, 0.34]), WHITE), Body(np.array([0.3, 0.3, 0.9]), WHITE, "cylinder")]
    poses = [standing(5.0, 0.6), standing(4.0, -0.4, 1.2)]
    placed = [
        Placed(
            f"s{i}",
            Body(np.array(axes), WHITE, form),
            standing(*at, quaternion_from_axis_angle((1, 2, 3), turn)),
        )
        for i, (form, at, axes, turn) in enumerate(things)
    ]
    seen = [make(placed[:count]).visible_pixels(bodies, poses) for count in range(len(placed) + 1)]
    assert (np.diff(seen, axis=0) <= 1e-9).all()


def test_a_film_shows_behind_the_scenery():
    def film(step):
        return np.full((240, 320, 3), 10 * step, np.uint8)

    pillar = Placed("p", Body(np.array([0.3, 0.3, 9.0]), WHITE, "cylinder"), standing(4.0))
    found = make([pillar], background=film)
    body = Body(np.full(3, 0.2), WHITE)
    for step in (1, 7, 3):
        image = found.render(step, [body], [standing(3.0, 1.0)])
        assert (image[:, :30] == 10 * step).all()
        assert (image[:, 150:170] == 240).all()
        still = make([pillar], background=film(step)).render(step, [body], [standing(3.0, 1.0)])
        np.testing.assert_array_equal(image, still)


def test_a_film_must_fit_the_camera():
    found = make(background=lambda step: np.zeros((10, 10, 3), np.uint8))
    with pytest.raises(ValueError, match="background: must have the camera's shape"):
        found.render(1, [], [])
