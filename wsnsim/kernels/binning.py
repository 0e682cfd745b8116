"""Hue–saturation–value and local-binary-pattern bins of the pixels in a box, in exact integers."""

import numpy as np
from numpy.typing import NDArray

from wsnsim.kernels.jit import frozen, kernel
from wsnsim.types import ByteArray


def bin_pixels(
    image: ByteArray, x0: int, y0: int, x1: int, y1: int, with_value: bool
) -> tuple[NDArray[np.int16], NDArray[np.int16]]:
    """Return the colour and texture bins of the pixels x0 ≤ x < x1, y0 ≤ y < y1.

    Parameters
    ----------
    image : (h, w, 3) - RGB
    x0, y0, x1, y1 : a box within the image
    with_value : whether pale and dark pixels go to 10 value bins (100 to 109)

    Returns
    -------
    colour : (y1 - y0, x1 - x0) - 10 · hue bin + saturation bin, or 100 + value bin
    texture : (y1 - y0, x1 - x0) - 0 to 9
    """
    pixels = frozen(image, np.uint8)
    return _colour_bins(pixels, x0, y0, x1, y1, with_value), _texture_bins(pixels, x0, y0, x1, y1)


@kernel
def _colour_bins(image: ByteArray, x0: int, y0: int, x1: int, y1: int, with_value: bool) -> NDArray[np.int16]:
    bins = np.empty((y1 - y0, x1 - x0), np.int16)
    for y in range(y0, y1):
        for x in range(x0, x1):
            red = int(np.int32(image[y, x, 0]))
            green = int(np.int32(image[y, x, 1]))
            blue = int(np.int32(image[y, x, 2]))
            value = max(red, green, blue)
            chroma = value - min(red, green, blue)
            if with_value and (10 * chroma <= value or value <= 51):
                bins[y - y0, x - x0] = 100 + min(10 * value // 255, 9)
                continue
            if value == red:
                sixth = green - blue
                if sixth < 0:
                    sixth += 6 * chroma
            elif value == green:
                sixth = blue - red + 2 * chroma
            else:
                sixth = red - green + 4 * chroma
            # A quotient of integers below 2^12 is never rounded onto the next integer.
            hue = int(np.float32(10 * sixth) / np.float32(max(6 * chroma, 1)))
            saturation = int(np.float32(10 * chroma) / np.float32(max(value, 1)))
            bins[y - y0, x - x0] = 10 * hue + min(saturation, 9)
    return bins


@kernel
def _texture_bins(image: ByteArray, x0: int, y0: int, x1: int, y1: int) -> NDArray[np.int16]:
    height, width, _ = image.shape
    rows, columns = y1 - y0, x1 - x0
    # BT.601 luma in 1/256 grey levels, not rounded, with one pixel more on each side.
    luma = np.empty((rows + 2, columns + 2), np.int32)
    for i in range(rows + 2):
        y = min(max(y0 + i - 1, 0), height - 1)
        for j in range(columns + 2):
            x = min(max(x0 + j - 1, 0), width - 1)
            red, green, blue = np.int32(image[y, x, 0]), np.int32(image[y, x, 1]), np.int32(image[y, x, 2])
            luma[i, j] = 77 * red + 150 * green + 29 * blue
    bins = np.empty((rows, columns), np.int16)
    for i in range(rows):
        for j in range(columns):
            centre = luma[i + 1, j + 1]
            north = luma[i, j + 1] - centre
            south = luma[i + 2, j + 1] - centre
            west = luma[i + 1, j] - centre
            east = luma[i + 1, j + 2] - centre
            # Bilinear at (√½, √½) minus the centre, over √½; 169/239 is √½ within 7e-6.
            a = np.int32(east >= 0)
            b = np.int32(70 * (north + east) + 169 * (luma[i, j + 2] - centre) >= 0)
            c = np.int32(north >= 0)
            d = np.int32(70 * (north + west) + 169 * (luma[i, j] - centre) >= 0)
            e = np.int32(west >= 0)
            f = np.int32(70 * (south + west) + 169 * (luma[i + 2, j] - centre) >= 0)
            g = np.int32(south >= 0)
            h = np.int32(70 * (south + east) + 169 * (luma[i + 2, j + 2] - centre) >= 0)
            changes = (a ^ b) + (b ^ c) + (c ^ d) + (d ^ e) + (e ^ f) + (f ^ g) + (g ^ h) + (h ^ a)
            ones = a + b + c + d + e + f + g + h
            bins[i, j] = ones if changes <= 2 else 9
    return bins
