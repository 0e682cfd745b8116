"""Which pixels of a foreground have the colours of one object: histogram back-projection.

A colour speaks for the object as far as it is more frequent on it than in the foreground of the same
image, other movers included (the ratio histogram). A mover in the very colours of the object is taken for
it; texture and shape play no part.

References
----------
Swain, Ballard (1991), Color indexing, International Journal of Computer Vision 7(1), Sec. 4.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from wsnsim.geometry.quadrics import ellipsoid_outlines, outline_box
from wsnsim.kernels.histograms import kernel_histogram
from wsnsim.types import BoolArray, ByteArray, FloatArray
from wsnsim.vision.features import FeatureSpace
from wsnsim.vision.portrait import Portrait

FEATURES = FeatureSpace()
"""Hue and saturation, which the light does not change, and value where there is little colour."""


@dataclass(frozen=True, eq=False)
class ObjectColours:
    """How frequent each colour is on an object from the side that shows most of it.

    Parameters
    ----------
    shares : (c,) - largest share of each colour bin of `FEATURES` in any picture [0–1]
    """

    shares: FloatArray


def learned_colours(portraits: Iterable[Portrait], semi_axes_m: FloatArray) -> ObjectColours:
    """Return the colours of an object from pictures of it.

    Only what lies within the ellipsoid of its semi-axes counts, which every form of a body holds.

    Parameters
    ----------
    portraits : from several sides, with the object's centre at the origin
    semi_axes_m : (3,) - of the object [m]
    """
    shares = np.zeros(FEATURES.colour_bins)
    for portrait in portraits:
        outlines = ellipsoid_outlines(portrait.camera, np.zeros((1, 3)), portrait.orientation, semi_axes_m)
        box = outline_box(outlines, *portrait.camera.resolution_px)
        region = FEATURES.bin_region(portrait.image, box)
        colour, _ = kernel_histogram(
            region.colour,
            region.texture,
            region.x0,
            region.y0,
            outlines.centres[0],
            outlines.shapes[0],
            FEATURES.colour_bins,
            FEATURES.texture_bins,
        )
        shares = np.maximum(shares, colour)
    return ObjectColours(shares)


def object_pixels(
    colours: ObjectColours, image: ByteArray, foreground: BoolArray, share: float, ratio: float
) -> BoolArray:
    """Tell which foreground pixels (h, w) have a colour of the object.

    Parameters
    ----------
    colours : of the object
    image : (h, w, 3) - RGB
    foreground : (h, w) - the pixels that are asked
    share : of the object, at least, that has such a colour: what is rarer is noise, or a mixture at an edge
        [0–1]
    ratio : times that a colour must be as frequent on the object as in the foreground [-]
    """
    chosen = np.zeros(foreground.shape, dtype=np.bool_)
    rows, columns = np.flatnonzero(foreground.any(axis=1)), np.flatnonzero(foreground.any(axis=0))
    if not len(rows):
        return chosen
    y0, y1, x0, x1 = int(rows[0]), int(rows[-1]) + 1, int(columns[0]), int(columns[-1]) + 1
    asked = foreground[y0:y1, x0:x1]
    bins = FEATURES.bin_region(image, (x0, y0, x1, y1)).colour
    counts = np.bincount(bins[asked], minlength=FEATURES.colour_bins)
    least = np.maximum(ratio * counts / counts.sum(), share)
    chosen[y0:y1, x0:x1] = asked & (colours.shares >= least)[bins]
    return chosen
