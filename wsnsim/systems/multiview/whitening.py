"""Coordinates in which a step's prediction is N(0, I): what mixtures are expressed in on their way.

Every node knows the prediction from the state message. The prior that each camera's
density contains is then the standard normal, so that a relay can divide it out
without having heard the state, and a code of 8 bits is relative to the prediction.
"""

from dataclasses import dataclass

import numpy as np

from wsnsim.types import FloatArray


@dataclass(frozen=True, eq=False)
class Whitening:
    """u = L⁻¹ (x − m) with the prediction N(m, L Lᵀ).

    Parameters
    ----------
    mean : (d,) m
    root : (d, d) L, lower triangular
    """

    mean: FloatArray
    root: FloatArray

    @classmethod
    def of(cls, mean: FloatArray, cov: FloatArray) -> "Whitening":
        """Return the coordinates of the prediction N(mean, cov)."""
        root = np.asarray(np.linalg.cholesky(cov), dtype=np.float64)
        return cls(mean, root)

    def whitened(self, points: FloatArray) -> FloatArray:
        """Return points (n, d) in these coordinates."""
        return np.asarray((points - self.mean) @ np.linalg.inv(self.root).T, dtype=np.float64)
