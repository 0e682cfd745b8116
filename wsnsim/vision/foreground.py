"""Background subtraction as a mote does it: a running Gaussian average at every pixel.

A pixel is foreground where its colour is farther from the background's mean than its noise explains; the
others move the mean and the variance a little. A frame's gain is found first, so that a change of the
light, or of the exposure, that is the same everywhere makes no foreground. Left out: shadows, backgrounds
with several states, and whoever stays for good: nothing that is foreground is ever learned.

References
----------
Wren, Azarbayejani, Darrell, Pentland (1997), Pfinder: real-time tracking of the human body, IEEE PAMI
19(7), Secs. 3.2, 3.4: the Gaussian at every pixel and its update.
Piccardi (2004), Background subtraction techniques: a review, IEEE SMC, Sec. 2.1: only where nothing is
foreground.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wsnsim.kernels.foreground import foreground_mask, learned_background
from wsnsim.kernels.jit import frozen
from wsnsim.types import BoolArray, ByteArray, FloatArray

FloatImage = NDArray[np.float32]

_LEAST_VARIANCE = 1.0
"""Of rounding and of what the gain leaves, so that a picture without noise has a threshold too."""
_FIRST_NOISE = 5.0
"""Deviation that is taken at the beginning at least: a compressed picture, for one, shows too little."""
GAIN_STRIDE = 8
"""Every so many rows and columns a pixel is asked for the gain: 1,200 of a QVGA image tell it to .1 %."""
_DARK, _BRIGHT = 60.0, 250.0
"""Sum of the channels below which noise hides the gain, and channel above which the sensor may clip."""
_GAIN_STEP, _GAIN_STEPS, _GAIN_REACH = 0.02, 70, 0.1
"""Logarithms of the gains are counted in bins of 2 %, so many up and down; the peak reaches ± 10 %."""
_NORMAL_MAD = 0.6745
"""Median of the absolute value of a standard normal variable."""


@dataclass(frozen=True, eq=False)
class Background:
    """What an empty room looks like to one camera.

    Parameters
    ----------
    mean : (h, w, 3) - RGB [grey levels]
    variance : (h, w) - of one channel's difference from it [grey levels²]
    """

    mean: FloatImage
    variance: FloatImage


def learned(images: Sequence[ByteArray]) -> Background:
    """Return the background that pictures of the empty room show.

    The noise is estimated from the second differences within a picture, too high where it is rough
    everywhere: frames then bring it down, while one that is too low would keep them from being learned.

    Parameters
    ----------
    images : (h, w, 3) each, RGB, of the same room; their gains may differ

    Raises
    ------
    ValueError : no picture, or no RGB images of one shape with 3 rows and columns at least
    """
    if not images:
        raise ValueError("images: must be at least one picture of the empty room, got none")
    for image in images:
        _checked(image, images[0].shape)
    first = Background(
        images[0].astype(np.float32), np.full(images[0].shape[:2], _LEAST_VARIANCE, np.float32)
    )
    scaled = np.stack([image / np.float32(gain(first, image)) for image in images])
    mean = scaled.mean(axis=0, dtype=np.float32)
    noise = max(_FIRST_NOISE, *map(picture_noise, images))
    # the mean has noise of its own
    variance = noise**2 * (1.0 + 1.0 / len(images))
    return Background(mean, np.full(mean.shape[:2], variance, np.float32))


def picture_noise(image: ByteArray) -> float:
    """Return the standard deviation of the noise in one picture (h, w, 3), estimated [grey levels].

    The mask removes what is linear along rows or columns; a median takes edges for the outliers that they
    are.

    References
    ----------
    Immerkær (1996), Fast noise variance estimation, Computer Vision and Image Understanding 64(2).
    """
    pixels = image.astype(np.int32)
    across = pixels[:, :-2] - 2 * pixels[:, 1:-1] + pixels[:, 2:]
    both = across[:-2] - 2 * across[1:-1] + across[2:]
    # the mask's weights have a sum of squares of 36
    return float(np.median(np.abs(both))) / (6.0 * _NORMAL_MAD)


def gain(background: Background, image: ByteArray) -> float:
    """Return how much brighter an image is than the background where it shows it.

    The most frequent ratio of a sample of the pixels, so that the foreground may cover more than half of
    the image as long as it has no one brightness; 1 where all is too dark or too bright to tell.

    Parameters
    ----------
    background : of the camera
    image : (h, w, 3) - RGB

    Raises
    ------
    ValueError : the image has not the background's shape
    """
    _checked(image, background.mean.shape)
    half = GAIN_STRIDE // 2
    seen = image[half::GAIN_STRIDE, half::GAIN_STRIDE].astype(np.float32)
    known = background.mean[half::GAIN_STRIDE, half::GAIN_STRIDE]
    sums, expected = seen.sum(axis=2), known.sum(axis=2)
    # which pixels are fit must not turn on their noise, or the median would
    fit = (expected > _DARK) & (sums > 0.0) & (np.maximum(seen, known).max(axis=2) < _BRIGHT)
    if not fit.any():
        return 1.0
    logs: FloatArray = np.log(sums[fit] / expected[fit]).astype(np.float64)
    steps = np.clip(np.rint(logs / _GAIN_STEP), -_GAIN_STEPS, _GAIN_STEPS).astype(np.int64)
    counts = np.bincount(steps + _GAIN_STEPS, minlength=2 * _GAIN_STEPS + 1)
    # three bins together, so that a peak between two is one
    peak = int(np.convolve(counts, np.ones(3), mode="same").argmax()) - _GAIN_STEPS
    near = np.abs(logs - peak * _GAIN_STEP) <= _GAIN_REACH
    return float(np.exp(np.median(logs[near])))


def foreground(
    background: Background, image: ByteArray, threshold: float, image_gain: float | None = None
) -> BoolArray:
    """Tell which pixels (h, w) of an image do not show the background.

    Parameters
    ----------
    background : of the camera
    image : (h, w, 3) - RGB
    threshold : Mahalanobis distance of a colour, whose square has three degrees of freedom [-]
    image_gain : of the image; None: `gain`

    Raises
    ------
    ValueError : the image has not the background's shape
    """
    _checked(image, background.mean.shape)
    factor = gain(background, image) if image_gain is None else image_gain
    return foreground_mask(*_arrays(background, image), float(factor), float(threshold))


def updated(
    background: Background,
    image: ByteArray,
    foreground: BoolArray,
    rate: float,
    image_gain: float | None = None,
) -> Background:
    """Return the background moved towards an image where that shows no foreground.

    The mean keeps the brightness of the first picture; a frame's gain is taken out of it.

    Parameters
    ----------
    background : of the camera
    image : (h, w, 3) - RGB
    foreground : (h, w) - pixels from which nothing is learned
    rate : share of the image in the running average [0–1]
    image_gain : of the image; None: `gain`

    Raises
    ------
    ValueError : the image has not the background's shape
    """
    _checked(image, background.mean.shape)
    factor = gain(background, image) if image_gain is None else image_gain
    pixels, mean, variance = _arrays(background, image)
    return Background(
        *learned_background(
            pixels,
            mean,
            variance,
            float(factor),
            frozen(foreground, np.bool_),
            float(rate),
            _LEAST_VARIANCE,
        )
    )


def _arrays(background: Background, image: ByteArray) -> tuple[ByteArray, FloatImage, FloatImage]:
    return (
        frozen(image, np.uint8),
        frozen(background.mean, np.float32),
        frozen(background.variance, np.float32),
    )


def _checked(image: ByteArray, shape: tuple[int, ...]) -> None:
    """Refuse what is no RGB image of the shape."""
    if image.ndim != 3 or image.shape[2] != 3 or image.dtype != np.uint8 or min(image.shape[:2]) < 3:
        raise ValueError(
            f"image: must be (h, w, 3) uint8 with h and w at least 3, got {image.shape} {image.dtype}"
        )
    if image.shape != shape:
        raise ValueError(f"image: must have the background's shape {shape}, got {image.shape}")
