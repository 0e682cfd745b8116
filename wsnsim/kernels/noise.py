"""A walk through the patterns of a trace of noise, sample by sample."""

import numpy as np

from wsnsim.kernels.jit import kernel
from wsnsim.types import FloatArray, IntArray


@kernel
def follow(at: int, draws: FloatArray, pattern: IntArray, order: IntArray, starts: IntArray) -> IntArray:
    """Return the places in the trace of the samples that follow.

    Parameters
    ----------
    at : place of the sample before the first
    draws : (k,) - uniform from 0 to 1, one for each sample
    pattern : (n,) - number of the pattern that each sample of the trace follows
    order : (n,) - places of samples, sorted by the pattern they follow
    starts : (patterns + 1,) - where each pattern's begin in `order`

    Returns
    -------
    (k,) - places of samples
    """
    places = np.empty(len(draws), dtype=np.int64)
    for step in range(len(draws)):
        ahead = pattern[(at + 1) % len(pattern)]
        first, last = starts[ahead], starts[ahead + 1]
        at = order[first + int(draws[step] * (last - first))]
        places[step] = at
    return places
