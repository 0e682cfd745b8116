"""Cholesky factors as bytes, so that a covariance stays positive definite however its numbers are rounded.

A covariance itself must not be rounded: one that is a hundred times longer than wide is
none any more with 8 bits a number. In float64 nothing is rounded, and who has a
covariance sends it as it is. In the narrower encodings two things travel of its factor
L, a lower triangle with L Lᵀ the covariance:

- Widths, the diagonal: the standard deviation of each coordinate given those before it. They are above 0
  in every encoding. A floating-point number keeps them to the same share at every size; the 8-bit form
  codes their logarithm, 20 codes a factor of e: 2.5 % from e⁻⁸ to e^4.75 (0.0003 to 116); what is wider
  reads as that.
- Leans, what stands left of the diagonal over the width of its row: by how many widths a coordinate moves
  when one before it moves by a standard deviation. Leans are as large as the aspect ratio; 8 bits do not
  reach from 1/32 to 1000, and float16 and the 8-bit form spend 16 on each, a whole number of 1/32.

What is rounded of a row is the distribution of its coordinate given those before it as they arrive, with
their own rounding. The divergences of the rows then add up (chain rule of the Kullback–Leibler
divergence: Cover & Thomas 2006, theorem 2.5.3): an error of δ in a lean costs δ²/2 nats however thin the
density is, one of δ in the logarithm of a width about δ². Rounding the numbers of L one by one does not
do that: with an aspect of 1 : 100, the first width 2.5 % too large turns the long axis out of the density.

Leans end at 1023, in float32 at 4096, and widths at the smallest that an encoding rounds well: a coordinate
that is surer given the others gets noise until it is not. Float64 arithmetic then finds every decoded
covariance positive definite (Higham 2002, Accuracy and Stability of Numerical Algorithms, theorem 10.7).
Up to an aspect of 1 : 1000, what was decoded is encoded to the same bytes again.
"""

from math import exp

import numpy as np

from wsnsim.errors import DecodeError
from wsnsim.messages.numbers import Encoding, float_bytes, pack_floats, unpack_floats
from wsnsim.types import FloatArray

_CODES_A_NAT = 20.0
_LEAST_LOG = -8.0
_LARGEST_CODE = 255
_LEANS = "<i2"
_LEAN_CODES = 32.0
_UP: dict[Encoding, float] = {
    "float32": 1 + 2.0**-23,
    "float16": 1 + 2.0**-10,
    "uint8": exp(0.5 / _CODES_A_NAT),
}
"""What rounds up after a factor of this: half a step."""
_LEAST_WIDTH: dict[Encoding, float] = {"float32": 2.0**-126, "float16": 2.0**-14, "uint8": exp(_LEAST_LOG)}
"""The smallest that is rounded to the same share as all above."""
_ENOUGH = 1 - 1e-6
_FINEST_LEAN = 2.0**-20
"""Of float32: what is smaller is the rounding error of a Cholesky decomposition."""


def factor_bytes(count: int, dimension: int, encoding: Encoding) -> int:
    """Return what `pack_factors` makes of `count` factors (d, d) [bytes]."""
    leans = dimension * (dimension - 1) // 2
    return count * (dimension * float_bytes(encoding) + leans * _lean_bytes(encoding))


def pack_factors(factors: FloatArray, encoding: Encoding) -> bytes:
    """Encode lower triangles (k, d, d) with a diagonal above 0 in an encoding narrower than float64."""
    sent = _rounded(factors, encoding)
    rows, columns = np.tril_indices(sent.shape[1], -1)
    widths = np.diagonal(sent, axis1=1, axis2=2)
    leans = sent[:, rows, columns] / widths[:, rows]
    return _pack_widths(widths, encoding) + _pack_leans(leans, encoding)


def unpack_factors(data: memoryview, dimension: int, encoding: Encoding) -> FloatArray:
    """Return the factors (k, d, d) that `pack_factors` encoded into `data`.

    Raises
    ------
    DecodeError : the size does not fit, a width that is not above 0, a lean that nobody sends
    """
    each = factor_bytes(1, dimension, encoding)
    if len(data) % each:
        raise DecodeError(f"factors: each must hold {each} bytes, got {len(data)} bytes")
    count = len(data) // each
    rows, columns = np.tril_indices(dimension, -1)
    behind = count * dimension * float_bytes(encoding)
    widths = _unpack_widths(data[:behind], encoding).reshape(count, dimension)
    leans = _unpack_leans(data[behind:], encoding).reshape(count, rows.size)
    if (widths <= 0.0).any():
        raise DecodeError("factors: every width must be above 0")
    if (np.abs(leans) > _largest_lean(encoding)).any():
        raise DecodeError(f"factors: every lean must be at most {_largest_lean(encoding):g}")
    factors = np.zeros((count, dimension, dimension))
    factors[:, np.arange(dimension), np.arange(dimension)] = widths
    factors[:, rows, columns] = leans * widths[:, rows]
    return factors


