"""The target's orientation: from where each camera sees it, and what they say together.

Kushwaha & Koutsoukos 2013, Sec. 4.1.4. A camera compares what it sees with the
reference model's viewpoints and finds the direction ê in the target's axes from which
it looks. As printed, the camera makes a quaternion of it by the smallest rotation of
−ê onto its optical axis, and the base station averages the quaternions; the smallest
rotation is not the target's, whose turn about the axis no single camera can tell.
Wahba's problem on the directions and the viewing rays leaves that to the other
cameras, and where there is one camera only, to the orientation before.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np

from wsnsim.estimation.attitude import angle_between, mean_quaternion, minimal_rotation, towards, wahba
from wsnsim.geometry.camera import PinholeCamera
from wsnsim.geometry.rotations import (
    conjugate,
    matrix_to_quaternion,
    normalise,
    quaternion_from_axis_angle,
    quaternion_multiply,
    quaternion_to_matrix,
    rotation_vector,
)
from wsnsim.systems.multiview.rules import AverageOrientation, InitialOrientation, Orientation
from wsnsim.types import FloatArray, NodeId, Seconds

_PRIOR_SHARE = 0.05
"""Weight of the orientation before in Wahba's problem: it decides what the directions leave open."""

_SHORTEST = 1e-6


def facing_numbers(rule: Orientation) -> int:
    """Return of how many numbers `facing` is."""
    if isinstance(rule, InitialOrientation):
        return 0
    return 4 if isinstance(rule, AverageOrientation) else 3


def _mean_direction(weights: FloatArray, viewpoints: FloatArray) -> FloatArray:
    """Return the weighted mean (3,) of unit vectors: as long as it is sure, 1 for one viewpoint only."""
    return np.asarray(weights @ viewpoints / weights.sum(), dtype=np.float64)


def facing(
    similarities: FloatArray,
    viewpoints: FloatArray,
    camera: PinholeCamera,
    expected: FloatArray,
    rule: Orientation,
) -> FloatArray:
    """Return what a camera sends of the orientation: a direction (3,), a quaternion (4,) or nothing (0,).

    Parameters
    ----------
    similarities : (n,) of the candidate histogram to each viewpoint's
    viewpoints : (n, 3) unit vectors in the target's axes
    expected : (3,) unit vector from which the camera would see the target, did it stand as predicted
    """
    if isinstance(rule, InitialOrientation):
        return np.empty(0)
    if not isinstance(rule, AverageOrientation):
        weights = rule.sharpness * similarities + rule.prior_sharpness * (viewpoints @ expected)
        return _mean_direction(np.exp(weights - weights.max()), viewpoints)
    mean = _mean_direction(similarities, viewpoints)
    length = float(np.linalg.norm(mean))
    if length < _SHORTEST:
        return np.empty(0)
    return minimal_rotation(-mean / length, camera.rotation[2])


@dataclass(frozen=True, eq=False)
class Attitude:
    """How a target stands and turns.

    Parameters
    ----------
    orientation : (4,) unit quaternion
    rate : (3,) angular velocity in world axes [rad/s]
    """

    orientation: FloatArray
    rate: FloatArray = field(default_factory=lambda: np.zeros(3))

    def after(self, dt: Seconds) -> Self:
        """Return the attitude `dt` later, at the same rate."""
        angle = float(np.linalg.norm(self.rate)) * dt
        if angle == 0.0:
            return self
        turn = quaternion_from_axis_angle(self.rate, angle)
        return replace(self, orientation=normalise(quaternion_multiply(turn, self.orientation)))


def corrected(
    predicted: Attitude,
    reports: Mapping[NodeId, FloatArray],
    cameras: Mapping[NodeId, PinholeCamera],
    position: FloatArray,
    rule: Orientation,
    dt: Seconds,
) -> Attitude:
    """Return the attitude after a step.

    The orientation goes a share α of the way to the measured one, and the rate a
    share β of what that says of it: the α-β filter.

    Parameters
    ----------
    reports : what `facing` gave at each camera; one of another rule says nothing
    cameras : at least those
    position : (3,) of the target [m]
    dt : between steps [s]

    References
    ----------
    Kushwaha & Koutsoukos (2013), Sec. 4.1.4, on α; Bar-Shalom, Li, Kirubarajan (2001), sec. 6.5.1, on β.
    """
    numbers = facing_numbers(rule)
    said = {
        node: report
        for node, report in reports.items()
        if report.size == numbers and np.linalg.norm(report) > _SHORTEST
    }
    if isinstance(rule, InitialOrientation) or not said:
        return predicted
    limit, before = np.radians(rule.outlier_deg), predicted.orientation
    if isinstance(rule, AverageOrientation):
        measured = _average(np.array([normalise(report) for report in said.values()]), limit)
        return Attitude(towards(before, measured, rule.update))
    rays = np.array([cameras[node].position - position for node in said])
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    found = _least_squares(rays, np.array(list(said.values())), before, limit)
    if found is None:
        return predicted
    turn = rotation_vector(quaternion_multiply(found, conjugate(before)))
    return Attitude(towards(before, found, rule.update), predicted.rate + rule.rate_update / dt * turn)


def _average(quaternions: FloatArray, limit: float) -> FloatArray:
    """Return the mean quaternion of all but those that lie farther than `limit` [rad] from it."""
    mean = mean_quaternion(quaternions, np.ones(len(quaternions)))
    near = np.array([angle_between(quaternion, mean) <= limit for quaternion in quaternions])
    if near.all() or not near.any():
        return mean
    return mean_quaternion(quaternions[near], np.ones(int(near.sum())))


def _least_squares(
    rays: FloatArray, reported: FloatArray, before: FloatArray, limit: float
) -> FloatArray | None:
    """Return the quaternion by Wahba's problem, the worst direction left out until none is an outlier.

    The fused orientation always agrees with a single direction: that one is held
    against the orientation before.

    Parameters
    ----------
    rays : (n, 3) unit vectors from the target to the cameras
    reported : (n, 3) the same in the target's axes, as long as they are sure
    before : (4,) the orientation before
    limit : angle above which a direction is an outlier [rad]

    Returns
    -------
    (4,), or None where no direction is left
    """
    rotation = quaternion_to_matrix(before)
    lengths = np.linalg.norm(reported, axis=1)
    kept = np.arange(len(rays))
    while kept.size:
        directions = reported[kept] / lengths[kept, None]
        share = _PRIOR_SHARE * lengths[kept].sum()
        found = wahba(
            np.vstack([rays[kept], rotation.T]),
            np.vstack([directions, np.eye(3)]),
            np.concatenate([lengths[kept], np.full(3, share / 3.0)]),
        )
        judge = found if kept.size > 1 else rotation
        cosines = np.einsum("ij,ij->i", rays[kept], directions @ judge.T)
        worst = int(np.argmin(cosines))
        if np.arccos(np.clip(cosines[worst], -1.0, 1.0)) <= limit:
            return matrix_to_quaternion(found)
        kept = np.delete(kept, worst)
    return None
