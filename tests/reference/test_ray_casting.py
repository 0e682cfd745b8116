"""The compiled ray caster against plain ray casting of every sample of every pixel."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.geometry.rotations import IDENTITY, normalise, quaternion_to_matrix
from wsnsim.rng import RandomStreams
from wsnsim.vision.renderer import Renderer
from wsnsim.world.bodies import Body, PatchTexture
from wsnsim.world.motion import Pose
from wsnsim.world.world import Placed

WIDTH, HEIGHT = 120, 90
CAMERA = PinholeCamera.look_at((0.0, 0.0, 2.0), (5.0, 1.0, 1.0), 110.0, (WIDTH, HEIGHT))
BARREL, PINCUSHION = replace(CAMERA, distortion=(-0.3, 0.06)), replace(CAMERA, distortion=(0.2, 0.1))
LIGHT = np.array([-0.48, 0.36, 0.8])
AMBIENT = 0.35
SIDE = 4
ALL_FORMS = ("ellipsoid", "box", "cylinder")


def scene(seed, count=4, forms=("ellipsoid",)):
    generator = np.random.default_rng(seed)
    bodies, poses = [], []
    for number in range(count):
        form = forms[number % len(forms)]
        bodies.append(Body(generator.uniform(0.15, 0.7, 3), PatchTexture.random(generator), form))
        ahead = generator.uniform(1.2, 5.0)
        position = CAMERA.position + CAMERA.rotation.T @ (
            ahead * np.append(generator.uniform(-0.5, 0.5, 2), 1)
        )
        poses.append(Pose(position, np.zeros(3), normalise(generator.normal(size=4))))
    return bodies, poses


def prism(generator, sides):
    """Return a prism of some sides, with patches."""
    angles = 2 * np.pi * (np.arange(sides) + generator.uniform(-0.3, 0.3, sides)) / sides
    corners = np.column_stack([np.cos(angles), np.sin(angles)]) * generator.uniform(0.2, 0.7, 2)
    half = np.append(abs(corners).max(axis=0), generator.uniform(0.15, 0.7))
    return Body(half, PatchTexture.random(generator), "prism", corners)


def background(seed):
    return np.random.default_rng(seed).integers(0, 256, (HEIGHT, WIDTH, 3), dtype=np.uint8)


def before_the_lens(points, camera):
    """Undo the distortion by halving an interval; points over the focal length."""
    k1, k2 = camera.distortion
    distorted = np.hypot(*points.T)
    low, high = np.zeros(len(points)), np.full(len(points), 2.0 * distorted.max())
    for _ in range(60):
        r = 0.5 * (low + high)
        # (1 + 3 k1 r² + 5 k2 r⁴ is above 0 up to r = 1.05 for all lenses here)
        beyond = (r * (1 + k1 * r**2 + k2 * r**4) >= distorted) | (r > 1.05)
        low, high = np.where(beyond, low, r), np.where(beyond, r, high)
    return points * (high / distorted)[:, None]


@cache
def rays_of(camera):
    """Return the ray of every sample, in the world's axes."""
    steps = (np.arange(SIDE) + 0.5) / SIDE - 0.5
    x = (np.arange(WIDTH)[:, None] + steps).ravel()
    y = (np.arange(HEIGHT)[:, None] + steps).ravel()
    cx, cy = camera.principal_point
    flat = np.stack(
        np.broadcast_arrays((x - cx) / camera.focal_px, ((y - cy) / camera.focal_px)[:, None]), -1
    )
    flat = flat.reshape(-1, 2)
    if camera.distortion != (0.0, 0.0):
        flat = before_the_lens(flat, camera)
    return np.column_stack((flat, np.ones(len(flat)))) @ camera.rotation


