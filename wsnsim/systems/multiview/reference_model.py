"""The reference model: histograms of a target seen from many sides, 26 directions by default.

Kushwaha & Koutsoukos 2013, Sec. 4.1.2.
"""

from dataclasses import dataclass

import numpy as np

from wsnsim.geometry.quadrics import ellipsoid_outlines, outline_box
from wsnsim.kernels.histograms import kernel_histogram
from wsnsim.systems.base import TrackedTarget
from wsnsim.systems.multiview.viewpoints import viewpoints
from wsnsim.types import FloatArray
from wsnsim.vision.album import View
from wsnsim.vision.features import FeatureSpace


@dataclass(frozen=True, eq=False)
class ReferenceModel:
    """Multi-view histograms (Eq. 7), stored as square roots, which is how they are compared (Eq. 3).

    Parameters
    ----------
    directions : (n, 3) viewpoints, unit vectors in the target's axes
    sqrt_colour : (n, c) roots of the colour histograms, each histogram summing to one
    sqrt_texture : (n, t) roots of the texture histograms
    """

    directions: FloatArray
    sqrt_colour: FloatArray
    sqrt_texture: FloatArray


def learn(target: TrackedTarget, features: FeatureSpace) -> ReferenceModel:
    """Keep the kernel-weighted histograms (Eq. 8) of pictures of a target from many sides.

    The pictures are the user's where there are any, else portraits from the 26
    viewpoints.
    """
    views = target.album or tuple(View(direction, target.portrait(direction)) for direction in viewpoints())
    colour, texture = [], []
    for _, portrait in views:
        outlines = ellipsoid_outlines(
            portrait.camera, np.zeros((1, 3)), portrait.orientation, target.semi_axes_m
        )
        width, height = portrait.camera.resolution_px
        region = features.bin_region(portrait.image, outline_box(outlines, width, height))
        histograms = kernel_histogram(
            region.colour,
            region.texture,
            region.x0,
            region.y0,
            outlines.centres[0],
            outlines.shapes[0],
            features.colour_bins,
            features.texture_bins,
        )
        colour.append(histograms[0])
        texture.append(histograms[1])
    directions = np.array([view.direction for view in views])
    return ReferenceModel(directions, np.sqrt(np.array(colour)), np.sqrt(np.array(texture)))
