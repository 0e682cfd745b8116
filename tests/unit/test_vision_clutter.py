import numpy as np

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.rng import RandomStreams
from wsnsim.vision.clutter import with_decoys
from wsnsim.world.bodies import PatchTexture

CAMERA = PinholeCamera.look_at((0.0, 0.0, 2.0), (4.0, 0.0, 1.0), 300.0, (320, 240))
GREY = np.full((240, 320, 3), 128, np.uint8)
LIGHT = np.array([0.0, 0.6, 0.8])
PURE = PatchTexture(np.eye(3), 250.0 * np.eye(3))
"""Red, green and blue, one patch each."""


def decoys(count, radius_px=(7.0, 24.0), seed=0, camera=CAMERA, textures=(PURE,)):
    generator = RandomStreams(seed).stream("clutter", "c1")
    return with_decoys(GREY, camera, textures, count, radius_px, LIGHT, 0.6, generator)


def painted(image):
    return (image != GREY).any(axis=2)


def test_none_leave_the_picture_as_it_is():
    np.testing.assert_array_equal(decoys(0), GREY)


def test_their_colours_are_the_targets():
    image = decoys(10).astype(int)
    # Within a decoy one channel is lit, shaded down to 0.6 of 250 at most, and the others are 0;
    # only at borders do two colours or the grey mix.
    pure = (np.sort(image, axis=2)[:, :, 1] == 0) & (image.max(axis=2) >= 149)
    assert pure.sum() > 0.7 * painted(image).sum()
    hues = {int(channel) for channel in image[pure].argmax(axis=1)}
    assert hues == {0, 1, 2}


def test_the_size_lies_between_the_bounds():
    areas = []
    for seed in range(60):
        image = painted(decoys(1, (10.0, 20.0), seed))
        rows, columns = np.nonzero(image)
        if min(rows.min(), columns.min()) > 0 and rows.max() < 239 and columns.max() < 319:
            areas.append(image.sum())
    assert len(areas) > 30
    # Semi-axes of 0.6 to 1 times the longest; what is off the axis looks larger, here by up to
    # (1 + r²)^1.5 = 1.75 at the corners, r = 0.67.
    assert min(areas) > 0.6 * 0.6 * np.pi * 9.5**2
    assert max(areas) < 1.75 * np.pi * 20.5**2
    assert max(areas) > 2 * min(areas)


def test_ten_of_them_lie_all_over_the_image():
    counts = [painted(decoys(10, seed=seed)) for seed in range(30)]
    halves = [[mask[:, :160].sum(), mask[:, 160:].sum()] for mask in counts]
    left, right = np.mean(halves, axis=0)
    assert 0.7 < left / right < 1.4
    # Ten of 7 to 24 px, log-uniform: 660 px each on average for discs, less for their flatness.
    assert 0.02 < np.mean(counts) < 0.09


def test_each_seed_has_its_own_and_the_same_again():
    np.testing.assert_array_equal(decoys(5, seed=3), decoys(5, seed=3))
    assert (decoys(5, seed=3) != decoys(5, seed=4)).any()


def test_very_large_ones_through_a_bent_lens_are_no_trouble():
    camera = PinholeCamera.look_at((0.0, 0.0, 2.0), (4.0, 0.0, 1.0), 100.0, (320, 240), (-0.05, 0.002))
    image = decoys(3, (200.0, 1000.0), camera=camera)
    assert painted(image).mean() > 0.3
