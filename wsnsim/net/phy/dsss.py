"""Bit and symbol errors of the four modulations of IEEE 802.11b in white Gaussian noise.

All are functions of a signal-to-noise ratio per bit or per symbol, as a ratio.
Left out: multipath and the equaliser against it, and errors of carrier and clock
recovery. Interference counts as noise.

References
----------
IEEE Std 802.11-2007, sec. 15.4.6.4 (DBPSK, DQPSK), 18.4.6.5 and 18.4.6.6 (CCK at 5.5 and 11 Mbit/s);
Proakis, Digital Communications (4th ed., 2001), sec. 5.2.8 (differential PSK), 5.2.3 (biorthogonal
signals); Simon, Alouini, Digital Communication over Fading Channels (2nd ed., 2005), sec. 8.1.1.5 (the
integral of the DQPSK's error rate); Pursley, Royster, Properties and performance of the IEEE 802.11b
complementary-code-key signal sets (IEEE Trans. Commun. 57(2), 2009): CCK as biorthogonal signals.
"""

from math import cos, erfc, exp, expm1, log1p, pi, sqrt

import numpy as np

_CIRCLE = tuple(sqrt(2.0) - cos(pi * (k + 0.5) / 32) for k in range(32))
"""sqrt(2) + sin(theta) at the points of a half circle: the midpoint rule converges exponentially on it."""
_NODES, _WEIGHTS = (tuple(each.tolist()) for each in np.polynomial.legendre.leggauss(48))
_OTHERS = 7
"""The wrong pairs of antipodal signals among eight."""


def dbpsk_bit_errors(eb_n0: float) -> float:
    """Return the probability of a wrong bit of differential BPSK, 1/2 exp(-Eb/N0)."""
    return 0.5 * exp(-eb_n0)


def dqpsk_bit_errors(eb_n0: float) -> float:
    """Return the probability of a wrong bit of Gray-coded differential QPSK.

    The exact Q1(a, b) - I0(ab) exp(-(a² + b²)/2) / 2 with a, b = sqrt((2 -+ sqrt 2) Eb/N0), as the
    integral 1/(4 pi) of exp(-Eb/N0 sqrt(2) x) / x over the circle, x = sqrt 2 + sin(theta).
    """
    rate = sqrt(2.0) * eb_n0
    return 0.5 * sum(exp(-rate * x) / x for x in _CIRCLE) / len(_CIRCLE)


def biorthogonal_symbol_errors(es_n0: float) -> float:
    """Return the probability of a wrong symbol among 16 biorthogonal ones, detected coherently.

    A symbol is right if its correlation y with the signal, of mean b = sqrt(2 Es/N0) and variance 1, is
    positive, and larger than that with each of seven other pairs in magnitude.
    """
    mean = sqrt(2.0 * es_n0)
    half = (mean / 2.0 + 7.0) / 2.0
    wrong = 0.0
    for node, weight in zip(_NODES, _WEIGHTS, strict=True):
        y = half * (1.0 + node)
        beaten = -expm1(_OTHERS * log1p(-erfc(y / sqrt(2.0))))
        wrong += weight * beaten * exp(-((y - mean) ** 2) / 2.0)
    return half * wrong / sqrt(2.0 * pi) + 0.5 * erfc(mean / sqrt(2.0))


def cck_55_symbol_errors(es_n0: float) -> float:
    """Return the probability of a wrong symbol (4 bit) of CCK at 5.5 Mbit/s: one of 16 biorthogonal ones."""
    return biorthogonal_symbol_errors(es_n0)


def cck_11_symbol_errors(es_n0: float) -> float:
    """Return the probability of a wrong symbol (8 bit) of CCK at 11 Mbit/s.

    Taken for two independent choices among 16 biorthogonal signals of half the energy each, as in ns-3. The
    256 signals have 24 nearest neighbours at that distance, this has 28: where errors are few it
    counts a sixth too many, which a tenth of a decibel makes good.
    """
    half = biorthogonal_symbol_errors(es_n0 / 2.0)
    return half * (2.0 - half)
