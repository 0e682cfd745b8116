"""Fixed-lag smoothing: what the measurements that came later say of an earlier instant."""

from collections.abc import Sequence

import numpy as np

from wsnsim.estimation.kalman import Gaussian, predict
from wsnsim.types import FloatArray


def smoothed(filtered: Sequence[Gaussian], transition: FloatArray, process_cov: FloatArray) -> list[Gaussian]:
    """Return the beliefs of consecutive instants, each given all measurements of the sequence.

    Parameters
    ----------
    filtered : n beliefs in d dimensions, each given the measurements up to its own instant
    transition : (d, d) F from one instant to the next
    process_cov : (d, d) Q

    Raises
    ------
    numpy.linalg.LinAlgError : a predicted covariance is singular

    References
    ----------
    Rauch, Tung, Striebel (1965), AIAA Journal 3(8), eqs. 3.29-3.31; Bar-Shalom, Li, Kirubarajan
    (2001), sec. 8.6.
    """
    results = [filtered[-1]]
    for belief in reversed(filtered[:-1]):
        later = results[-1]
        predicted = predict(belief, transition, process_cov)
        gain = np.linalg.solve(predicted.cov, transition @ belief.cov).T
        mean = belief.mean + gain @ (later.mean - predicted.mean)
        cov = belief.cov + gain @ (later.cov - predicted.cov) @ gain.T
        results.append(Gaussian(mean, 0.5 * (cov + cov.T)))
    return results[::-1]
