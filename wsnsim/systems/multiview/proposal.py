"""The synchronised particles, and which cameras they ask (Kushwaha & Koutsoukos 2013, Algorithm 1, line 4).

Every node draws the same particles from the same state: the stream is named by
target and step, so that a node that missed a step is in time again at once.
"""

from dataclasses import dataclass

import numpy as np

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.messages.state import StatePayload
from wsnsim.systems.base import Site
from wsnsim.systems.multiview.params import MultiviewParams, PointParticipation
from wsnsim.types import BoolArray, FloatArray, NodeId


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


def propose(state: StatePayload, params: MultiviewParams, site: Site) -> Proposal:
    """Draw the particles of a step about the constant-velocity prediction x̂ + v̂ dt."""
    mean = state.position + state.velocity / site.rate_hz
    draws = site.streams.stream("particles", state.target, state.step).standard_normal((params.particles, 3))
    return Proposal(mean, params.particle_sd_m**2 * np.eye(3), mean + params.particle_sd_m * draws)


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


def takes_part(camera: PinholeCamera, proposal: Proposal, params: MultiviewParams) -> bool:
    """Tell whether a camera is asked at this step.

    By the whole cloud of the predicted particles: after a wrong estimate cameras
    beside the mean, which could correct it, are still asked. The cloud's spread
    is fixed, as the 80-byte state carries no covariance. Or by the predicted
    point, as printed. Camera and base station come to the same answer without a
    message.
    """
    rule = params.participation
    if isinstance(rule, PointParticipation):
        return bool(in_view(camera, proposal.mean[None])[0])
    return float(np.mean(in_view(camera, proposal.particles))) >= rule.share_min


def participants(site: Site, proposal: Proposal, params: MultiviewParams) -> tuple[NodeId, ...]:
    """Return the cameras that are asked at this step."""
    return tuple(node for node, camera in site.cameras.items() if takes_part(camera, proposal, params))
