"""Colour and texture bins of an image, pixel by pixel.

Colour is hue and saturation, and value where there is too little colour to tell a
hue. Texture is the rotation-invariant uniform local binary pattern of the eight
neighbours at radius 1. Everything is decided in integers, so that ties are exact and
no library's rounding shows.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from wsnsim.geometry.quadrics import Box
from wsnsim.kernels.binning import bin_pixels
from wsnsim.types import ByteArray

BinArray = NDArray[np.int16]


@dataclass(frozen=True, eq=False)
class BinnedRegion:
    """Bins of the pixels of one box of an image.

    Parameters
    ----------
    colour : (h, w) - colour bin of each pixel
    texture : (h, w) - texture bin of each pixel
    x0, y0 : the box's first pixel in the image
    """

    colour: BinArray
    texture: BinArray
    x0: int
    y0: int


@dataclass(frozen=True)
class FeatureSpace:
    """The bins that histograms are made of.

    Colour `hsv`: 10 × 10 bins of hue and saturation for pixels with saturation above
    0.1 and value above 0.2, then 10 bins of value for the others. Colour `hs`: the
    10 × 10 bins for all pixels. Hue 0 stands for greys.

    Texture: a pixel's eight neighbours on the circle of radius 1, diagonals by bilinear
    interpolation, are 1 where they are at least as bright as the pixel; the bin is the
    number of ones where the circle has at most two changes, else 9. At the border of
    the image the border pixels repeat.

    Parameters
    ----------
    colour : `hsv` or `hs`

    References
    ----------
    Pérez, Hue, Vermaak, Gangnet (2002), Color-based probabilistic tracking, Sec. 3.
    Ojala, Pietikäinen, Mäenpää (2002), Multiresolution gray-scale and rotation
    invariant texture classification with local binary patterns, eq. 9.
    """

    colour: Literal["hsv", "hs"] = "hsv"

    @property
    def colour_bins(self) -> int:
        """Number of colour bins."""
        return 110 if self.colour == "hsv" else 100

    @property
    def texture_bins(self) -> int:
        """Number of texture bins."""
        return 10

    def bin_region(self, image: ByteArray, box: Box | tuple[int, int, int, int]) -> BinnedRegion:
        """Find the bins of the pixels in a box.

        Parameters
        ----------
        image : (h, w, 3) - RGB
        box : (x0, y0, x1, y1), pixels x0 ≤ x < x1, y0 ≤ y < y1; may be empty

        Raises
        ------
        ValueError : the image is not 8-bit RGB, or the box reaches out of it
        """
        if image.ndim != 3 or image.shape[2] != 3 or image.dtype != np.uint8:
            raise ValueError(f"image: must be (h, w, 3) uint8, got {image.shape} {image.dtype}")
        x0, y0, x1, y1 = box
        height, width, _ = image.shape
        if not (0 <= x0 <= x1 <= width and 0 <= y0 <= y1 <= height):
            raise ValueError(f"box: must lie in the image of {width} x {height} px, got {tuple(box)}")
        colour, texture = bin_pixels(image, x0, y0, x1, y1, self.colour == "hsv")
        return BinnedRegion(colour, texture, x0, y0)
