"""The base station's Kalman filter: velocity from positions, with covariances that mean something.

The published filter has a fixed measurement covariance; in an interval with a
single camera depth and velocity then wander. Here the measurement of a step is
what the images added to the proposal, direction by direction.
"""

import numpy as np

from wsnsim.estimation.kalman import Gaussian, constant_velocity, predict, update
from wsnsim.estimation.particles import Evidence
from wsnsim.systems.base import Belief
from wsnsim.systems.multiview.rules import InitialError
from wsnsim.types import FloatArray, Seconds

_START_POSITION_SD_M = 0.01
_START_VELOCITY_SD_MPS = 0.1
"""A manual initialisation is never exact; the filter starts with these at least."""
_FOUND_VELOCITY_SD_MPS = 1.5
"""No less is known of a target that walks, or stands."""


def start(belief: Belief, error: InitialError) -> Gaussian:
    """Return the filter's belief (6,) at the beginning of the run."""
    position_sd = max(error.position_sd_m, _START_POSITION_SD_M)
    velocity_sd = max(error.velocity_sd_mps, _START_VELOCITY_SD_MPS)
    mean = np.concatenate([belief.position, belief.velocity])
    return Gaussian(mean, np.diag([position_sd**2] * 3 + [velocity_sd**2] * 3))


def appear(place: FloatArray, velocity: FloatArray, position_sd: float, apart: Seconds) -> Gaussian:
    """Return the filter's belief (6,) of a target that was just found.

    Parameters
    ----------
    place, velocity : (3,) [m], (3,) [m/s] from two places
    position_sd : of each place, each axis [m]
    apart : time between them [s]
    """
    velocity_sd = min(np.sqrt(2.0) * position_sd / apart, _FOUND_VELOCITY_SD_MPS)
    variances = np.array([position_sd**2] * 3 + [velocity_sd**2] * 3)
    return Gaussian(np.concatenate([place, velocity]), np.diag(variances))


def advance(state: Gaussian, dt: Seconds, acceleration_sd: float) -> Gaussian:
    """Predict by `dt` with constant velocity."""
    transition, process_cov = constant_velocity(dt, acceleration_sd)
    return predict(state, transition, process_cov)


def correct(state: Gaussian, evidence: Evidence) -> Gaussian:
    """Condition the state on what the images said of the position."""
    if evidence.values.size == 0:
        return state
    matrix = np.hstack([evidence.matrix, np.zeros_like(evidence.matrix)])
    return update(state, evidence.values, matrix, evidence.cov)


def position_cov(state: Gaussian) -> FloatArray:
    """Return the covariance (3, 3) of the position [m²]."""
    return state.cov[:3, :3]
