"""How well each particle explains one camera's image, by histograms.

Kushwaha & Koutsoukos 2013, Eqs. 12–17 and 23.
"""

from dataclasses import dataclass
from math import pi

import numpy as np

from wsnsim.hardware.work import Work
from wsnsim.kernels.histograms import kernel_histogram, particle_histogram_similarities
from wsnsim.systems.multiview.reference_model import ReferenceModel
from wsnsim.systems.multiview.sight import Sight
from wsnsim.types import BoolArray, FloatArray
from wsnsim.vision.features import FeatureSpace

JUDGED = 0.5
"""Share of a particle's outline that must lie in the image for the camera to judge it."""

# Operations of the mote's own integer implementation, counted from its inner loops.
_HISTOGRAM_OPS_PER_PIXEL = 8.0  # two additions of the kernel's recurrence, two loads, two accumulations
_COMPARE_FLOATS_PER_BIN = 3.0  # square root, product, sum


@dataclass(frozen=True, eq=False)
class Similarity:
    """Bhattacharyya coefficients of particles in one image.

    Parameters
    ----------
    rho : (M,) colour and texture mixed, in [0, 1]; 0 where not judged
    judged : (M,) False where the particle is out of view: the camera cannot tell
    work : what it cost
    """

    rho: FloatArray
    judged: BoolArray
    work: Work


def compare(
    sight: Sight,
    sqrt_colour: FloatArray,
    sqrt_texture: FloatArray,
    colour_share: float,
) -> Similarity:
    """Compare an image with a reference histogram at every particle.

    The histograms are taken inside the projected ellipsoid, by its dual conic
    (the projected centre is not the ellipse's centre), with the Epanechnikov
    kernel. Colour and texture are mixed in each camera, before the product
    over cameras.

    Parameters
    ----------
    sqrt_colour, sqrt_texture : (c,), (t,) roots of the reference histograms
    colour_share : α_HS
    """
    outlines, region = sight.outlines, sight.region
    rho_colour, rho_texture, inside = particle_histogram_similarities(
        region.colour,
        region.texture,
        region.x0,
        region.y0,
        *sight.resolution_px,
        outlines.centres,
        outlines.shapes,
        outlines.visible,
        sqrt_colour,
        sqrt_texture,
    )
    judged = inside >= JUDGED
    rho = np.where(judged, colour_share * rho_colour + (1.0 - colour_share) * rho_texture, 0.0)
    areas = pi / np.sqrt(np.linalg.det(outlines.shapes[judged]))
    bins = sqrt_colour.size + sqrt_texture.size
    work = Work(
        int_ops=_HISTOGRAM_OPS_PER_PIXEL * float(areas.sum()),
        float_ops=areas.size * bins * _COMPARE_FLOATS_PER_BIN,
    )
    return Similarity(rho, judged, work)


def view_similarities(
    sight: Sight, model: ReferenceModel, features: FeatureSpace, colour_share: float
) -> tuple[FloatArray, Work]:
    """Compare what the first outline of a sight shows with every viewpoint of the model (n,).

    All 0 where it is not in the image.
    """
    outlines, region = sight.outlines, sight.region
    if not outlines.visible[0] or region.colour.size == 0:
        return np.zeros(len(model.directions)), Work()
    colour, texture = kernel_histogram(
        region.colour,
        region.texture,
        region.x0,
        region.y0,
        outlines.centres[0],
        outlines.shapes[0],
        features.colour_bins,
        features.texture_bins,
    )
    rho = colour_share * (model.sqrt_colour @ np.sqrt(colour))
    rho += (1.0 - colour_share) * (model.sqrt_texture @ np.sqrt(texture))
    work = Work(
        int_ops=_HISTOGRAM_OPS_PER_PIXEL * float(region.colour.size),
        float_ops=_COMPARE_FLOATS_PER_BIN * len(rho) * (colour.size + texture.size),
    )
    return rho, work
