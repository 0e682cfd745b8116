"""How well each particle explains one camera's image (Kushwaha & Koutsoukos 2013, Eqs. 12–17, 23)."""

from dataclasses import dataclass
from math import pi

import numpy as np

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.geometry.quadrics import ellipsoid_outlines, outline_box
from wsnsim.geometry.rotations import quaternion_to_matrix
from wsnsim.hardware.work import Work
from wsnsim.kernels.histograms import particle_histogram_similarities
from wsnsim.systems.multiview.params import Likelihood, RawLikelihood
from wsnsim.systems.multiview.proposal import Proposal
from wsnsim.systems.multiview.reference_model import ReferenceModel
from wsnsim.systems.multiview.viewpoints import nearest_viewpoint
from wsnsim.types import BoolArray, ByteArray, FloatArray
from wsnsim.vision.features import FeatureSpace

_JUDGED = 0.5
"""Share of a particle's kernel mass that must lie in the image for the camera to judge it."""

_LEAST_RHO = 1e-9

# Operations of the mote's own integer implementation, counted from its inner loops.
_BINNING_OPS_PER_PIXEL = 90.0  # hue by division, saturation, eight LBP comparisons, table look-ups
_HISTOGRAM_OPS_PER_PIXEL = 8.0  # two additions of the kernel's recurrence, two loads, two accumulations
_COMPARE_FLOATS_PER_BIN = 3.0  # square root, product, sum
_OUTLINE_FLOATS = 120.0  # dual conic, its inverse, one particle


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
    image: ByteArray,
    camera: PinholeCamera,
    proposal: Proposal,
    orientation: FloatArray,
    semi_axes: FloatArray,
    model: ReferenceModel,
    features: FeatureSpace,
    colour_share: float,
) -> Similarity:
    """Compare an image with the reference model at every particle.

    The histograms are taken inside the projected ellipsoid, by its dual conic
    (the projected centre is not the ellipse's centre), with the Epanechnikov
    kernel. Colour and texture are mixed in each camera, before the product
    over cameras.

    Parameters
    ----------
    image : (h, w, 3) RGB
    orientation : (4,) unit quaternion of the target
    semi_axes : (3,) [m]
    colour_share : α_HS
    """
    outlines = ellipsoid_outlines(camera, proposal.particles, orientation, semi_axes)
    width, height = camera.resolution_px
    towards = camera.position - proposal.mean
    towards /= np.linalg.norm(towards)
    view = nearest_viewpoint(model.directions, towards, quaternion_to_matrix(orientation))
    region = features.bin_region(image, outline_box(outlines, width, height))
    rho_colour, rho_texture, inside = particle_histogram_similarities(
        region.colour,
        region.texture,
        region.x0,
        region.y0,
        width,
        height,
        outlines.centres,
        outlines.shapes,
        outlines.visible,
        model.sqrt_colour[view],
        model.sqrt_texture[view],
    )
    judged = inside >= _JUDGED
    rho = np.where(judged, colour_share * rho_colour + (1.0 - colour_share) * rho_texture, 0.0)
    areas = pi / np.sqrt(np.linalg.det(outlines.shapes[judged]))
    bins = features.colour_bins + features.texture_bins
    work = Work(
        int_ops=_BINNING_OPS_PER_PIXEL * region.colour.size + _HISTOGRAM_OPS_PER_PIXEL * float(areas.sum()),
        float_ops=len(rho) * _OUTLINE_FLOATS + areas.size * bins * _COMPARE_FLOATS_PER_BIN,
        memory_bytes=3.0 * region.colour.size,
    )
    return Similarity(rho, judged, work)


def particle_weights(similarity: Similarity, likelihood: Likelihood) -> FloatArray:
    """Return weights (M,): w = exp(λ (ρ − ρ_max)), relative to the largest, or the raw w = ρ.

    A particle the camera cannot judge gets the mean weight of those it can:
    the image says nothing on whether the target is out of view. A camera that can
    judge none gives all the same weight.
    """
    judged = similarity.judged
    if not judged.any():
        return np.ones(judged.size)
    rho = similarity.rho
    if isinstance(likelihood, RawLikelihood):
        # Identical histograms of nothing have ρ = 0: never a weight of all zeros.
        weights = np.maximum(rho, _LEAST_RHO)
    else:
        weights = np.exp(likelihood.sharpness * (rho - rho[judged].max()))
    return np.asarray(np.where(judged, weights, weights[judged].mean()), dtype=np.float64)
