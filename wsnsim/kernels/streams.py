"""The first numbers of very many random streams: NumPy's seeding, PCG64 and ziggurat without its objects.

References
----------
O'Neill, Developing a seed_seq alternative (2015), and NumPy's `SeedSequence` (mixing of the entropy);
O'Neill, PCG: A family of simple fast space-efficient statistically good algorithms for random number
generation (HMC-CS-2014-0905; PCG XSL RR 128/64); Marsaglia & Tsang, The ziggurat method for generating
random variables (J. Stat. Softw. 5(8), 2000), in NumPy's form.
"""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from wsnsim.kernels.jit import kernel
from wsnsim.types import FloatArray

Words: TypeAlias = NDArray[np.uint64]
Word: TypeAlias = np.uint64

_LOW = np.uint64(0xFFFFFFFF)
_32, _16 = np.uint64(32), np.uint64(16)
_PCG_HIGH, _PCG_LOW = np.uint64(0x2360ED051FC65DA4), np.uint64(0x4385DF649FCCF645)
_MIX_LEFT, _MIX_RIGHT = np.uint64(0xCA01F9DD), np.uint64(0x4973F715)
_ONE = np.uint64(1)
_SURE = 1.0 - 2.0**-30
"""What lies this near to the edge of a strip, or beyond it, is left undecided."""


@kernel
def first_two_normals(common: Words, ones: Words, others: Words, widths: FloatArray) -> FloatArray:
    """Return the first two normal numbers of streams.

    Parameters
    ----------
    common : (5,) uint64 - words of 32 bits that all streams have first in their entropy
    ones, others : (m,), (m,) uint64 - the two words that follow
    widths : (256,) - by what the ziggurat multiplies the 52 random bits of each strip

    Returns
    -------
    (m, 2) - NaN where the ziggurat does not decide at once
    """
    draws = np.empty((len(ones), 2))
    entropy = np.empty(7, dtype=np.uint64)
    entropy[:5] = common
    pool, words = np.empty(4, dtype=np.uint64), np.empty(8, dtype=np.uint64)
    for at in range(len(ones)):
        entropy[5], entropy[6] = ones[at], others[at]
        _seed(entropy, pool, words)
        # two words of 32 bits make one of 64, the lower first; of two of those the higher is first
        inc_high, inc_low = words[4] | words[5] << _32, words[6] | words[7] << _32
        inc_high, inc_low = inc_high << _ONE | inc_low >> np.uint64(63), inc_low << _ONE | _ONE
        low = inc_low + (words[2] | words[3] << _32)
        high = inc_high + (words[0] | words[1] << _32) + (_ONE if low < inc_low else np.uint64(0))
        high, low = _step(high, low, inc_high, inc_low)
        for number in range(2):
            high, low = _step(high, low, inc_high, inc_low)
            draws[at, number] = _normal(_output(high, low), widths)
        if np.isnan(draws[at, 1]):
            draws[at, 0] = np.nan
    return draws


@kernel
def _seed(entropy: Words, pool: Words, words: Words) -> None:
    """Mix entropy (7,) by a pool (4,) into words (8,) of 32 bits, as NumPy's SeedSequence does."""
    constant = np.uint64(0x43B0D7E5)
    for i in range(4):
        pool[i], constant = _hash(entropy[i], constant)
    for source in range(4):
        for target in range(4):
            if source != target:
                value, constant = _hash(pool[source], constant)
                pool[target] = _mix(pool[target], value)
    for source in range(4, 7):
        for target in range(4):
            value, constant = _hash(entropy[source], constant)
            pool[target] = _mix(pool[target], value)
    constant = np.uint64(0x8B51F9DD)
    for i in range(8):
        value = pool[i % 4] ^ constant
        constant = constant * np.uint64(0x58F38DED) & _LOW
        value = value * constant & _LOW
        words[i] = value ^ value >> _16


@kernel
def _hash(value: Word, constant: Word) -> tuple[Word, Word]:
    """Return a scrambled word and the next constant."""
    value = value ^ constant
    constant = constant * np.uint64(0x931E8875) & _LOW
    value = value * constant & _LOW
    return value ^ value >> _16, constant


@kernel
def _mix(one: Word, other: Word) -> Word:
    """Return two words as one."""
    value = _MIX_LEFT * one - _MIX_RIGHT * other & _LOW
    return value ^ value >> _16


@kernel
def _step(high: Word, low: Word, inc_high: Word, inc_low: Word) -> tuple[Word, Word]:
    """Return the next state of PCG64: state × multiplier + increment, modulo 2**128."""
    a, b, c, d = low & _LOW, low >> _32, _PCG_LOW & _LOW, _PCG_LOW >> _32
    middle = b * c + (a * c >> _32)
    carried = a * d + (middle & _LOW)
    product_high = b * d + (middle >> _32) + (carried >> _32)
    product_high += high * _PCG_LOW + low * _PCG_HIGH
    product_low = low * _PCG_LOW
    summed = product_low + inc_low
    return product_high + inc_high + (_ONE if summed < inc_low else np.uint64(0)), summed


@kernel
def _output(high: Word, low: Word) -> Word:
    """Return the output of a state: both halves as one, rotated by the topmost six bits."""
    value, turn = high ^ low, high >> np.uint64(58)
    return value >> turn | value << (np.uint64(64) - turn & np.uint64(63))


@kernel
def _normal(bits: Word, widths: FloatArray) -> float:
    """Return the normal number that 64 random bits decide, or NaN."""
    strip = int(bits & np.uint64(0xFF))
    number: float = float(bits >> np.uint64(9) & np.uint64(0xFFFFFFFFFFFFF)) * widths[strip]
    # a strip is inside the curve as far as the next narrower one reaches
    inside = 2.0**52 * widths[(strip - 1) % 256]
    if strip == 1 or number >= inside * _SURE:
        return np.nan
    return -number if bits >> np.uint64(8) & _ONE else number
