"""Background subtraction: what is learned, what stands out, and what light and noise must not do to it."""

import numpy as np
import pytest
from scipy.stats import chi2

from wsnsim.vision.foreground import (
    GAIN_STRIDE,
    Background,
    foreground,
    gain,
    learned,
    picture_noise,
    updated,
)
from wsnsim.vision.photos import load_background

SIZE = (160, 120)
NOISE = 5.0
PHOTOS = ("photo/china", "photo/coffee", "photo/flower", "photo/gravel")


def exposed(clean, generator, factor=1.0, noise=NOISE):
    """Return a picture as the renderer's sensor makes it."""
    image = factor * clean + noise * generator.standard_normal(clean.shape)
    return np.clip(np.rint(image), 0, 255).astype(np.uint8)


def soft(photo="photo/coffee"):
    """Return a photograph without clipped channels."""
    return np.clip(load_background(photo, SIZE).astype(np.float64), 30.0, 200.0)


def model(clean, noise=NOISE, pictures=1):
    """Return a background that is known as well as so many pictures tell."""
    variance = noise**2 * (1.0 + 1.0 / pictures)
    return Background(clean.astype(np.float32), np.full(clean.shape[:2], variance, np.float32))


def test_noise_of_a_picture_without_structure():
    generator = np.random.default_rng(0)
    flat = np.full((SIZE[1], SIZE[0], 3), 120.0)
    # the deviation of a median of absolute values, 1.17 / √n for n independent ones; the mask makes
    # neighbours depend on each other, no more than its nine pixels
    bound = 4.0 * 3.0 * 1.17 / np.sqrt(flat.size)
    assert picture_noise(exposed(flat, generator)) == pytest.approx(NOISE, rel=bound)


@pytest.mark.parametrize("photo", PHOTOS)
def test_noise_of_one_picture_is_never_much_too_low(photo):
    # too low would be for good: what is foreground is not learned
    image = exposed(soft(photo), np.random.default_rng(1))
    assert 0.9 * NOISE < picture_noise(image) < 3.0 * NOISE


@pytest.mark.parametrize("factor", [0.5, 0.8, 0.98, 1.0, 1.02, 1.25])
@pytest.mark.parametrize("photo", PHOTOS)
def test_gain_is_found(photo, factor):
    clean = soft(photo)
    image = exposed(clean, np.random.default_rng(2), factor)
    # standard error of a median, of as many ratios as are asked
    ratios_sd = np.sqrt(3.0) * NOISE / (factor * np.median(clean.sum(axis=2)))
    error = 1.2533 * ratios_sd / np.sqrt(SIZE[0] * SIZE[1] / GAIN_STRIDE**2)
    assert gain(model(clean), image) == pytest.approx(factor, rel=4.0 * error)


def test_gain_is_found_behind_a_crowd():
    # the foreground covers three quarters of the image, in all kinds of colours
    generator = np.random.default_rng(3)
    clean = soft()
    scene = clean.copy()
    for left in range(0, 120, 12):
        scene[:, left : left + 12] = generator.uniform(20.0, 230.0, 3)
    image = exposed(scene, generator, 0.96)
    assert gain(model(clean), image) == pytest.approx(0.96, rel=0.015)


def test_gain_of_the_dark_is_one():
    dark = np.zeros((SIZE[1], SIZE[0], 3))
    assert gain(model(dark), dark.astype(np.uint8)) == 1.0


@pytest.mark.parametrize("pictures", [2, 8])
def test_several_pictures_make_a_better_mean(pictures):
    generator = np.random.default_rng(4)
    clean = soft()
    images = [exposed(clean, generator, factor) for factor in np.linspace(0.97, 1.03, pictures)]
    background = learned(images)
    error = background.mean - 0.97 * clean
    assert error.std() == pytest.approx(NOISE / np.sqrt(pictures), rel=0.1)
    assert background.variance.min() == background.variance.max()


