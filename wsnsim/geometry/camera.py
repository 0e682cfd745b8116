"""Pinhole cameras, with the radial distortion of their lens.

Camera axes: x right, y down, z forward. The world's z is up. Pixel centres have
integer coordinates, so that an image of width w spans -0.5 to w - 0.5. The optical
axis meets the image in its middle; pixels are square.
"""

import math
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from wsnsim.geometry.lens import (
    NONE,
    Distortion,
    distort,
    distortion_jacobians,
    farthest_image,
    undistort,
)
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
    distortion : coefficients (k1, k2) of the lens, see `geometry.lens` [-]

    Raises
    ------
    ValueError : the focal length or the resolution is not positive, or the lens sends no ray
        to the corners of the image
    """

    focal_px: float
    resolution_px: tuple[int, int]
    rotation: FloatArray
    position: FloatArray
    distortion: Distortion = NONE

    def __post_init__(self) -> None:
        if not (np.isfinite(self.focal_px) and self.focal_px > 0.0):
            raise ValueError(f"focal_px: must be above 0, got {self.focal_px} [px]")
        if min(self.resolution_px) < 1:
            raise ValueError(f"resolution_px: must be at least 1 x 1, got {self.resolution_px} [px]")
        if not all(math.isfinite(k) for k in self.distortion):
            raise ValueError(f"distortion: must be two finite numbers, got {list(self.distortion)}")
        corner, reach = 0.5 * math.hypot(*self.resolution_px) / self.focal_px, farthest_image(self.distortion)
        if corner >= reach:
            raise ValueError(
                f"distortion: a ray must reach the corners of the image, {corner:.3g} focal lengths from "
                f"its middle, got {list(self.distortion)}, with which none gets beyond {reach:.3g}; "
                "take weaker coefficients or a longer focal length"
            )

    @classmethod
    def look_at(
        cls,
        position: ArrayLike,
        target: ArrayLike,
        focal_px: float,
        resolution_px: tuple[int, int],
        distortion: Distortion = NONE,
    ) -> Self:
        """Return a camera whose optical axis passes through `target`, with the horizon level.

        A camera that looks straight down (or up) has the world's x to its right.

        Parameters
        ----------
        position, target : (3,) - [m]
        focal_px : focal length [px]
        resolution_px : (width, height) [px]
        distortion : coefficients (k1, k2) of the lens [-]

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
        rotation = np.stack((right, np.cross(forward, right), forward))
        return cls(focal_px, resolution_px, rotation, place, distortion)

    @classmethod
    def at_angles(
        cls,
        position: ArrayLike,
        yaw_rad: float,
        pitch_rad: float,
        roll_rad: float,
        focal_px: float,
        resolution_px: tuple[int, int],
        distortion: Distortion = NONE,
    ) -> Self:
        """Return a camera turned by three angles, in this order.

        Parameters
        ----------
        position : (3,) - [m]
        yaw_rad : of the optical axis about the world's z, anticlockwise from x as seen from above [rad]
        pitch_rad : of the optical axis above the horizontal plane [rad]
        roll_rad : of the camera about its optical axis, clockwise as seen from behind it, so that the
            image turns anticlockwise; 0 has the horizon level [rad]
        focal_px : focal length [px]
        resolution_px : (width, height) [px]
        distortion : coefficients (k1, k2) of the lens [-]
        """
        ahead = np.array([math.cos(yaw_rad), math.sin(yaw_rad), 0.0])
        forward = math.cos(pitch_rad) * ahead + math.sin(pitch_rad) * _UP
        level = np.array([math.sin(yaw_rad), -math.cos(yaw_rad), 0.0])
        below = np.cross(forward, level)
        right = math.cos(roll_rad) * level + math.sin(roll_rad) * below
        down = math.cos(roll_rad) * below - math.sin(roll_rad) * level
        place = np.array(position, dtype=np.float64)
        return cls(focal_px, resolution_px, np.stack((right, down, forward)), place, distortion)

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
        """(3, 4) camera matrix P = K [R | -R c], of the camera without its lens's distortion.

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
        pixels : (n, 2) - (x, y) [px], NaN where the depth is not above 0 or the ray is
            so steep that the lens's polynomial has stopped growing
        depths : (n,) - along the optical axis [m]
        """
        seen = self.to_camera_axes(points)
        depths = seen[:, 2]
        in_front = np.where(depths > 0.0, depths, np.nan)
        if self.distortion == NONE:
            pixels = self.focal_px * seen[:, :2] / in_front[:, None] + np.array(self.principal_point)
        else:
            pixels = self.focal_px * distort(seen[:, :2] / in_front[:, None], self.distortion)
            pixels += np.array(self.principal_point)
        return pixels, depths

    def jacobians(self, points: FloatArray) -> FloatArray:
        """Return the derivatives (n, 2, 3) of pixels by points (n, 3) [px/m]; NaN behind the camera."""
        seen = self.to_camera_axes(points)
        depths = np.where(seen[:, 2] > 0.0, seen[:, 2], np.nan)
        flat = seen[:, :2] / depths[:, None]
        bends = np.zeros((len(points), 2, 3))
        bends[:, 0, 0] = bends[:, 1, 1] = 1.0
        bends[:, :, 2] = -flat
        bends *= (self.focal_px / depths)[:, None, None]
        if self.distortion != NONE:
            bends = distortion_jacobians(flat, self.distortion) @ bends
        return np.asarray(bends @ self.rotation, dtype=np.float64)

    def rays(self, pixels: FloatArray) -> FloatArray:
        """Return the rays that meet the image at `pixels`: the inverse of `project`.

        Parameters
        ----------
        pixels : (n, 2) - (x, y), also outside the image [px]

        Returns
        -------
        (n, 3) - (x, y, 1) in camera axes; x and y NaN where no ray comes out of the lens
        """
        flat = (pixels - np.array(self.principal_point)) / self.focal_px
        if self.distortion != NONE:
            flat = undistort(flat, self.distortion)
        return np.column_stack((flat, np.ones(len(flat))))
