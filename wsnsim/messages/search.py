"""Looking for a target that no track follows: what the base station asks, what a camera finds."""

import struct
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from wsnsim.errors import DecodeError, EncodeError
from wsnsim.messages.header import pack_header, unpack_header
from wsnsim.messages.numbers import (
    Encoding,
    as_similarity,
    block_bytes,
    float_bytes,
    pack_block,
    pack_shares,
    unpack_block,
    unpack_shares,
)
from wsnsim.types import FloatArray

_WHOLE_PIXELS = struct.Struct("<hh")
_LARGEST_PX = 32_767
_LARGEST_DISTANCE_M = 1e6
"""Beyond it a distance is no message of anybody: the mark of a flipped exponent."""


@dataclass(frozen=True)
class SearchPayload:
    """Asks every camera to look for a target in its whole image, from step `step` on."""

    target: int
    step: int

    tag: ClassVar[int] = 0x02
    kind: ClassVar[str] = "search"

    def encode(self) -> bytes:
        """Return the header, which says it all."""
        return pack_header(self.tag, self.target, self.step)

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """Return the search in `data`.

        Raises
        ------
        DecodeError : wrong tag, or anything behind the header
        """
        target, step, _, body = unpack_header(data, cls.tag, cls.kind)
        if len(body):
            raise DecodeError(f"search: nothing may stand behind the header, got {len(body)} bytes")
        return cls(target, step)


@dataclass(frozen=True, eq=False)
class SightingPayload:
    """Where in its image a camera has found a target.

    Parameters
    ----------
    target : the target's number
    step : of the frame
    pixel : (2,) centre of its outline, at most 32,767 px from the corner of the image [px]
    distance_m : by its size in the image, up to 10⁶ m [m]
    similarity : to the reference model [0–1]
    encoding : of all numbers; the 8-bit form has whole pixels
    """

    target: int
    step: int
    pixel: FloatArray
    distance_m: float
    similarity: float
    encoding: Encoding = "float64"

    tag: ClassVar[int] = 0x12
    kind: ClassVar[str] = "sighting"

    def encode(self) -> bytes:
        """Return header, pixel, distance and similarity.

        Raises
        ------
        EncodeError : a number is none of those above, or too large for the encoding
        """
        fault = _fault(self.pixel, self.distance_m)
        if fault:
            raise EncodeError(f"sighting: {fault}")
        if self.encoding == "uint8":
            pixel = _WHOLE_PIXELS.pack(*(round(float(value)) for value in self.pixel))
        else:
            pixel = pack_block(self.pixel, self.encoding)
        return (
            pack_header(self.tag, self.target, self.step, self.encoding)
            + pixel
            + pack_block(np.array([self.distance_m]), self.encoding)
            + pack_shares(np.array([self.similarity]), self.encoding)
        )

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """Return the sighting in `data`.

        Raises
        ------
        DecodeError : wrong tag or length, or impossible numbers
        """
        target, step, encoding, body = unpack_header(data, cls.tag, cls.kind)
        pixel_size = _WHOLE_PIXELS.size if encoding == "uint8" else block_bytes(2, encoding)
        distance_size = block_bytes(1, encoding)
        expected = pixel_size + distance_size + float_bytes(encoding)
        if len(body) != expected:
            raise DecodeError(f"sighting: the body must hold {expected} bytes, got {len(body)}")
        if encoding == "uint8":
            pixel = np.array(_WHOLE_PIXELS.unpack(body[:pixel_size]), dtype=np.float64)
        else:
            pixel = unpack_block(body[:pixel_size], encoding)
        (distance,) = unpack_block(body[pixel_size : pixel_size + distance_size], encoding)
        (similarity,) = unpack_shares(body[pixel_size + distance_size :], encoding)
        fault = _fault(pixel, float(distance))
        if fault:
            raise DecodeError(f"sighting: {fault}")
        return cls(target, step, pixel, float(distance), as_similarity(similarity), encoding)


def _fault(pixel: FloatArray, distance_m: float) -> str:
    """Return what makes the numbers the message of nobody; nothing where they are sound."""
    if not (np.abs(pixel) <= _LARGEST_PX).all():
        return f"the pixel must lie within {_LARGEST_PX} px of the image's corner, got {pixel.tolist()} [px]"
    if not 0.0 < distance_m <= _LARGEST_DISTANCE_M:
        return f"the distance must be above 0 and up to {_LARGEST_DISTANCE_M:g} m, got {distance_m:g} [m]"
    return ""
