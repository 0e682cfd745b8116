"""P: independent trackers in the images; the base station intersects their rays (Sec. 2.3).

What Kushwaha & Koutsoukos 2013 compare with. Each camera follows the target in its own
image with a particle filter of position and size, and a histogram that it never
changes: it knows nothing of space, of the target's turning or of the other cameras.
Only where its filter starts does the base station's state say where and how large.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wsnsim.estimation.kalman import Gaussian
from wsnsim.estimation.mixtures import GaussianMixture
from wsnsim.estimation.particles import mean_and_cov
from wsnsim.geometry.quadrics import Outlines
from wsnsim.hardware.work import Work
from wsnsim.kernels.histograms import kernel_histogram
from wsnsim.messages.ray import RayPayload
from wsnsim.messages.state import StatePayload
from wsnsim.systems.base import Site
from wsnsim.systems.multiview.eye import Eye, shares
from wsnsim.systems.multiview.image_proposal import ImagePrediction, image_prediction
from wsnsim.systems.multiview.judgement import judge
from wsnsim.systems.multiview.map_estimate import ImageDensity, best_place
from wsnsim.systems.multiview.params import MultiviewParams
from wsnsim.systems.multiview.proposal import Proposal
from wsnsim.systems.multiview.sight import facing_viewpoint, look_at_outlines
from wsnsim.systems.multiview.variants import Posterior, Question, Report, Variant
from wsnsim.types import FloatArray
from wsnsim.vision.frame import Frame

_WEAK_SD_M = 3.0
"""Of the prior that keeps nearly parallel rays from meeting anywhere."""
_LEAST_SD_PX = 0.5
_VELOCITY_SHARE = 0.5
"""How far the velocity goes towards the one just seen: the gain β of an α-β filter with α = 1."""


@dataclass(frozen=True, eq=False)
class ImageTrack:
    """A target in one image.

    Parameters
    ----------
    step : of the last frame
    pixel, velocity : (2,) [px], (2,) [px a step]
    log_scale : logarithm of the size, in those at the start
    shape : (2, 2) of the outline at the start, as in `Outlines`
    sqrt_colour, sqrt_texture : roots of its own histograms
    """

    step: int
    pixel: FloatArray
    velocity: FloatArray
    log_scale: float
    shape: FloatArray
    sqrt_colour: FloatArray
    sqrt_texture: FloatArray


class PCamera:
    """Follows targets in its image."""

    def __init__(self, eye: Eye) -> None:
        self._eye = eye
        self._tracks: dict[int, ImageTrack] = {}

    def answer(self, frame: Frame, state: StatePayload, proposal: Proposal) -> tuple[RayPayload | None, Work]:
        """Return where the camera sees the target; None where it has lost it."""
        eye, rule = self._eye, self._eye.params.image_tracker
        track = self._tracks.pop(state.target, None)
        if track is None or track.step != frame.step - 1:
            track = self._started(frame, state, proposal)
            if track is None:
                return None, Work()
        draws = eye.site.streams.stream("image_tracker", state.target, state.step, eye.number)
        normal = draws.standard_normal((eye.params.image_particles, 3))
        expected = track.pixel + track.velocity
        pixels = expected + rule.sd_px * normal[:, :2]
        scales = track.log_scale + rule.scale_sd * normal[:, 2]
        shapes = np.exp(-2.0 * scales)[:, None, None] * track.shape
        outlines = Outlines(pixels, shapes, np.ones(len(pixels), dtype=np.bool_))
        sight = look_at_outlines(frame.image, eye.camera, outlines, eye.features)
        judgement = judge(sight, track.sqrt_colour, track.sqrt_texture, eye.params)
        work = sight.work + judgement.work
        weights = shares(judgement.weights)
        pixel, cov = mean_and_cov(pixels, weights)
        width, height = eye.camera.resolution_px
        inside = 0.0 <= pixel[0] < width and 0.0 <= pixel[1] < height
        if judgement.similarity < rule.similarity_min or not inside:
            return None, work
        self._tracks[state.target] = ImageTrack(
            frame.step,
            pixel,
            track.velocity + _VELOCITY_SHARE * (pixel - expected),
            float(weights @ scales),
            track.shape,
            track.sqrt_colour,
            track.sqrt_texture,
        )
        root = np.asarray(np.linalg.cholesky(cov + _LEAST_SD_PX**2 * np.eye(2)), dtype=np.float64)
        said = RayPayload(
            state.target,
            state.step,
            pixel,
            root[np.tril_indices(2)],
            judgement.similarity,
            eye.params.encoding,
        )
        return said, work

    def _started(self, frame: Frame, state: StatePayload, proposal: Proposal) -> ImageTrack | None:
        """Begin where the base station believes the target to be."""
        eye = self._eye
        prediction = image_prediction(eye.camera, proposal, state, eye.params, eye.site)
        if prediction is None:
            return None
        if eye.params.image_tracker.histogram == "model":
            model = eye.models[state.target]
            view = facing_viewpoint(model, eye.camera, proposal.mean, state.orientation)
            colour, texture = model.sqrt_colour[view], model.sqrt_texture[view]
        else:
            colour, texture = self._own_histograms(frame, prediction)
        moved = prediction.jacobian @ state.velocity / eye.site.rate_hz
        return ImageTrack(
            frame.step - 1, prediction.mean - moved, moved, 0.0, prediction.shape, colour, texture
        )

    def _own_histograms(self, frame: Frame, prediction: ImagePrediction) -> tuple[FloatArray, FloatArray]:
        """Return roots of the histograms of what the image shows where the filter starts."""
        eye = self._eye
        sight = look_at_outlines(
            frame.image, eye.camera, prediction.outlines(prediction.mean[None]), eye.features
        )
        region = sight.region
        colour, texture = kernel_histogram(
            region.colour,
            region.texture,
            region.x0,
            region.y0,
            prediction.mean,
            prediction.shape,
            eye.features.colour_bins,
            eye.features.texture_bins,
        )
        return np.sqrt(colour), np.sqrt(texture)


def posterior(
    params: MultiviewParams, site: Site, question: Question, reports: Sequence[Report]
) -> Posterior:
    """Intersect the rays, each as sure as its camera is.

    The centre of an outline stands for the image of the target's centre, of which it is up
    to a pixel off: a tracker that knows nothing of space cannot tell.
    """
    prior = Gaussian(question.proposal.mean, _WEAK_SD_M**2 * np.eye(3))
    densities = []
    for report in reports:
        assert isinstance(report.said, RayPayload)
        (node,) = report.cameras
        if image_prediction(site.cameras[node], question.proposal, question.state, params, site) is None:
            continue
        root = report.said.root()
        mixture = GaussianMixture.single(report.said.pixel, root @ root.T)
        densities.append(ImageDensity(site.cameras[node], mixture, np.empty((0, 3))))
    found = best_place(prior, densities)
    return Posterior(found.place, found.place, found.cov, prior, 0.0, found.work)


VARIANT = Variant(RayPayload, PCamera, posterior)
