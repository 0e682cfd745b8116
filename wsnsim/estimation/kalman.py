"""A linear Kalman filter, and the constant-velocity model of a point in space.

Values in, values out: a filter's belief is a `Gaussian`, and each step returns
a new one.
"""

from dataclasses import dataclass

import numpy as np

from wsnsim.types import FloatArray, Seconds


@dataclass(frozen=True, eq=False)
class Gaussian:
    """A normal distribution: mean (d,), covariance (d, d)."""

    mean: FloatArray
    cov: FloatArray


def predict(prior: Gaussian, transition: FloatArray, process_cov: FloatArray) -> Gaussian:
    """Move a belief through x' = F x + w, w ~ N(0, Q).

    Parameters
    ----------
    prior : belief in d dimensions
    transition : (d, d) F
    process_cov : (d, d) Q
    """
    return Gaussian(transition @ prior.mean, transition @ prior.cov @ transition.T + process_cov)


def update(prior: Gaussian, measurement: FloatArray, matrix: FloatArray, cov: FloatArray) -> Gaussian:
    """Condition a belief on z = H x + v, v ~ N(0, R), in Joseph's form.

    Parameters
    ----------
    prior : belief in d dimensions
    measurement : (m,) z
    matrix : (m, d) H
    cov : (m, m) R, positive semi-definite

    Raises
    ------
    numpy.linalg.LinAlgError : the innovation covariance is singular

    References
    ----------
    Bar-Shalom, Li, Kirubarajan (2001), eq. 5.2.3-18 (Joseph's form).
    """
    innovation_cov = matrix @ prior.cov @ matrix.T + cov
    gain = np.linalg.solve(innovation_cov, matrix @ prior.cov).T
    keep = np.eye(prior.mean.size) - gain @ matrix
    posterior_cov = keep @ prior.cov @ keep.T + gain @ cov @ gain.T
    return Gaussian(prior.mean + gain @ (measurement - matrix @ prior.mean), posterior_cov)


def constant_velocity(dt: Seconds, acceleration_sd: float) -> tuple[FloatArray, FloatArray]:
    """Return F and Q (6, 6) of [position, velocity] in space under white acceleration.

    The acceleration is constant within a step and independent from step to
    step, with standard deviation `acceleration_sd` [m/s²] on each axis.

    References
    ----------
    Bar-Shalom, Li, Kirubarajan (2001), eq. 6.3.2-4.
    """
    identity = np.eye(3)
    transition = np.block([[identity, dt * identity], [np.zeros((3, 3)), identity]])
    gain = np.vstack([0.5 * dt * dt * identity, dt * identity])
    return transition, acceleration_sd**2 * (gain @ gain.T)
