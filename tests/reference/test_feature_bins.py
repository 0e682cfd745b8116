"""Colour bins against exact fractions, texture bins against scikit-image and a plain twin."""

import os
import warnings
from fractions import Fraction

import numpy as np
import pytest
from skimage.feature import local_binary_pattern

from wsnsim.geometry.quadrics import Box
from wsnsim.vision.features import FeatureSpace
from wsnsim.vision.photos import load_background

SEED = int(os.environ.get("WSNSIM_TEST_SEED", "0"))
ALL = Box(0, 0, 320, 240)


def noisy_photo(name="photo/coffee", noise_sd=5.0):
    photo = load_background(name, (320, 240))
    noise = np.random.default_rng(SEED).normal(0.0, noise_sd, photo.shape)
    return np.clip(np.rint(photo + noise), 0, 255).astype(np.uint8)


def colour_bin(red, green, blue, with_value):
    """Pérez et al. 2002 in exact arithmetic: the hexcone model with hue in turns."""
    high, low = max(red, green, blue), min(red, green, blue)
    chroma = high - low
    value = Fraction(high, 255)
    saturation = Fraction(chroma, high) if high else Fraction(0)
    if chroma == 0:
        hue = Fraction(0)
    elif high == red:
        hue = Fraction(green - blue, 6 * chroma) % 1
    elif high == green:
        hue = Fraction(blue - red, 6 * chroma) + Fraction(1, 3)
    else:
        hue = Fraction(red - green, 6 * chroma) + Fraction(2, 3)
    if with_value and not (saturation > Fraction(1, 10) and value > Fraction(1, 5)):
        return 100 + min(int(10 * value), 9)
    return 10 * int(10 * hue) + min(int(10 * saturation), 9)


@pytest.mark.parametrize("colour", ["hsv", "hs"])
def test_colour_bins_are_exact(colour):
    levels = [0, 1, 25, 26, 50, 51, 52, 102, 127, 128, 153, 204, 229, 230, 254, 255]
    grid = np.array(np.meshgrid(levels, levels, levels), dtype=np.uint8).reshape(3, -1).T
    random = np.random.default_rng(SEED).integers(0, 256, (3000, 3), dtype=np.uint8)
    image = np.concatenate((grid, random))[None]
    found = FeatureSpace(colour).bin_region(image, Box(0, 0, image.shape[1], 1)).colour[0]
    expected = [colour_bin(*map(int, rgb), colour == "hsv") for rgb in image[0]]
    np.testing.assert_array_equal(found, expected)
    assert found.max() < FeatureSpace(colour).colour_bins


def luma(image):
    return image.astype(np.int64) @ np.array([77, 150, 29])


def texture_twin(grey):
    """Ojala et al. 2002, eq. 9, of a whole image: whole numbers, repeated border, one bit after another."""
    padded = np.pad(grey, 1, mode="edge")
    height, width = grey.shape

    def at(dy, dx):
        return padded[1 + dy : 1 + dy + height, 1 + dx : 1 + dx + width] - grey

    def diagonal(dy, dx):
        return 70 * (at(dy, 0) + at(0, dx)) + 169 * at(dy, dx)

    around = [at(0, 1), diagonal(-1, 1), at(-1, 0), diagonal(-1, -1), at(0, -1), diagonal(1, -1), at(1, 0)]
    bits = np.array([*around, diagonal(1, 1)]) >= 0
    changes = (bits != np.roll(bits, 1, axis=0)).sum(axis=0)
    return np.where(changes <= 2, bits.sum(axis=0), 9)


@pytest.mark.parametrize("name", ["photo/coffee", "photo/gravel"])
@pytest.mark.parametrize("noise_sd", [0.0, 5.0])
def test_texture_bins_equal_the_twin(name, noise_sd):
    image = noisy_photo(name, noise_sd)
    found = FeatureSpace().bin_region(image, ALL).texture
    np.testing.assert_array_equal(found, texture_twin(luma(image)))


def test_texture_bins_agree_with_scikit_image():
    image = noisy_photo()
    # scikit-image puts zeros round the image; one more ring of border pixels moves them away.
    padded = np.pad(luma(image), 1, mode="edge")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        peer = local_binary_pattern(padded, 8, 1, method="uniform")[1:-1, 1:-1]
    found = FeatureSpace().bin_region(image, ALL).texture
    # The diagonal's weight differs in the sixth digit (169/239 against 0.70711): only a
    # difference of grey levels within 1e-5 of a tie can come out otherwise.
    assert (found != peer).mean() < 2e-4
    np.testing.assert_array_equal(np.bincount(found.ravel(), minlength=10) > 0, np.ones(10, bool))


def test_texture_does_not_change_with_quarter_turns_and_brightness():
    image = noisy_photo()[:, 40:280]
    box = Box(0, 0, 240, 240)
    bins = FeatureSpace().bin_region(image, box).texture
    turned = FeatureSpace().bin_region(np.rot90(image), box).texture
    np.testing.assert_array_equal(turned, np.rot90(bins))
    dark = (image // 2).astype(np.uint8)
    bright = dark + np.uint8(100)
    np.testing.assert_array_equal(
        FeatureSpace().bin_region(dark, box).texture, FeatureSpace().bin_region(bright, box).texture
    )


def test_flat_image_has_ones_all_round():
    image = np.full((5, 6, 3), 77, np.uint8)
    assert (FeatureSpace().bin_region(image, Box(0, 0, 6, 5)).texture == 8).all()


@pytest.mark.parametrize("box", [(0, 0, 320, 240), (17, 31, 90, 95), (300, 200, 320, 240), (5, 5, 6, 6)])
def test_a_box_shows_the_same_bins_as_the_whole_image(box):
    image = noisy_photo()
    whole = FeatureSpace().bin_region(image, ALL)
    part = FeatureSpace().bin_region(image, box)
    x0, y0, x1, y1 = box
    assert (part.x0, part.y0) == (x0, y0)
    np.testing.assert_array_equal(part.colour, whole.colour[y0:y1, x0:x1])
    np.testing.assert_array_equal(part.texture, whole.texture[y0:y1, x0:x1])
    assert part.colour.dtype == part.texture.dtype == np.int16


def test_an_empty_box_has_no_bins():
    region = FeatureSpace().bin_region(noisy_photo(), Box(0, 0, 0, 0))
    assert region.colour.shape == region.texture.shape == (0, 0)


@pytest.mark.parametrize("box", [(-1, 0, 5, 5), (0, 0, 321, 5), (0, 0, 5, 241), (9, 0, 5, 5)])
def test_a_box_outside_the_image_is_refused(box):
    with pytest.raises(ValueError, match="box: must lie in the image of 320 x 240 px"):
        FeatureSpace().bin_region(noisy_photo(), box)


@pytest.mark.parametrize(
    "image", [np.zeros((4, 4), np.uint8), np.zeros((4, 4, 3)), np.zeros((4, 4, 4), np.uint8)]
)
def test_other_images_are_refused(image):
    with pytest.raises(ValueError, match="image: must be"):
        FeatureSpace().bin_region(image, Box(0, 0, 1, 1))


def test_numbers_of_bins():
    assert (FeatureSpace("hsv").colour_bins, FeatureSpace("hs").colour_bins) == (110, 100)
    assert FeatureSpace().texture_bins == 10
