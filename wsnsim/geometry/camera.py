"""Pinhole cameras without lens distortion.

Camera axes: x right, y down, z forward. The world's z is up. Pixel centres have
integer coordinates, so that an image of width w spans -0.5 to w - 0.5.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from wsnsim.types import FloatArray

_UP = np.array([0.0, 0.0, 1.0])
_EAST = np.array([1.0, 0.0, 0.0])


@dataclass(frozen=True, eq=False)
class PinholeCamera:
    """A calibrated camera at a place.

    Parameters
    ----------
    focal_px : focal length, the same in both directions [px]
    resolution_px : (width, height) of the image [px]
    rotation : (3, 3) - world axes to camera axes
    position : (3,) - centre of projection [m]

    Raises
    ------
    ValueError : the focal length or the resolution is not positive
    """

    focal_px: float
    resolution_px: tuple[int, int]
    rotation: FloatArray
    position: FloatArray

    def __post_init__(self) -> None:
        if not (np.isfinite(self.focal_px) and self.focal_px > 0.0):
            raise ValueError(f"focal_px: must be above 0, got {self.focal_px} [px]")
        if min(self.resolution_px) < 1:
            raise ValueError(f"resolution_px: must be at least 1 x 1, got {self.resolution_px} [px]")

    @classmethod
    def look_at(
        cls, position: ArrayLike, target: ArrayLike, focal_px: float, resolution_px: tuple[int, int]
    ) -> Self:
        """Return a camera whose optical axis passes through `target`, with the horizon level.

        A camera that looks straight down (or up) has the world's x to its right.

        Parameters
        ----------
        position, target : (3,) - [m]
        focal_px : focal length [px]
        resolution_px : (width, height) [px]

        Raises
        ------
        ValueError : the two points coincide
        """
        place = np.array(position, dtype=np.float64)
        forward = np.asarray(target, dtype=np.float64) - place
        distance = float(np.linalg.norm(forward))
        if not (np.isfinite(distance) and distance > 0.0):
            raise ValueError(
                f"look_at: must differ from the camera's position, got {place.tolist()} [m] twice"
            )
        forward = forward / distance
        right = np.cross(forward, _UP)
        sine = float(np.linalg.norm(right))
        # Below this the direction of `right` is rounding error.
        right = right / sine if sine > 1e-9 else _EAST
        return cls(focal_px, resolution_px, np.stack((right, np.cross(forward, right), forward)), place)

    @property
    def principal_point(self) -> tuple[float, float]:
        """Where the optical axis meets the image: its middle (x, y) [px]."""
        width, height = self.resolution_px
        return 0.5 * (width - 1), 0.5 * (height - 1)

    @property
    def intrinsics(self) -> FloatArray:
        """(3, 3) calibration matrix K [px]."""
        x, y = self.principal_point
        return np.array([[self.focal_px, 0.0, x], [0.0, self.focal_px, y], [0.0, 0.0, 1.0]])

    @property
    def matrix(self) -> FloatArray:
        """(3, 4) camera matrix P = K [R | -R c].

        References
        ----------
        Hartley, Zisserman (2004), Multiple View Geometry, eq. 6.8.
        """
        translation = -self.rotation @ self.position
        return self.intrinsics @ np.column_stack((self.rotation, translation))

    def to_camera_axes(self, points: FloatArray) -> FloatArray:
        """Return points (n, 3) of the world [m] in camera axes (n, 3) [m]."""
        return (points - self.position) @ self.rotation.T

    def project(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Project points of the world into the image.

        Parameters
        ----------
        points : (n, 3) - [m]

        Returns
        -------
        pixels : (n, 2) - (x, y) [px], NaN where the depth is not above 0
        depths : (n,) - along the optical axis [m]
        """
        seen = self.to_camera_axes(points)
        depths = seen[:, 2]
        in_front = np.where(depths > 0.0, depths, np.nan)
        pixels = self.focal_px * seen[:, :2] / in_front[:, None] + np.array(self.principal_point)
        return pixels, depths
