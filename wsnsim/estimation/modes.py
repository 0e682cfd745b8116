"""The highest mode of a Gaussian mixture."""

from dataclasses import dataclass

import numpy as np

from wsnsim.estimation.mixtures import GaussianMixture
from wsnsim.kernels.modes import climb
from wsnsim.types import FloatArray

_MOST_STEPS = 500
_TOLERANCE = 1e-9
"""Step [standard deviations] at which a climb ends."""


@dataclass(frozen=True, eq=False)
class Mode:
    """A local maximum of a density: the point (d,) and the logarithm of the density there."""

    point: FloatArray
    log_density: float


def highest_mode(mixture: GaussianMixture) -> Mode:
    """Return the highest of the modes uphill from the components' means.

    A mixture in two or more dimensions can have modes that no mean leads to; they are rare, and
    not found.

    References
    ----------
    Carreira-Perpiñán (2000), Mode-finding for mixtures of Gaussian distributions.
    """
    peaks = mixture.log_weights - np.log(np.diagonal(mixture.roots, axis1=1, axis2=2)).sum(axis=1)
    precisions = np.asarray(np.linalg.inv(mixture.covs), dtype=np.float64)
    points, logs = climb(peaks, mixture.means, precisions, mixture.means, _MOST_STEPS, _TOLERANCE)
    best = int(np.argmax(logs))
    constant = 0.5 * mixture.dimension * np.log(2.0 * np.pi)
    return Mode(points[best], float(logs[best]) - constant)