def _rounded(factors: FloatArray, encoding: Encoding) -> FloatArray:
    """Return the factors (k, d, d) that arrive."""
    given, sent = factors, np.zeros_like(factors)
    largest = _largest_lean(encoding)
    for row in range(factors.shape[1]):
        before, arrived = (of[:, :row, :row].transpose(0, 2, 1) for of in (given, sent))
        wanted = (arrived @ np.linalg.solve(before, given[:, row, :row, None]))[:, :, 0]
        least = np.maximum(np.abs(wanted).max(axis=1, initial=0.0) / largest, _LEAST_WIDTH[encoding])
        if (given[:, row, row] < least).any():
            given = _with_noise(given, row, least)
        width = _round_widths(given[:, row, row], encoding)
        narrow = width < least * _ENOUGH
        if narrow.any():
            width = np.where(narrow, _round_widths(least * _UP[encoding], encoding), width)
        leans = np.clip(wanted / width[:, None], -largest, largest)
        sent[:, row, :row] = _round_leans(leans, encoding) * width[:, None]
        sent[:, row, row] = width
    return sent


def _with_noise(factors: FloatArray, row: int, least: FloatArray) -> FloatArray:
    """Return factors whose widths (k,) of a row are at least so large, by noise that no later row shares."""
    noisy = factors.copy()
    noisy[:, row, row] = np.maximum(factors[:, row, row], least)
    share = factors[:, row, row] / noisy[:, row, row]
    for later in range(row + 1, factors.shape[1]):
        noisy[:, later, row] = factors[:, later, row] * share
        unknown = factors[:, later, row] ** 2 * (1.0 - share**2)
        noisy[:, later, later] = np.sqrt(factors[:, later, later] ** 2 + unknown)
    return noisy


def _largest_lean(encoding: Encoding) -> float:
    return 4096.0 if encoding == "float32" else 1023.0


def _lean_bytes(encoding: Encoding) -> int:
    return float_bytes(encoding) if encoding == "float32" else np.dtype(_LEANS).itemsize


def _pack_leans(leans: FloatArray, encoding: Encoding) -> bytes:
    if encoding == "float32":
        # adding 0 leaves one zero of two
        return pack_floats(np.rint(leans.ravel() / _FINEST_LEAN) * _FINEST_LEAN + 0.0, encoding)
    return np.rint(leans * _LEAN_CODES).astype(_LEANS).tobytes()


def _unpack_leans(data: memoryview, encoding: Encoding) -> FloatArray:
    if encoding == "float32":
        return unpack_floats(data, encoding)
    return np.asarray(np.frombuffer(data, dtype=_LEANS) / _LEAN_CODES, dtype=np.float64)


def _pack_widths(widths: FloatArray, encoding: Encoding) -> bytes:
    if encoding == "uint8":
        codes = np.rint((np.log(widths) - _LEAST_LOG) * _CODES_A_NAT)
        return np.minimum(codes, _LARGEST_CODE).astype(np.uint8).tobytes()
    return pack_floats(widths.ravel(), encoding)


def _unpack_widths(data: memoryview, encoding: Encoding) -> FloatArray:
    if encoding == "uint8":
        codes = np.frombuffer(data, dtype=np.uint8)
        return np.asarray(np.exp(codes / _CODES_A_NAT + _LEAST_LOG), dtype=np.float64)
    return unpack_floats(data, encoding)


def _round_widths(widths: FloatArray, encoding: Encoding) -> FloatArray:
    return _unpack_widths(memoryview(_pack_widths(widths, encoding)), encoding).reshape(widths.shape)


def _round_leans(leans: FloatArray, encoding: Encoding) -> FloatArray:
    return _unpack_leans(memoryview(_pack_leans(leans, encoding)), encoding).reshape(leans.shape)