def entries(body, start, rays):
    """Return where rays from `start` enter a body, in its axes and metres, and the normals there."""
    a, b, c = body.semi_axes_m
    if body.form == "box":
        with np.errstate(divide="ignore"):
            one, other = (-body.semi_axes_m - start) / rays, (body.semi_axes_m - start) / rays
        firsts, lasts = np.minimum(one, other), np.maximum(one, other)
        t, axis = firsts.max(axis=1), firsts.argmax(axis=1)
        t = np.where((t < lasts.min(axis=1)) & (t > 0), t, np.inf)
        normals = -np.sign(rays) * np.eye(3)[axis]
        return t, normals
    if body.form == "prism":
        return prism_entries(body, start, rays)
    flat = np.array([a**-2.0, b**-2.0, c**-2.0 if body.form == "ellipsoid" else 0.0])
    p, q, r = (rays**2 @ flat), (rays @ (flat * start)), start @ (flat * start) - 1.0
    root = q * q - p * r
    spread = np.sqrt(np.maximum(root, 0.0))
    enter, leave = (
        np.where(root >= 0, (-q - spread) / p, np.inf),
        np.where(root >= 0, (-q + spread) / p, -np.inf),
    )
    cap = np.zeros(len(rays), dtype=bool)
    if body.form == "cylinder":
        one, other = (-c - start[2]) / rays[:, 2], (c - start[2]) / rays[:, 2]
        cap = np.minimum(one, other) > enter
        enter, leave = np.maximum(enter, np.minimum(one, other)), np.minimum(leave, np.maximum(one, other))
    t = np.where((enter < leave) & (enter > 0), enter, np.inf)
    points = start + np.where(np.isfinite(t), t, 0.0)[:, None] * rays
    normals = np.where(cap[:, None], [0.0, 0.0, 1.0] * -np.sign(rays[:, 2:]), points * flat)
    return t, normals


def prism_entries(body, start, rays):
    """Return where rays enter a prism and the normals there: by its last plane, if none is left before."""
    corners = body.corners_m
    sides = np.roll(corners, -1, axis=0) - corners
    normals = np.column_stack([sides[:, 1], -sides[:, 0], np.zeros(len(sides))])
    normals *= np.where((normals[:, :2] * (corners - corners.mean(axis=0))).sum(axis=1) > 0, 1, -1)[:, None]
    offsets = (normals[:, :2] * corners).sum(axis=1)
    normals = np.vstack([normals, [0, 0, 1], [0, 0, -1]])
    offsets = np.append(offsets, [body.semi_axes_m[2]] * 2)
    rates = rays @ normals.T
    with np.errstate(divide="ignore"):
        reached = (offsets - normals @ start) / rates
    firsts, lasts = np.where(rates < 0, reached, -np.inf), np.where(rates > 0, reached, np.inf)
    t = firsts.max(axis=1)
    return np.where((t < lasts.min(axis=1)) & (t > 0), t, np.inf), normals[firsts.argmax(axis=1)]


def twin(bodies, poses, photo, camera=CAMERA):
    """Return image, coverage and areas; everything in the bodies' own axes and in metres."""
    rays = rays_of(camera)
    depth = np.full(len(rays), np.inf)
    owner = np.full(len(rays), -1)
    colour = np.zeros((len(rays), 3))
    for number, (body, pose) in enumerate(zip(bodies, poses, strict=True)):
        rotation = quaternion_to_matrix(pose.orientation)
        start, turned = (camera.position - pose.position) @ rotation, rays @ rotation
        t, normals = entries(body, start, turned)
        closer = t < depth
        depth[closer], owner[closer] = t[closer], number
        points = start + t[closer, None] * turned[closer]
        patch = ((points / body.semi_axes_m) @ body.texture.centres.T).argmax(axis=1)
        normals = normals[closer] / np.linalg.norm(normals[closer], axis=1, keepdims=True)
        shade = AMBIENT + (1 - AMBIENT) * np.maximum(normals @ (LIGHT @ rotation), 0.0)
        colour[closer] = shade[:, None] * body.texture.colours[patch]
    photo = photo.astype(float).repeat(SIDE, axis=0).repeat(SIDE, axis=1).reshape(-1, 3)
    colour = np.where(owner[:, None] >= 0, colour, photo)
    shape = (HEIGHT, SIDE, WIDTH, SIDE)
    areas = np.array([(owner == number).sum() / SIDE**2 for number in range(len(bodies))])
    return colour.reshape(*shape, 3).mean(axis=(1, 3)), areas


def renderer(photo, camera=CAMERA, scenery=()):
    return Renderer(camera, "c1", photo, 0.0, 0.0, LIGHT, AMBIENT, RandomStreams(0), scenery)


