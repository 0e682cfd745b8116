"""Numbers as bytes, in the four encodings that every payload knows.

float64, float32 and float16 are IEEE 754, little endian. The 8-bit form is a block
floating point: all numbers of a block share a power of two, the quantum, and each has
a code of -127 to 127. A number comes back within half a quantum, and the quantum is
at most 1/63.5 of the largest number.
"""

import math
import struct
from typing import Literal, TypeAlias

import numpy as np

from wsnsim.errors import DecodeError, EncodeError
from wsnsim.types import FloatArray

Encoding: TypeAlias = Literal["float64", "float32", "float16", "uint8"]
ENCODINGS: tuple[Encoding, ...] = ("float64", "float32", "float16", "uint8")

_FLOATS = {"float64": "<f8", "float32": "<f4", "float16": "<f2"}
_LARGEST_CODE = 127
_ROUNDING = 1e-9
_EXPONENT = struct.Struct("<b")
_SMALLEST_EXPONENT, _LARGEST_EXPONENT = -128, 127


def float_bytes(encoding: Encoding) -> int:
    """Return the size of one number of a floating-point encoding [bytes]; 1 for the 8-bit form."""
    return np.dtype(_FLOATS.get(encoding, "u1")).itemsize


def block_bytes(count: int, encoding: Encoding) -> int:
    """Return what `pack_block` makes of `count` numbers [bytes]."""
    return count + _EXPONENT.size if encoding == "uint8" else count * float_bytes(encoding)


def pack_floats(values: FloatArray, encoding: Encoding) -> bytes:
    """Encode numbers (n,) in a floating-point encoding.

    Raises
    ------
    EncodeError : a number is too large for the encoding
    """
    with np.errstate(over="ignore"):
        coded = values.astype(_FLOATS[encoding])
    if not np.isfinite(coded).all():
        largest = np.finfo(coded.dtype).max
        raise EncodeError(
            f"encoding: {encoding} holds numbers up to {largest:g}, got {np.abs(values).max():g}; "
            "use a wider encoding"
        )
    return coded.tobytes()


def unpack_floats(data: memoryview, encoding: Encoding) -> FloatArray:
    """Return the numbers (n,) in `data`, all of it.

    Raises
    ------
    DecodeError : not a whole number of numbers, or one that is not finite
    """
    size = float_bytes(encoding)
    if len(data) % size:
        raise DecodeError(f"numbers: {encoding} takes {size} bytes a number, got {len(data)} bytes")
    coded = np.frombuffer(data, dtype=_FLOATS[encoding])
    # before they are widened: a signalling NaN would do so with a warning
    if not np.isfinite(coded).all():
        raise DecodeError("numbers: every number must be finite")
    return coded.astype(np.float64)


def quantum(values: FloatArray) -> float:
    """Return the 8-bit form's quantum for a block of numbers: the least power of two that reaches them."""
    least = float(np.abs(values).max(initial=0.0)) / _LARGEST_CODE
    return math.ldexp(1.0, math.ceil(math.log2(max(least, 2.0**_SMALLEST_EXPONENT))))


def pack_block(values: FloatArray, encoding: Encoding) -> bytes:
    """Encode numbers (n,) that belong together.

    Raises
    ------
    EncodeError : a number is not finite, or too large for the encoding
    """
    if encoding != "uint8":
        return pack_floats(values, encoding)
    if not np.isfinite(values).all() or quantum(values) > 2.0**_LARGEST_EXPONENT:
        raise EncodeError(f"encoding: uint8 holds finite numbers below 2^134, got {values.tolist()}")
    step = quantum(values)
    codes = np.rint(values / step).astype(np.int8)
    return _EXPONENT.pack(round(math.log2(step))) + codes.tobytes()


def unpack_block(data: memoryview, encoding: Encoding) -> FloatArray:
    """Return the numbers (n,) that `pack_block` encoded into `data`.

    Raises
    ------
    DecodeError : the size does not fit, or a number is not finite
    """
    if encoding != "uint8":
        return unpack_floats(data, encoding)
    if len(data) < _EXPONENT.size:
        raise DecodeError("numbers: a block of 8-bit numbers must hold its exponent, got 0 bytes")
    (exponent,) = _EXPONENT.unpack_from(data)
    codes = np.frombuffer(data[_EXPONENT.size :], dtype=np.int8).astype(np.float64)
    return np.asarray(codes * math.ldexp(1.0, exponent), dtype=np.float64)


def pack_shares(values: FloatArray, encoding: Encoding) -> bytes:
    """Encode numbers (n,) in [-1, 1]; the 8-bit form has a quantum of 1/127.

    Raises
    ------
    EncodeError : a number is outside [-1, 1]
    """
    if not (np.abs(values) <= 1.0 + _ROUNDING).all():
        raise EncodeError(f"encoding: a share must lie between -1 and 1, got {values.tolist()}")
    if encoding != "uint8":
        return pack_floats(values, encoding)
    return np.rint(np.clip(values, -1.0, 1.0) * _LARGEST_CODE).astype(np.int8).tobytes()


def unpack_shares(data: memoryview, encoding: Encoding) -> FloatArray:
    """Return the numbers (n,) that `pack_shares` encoded into `data`.

    Raises
    ------
    DecodeError : the size does not fit, or a number is outside [-1, 1]
    """
    if encoding != "uint8":
        values = unpack_floats(data, encoding)
    else:
        values = np.frombuffer(data, dtype=np.int8).astype(np.float64) / _LARGEST_CODE
    if (np.abs(values) > 1.0 + _ROUNDING).any():
        raise DecodeError("numbers: a share must lie between -1 and 1")
    return values


def as_similarity(share: float) -> float:
    """Return a share that is a similarity.

    Raises
    ------
    DecodeError : below 0
    """
    if share < 0.0:
        raise DecodeError(f"numbers: a similarity must lie between 0 and 1, got {share:g}")
    return float(share)
