"""Gains of fading links, made from counters: no state, and any of them at any time.

References
----------
Salmon, Moraes, Dror, Shaw, Parallel random numbers: as easy as 1, 2, 3 (SC 2011): Philox 4x32-10.
"""

from math import cos, log, pi, sin, sqrt

import numpy as np

from wsnsim.kernels.jit import kernel
from wsnsim.types import FloatArray, IntArray, Nanoseconds

_LOW = np.uint64(0xFFFFFFFF)
_32 = np.uint64(32)
_LEFT, _RIGHT = np.uint64(0xD2511F53), np.uint64(0xCD9E8D57)
_WEYL_LEFT, _WEYL_RIGHT = np.uint64(0x9E3779B9), np.uint64(0xBB67AE85)
_OFFSET = np.uint64(0xFFFFFFFF)
"""In place of a block's number where a pair's own instant is asked for, and no block's upper half."""


@kernel
def block_gains(
    sender: int,
    receivers: IntArray,
    now_ns: Nanoseconds,
    coherence_ns: Nanoseconds,
    key: np.uint64,
    other_key: np.uint64,
    sight: float,
    scatter: float,
) -> FloatArray:
    """Return the power gains of the links from one node to others.

    Parameters
    ----------
    sender : number of a node
    receivers : (m,) - numbers of nodes
    now_ns, coherence_ns : time, and length of a block [ns]
    key, other_key : of the run, 32 bits each
    sight : amplitude of the way in sight [-]
    scatter : standard deviation of the real and the imaginary part of all others [-]

    Returns
    -------
    (m,) - [-]
    """
    gains = np.empty(len(receivers))
    for at in range(len(receivers)):
        low, high = np.uint64(min(sender, receivers[at])), np.uint64(max(sender, receivers[at]))
        begin, _ = philox(low, high, _OFFSET, _OFFSET, key, other_key)
        block = np.uint64((now_ns + int(begin * 2.0**-32 * coherence_ns)) // coherence_ns)
        one, other = philox(low, high, block & _LOW, block >> _32, key, other_key)
        # two normal numbers by Box and Muller
        radius = scatter * sqrt(-2.0 * log((one + 0.5) * 2.0**-32))
        angle = 2.0 * pi * (other * 2.0**-32)
        gains[at] = (sight + radius * cos(angle)) ** 2 + (radius * sin(angle)) ** 2
    return gains


@kernel
def philox(
    a: np.uint64, b: np.uint64, c: np.uint64, d: np.uint64, key: np.uint64, other_key: np.uint64
) -> tuple[float, float]:
    """Return the first two of the four words of 32 bits that Philox 4x32-10 makes of a counter and a key."""
    x, y, z, w, left, right = a, b, c, d, key, other_key
    for _ in range(10):
        one, two = _LEFT * x, _RIGHT * z
        x, y, z, w = (two >> _32) ^ y ^ left, two & _LOW, (one >> _32) ^ w ^ right, one & _LOW
        left, right = left + _WEYL_LEFT & _LOW, right + _WEYL_RIGHT & _LOW
    return float(x), float(y)