@pytest.mark.parametrize("seed", range(6))
def test_image_and_areas_equal_the_twin(seed):
    bodies, poses = scene(seed)
    photo = background(seed)
    expected, areas = twin(bodies, poses, photo)
    found = renderer(photo).render(1, bodies, poses)
    np.testing.assert_allclose(renderer(photo).visible_pixels(bodies, poses), areas, atol=1e-9)
    # Rounding gives 0.5; in a pixel that one patch fills, four samples stand for sixteen.
    difference = abs(found - expected)
    assert difference.max() < 5.0
    assert difference.mean() < 0.2


def test_body_cut_by_the_camera_plane_is_drawn_in_full():
    # Beside the camera and reaching past its plane: the outline in the image is no ellipse.
    generator = np.random.default_rng(9)
    body = Body(np.array([0.9, 0.5, 0.4]), PatchTexture.random(generator))
    position = CAMERA.position + CAMERA.rotation.T @ np.array([0.6, 0.2, 0.35])
    pose = Pose(position, np.zeros(3), normalise([1.0, 0.2, 0.1, 0.4]))
    expected, areas = twin([body], [pose], background(0))
    assert 500 < areas[0] < 0.9 * WIDTH * HEIGHT
    found = renderer(background(0))
    np.testing.assert_allclose(found.visible_pixels([body], [pose]), areas, atol=1e-9)
    assert abs(found.render(1, [body], [pose]) - expected).max() < 0.51


@pytest.mark.parametrize("offset", [(0.0, 0.0, 0.0), (0.1, 0.0, 0.1), (0.0, 0.0, -3.0), (0.0, 0.0, -0.41)])
def test_body_round_or_behind_the_camera_is_not_drawn(offset):
    body = Body(np.full(3, 0.4), PatchTexture.random(np.random.default_rng(0)))
    pose = Pose(CAMERA.position + CAMERA.rotation.T @ np.array(offset), np.zeros(3), normalise([1, 0, 0, 0]))
    found = renderer(background(0))
    assert found.visible_pixels([body], [pose]).tolist() == [0.0]
    np.testing.assert_array_equal(found.render(1, [body], [pose]), background(0))


@pytest.mark.parametrize("camera", [CAMERA, BARREL, PINCUSHION], ids=["straight", "barrel", "pincushion"])
@pytest.mark.parametrize("seed", range(2))
def test_all_solids_through_any_lens_equal_the_twin(seed, camera):
    bodies, poses = scene(10 + seed, 6, ALL_FORMS)
    photo = background(seed)
    expected, areas = twin(bodies, poses, photo, camera)
    assert np.count_nonzero(areas) >= 4
    found = renderer(photo, camera)
    np.testing.assert_allclose(found.visible_pixels(bodies, poses), areas, atol=1e-9)
    difference = abs(found.render(1, bodies, poses) - expected)
    # A patch's corner may reach between a pixel's four corner samples; a side's shade too.
    assert np.percentile(difference, 99.99) < 5.0
    assert difference.max() < 40.0
    assert difference.mean() < 0.2


@pytest.mark.parametrize("camera", [CAMERA, BARREL], ids=["straight", "barrel"])
@pytest.mark.parametrize("seed", range(2))
def test_what_moves_and_what_stands_hide_each_other_as_in_the_twin(seed, camera):
    moving = scene(20 + seed, 4, ALL_FORMS)
    bodies, _ = scene(30 + seed, 4, ("box", "cylinder", "ellipsoid"))
    # Each stands in front of something that moves, or behind it, a little aside.
    poses = [
        replace(pose, position=camera.position + factor * (pose.position - camera.position) + 0.1)
        for pose, factor in zip(moving[1], (0.5, 1.6, 0.5, 1.6), strict=True)
    ]
    smaller = [replace(body, semi_axes_m=0.5 * body.semi_axes_m) for body in bodies]
    photo = background(seed)
    scenery = [Placed(f"s{i}", *each) for i, each in enumerate(zip(smaller, poses, strict=True))]
    expected, areas = twin([*moving[0], *smaller], [*moving[1], *poses], photo, camera)
    empty = renderer(photo, camera)
    assert (areas[:4] < empty.visible_pixels(*moving)).any()
    assert (areas[4:] < empty.visible_pixels(smaller, poses)).any()
    found = renderer(photo, camera, scenery)
    np.testing.assert_allclose(found.visible_pixels(*moving), areas[:4], atol=1e-9)
    difference = abs(found.render(1, *moving) - expected)
    assert np.percentile(difference, 99.99) < 5.0
    assert difference.max() < 40.0
    assert difference.mean() < 0.2


