"""The compiled background subtraction against plain NumPy in double precision."""

import numpy as np
import pytest

from wsnsim.vision.foreground import Background, foreground, updated


def plain_foreground(background, image, threshold, image_gain):
    difference = image.astype(float) - image_gain * background.mean.astype(float)
    return (difference**2).sum(axis=2), threshold**2 * background.variance.astype(float)


def plain_updated(background, image, mask, rate, image_gain):
    mean, variance = background.mean.astype(float), background.variance.astype(float)
    difference = image.astype(float) - image_gain * mean
    learnt_mean = mean + rate * (image / image_gain - mean)
    learnt_variance = (1.0 - rate) * variance + rate * (difference**2).mean(axis=2)
    return (
        np.where(mask[:, :, None], mean, learnt_mean),
        np.where(mask, variance, np.maximum(learnt_variance, 1.0)),
    )


@pytest.mark.parametrize("image_gain", [0.7, 1.0, 1.1])
def test_twins_agree(test_seed, image_gain):
    generator = np.random.default_rng((test_seed, 1))
    mean = generator.uniform(0.0, 255.0, (40, 50, 3)).astype(np.float32)
    variance = generator.uniform(0.5, 60.0, (40, 50)).astype(np.float32)
    background = Background(mean, variance)
    noise = np.sqrt(variance)[:, :, None] * generator.standard_normal(mean.shape)
    image = np.clip(np.rint(image_gain * mean + 2.0 * noise), 0, 255).astype(np.uint8)
    mask = foreground(background, image, 3.0, image_gain)
    squares, limits = plain_foreground(background, image, 3.0, image_gain)
    # single precision may decide otherwise where the two are all but equal
    clear = np.abs(squares - limits) > 1e-4 * limits
    assert (mask == (squares > limits))[clear].all()
    assert clear.mean() > 0.99
    assert 0.05 < mask.mean() < 0.95
    after = updated(background, image, mask, 0.1, image_gain)
    wanted_mean, wanted_variance = plain_updated(background, image, mask, 0.1, image_gain)
    np.testing.assert_allclose(after.mean, wanted_mean, rtol=1e-5, atol=1e-4)
    np.testing.assert_allclose(after.variance, wanted_variance, rtol=1e-4)
