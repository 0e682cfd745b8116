"""Unit quaternions (w, x, y, z) and the rotation matrices they stand for.

A quaternion turns body axes into world axes: `quaternion_to_matrix(q) @ v` is the
body vector `v` in the world. `q` and `-q` are the same rotation.
"""

import numpy as np
from numpy.typing import ArrayLike

from wsnsim.types import FloatArray

IDENTITY: FloatArray = np.array([1.0, 0.0, 0.0, 0.0])
"""The rotation that changes nothing."""
IDENTITY.flags.writeable = False


def normalise(quaternion: ArrayLike) -> FloatArray:
    """Scale a quaternion (4,) to unit length.

    Raises
    ------
    ValueError : it is not four finite numbers, or its length is 0
    """
    q = np.asarray(quaternion, dtype=np.float64)
    length = float(np.linalg.norm(q)) if q.shape == (4,) else np.nan
    if not (np.isfinite(length) and length > 0.0):
        raise ValueError(f"quaternion: must be four finite numbers (w, x, y, z), not all 0, got {q.tolist()}")
    return q / length


def quaternion_to_matrix(quaternion: FloatArray) -> FloatArray:
    """Return the rotation matrix of a unit quaternion.

    Parameters
    ----------
    quaternion : (4,) - unit quaternion (w, x, y, z)

    Returns
    -------
    (3, 3) - body axes to world axes

    References
    ----------
    Kuipers (1999), Quaternions and Rotation Sequences, eq. 7.7.
    """
    w, x, y, z = (float(part) for part in quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def quaternion_multiply(left: FloatArray, right: FloatArray) -> FloatArray:
    """Return the rotation `right` followed by `left`; all (4,), (w, x, y, z)."""
    a, b, c, d = (float(part) for part in left)
    w, x, y, z = (float(part) for part in right)
    return np.array(
        [
            a * w - b * x - c * y - d * z,
            a * x + b * w + c * z - d * y,
            a * y - b * z + c * w + d * x,
            a * z + b * y - c * x + d * w,
        ]
    )


def quaternion_from_axis_angle(axis: ArrayLike, angle_rad: float) -> FloatArray:
    """Return the unit quaternion of a right-handed turn about an axis.

    Parameters
    ----------
    axis : (3,) - direction, of any length but 0
    angle_rad : turn [rad]

    Raises
    ------
    ValueError : the axis is not three finite numbers, or its length is 0
    """
    direction = np.asarray(axis, dtype=np.float64)
    length = float(np.linalg.norm(direction)) if direction.shape == (3,) else np.nan
    if not (np.isfinite(length) and length > 0.0):
        raise ValueError(f"axis: must be three finite numbers, not all 0, got {direction.tolist()}")
    half = 0.5 * angle_rad
    return np.concatenate(([np.cos(half)], np.sin(half) / length * direction))


def matrix_to_quaternion(matrix: FloatArray) -> FloatArray:
    """Return the unit quaternion (w, x, y, z) of a rotation matrix (3, 3), the one with w at least 0.

    References
    ----------
    Shepperd (1978), J. Guidance and Control 1(3): the largest of four forms, so that no digits cancel.
    """
    m = matrix
    trace = float(np.trace(m))
    rows = np.array(
        [
            [1 + trace, m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]],
            [m[2, 1] - m[1, 2], 1 + 2 * m[0, 0] - trace, m[0, 1] + m[1, 0], m[0, 2] + m[2, 0]],
            [m[0, 2] - m[2, 0], m[0, 1] + m[1, 0], 1 + 2 * m[1, 1] - trace, m[1, 2] + m[2, 1]],
            [m[1, 0] - m[0, 1], m[0, 2] + m[2, 0], m[1, 2] + m[2, 1], 1 + 2 * m[2, 2] - trace],
        ]
    )
    largest = rows[int(np.argmax(np.diag(rows)))]
    return normalise(-largest if largest[0] < 0.0 else largest)


def conjugate(quaternion: FloatArray) -> FloatArray:
    """Return the inverse of a rotation, (4,) to (4,)."""
    return np.asarray(quaternion * np.array([1.0, -1.0, -1.0, -1.0]), dtype=np.float64)


def rotation_vector(quaternion: FloatArray) -> FloatArray:
    """Return axis times angle (3,) [rad] of a unit quaternion, the angle at most π."""
    q = -quaternion if quaternion[0] < 0.0 else quaternion
    sine = float(np.linalg.norm(q[1:]))
    if sine == 0.0:
        return np.zeros(3)
    return np.asarray(2.0 * np.arctan2(sine, float(q[0])) / sine * q[1:], dtype=np.float64)