@pytest.mark.parametrize("camera", [CAMERA, BARREL], ids=["straight", "barrel"])
@pytest.mark.parametrize("seed", [2, 4])
def test_prisms_that_move_and_stand_equal_the_twin(seed, camera):
    generator = np.random.default_rng(40 + seed)
    bodies, poses = scene(50 + seed, 7, ("ellipsoid", "box"))
    bodies[2:] = [prism(generator, sides) for sides in (3, 4, 5, 7, 32)]
    photo = background(seed)
    expected, areas = twin(bodies, poses, photo, camera)
    assert np.count_nonzero(areas) >= 5
    assert np.count_nonzero(areas[2:]) >= 3
    standing = [Placed(f"s{i}", *each) for i, each in enumerate(zip(bodies[4:], poses[4:], strict=True))]
    for moving, scenery in ((7, []), (4, standing)):
        found = renderer(photo, camera, scenery)
        np.testing.assert_allclose(
            found.visible_pixels(bodies[:moving], poses[:moving]), areas[:moving], atol=1e-9
        )
        difference = abs(found.render(1, bodies[:moving], poses[:moving]) - expected)
        assert difference.max() < 5.0
        # rounding to whole grey levels alone makes a mean of a quarter
        assert difference.mean() < 0.26


@pytest.mark.parametrize("form", ["box", "cylinder"])
@pytest.mark.parametrize("camera", [CAMERA, BARREL], ids=["straight", "barrel"])
def test_solids_cut_by_the_camera_plane_are_drawn_in_full(form, camera):
    body = Body(np.array([0.9, 0.5, 0.4]), PatchTexture.random(np.random.default_rng(9)), form)
    position = camera.position + camera.rotation.T @ np.array([1.1, 0.2, 0.35])
    pose = Pose(position, np.zeros(3), normalise([1.0, 0.2, 0.1, 0.4]))
    expected, areas = twin([body], [pose], background(0), camera)
    assert 300 < areas[0] < 0.9 * WIDTH * HEIGHT
    found = renderer(background(0), camera)
    np.testing.assert_allclose(found.visible_pixels([body], [pose]), areas, atol=1e-9)
    assert abs(found.render(1, [body], [pose]) - expected).mean() < 0.3


@pytest.mark.parametrize("form", ["box", "cylinder"])
@pytest.mark.parametrize("offset", [(0.0, 0.0, 0.0), (0.3, 0.2, 0.3), (0.0, 0.0, -3.0), (0.0, 0.0, -0.75)])
def test_solids_round_or_behind_the_camera_are_not_drawn(form, offset):
    body = Body(np.full(3, 0.4), PatchTexture.random(np.random.default_rng(0)), form)
    pose = Pose(CAMERA.position + np.array(offset) @ CAMERA.rotation, np.zeros(3), IDENTITY)
    found = renderer(background(0), scenery=[Placed("s", body, pose)])
    np.testing.assert_array_equal(found.render(1, [], []), background(0))
    found = renderer(background(0))
    assert found.visible_pixels([body], [pose]).tolist() == [0.0]
    np.testing.assert_array_equal(found.render(1, [body], [pose]), background(0))


def test_rays_along_a_face_and_through_an_edge_are_no_trouble():
    # The camera in the plane of a box's face and of a cylinder's cap: rays that never meet a slab.
    camera = PinholeCamera.look_at((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 110.0, (121, 91))
    texture = PatchTexture.random(np.random.default_rng(0))
    for form in ("box", "cylinder"):
        body = Body(np.ones(3), texture, form)
        found = Renderer(camera, "c", np.zeros((91, 121, 3), np.uint8), 0, 0, LIGHT, 1.0, RandomStreams(0))
        pose = Pose(np.array([4.0, 0.0, -1.0]), np.zeros(3), IDENTITY)
        area = found.visible_pixels([body], [pose])[0]
        # The near face is 3 m away, 2 m wide and 2 m high, of which the image shows 91 / 2 px.
        assert area == pytest.approx(2 * 110 / (3 if form == "box" else np.sqrt(15)) * 91 / 2, rel=0.02)
