"""Orientations from directions, and averages of orientations.

Matrices turn body axes into world axes; quaternions are (w, x, y, z).
"""

import numpy as np

from wsnsim.geometry.rotations import normalise
from wsnsim.types import FloatArray


def wahba(observed: FloatArray, reference: FloatArray, weights: FloatArray) -> FloatArray:
    """Return the rotation that best turns reference directions into observed ones.

    Minimises Σ w_n |observed_n − R reference_n|²; two directions that are not
    parallel decide it.

    Parameters
    ----------
    observed : (n, 3) unit vectors in world axes
    reference : (n, 3) unit vectors in body axes
    weights : (n,) at least 0

    Returns
    -------
    (3, 3) rotation matrix

    References
    ----------
    Wahba (1965), SIAM Review 7(3), problem 65-1; Markley (1988), J. Astronaut. Sci. 36(3), eqs. 11-15.
    """
    profile = (weights[:, None] * observed).T @ reference
    left, _, right = np.linalg.svd(profile)
    handedness = np.diag([1.0, 1.0, float(np.linalg.det(left) * np.linalg.det(right))])
    return np.asarray(left @ handedness @ right, dtype=np.float64)


def mean_quaternion(quaternions: FloatArray, weights: FloatArray) -> FloatArray:
    """Return the normalised weighted sum of quaternions (n, 4), their signs aligned with the first.

    Close to the mean rotation where all are close together.

    Raises
    ------
    ValueError : the sum is zero

    References
    ----------
    Kushwaha & Koutsoukos (2013), eq. 20; Markley et al. (2007), J. Guid. Control Dyn. 30(4), on the signs.
    """
    signs = np.where(quaternions @ quaternions[0] < 0.0, -1.0, 1.0)
    return normalise((weights * signs) @ quaternions)


def towards(start: FloatArray, end: FloatArray, share: float) -> FloatArray:
    """Return the quaternion (4,) a share of the way from `start` to `end`, by the shorter way.

    The normalised form of share · end + (1 − share) · start (Kushwaha & Koutsoukos 2013, Sec. 4.1.4).
    """
    sign = -1.0 if float(start @ end) < 0.0 else 1.0
    return normalise(share * sign * end + (1.0 - share) * start)


def angle_between(first: FloatArray, second: FloatArray) -> float:
    """Return the angle of the rotation from one unit quaternion (4,) to another [rad], 0 to π."""
    return 2.0 * float(np.arccos(min(1.0, abs(float(first @ second)))))


def minimal_rotation(start: FloatArray, end: FloatArray) -> FloatArray:
    """Return the quaternion of the smallest rotation that turns unit vector `start` into `end`.

    Opposite vectors have no such rotation; any half turn stands in.
    """
    cosine = float(start @ end)
    if cosine < -1.0 + 1e-12:
        aside = np.eye(3)[int(np.argmin(np.abs(start)))]
        axis = np.cross(start, aside)
        return normalise(np.concatenate([[0.0], axis]))
    return normalise(np.concatenate([[1.0 + cosine], np.cross(start, end)]))