def test_false_alarms_are_as_rare_as_chi_square_has_it():
    generator = np.random.default_rng(5)
    clean, threshold, frames = soft(), 3.5, 20
    background = model(clean)
    background = Background(background.mean, np.full(clean.shape[:2], NOISE**2, np.float32))
    count = sum(
        np.count_nonzero(foreground(background, exposed(clean, generator), threshold, 1.0))
        for _ in range(frames)
    )
    # rounding adds a twelfth to the variance
    pixels, share = frames * SIZE[0] * SIZE[1], chi2.sf(threshold**2 / (1.0 + 1.0 / 12.0 / NOISE**2), 3)
    assert abs(count - pixels * share) < 4.0 * np.sqrt(pixels * share)


def test_frames_teach_noise_and_mean_whatever_the_first_picture_said():
    generator = np.random.default_rng(6)
    clean, rate = soft("photo/gravel"), 0.05
    background = learned((exposed(clean, generator),))
    assert np.sqrt(background.variance.mean()) > 1.5 * NOISE
    for _ in range(150):
        image = exposed(clean, generator, generator.normal(1.0, 0.02))
        background = updated(background, image, foreground(background, image, 4.5), rate)
    # a running average has (2 - α) / α independent frames, and its difference from the next their noise too
    averaged = rate / (2.0 - rate)
    scale = np.median(background.mean / clean)
    error = background.mean / scale - clean
    assert error.std() == pytest.approx(NOISE * np.sqrt(averaged), rel=0.15)
    assert background.variance.mean() == pytest.approx(NOISE**2 * (1.0 + averaged), rel=0.1)


def test_nothing_is_learned_from_the_foreground():
    clean = soft()
    background = learned((exposed(clean, np.random.default_rng(7)),))
    image = exposed(clean, np.random.default_rng(8))
    image[30:90, 40:60] = (255, 0, 255)
    mask = foreground(background, image, 4.5)
    assert mask[31:89, 41:59].all()
    before = background.mean.copy(), background.variance.copy()
    after = updated(background, image, mask, 0.5)
    assert (after.mean[mask] == background.mean[mask]).all()
    assert (after.variance[mask] == background.variance[mask]).all()
    assert (after.mean[~mask] != background.mean[~mask]).any()
    assert (background.mean == before[0]).all()
    assert (background.variance == before[1]).all()


def test_slow_light_makes_no_foreground():
    generator = np.random.default_rng(9)
    clean = soft()
    background = learned((exposed(clean, generator),))
    for factor in np.linspace(1.0, 0.6, 60):
        image = exposed(clean, generator, factor)
        mask = foreground(background, image, 4.5)
        assert mask.mean() < 2e-3
        background = updated(background, image, mask, 0.05)


def test_a_picture_without_noise_is_not_all_foreground():
    clean = soft().astype(np.uint8)
    background = learned((clean,))
    assert not foreground(background, clean, 4.5).any()
    assert background.variance.min() >= 1.0


def test_rate_zero_learns_nothing():
    clean = soft()
    background = learned((exposed(clean, np.random.default_rng(10)),))
    image = exposed(clean, np.random.default_rng(11))
    after = updated(background, image, np.zeros(clean.shape[:2], bool), 0.0)
    assert (after.mean == background.mean).all()
    assert (after.variance == background.variance).all()


@pytest.mark.parametrize(
    ("image", "told"),
    [
        (np.zeros((4, 4), np.uint8), r"must be \(h, w, 3\) uint8"),
        (np.zeros((4, 4, 3)), r"must be \(h, w, 3\) uint8.*float64"),
        (np.zeros((2, 4, 3), np.uint8), "at least 3"),
        (np.zeros((5, 4, 3), np.uint8), "background's shape"),
    ],
)
def test_other_pictures_are_refused(image, told):
    background = learned((np.zeros((4, 4, 3), np.uint8),))
    with pytest.raises(ValueError, match=told):
        foreground(background, image, 4.5)
    with pytest.raises(ValueError, match=told):
        learned((np.zeros((4, 4, 3), np.uint8), image))


def test_no_picture_is_refused():
    with pytest.raises(ValueError, match="at least one picture"):
        learned(())
