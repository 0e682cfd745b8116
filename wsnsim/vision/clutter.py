"""Clutter: things in a camera's background that look like the targets and are none.

A decoy is an ellipsoid with a target's colours on patches of its own, under the light of
the scene, and cast on to the background as the targets are: by its pixels alone it is a
target. It stays where it is in the image and hides nothing.
"""

from collections.abc import Sequence

import numpy as np

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.geometry.rotations import normalise
from wsnsim.types import ByteArray, FloatArray
from wsnsim.vision.casting import NO_OWNERS, prepare, shoot
from wsnsim.world.bodies import Body, PatchTexture
from wsnsim.world.motion import Pose

_SHAPES = (0.6, 1.0)
"""Semi-axes over the longest: those of the reference target are 0.70 and 0.85 of it."""


def with_decoys(
    picture: ByteArray,
    camera: PinholeCamera,
    textures: Sequence[PatchTexture],
    count: int,
    radius_px: tuple[float, float],
    light: FloatArray,
    ambient: float,
    generator: np.random.Generator,
) -> ByteArray:
    """Return a picture with decoys on it, each centred at a random pixel.

    Parameters
    ----------
    picture : (h, w, 3) - RGB
    camera : whose background it is
    textures : of the targets; each decoy takes one's colours, in the same numbers of patches
    count : number of decoys
    radius_px : smallest and largest long semi-axis of a decoy in the middle of the image [px]; all
        ratios are equally likely
    light : (3,) - unit vector towards the light
    ambient : share of the light that comes from everywhere
    generator : source of randomness

    Returns
    -------
    (h, w, 3) - RGB; later decoys lie over earlier ones
    """
    width, height = camera.resolution_px
    smallest, largest = radius_px
    for _ in range(count):
        pixel = generator.uniform((-0.5, -0.5), (width - 0.5, height - 0.5))
        place = camera.position + camera.rotation.T @ camera.rays(pixel[None])[0]
        tangent = smallest * (largest / smallest) ** generator.uniform() / camera.focal_px
        # A sphere of radius a at depth 1 has an outline of a / √(1 - a²) focal lengths.
        longest = tangent / np.sqrt(1.0 + tangent**2)
        axes = longest * np.append(1.0, generator.uniform(*_SHAPES, 2))
        texture = textures[int(generator.integers(len(textures)))]
        centres = PatchTexture.random(generator, len(texture.centres), 1).centres
        body = Body(axes, PatchTexture(centres, generator.permutation(texture.colours)))
        pose = Pose(place, np.zeros(3), normalise(generator.standard_normal(4)))
        cast = prepare(camera, [body], [pose], light)
        painted, _, _, _ = shoot(camera, picture, picture.astype(np.float32), cast, None, NO_OWNERS, ambient)
        picture = np.rint(painted).astype(np.uint8)
    return picture
