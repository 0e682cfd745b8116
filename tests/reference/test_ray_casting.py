"""The compiled ray caster against plain ray casting of every sample of every pixel."""

import numpy as np
import pytest

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.geometry.rotations import normalise, quaternion_to_matrix
from wsnsim.rng import RandomStreams
from wsnsim.vision.renderer import Renderer
from wsnsim.world.bodies import Body, PatchTexture
from wsnsim.world.motion import Pose

WIDTH, HEIGHT = 120, 90
CAMERA = PinholeCamera.look_at((0.0, 0.0, 2.0), (5.0, 1.0, 1.0), 110.0, (WIDTH, HEIGHT))
LIGHT = np.array([-0.48, 0.36, 0.8])
AMBIENT = 0.35
SIDE = 4


def scene(seed, count=4):
    generator = np.random.default_rng(seed)
    bodies, poses = [], []
    for _ in range(count):
        bodies.append(Body(generator.uniform(0.15, 0.7, 3), PatchTexture.random(generator)))
        ahead = generator.uniform(1.2, 5.0)
        position = CAMERA.position + CAMERA.rotation.T @ (
            ahead * np.append(generator.uniform(-0.5, 0.5, 2), 1)
        )
        poses.append(Pose(position, np.zeros(3), normalise(generator.normal(size=4))))
    return bodies, poses


def background(seed):
    return np.random.default_rng(seed).integers(0, 256, (HEIGHT, WIDTH, 3), dtype=np.uint8)


def twin(bodies, poses, photo):
    """Return image, coverage and areas; everything in world coordinates."""
    steps = (np.arange(SIDE) + 0.5) / SIDE - 0.5
    x = (np.arange(WIDTH)[:, None] + steps).ravel()
    y = (np.arange(HEIGHT)[:, None] + steps).ravel()
    cx, cy = CAMERA.principal_point
    rays = np.stack(
        np.broadcast_arrays((x - cx) / CAMERA.focal_px, ((y - cy) / CAMERA.focal_px)[:, None], 1.0), -1
    )
    rays = rays.reshape(-1, 3) @ CAMERA.rotation
    depth = np.full(len(rays), np.inf)
    owner = np.full(len(rays), -1)
    colour = np.zeros((len(rays), 3))
    for number, (body, pose) in enumerate(zip(bodies, poses, strict=True)):
        rotation = quaternion_to_matrix(pose.orientation)
        quadric = rotation @ np.diag(body.semi_axes_m**-2.0) @ rotation.T
        start = CAMERA.position - pose.position
        a = np.einsum("ni,ij,nj->n", rays, quadric, rays)
        b = rays @ quadric @ start
        c = start @ quadric @ start - 1.0
        root = b * b - a * c
        t = np.where((root >= 0) & (c > 0), (-b - np.sqrt(np.maximum(root, 0.0))) / a, np.inf)
        closer = (t > 0) & (t < depth)
        depth[closer], owner[closer] = t[closer], number
        points = start + t[closer, None] * rays[closer]
        patch = ((points @ rotation / body.semi_axes_m) @ body.texture.centres.T).argmax(axis=1)
        normals = points @ quadric
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        shade = AMBIENT + (1 - AMBIENT) * np.maximum(normals @ LIGHT, 0.0)
        colour[closer] = shade[:, None] * body.texture.colours[patch]
    photo = photo.astype(float).repeat(SIDE, axis=0).repeat(SIDE, axis=1).reshape(-1, 3)
    colour = np.where(owner[:, None] >= 0, colour, photo)
    shape = (HEIGHT, SIDE, WIDTH, SIDE)
    areas = np.array([(owner == number).sum() / SIDE**2 for number in range(len(bodies))])
    return colour.reshape(*shape, 3).mean(axis=(1, 3)), areas


def renderer(photo):
    return Renderer(CAMERA, "c1", photo, 0.0, 0.0, LIGHT, AMBIENT, RandomStreams(0))


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
