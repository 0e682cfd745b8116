"""The prediction as one camera sees it, and particles about it in its image (T3, T4).

Kushwaha & Koutsoukos 2013, Algorithm 2, lines 4 and 5. The particles spread as those
in space do, projected (J Σ Jᵀ, about f σ / z): a spread of so many pixels whatever the
distance is far too wide for a small target. By name it is there.
"""

from dataclasses import dataclass

import numpy as np

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.geometry.quadrics import Outlines, ellipsoid_outlines
from wsnsim.messages.state import StatePayload
from wsnsim.systems.base import Site
from wsnsim.systems.multiview.params import MultiviewParams
from wsnsim.systems.multiview.proposal import Proposal
from wsnsim.systems.multiview.rules import FixedImageSpread
from wsnsim.types import FloatArray

_LEAST_SD_PX = 0.5
"""Added to every spread: no camera tells a position better."""


@dataclass(frozen=True, eq=False)
class ImagePrediction:
    """N(mean, cov) of the centre of the target's outline, linear in its position about the prediction.

    Parameters
    ----------
    mean, cov : (2,) [px], (2, 2) [px²]
    jacobian : (2, 3) of the pixel by the position [px/m]
    offset : (2,) of the outline's centre from the image of the target's centre [px]
    shape : (2, 2) of the outline, as in `Outlines`
    """

    mean: FloatArray
    cov: FloatArray
    jacobian: FloatArray
    offset: FloatArray
    shape: FloatArray

    def outlines(self, pixels: FloatArray) -> Outlines:
        """Return the outlines of the predicted shape about pixels (n, 2)."""
        shapes = np.broadcast_to(self.shape, (len(pixels), 2, 2)).copy()
        return Outlines(pixels, shapes, np.ones(len(pixels), dtype=np.bool_))


@dataclass(frozen=True, eq=False)
class ImageProposal:
    """Draws from a prediction in an image.

    Parameters
    ----------
    prediction : what they are drawn from
    root : (2, 2) lower Cholesky factor of its covariance [px]
    draws : (m, 3) standard normal: two of the pixel, one of the depth
    particles : (m, 2) [px]
    """

    prediction: ImagePrediction
    root: FloatArray
    draws: FloatArray
    particles: FloatArray

    @property
    def outlines(self) -> Outlines:
        """The outlines of all particles."""
        return self.prediction.outlines(self.particles)


def image_prediction(
    camera: PinholeCamera, proposal: Proposal, state: StatePayload, params: MultiviewParams, site: Site
) -> ImagePrediction | None:
    """Return the prediction in a camera's image; None where the predicted outline is no ellipse there."""
    place = proposal.mean[None]
    outlines = ellipsoid_outlines(camera, place, state.orientation, site.targets[state.target].semi_axes_m)
    if not outlines.visible[0]:
        return None
    (pixel,), _ = camera.project(place)
    jacobian = camera.jacobians(place)[0]
    if not (np.isfinite(pixel).all() and np.isfinite(jacobian).all()):
        return None
    rule = params.image_spread
    if isinstance(rule, FixedImageSpread):
        cov = rule.sd_px**2 * np.eye(2)
    else:
        cov = jacobian @ proposal.cov @ jacobian.T
    cov = cov + _LEAST_SD_PX**2 * np.eye(2)
    centre = outlines.centres[0]
    return ImagePrediction(centre, cov, jacobian, centre - pixel, outlines.shapes[0])


def propose_in_image(
    prediction: ImagePrediction, node: int, state: StatePayload, params: MultiviewParams, site: Site
) -> ImageProposal:
    """Draw the particles of one camera, by its number; nobody else needs the same ones."""
    stream = site.streams.stream("image_particles", state.target, state.step, node)
    draws = stream.standard_normal((params.image_particles, 3))
    root = np.asarray(np.linalg.cholesky(prediction.cov), dtype=np.float64)
    return ImageProposal(prediction, root, draws, prediction.mean + draws[:, :2] @ root.T)


def image_spacing_variance(proposal: Proposal, params: MultiviewParams) -> float:
    """Return the smallest variance [m²] that particles in an image can resolve, at the prediction's distance.

    (1.25 σ / M^(1/2))², the counterpart of `spacing_variance` in two dimensions, σ² the
    geometric mean of the variances in space.
    """
    variance = float(np.linalg.det(proposal.cov)) ** (1.0 / 3.0)
    return float(1.25**2 * variance / params.image_particles)
