"""Kalman filters of many occluders at the cluster head, some of whose measurements may be missing.

The model is that of `priors.VirtualSensor`: constant velocity under white acceleration, a step a frame.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np

from wsnsim.systems.scanline.priors import INPUT, TURN
from wsnsim.types import BoolArray, FloatArray


@dataclass(frozen=True, eq=False)
class OccluderBeliefs:
    """What the filters believe; both axes of an occluder have one covariance.

    Parameters
    ----------
    means : (k, 2, 2) - (place, velocity) by axis [m], [m/step]
    covs : (k, 2, 2) - of (place, velocity) on one axis
    known : (k,) - who was measured at least once
    """

    means: FloatArray
    covs: FloatArray
    known: BoolArray

    @classmethod
    def unknown(cls, count: int) -> Self:
        """Return the beliefs of `count` filters that have not begun."""
        return cls(np.zeros((count, 2, 2)), np.zeros((count, 2, 2)), np.zeros(count, np.bool_))

    @property
    def places(self) -> FloatArray:
        """Means (k, 2) of the places [m]."""
        return self.means[:, 0]

    @property
    def variances(self) -> FloatArray:
        """Variances (k,) of the places on each axis [m²]."""
        return self.covs[:, 0, 0]


def stepped(
    beliefs: OccluderBeliefs,
    measured: FloatArray,
    sensor_sd_m: float,
    acceleration_variance: float,
    speed_m: float,
) -> OccluderBeliefs:
    """Predict one step, and take what was measured.

    Parameters
    ----------
    beliefs : after the step before
    measured : (k, 2) - places, NaN where nobody reported one [m]
    sensor_sd_m : σ_v, on each axis [m]
    acceleration_variance : q, on each axis [m²/step⁴]
    speed_m : of occluders as a rule; who is measured first has any velocity of that size [m/step]

    References
    ----------
    Bar-Shalom, Li, Kirubarajan (2001), ch. 5.2, the update in Joseph's form.
    """
    means = TURN @ beliefs.means
    covs = TURN @ beliefs.covs @ TURN.T + acceleration_variance * INPUT
    heard = np.asarray(~np.isnan(measured).any(axis=1))
    gains = covs[:, :, 0] / (covs[:, 0, 0] + sensor_sd_m**2)[:, np.newaxis]
    surprise = np.where(heard[:, np.newaxis], measured, 0.0) - means[:, 0]
    updated = means + gains[:, :, np.newaxis] * surprise[:, np.newaxis]
    keep = np.eye(2) - gains[:, :, np.newaxis] * np.array([1.0, 0.0])
    joseph = keep @ covs @ keep.transpose(0, 2, 1)
    joseph += sensor_sd_m**2 * gains[:, :, np.newaxis] * gains[:, np.newaxis]
    first_means = np.zeros_like(means)
    first_means[:, 0] = np.where(heard[:, np.newaxis], measured, 0.0)
    first_covs = np.broadcast_to(np.diag([sensor_sd_m**2, 0.5 * speed_m**2]), covs.shape)
    update = (heard & beliefs.known)[:, np.newaxis, np.newaxis]
    begin = (heard & ~beliefs.known)[:, np.newaxis, np.newaxis]
    return OccluderBeliefs(
        np.where(begin, first_means, np.where(update, updated, means)),
        np.where(begin, first_covs, np.where(update, joseph, covs)),
        beliefs.known | heard,
    )
