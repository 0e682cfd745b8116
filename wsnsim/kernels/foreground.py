"""Background subtraction, pixel by pixel: which pixels are foreground, and what the others teach."""

import numpy as np
from numpy.typing import NDArray

from wsnsim.kernels.jit import kernel
from wsnsim.types import BoolArray, ByteArray

FloatImage = NDArray[np.float32]


@kernel
def foreground_mask(
    image: ByteArray, mean: FloatImage, variance: FloatImage, gain: float, threshold: float
) -> BoolArray:
    """Tell which pixels are farther from the background than their noise explains.

    Parameters
    ----------
    image : (h, w, 3) - RGB
    mean : (h, w, 3) - the background [grey levels]
    variance : (h, w) - of the difference of one channel from it [grey levels²]
    gain : brightness of the image over the background's [-]
    threshold : Mahalanobis distance of the colour [-]

    Returns
    -------
    (h, w)
    """
    height, width, channels = image.shape
    mask = np.empty((height, width), np.bool_)
    factor, limit = np.float32(gain), np.float32(threshold * threshold)
    for y in range(height):
        for x in range(width):
            squares = np.float32(0.0)
            for c in range(channels):
                difference = np.float32(image[y, x, c]) - factor * mean[y, x, c]
                squares += difference * difference
            mask[y, x] = squares > limit * variance[y, x]
    return mask


@kernel
def learned_background(
    image: ByteArray,
    mean: FloatImage,
    variance: FloatImage,
    gain: float,
    foreground: BoolArray,
    rate: float,
    least_variance: float,
) -> tuple[FloatImage, FloatImage]:
    """Return mean and variance moved by `rate` towards an image, where nothing is foreground.

    Parameters
    ----------
    image, mean, variance, gain : as in `foreground_mask`
    foreground : (h, w) - pixels that stay as they are
    rate : share of the image in the average [0–1]
    least_variance : no variance falls below [grey levels²]

    Returns
    -------
    mean : (h, w, 3)
    variance : (h, w)
    """
    height, width, channels = image.shape
    new_mean, new_variance = mean.copy(), variance.copy()
    factor, share, least = np.float32(gain), np.float32(rate), np.float32(least_variance)
    per_gain = share / factor
    for y in range(height):
        for x in range(width):
            if foreground[y, x]:
                continue
            squares = np.float32(0.0)
            for c in range(channels):
                difference = np.float32(image[y, x, c]) - factor * mean[y, x, c]
                squares += difference * difference
                new_mean[y, x, c] += per_gain * difference
            moved = variance[y, x] + share * (squares / np.float32(channels) - variance[y, x])
            new_variance[y, x] = max(moved, least)
    return new_mean, new_variance
