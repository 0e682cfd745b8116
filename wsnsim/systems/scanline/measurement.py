"""What a camera says of a point on the floor plan, and how far it errs (Ercan et al. 2007, Eqs. 1, 2).

The paper's angle θ points from the scene to the camera; here a camera's heading is the direction in which
it looks, θ + π, so that h is positive on its left and d positive before it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import cos, isfinite, pi, sin, tan

import numpy as np

from wsnsim.kernels.jit import frozen
from wsnsim.types import BoolArray, FloatArray


@dataclass(frozen=True)
class ScanCamera:
    """A camera that sees one line of pixels.

    Parameters
    ----------
    position : (x, y) [m]
    heading_rad : direction in which it looks, from x towards y [rad]
    focal_px : focal length f [px]
    fov_rad : whole horizontal field of view, above 0 and below π [rad]

    Raises
    ------
    ValueError : a value that is not finite, a focal length not above 0, or a field of view outside (0, π)
    """

    position: tuple[float, float]
    heading_rad: float
    focal_px: float
    fov_rad: float

    def __post_init__(self) -> None:
        if not all(map(isfinite, (*self.position, self.heading_rad))):
            raise ValueError(
                f"position, heading_rad: must be finite, got {self.position}, {self.heading_rad}"
            )
        if not (isfinite(self.focal_px) and self.focal_px > 0.0):
            raise ValueError(f"focal_px: must be above 0, got {self.focal_px} [px]")
        if not 0.0 < self.fov_rad < pi:
            raise ValueError(f"fov_rad: must be above 0 and below π, got {self.fov_rad} [rad]")

    @property
    def half_width_px(self) -> float:
        """Where the scan line ends on either side [px]."""
        return self.focal_px * tan(0.5 * self.fov_rad)


@dataclass(frozen=True)
class MeasurementNoise:
    """Standard deviations of the independent errors of Eq. 2, the paper's by default.

    Parameters
    ----------
    position_sd_m : of the camera's position on each axis, σ_pos [m]
    angle_sd_rad : of its heading, σ_θ [rad]
    read_sd_px : of the read-out, σ_read [px]

    Raises
    ------
    ValueError : a deviation below 0 or not finite, or all of them 0
    """

    position_sd_m: float = 1.0
    angle_sd_rad: float = 0.01
    read_sd_px: float = 2.0

    def __post_init__(self) -> None:
        deviations = (self.position_sd_m, self.angle_sd_rad, self.read_sd_px)
        if not all(isfinite(sd) and sd >= 0.0 for sd in deviations) or not any(deviations):
            raise ValueError(f"noise: must be finite, at least 0 and somewhere above, got {deviations}")


@dataclass(frozen=True, eq=False)
class Report:
    """What the cluster head has heard of one frame.

    Parameters
    ----------
    values_px : (n,) - z of each camera, NaN from one that does not see the object [px]
    heard : (n,) - False where no report came in time: such a camera says nothing, not even NaN
    """

    values_px: FloatArray
    heard: BoolArray

    @cached_property
    def seeing(self) -> int:
        """Cameras that see the object, as a bit mask."""
        return _mask(self.heard & ~np.isnan(self.values_px))

    @cached_property
    def blind(self) -> int:
        """Cameras that report that they do not see it, as a bit mask."""
        return _mask(self.heard & np.isnan(self.values_px))


def report(values_px: FloatArray) -> Report:
    """Return a report (n,) in which every camera was heard."""
    return Report(values_px, np.ones(len(values_px), np.bool_))


def camera_rows(cameras: Sequence[ScanCamera]) -> FloatArray:
    """Return cameras as rows (n, 6) for the kernels: x, y, cos ψ, sin ψ, f, tan(fov / 2)."""
    rows = [
        (*c.position, cos(c.heading_rad), sin(c.heading_rad), c.focal_px, tan(0.5 * c.fov_rad))
        for c in cameras
    ]
    return frozen(np.array(rows, dtype=np.float64).reshape(-1, 6), np.float64)


def camera_frame(camera: ScanCamera, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return h and d of points (..., 2): left of the optical axis, and along it, each (...) [m] (Fig. 3)."""
    c, s = cos(camera.heading_rad), sin(camera.heading_rad)
    dx, dy = points[..., 0] - camera.position[0], points[..., 1] - camera.position[1]
    return c * dy - s * dx, c * dx + s * dy


def project(camera: ScanCamera, points: FloatArray) -> FloatArray:
    """Return f h / d of points (..., 2) before the camera, (...) [px] (Eq. 1); NaN for others."""
    h, d = camera_frame(camera, points)
    return np.asarray(camera.focal_px * h / np.where(d > 0.0, d, np.nan), dtype=np.float64)


def gradient(camera: ScanCamera, points: FloatArray) -> FloatArray:
    """Return ∂(f h / d) / ∂x of points (..., 2) before the camera, (..., 2) [px/m] (Appendix A)."""
    h, d = camera_frame(camera, points)
    c, s = cos(camera.heading_rad), sin(camera.heading_rad)
    return camera.focal_px * np.stack([-s * d - c * h, c * d - s * h], axis=-1) / (d * d)[..., np.newaxis]


def variance(camera: ScanCamera, points: FloatArray, noise: MeasurementNoise) -> FloatArray:
    """Return the variance of z of points (..., 2) before the camera, (...) [px²] (Eq. 2).

    First-order in the errors of the pose. It depends on the point, so that the cameras' errors are not
    identically distributed, against what the paper says below the equation.
    """
    h, d = camera_frame(camera, points)
    return slope_variance(camera, h / d, d, noise)


def slope_variance(
    camera: ScanCamera, slopes: FloatArray, depths: FloatArray, noise: MeasurementNoise
) -> FloatArray:
    """Return Eq. 2 of points with slopes h / d (...) at depths d (...), above 0 [m], (...) [px²]."""
    stretch = 1.0 + slopes * slopes
    pose = stretch * (stretch * noise.angle_sd_rad**2 + (noise.position_sd_m / depths) ** 2)
    return np.asarray(camera.focal_px**2 * pose + noise.read_sd_px**2, dtype=np.float64)


def displaced(camera: ScanCamera, noise: MeasurementNoise, generator: np.random.Generator) -> ScanCamera:
    """Return the camera where it really stands, if the given pose is wrong by one draw of the noise.

    A pose error is physically a constant bias: draw it once and read with `measure(..., white_pose=False)`.
    The paper takes it as white: draw nothing and read the camera as it is.
    """
    x, y = np.asarray(camera.position) + generator.normal(0.0, noise.position_sd_m, 2)
    turn = generator.normal(0.0, noise.angle_sd_rad)
    return replace(camera, position=(float(x), float(y)), heading_rad=camera.heading_rad + float(turn))


def measure(
    camera: ScanCamera,
    points: FloatArray,
    noise: MeasurementNoise,
    generator: np.random.Generator,
    *,
    white_pose: bool = True,
) -> FloatArray:
    """Return noisy z of points (..., 2) that the camera sees, (...) [px] (Eqs. 1, 2).

    Parameters
    ----------
    camera : the believed pose for white pose errors, the real one (`displaced`) for a bias
    points : before the camera [m]
    noise : standard deviations
    generator : source of randomness; one normal draw for each point
    white_pose : draw the pose's errors anew for each point, as printed; else the read-out's noise only
    """
    draws = generator.standard_normal(points.shape[:-1])
    sd = np.sqrt(variance(camera, points, noise)) if white_pose else noise.read_sd_px
    return project(camera, points) + sd * draws


def _mask(chosen: BoolArray) -> int:
    return sum(1 << int(k) for k in np.flatnonzero(chosen))
