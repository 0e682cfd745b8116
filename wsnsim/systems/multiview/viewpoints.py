"""The 26 directions from which the reference model has seen the target.

Roughly equidistant (Kushwaha & Koutsoukos 2013, Sec. 6.2.2 name the number):
the faces, edges and corners of a cube.
"""

from itertools import product

import numpy as np

from wsnsim.types import FloatArray


def viewpoints() -> FloatArray:
    """Return the directions (26, 3), unit vectors from the target's centre in its own axes."""
    cube = np.array([v for v in product((-1.0, 0.0, 1.0), repeat=3) if any(v)])
    return np.asarray(cube / np.linalg.norm(cube, axis=1, keepdims=True), dtype=np.float64)


def nearest_viewpoint(directions: FloatArray, towards_camera: FloatArray, rotation: FloatArray) -> int:
    """Return the index of the viewpoint that faces a camera best (Eq. 12).

    Parameters
    ----------
    directions : (n, 3) viewpoints in the target's axes
    towards_camera : (3,) from the target to the camera, in world axes (Eq. 14)
    rotation : (3, 3) target to world axes
    """
    return int(np.argmax(directions @ (rotation.T @ towards_camera)))
