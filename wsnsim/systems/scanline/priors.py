"""Where the occluders' normal priors come from (Ercan et al. 2007, Secs. 4.4 and 5).

A Kalman filter on virtual measurements y = x + v of each occluder; its RMSE is the paper's measure of how
good a prior is. Or nothing but the room: the stationary prior. Neither the filter's model nor its noise is
given in the paper: constant velocity under white acceleration, whose variance must fit how the occluders
really move, as a filter that is too sure of itself does more harm than a poor one.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from math import sqrt

import numpy as np

from wsnsim.types import FloatArray

TURN = np.array([[1.0, 1.0], [0.0, 1.0]])
"""F of (place, velocity) on one axis for a step of one time unit."""
INPUT = np.array([[0.25, 0.5], [0.5, 1.0]])
"""Q for an acceleration of variance 1, constant within the step (Bar-Shalom et al. 2001, eq. 6.3.2-4)."""
CONSISTENT_Q = 0.05
"""Acceleration variance that fits walkers of speed 1 and noise .33 [m²/step⁴]: NEES / 2 is .9 to 1.05 for
σ_v from 1 to 16. Much less is overconfident."""
PUBLISHED_Q = 1.2
"""With this one σ_v = 8 gives RMSE_occ 6.5, the paper's 6.67; too cautious, NEES / 2 is .8 [m²/step⁴]."""
_STEPS_TO_REST = 10_000
"""More than any Riccati recursion here takes to its fixed point."""


@dataclass(frozen=True, eq=False)
class OccluderTracks:
    """What the filters of all occluders believe; both axes and all occluders have one covariance.

    Parameters
    ----------
    places, velocities : (k, 2), (k, 2) - means [m], [m/step]
    cov : (2, 2) - of (place, velocity) on one axis
    """

    places: FloatArray
    velocities: FloatArray
    cov: FloatArray

    @property
    def covs(self) -> FloatArray:
        """The covariances (k, 2, 2) of the places [m²]."""
        return np.broadcast_to(self.cov[0, 0] * np.eye(2), (len(self.places), 2, 2))


@dataclass(frozen=True)
class VirtualSensor:
    """Virtual measurements of the occluders, and the Kalman filter on them.

    Parameters
    ----------
    sd_m : σ_v, of a measurement on each axis [m]
    acceleration_variance : q, on each axis, of the model [m²/step⁴]

    Raises
    ------
    ValueError : a parameter that is not above 0
    """

    sd_m: float
    acceleration_variance: float = CONSISTENT_Q

    def __post_init__(self) -> None:
        if not (self.sd_m > 0.0 and self.acceleration_variance > 0.0):
            raise ValueError(
                f"sd_m, acceleration_variance: must be above 0, got {self.sd_m}, {self.acceleration_variance}"
            )

    @cached_property
    def steady_cov(self) -> FloatArray:
        """The filter's covariance (2, 2) after many steps."""
        cov = np.diag([self.sd_m**2, 2.0 * self.acceleration_variance])
        for _ in range(_STEPS_TO_REST):
            after = self._updated(self._predicted(cov))[0]
            if np.allclose(after, cov, rtol=1e-12, atol=0.0):
                break
            cov = after
        return cov

    @property
    def rmse_m(self) -> float:
        """What the filter itself says of its error over both axes [m] (RMSE_occ)."""
        return sqrt(2.0 * float(self.steady_cov[0, 0]))

    def start(self, generator: np.random.Generator, places: FloatArray) -> OccluderTracks:
        """Return filters in their steady state that have measured occluders at places (k, 2) once."""
        root = np.linalg.cholesky(self.steady_cov)
        errors = generator.standard_normal((*places.shape, 2)) @ root.T
        return OccluderTracks(places + errors[..., 0], errors[..., 1], self.steady_cov)

    def step(
        self, generator: np.random.Generator, tracks: OccluderTracks, places: FloatArray
    ) -> OccluderTracks:
        """Predict, measure occluders at places (k, 2), update."""
        predicted = tracks.places + tracks.velocities
        cov, gain = self._updated(self._predicted(tracks.cov))
        surprise = places + generator.normal(0.0, self.sd_m, places.shape) - predicted
        return OccluderTracks(predicted + gain[0] * surprise, tracks.velocities + gain[1] * surprise, cov)

    def _predicted(self, cov: FloatArray) -> FloatArray:
        return np.asarray(TURN @ cov @ TURN.T + self.acceleration_variance * INPUT)

    def _updated(self, cov: FloatArray) -> tuple[FloatArray, FloatArray]:
        gain = cov[:, 0] / (cov[0, 0] + self.sd_m**2)
        keep = np.eye(2) - np.outer(gain, [1.0, 0.0])
        return keep @ cov @ keep.T + self.sd_m**2 * np.outer(gain, gain), gain


def sensor_for(rmse_m: float, acceleration_variance: float = CONSISTENT_Q) -> VirtualSensor:
    """Return the sensor whose filter says that its error is `rmse_m` [m] (both axes)."""
    low, high = 1e-3 * rmse_m, 1e3 * rmse_m
    sensor = VirtualSensor(sqrt(low * high), acceleration_variance)
    for _ in range(60):
        sensor = replace(sensor, sd_m=sqrt(low * high))
        low, high = (low, sensor.sd_m) if sensor.rmse_m > rmse_m else (sensor.sd_m, high)
    return sensor


def stationary(count: int, centre: FloatArray, sds_m: FloatArray | float) -> tuple[FloatArray, FloatArray]:
    """Return means (k, 2) and covariances (k, 2, 2) of occluders that are somewhere in the room.

    Without any sensor. It takes no account of how long an occlusion lasts: what hid the object from a
    camera in one step does so in the next.

    Parameters
    ----------
    count : k, how many occluders there are
    centre : (2,) - of the room [m]
    sds_m : RMSE_max of the paper on each axis (2,), or on both [m]
    """
    means = np.broadcast_to(centre, (count, 2)).astype(np.float64)
    return means, np.broadcast_to(sds_m**2 * np.eye(2), (count, 2, 2)).astype(np.float64)
