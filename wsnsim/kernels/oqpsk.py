"""Bit errors of O-QPSK in the 2.4 GHz band, compiled: a receiver among many senders meets ever new SINRs.

References
----------
IEEE Std 802.15.4-2006, sec. E.4.1.8.
"""

from math import comb, exp

from wsnsim.kernels.jit import kernel

FACTORS = tuple((-1) ** k * comb(16, k) / 30.0 for k in range(2, 17))
"""Of the sum over k; (8/15)(1/16) = 1/30."""
EXPONENTS = tuple(20.0 * (1.0 / k - 1.0) for k in range(2, 17))


@kernel
def bit_error_rate(sinr: float) -> float:
    """Return the probability that a bit is wrong at a signal over noise and interference (a ratio)."""
    rate = 0.0
    for term in range(len(FACTORS)):
        rate += FACTORS[term] * exp(EXPONENTS[term] * sinr)
    return rate
