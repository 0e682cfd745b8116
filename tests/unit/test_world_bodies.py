import colorsys

import numpy as np
import pytest

from wsnsim.world.bodies import Body, PatchTexture


@pytest.mark.parametrize(("patches", "colours"), [(18, 9), (1, 1), (9, 9), (30, 4)])
def test_random_texture_uses_every_colour_evenly(patches, colours):
    texture = PatchTexture.random(np.random.default_rng(3), patches, colours)
    assert texture.centres.shape == (patches, 3)
    np.testing.assert_allclose(np.linalg.norm(texture.centres, axis=1), 1.0)
    used, counts = np.unique(texture.colours, axis=0, return_counts=True)
    assert len(used) == colours
    assert counts.max() - counts.min() <= 1


def test_random_colours_are_saturated_and_apart_in_hue():
    texture = PatchTexture.random(np.random.default_rng(4))
    hsv = np.array([colorsys.rgb_to_hsv(*(rgb / 255.0)) for rgb in np.unique(texture.colours, axis=0)])
    hues = np.sort(hsv[:, 0])
    gaps = np.diff(np.append(hues, hues[0] + 1.0))
    np.testing.assert_allclose(gaps, 1.0 / 9.0, atol=1e-9)
    assert hsv[:, 1].min() >= 0.65
    assert hsv[:, 2].min() >= 0.7


def test_random_patches_keep_apart():
    # Eighteen points in the best packing are 49.6 degrees apart; eighteen uniform ones typically 8.
    for seed in range(20):
        centres = PatchTexture.random(np.random.default_rng(seed)).centres
        cosines = centres @ centres.T - 2.0 * np.eye(len(centres))
        assert np.degrees(np.arccos(cosines.max())) > 15.0


def test_texture_depends_on_the_generator_only():
    first, second, other = (PatchTexture.random(np.random.default_rng(seed)) for seed in (5, 5, 6))
    np.testing.assert_array_equal(first.centres, second.centres)
    np.testing.assert_array_equal(first.colours, second.colours)
    assert not np.array_equal(first.colours, other.colours)


@pytest.mark.parametrize(("patches", "colours"), [(3, 4), (3, 0), (0, 0)])
def test_numbers_of_patches_and_colours_must_fit(patches, colours):
    with pytest.raises(ValueError, match="colours: must be 1 to the number of patches"):
        PatchTexture.random(np.random.default_rng(0), patches, colours)


@pytest.mark.parametrize(
    ("centres", "colours", "message"),
    [
        (np.zeros((0, 3)), np.zeros((0, 3)), "centres: must have shape"),
        (np.array([[1.0, 0, 0]]), np.zeros((2, 3)), "colours: must have shape"),
        (np.array([[2.0, 0, 0]]), np.zeros((1, 3)), "must be unit vectors"),
        (np.array([[1.0, 0, 0]]), np.array([[0.0, 0.0, 256.0]]), "must lie in 0–255"),
        (np.array([[1.0, 0, 0]]), np.array([[0.0, 0.0, np.nan]]), "must lie in 0–255"),
    ],
)
def test_impossible_textures_are_refused(centres, colours, message):
    with pytest.raises(ValueError, match=message):
        PatchTexture(centres, colours)


@pytest.mark.parametrize("axes", [[0.4, 0.3], [0.4, 0.3, 0.0], [0.4, -0.3, 0.2], [0.4, np.nan, 0.2]])
def test_semi_axes_must_be_positive(axes):
    texture = PatchTexture(np.array([[1.0, 0, 0]]), np.zeros((1, 3)))
    with pytest.raises(ValueError, match="semi_axes_m: must be three numbers above 0"):
        Body(np.array(axes), texture)
