"""The synchronised particles, and which cameras they ask (Kushwaha & Koutsoukos 2013, Algorithm 1, line 4).

Every node draws the same particles from the same state: the stream is named by
target and step, so that a node that missed a step is in time again at once.
"""

from dataclasses import dataclass
from math import pi

import numpy as np

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.geometry.quadrics import ellipsoid_outlines
from wsnsim.messages.state import StatePayload
from wsnsim.systems.base import Site
from wsnsim.systems.multiview.params import IN_IMAGE, MultiviewParams
from wsnsim.systems.multiview.rules import PointParticipation, PredictedSpread
from wsnsim.types import BoolArray, FloatArray, NodeId

DRAW_FLOATS = 60.0
"""One particle: three normal draws, projection, test against the image's border."""
VIEW_FLOATS = 15.0
"""One particle and camera more: projection, test against the image's border."""
_THINNEST = 1.0 / 254.0
"""Least width of a cloud against its length: rounded to 8 bits, a thinner one might be flat."""


@dataclass(frozen=True, eq=False)
class Proposal:
    """Where the target may be at a step: N(mean, cov), and M draws from it.

    Parameters
    ----------
    mean, cov : (3,) [m], (3, 3) [m²]
    particles : (M, 3) [m]
    """

    mean: FloatArray
    cov: FloatArray
    particles: FloatArray


def spread(filter_cov: FloatArray, params: MultiviewParams) -> FloatArray:
    """Return what the state message says of the particles' spread.

    Parameters
    ----------
    filter_cov : (3, 3) covariance of the predicted position [m²]

    Returns
    -------
    (6,) lower triangle, row by row, of the Cholesky factor [m]; empty where the spread is fixed
    """
    if not isinstance(params.spread, PredictedSpread):
        return np.empty(0)
    variances, axes = np.linalg.eigh(filter_cov)
    variances = np.clip(variances, 0.0, params.spread.largest_sd_m**2)
    cov = params.spread.floor_sd_m**2 * np.eye(3) + (axes * variances) @ axes.T
    return np.asarray(np.linalg.cholesky(cov)[np.tril_indices(3)])


def propose(state: StatePayload, params: MultiviewParams, site: Site) -> Proposal:
    """Draw the particles of a step about the constant-velocity prediction x̂ + v̂ dt."""
    mean = state.position + state.velocity / site.rate_hz
    draws = site.streams.stream("particles", state.target, state.step).standard_normal((params.particles, 3))
    if not state.spread.size:
        return Proposal(mean, params.particle_sd_m**2 * np.eye(3), mean + params.particle_sd_m * draws)
    root = np.zeros((3, 3))
    root[np.tril_indices(3)] = state.spread
    np.fill_diagonal(root, np.maximum(np.diag(root), _THINNEST * np.abs(root).max()))
    return Proposal(mean, root @ root.T, mean + draws @ root.T)


def in_view(camera: PinholeCamera, points: FloatArray) -> BoolArray:
    """Tell which points (m, 3) fall into a camera's image."""
    pixels, depths = camera.project(points)
    width, height = camera.resolution_px
    return np.asarray(
        (depths > 0)
        & (pixels[:, 0] > -0.5)
        & (pixels[:, 0] < width - 0.5)
        & (pixels[:, 1] > -0.5)
        & (pixels[:, 1] < height - 0.5),
        dtype=np.bool_,
    )


def takes_part(
    camera: PinholeCamera, proposal: Proposal, state: StatePayload, params: MultiviewParams, site: Site
) -> bool:
    """Tell whether a camera is asked at this step.

    By the whole cloud of the predicted particles: after a wrong estimate cameras
    beside the mean, which could correct it, are still asked. Or by the predicted
    point, as printed. Not where the target would be too small to be of use
    (Kushwaha & Koutsoukos 2013, Sec. 6.2.2). Camera and base station come to the
    same answer without a message.
    """
    rule = params.participation
    if isinstance(rule, PointParticipation):
        within = bool(in_view(camera, proposal.mean[None])[0])
    else:
        within = float(np.mean(in_view(camera, proposal.particles))) >= rule.share_min
    needs_outline = params.variant in IN_IMAGE
    if not within or (params.usable_px_min == 0.0 and not needs_outline):
        return within
    semi_axes = site.targets[state.target].semi_axes_m
    outline = ellipsoid_outlines(camera, proposal.mean[None], state.orientation, semi_axes)
    if needs_outline and not outline.visible[0]:
        return False
    # behind the camera or cut by its plane: the target is near, if it is there at all
    return not outline.visible[0] or pi / np.sqrt(np.linalg.det(outline.shapes[0])) >= params.usable_px_min


def participants(
    site: Site, proposal: Proposal, state: StatePayload, params: MultiviewParams
) -> tuple[NodeId, ...]:
    """Return the cameras that are asked at this step."""
    return tuple(
        node for node, camera in site.cameras.items() if takes_part(camera, proposal, state, params, site)
    )
