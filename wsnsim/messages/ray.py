"""Where one camera's own tracker believes the target in its image (Kushwaha & Koutsoukos 2013, tracker P).

A pixel is a direction from the camera; the base station intersects the rays of several.
The 8-bit form has the pixel in two bytes a coordinate, eighths of a pixel, which reach 4095 px
from the corner of the image.
"""

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from wsnsim.errors import DecodeError, EncodeError
from wsnsim.messages.factors import factor_bytes, pack_factors, unpack_factors
from wsnsim.messages.header import pack_header, unpack_header
from wsnsim.messages.numbers import (
    Encoding,
    as_similarity,
    float_bytes,
    pack_floats,
    pack_shares,
    unpack_floats,
    unpack_shares,
)
from wsnsim.types import FloatArray

_EIGHTHS = "<i2"
_A_PIXEL = 8.0
_FARTHEST_PX = 4095.0
_UNIT_PX = 64.0
"""Unit of the widths: 8 bits then reach from 0.02 to 7,400 px."""
_NARROWEST_PX, _WIDEST_PX = 2.0**-20, 2.0**20
"""Beyond these a spread is no message of anybody."""


@dataclass(frozen=True, eq=False)
class RayPayload:
    """A direction in an image, and how sure the camera is of it.

    Parameters
    ----------
    target : the target's number
    step : of the frame
    pixel : (2,) where the target is believed to be, at most 4095 px from the corner of the image [px]
    spread : (3,) lower triangle, row by row, of the Cholesky factor of the pixel's covariance; diagonal
        above 0 [px]
    similarity : to the reference model [0–1]
    encoding : of all numbers
    """

    target: int
    step: int
    pixel: FloatArray
    spread: FloatArray
    similarity: float
    encoding: Encoding = "float64"

    tag: ClassVar[int] = 0x13
    kind: ClassVar[str] = "ray"

    def encode(self) -> bytes:
        """Return header, pixel, spread and similarity: 54 bytes in float64, 15 in 8 bits.

        Raises
        ------
        EncodeError : a pixel too far away, or a spread that is none
        """
        fault = _fault(self.pixel, self.spread)
        if fault:
            raise EncodeError(f"ray: {fault}")
        return (
            pack_header(self.tag, self.target, self.step, self.encoding)
            + _pack_pixel(self.pixel, self.encoding)
            + _pack_spread(self.spread, self.encoding)
            + pack_shares(np.array([self.similarity]), self.encoding)
        )

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """Return the ray in `data`.

        Raises
        ------
        DecodeError : wrong tag or length, or impossible numbers
        """
        target, step, encoding, body = unpack_header(data, cls.tag, cls.kind)
        pixel_bytes = 2 * (np.dtype(_EIGHTHS).itemsize if encoding == "uint8" else float_bytes(encoding))
        spread_bytes = 3 * float_bytes(encoding) if encoding == "float64" else factor_bytes(1, 2, encoding)
        expected = pixel_bytes + spread_bytes + float_bytes(encoding)
        if len(body) != expected:
            raise DecodeError(f"ray: the body must hold {expected} bytes, got {len(body)}")
        pixel = _unpack_pixel(body[:pixel_bytes], encoding)
        spread = _unpack_spread(body[pixel_bytes : pixel_bytes + spread_bytes], encoding)
        (similarity,) = unpack_shares(body[pixel_bytes + spread_bytes :], encoding)
        fault = _fault(pixel, spread)
        if fault:
            raise DecodeError(f"ray: {fault}")
        return cls(target, step, pixel, spread, as_similarity(similarity), encoding)

    def root(self) -> FloatArray:
        """Return the Cholesky factor (2, 2) of the pixel's covariance [px]."""
        return _root(self.spread)


def _root(spread: FloatArray) -> FloatArray:
    return np.array([[spread[0], 0.0], [spread[1], spread[2]]])


def _fault(pixel: FloatArray, spread: FloatArray) -> str:
    """Return what makes the numbers the message of nobody; nothing where they are sound."""
    if not (np.abs(pixel) <= _FARTHEST_PX).all():
        return (
            f"the pixel must lie within {_FARTHEST_PX:g} px of the image's corner, got {pixel.tolist()} [px]"
        )
    if not ((spread[::2] >= _NARROWEST_PX).all() and (np.abs(spread) <= _WIDEST_PX).all()):
        return (
            f"the spread must have a diagonal of at least {_NARROWEST_PX:g} px and nothing above "
            f"{_WIDEST_PX:g} px, got {spread.tolist()} [px]"
        )
    return ""


def _pack_pixel(pixel: FloatArray, encoding: Encoding) -> bytes:
    if encoding != "uint8":
        return pack_floats(pixel, encoding)
    return np.rint(pixel * _A_PIXEL).astype(_EIGHTHS).tobytes()


def _unpack_pixel(data: memoryview, encoding: Encoding) -> FloatArray:
    if encoding != "uint8":
        return unpack_floats(data, encoding)
    return np.asarray(np.frombuffer(data, dtype=_EIGHTHS) / _A_PIXEL, dtype=np.float64)


def _pack_spread(spread: FloatArray, encoding: Encoding) -> bytes:
    if encoding == "float64":
        return pack_floats(spread, encoding)
    return pack_factors(_root(spread)[None] / _UNIT_PX, encoding)


def _unpack_spread(data: memoryview, encoding: Encoding) -> FloatArray:
    if encoding == "float64":
        return unpack_floats(data, encoding)
    (root,) = unpack_factors(data, 2, encoding) * _UNIT_PX
    return np.asarray(root[np.tril_indices(2)], dtype=np.float64)
