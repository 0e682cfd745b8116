"""The sensor: gain, noise, rounding and clipping of an image."""

import numpy as np
from numpy.typing import NDArray

from wsnsim.kernels.jit import kernel
from wsnsim.types import ByteArray


@kernel
def expose(image: NDArray[np.float32], gain: float, noise: NDArray[np.float32], noise_sd: float) -> ByteArray:
    """Return gain · image + noise_sd · noise, rounded and clipped to 0–255.

    Parameters
    ----------
    image : (h, w, 3) - RGB [0–255]
    gain : of all pixels
    noise : (h, w, 3) - of standard deviation 1, or empty for none
    noise_sd : standard deviation of the noise [grey levels]

    Returns
    -------
    (h, w, 3)
    """
    height, width, channels = image.shape
    exposed = np.empty((height, width, channels), np.uint8)
    factor, sd = np.float32(gain), np.float32(noise_sd)
    black, half, white = np.float32(0.0), np.float32(0.5), np.float32(255.0)
    for y in range(height):
        for x in range(width):
            for c in range(channels):
                value = factor * image[y, x, c]
                if noise.size:
                    value += sd * noise[y, x, c]
                exposed[y, x, c] = np.uint8(min(max(value, black), white) + half)
    return exposed
