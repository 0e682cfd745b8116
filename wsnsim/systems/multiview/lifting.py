"""Particles of one image as points in space (T3)."""

import numpy as np

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.hardware.work import Work
from wsnsim.systems.multiview.image_proposal import ImageProposal
from wsnsim.systems.multiview.proposal import Proposal
from wsnsim.types import FloatArray

_LIFT_FLOATS = 40.0  # one particle: its ray, its depth, three coordinates
_NEAREST = 0.05
"""Least depth of a particle, as a share of the prediction's: behind the camera is nothing."""


def lifted(cloud: ImageProposal, camera: PinholeCamera, proposal: Proposal) -> tuple[FloatArray, Work]:
    """Return points (m, 3) [m] on the particles' rays, their depths from the prediction given the pixel.

    Depth and pixel are jointly normal where the projection is linear about the
    prediction; the ray itself is exact. Particles that spread as the prediction does
    become points that do.
    """
    prediction = cloud.prediction
    depth = camera.rotation[2] @ proposal.cov
    projected = prediction.jacobian @ proposal.cov @ prediction.jacobian.T
    gain = np.linalg.solve(projected, prediction.jacobian @ depth)
    variance = depth @ camera.rotation[2] - gain @ projected @ gain
    mean_depth = float(camera.to_camera_axes(proposal.mean[None])[0, 2])
    depths = mean_depth + (cloud.particles - prediction.mean) @ gain
    depths += np.sqrt(max(variance, 0.0)) * cloud.draws[:, 2]
    depths = np.maximum(depths, _NEAREST * mean_depth)
    rays = camera.rays(cloud.particles - prediction.offset)
    places = camera.position + (depths[:, None] * rays) @ camera.rotation
    # no ray comes out of a strongly distorting lens there: the prediction stands in
    places = np.where(np.isfinite(places), places, proposal.mean)
    return places, Work(float_ops=_LIFT_FLOATS * len(places))
