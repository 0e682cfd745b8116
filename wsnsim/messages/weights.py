"""Particle weights of one camera and one step (Kushwaha & Koutsoukos 2013, Sec. 4.2.1).

The particles themselves never travel: all nodes draw the same ones. Weights
matter up to a common factor only, so the 8-bit form sends each relative to the
largest and drops the scale.
"""

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from wsnsim.errors import DecodeError
from wsnsim.messages.header import pack_header, unpack_header
from wsnsim.types import ByteArray, FloatArray

_LEVELS = 255


@dataclass(frozen=True, eq=False)
class WeightsPayload:
    """Weights as float64.

    Parameters
    ----------
    target : the target's number
    step : the step the particles were drawn for
    weights : (m,) non-negative, finite, not all zero
    """

    target: int
    step: int
    weights: FloatArray

    tag: ClassVar[int] = 0x10
    kind: ClassVar[str] = "weights"

    def encode(self) -> bytes:
        """Return header and 8 bytes a weight."""
        return pack_header(self.tag, self.target, self.step) + self.weights.astype("<f8").tobytes()

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """Return the weights in `data`.

        Raises
        ------
        DecodeError : wrong tag or length; a weight that is negative or not finite; all weights zero
        """
        target, step, body = unpack_header(data, cls.tag, cls.kind)
        if len(body) == 0 or len(body) % 8:
            raise DecodeError(f"weights: the body must hold 8 bytes a weight, got {len(body)} bytes")
        weights = np.frombuffer(body, dtype="<f8").astype(np.float64)
        if not np.isfinite(weights).all() or (weights < 0).any() or not weights.any():
            raise DecodeError("weights: all must be finite and at least 0, and one above 0")
        return cls(target, step, weights)

    def relative(self) -> FloatArray:
        """Return the weights (m,) over the largest, in [0, 1]."""
        return np.asarray(self.weights / self.weights.max(), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class QuantisedWeightsPayload:
    """Weights as 8 bits relative to the largest.

    Parameters
    ----------
    target : the target's number
    step : the step the particles were drawn for
    codes : (m,) weight over largest weight, in 1/255ths
    """

    target: int
    step: int
    codes: ByteArray

    tag: ClassVar[int] = 0x11
    kind: ClassVar[str] = "weights"

    @classmethod
    def quantise(cls, target: int, step: int, weights: FloatArray) -> Self:
        """Round weights (m,), at least one above 0, to 8 bits, within half a 1/255th of the largest."""
        codes = np.rint(weights / weights.max() * _LEVELS).astype(np.uint8)
        return cls(target, step, codes)

    def encode(self) -> bytes:
        """Return header and one byte a weight."""
        return pack_header(self.tag, self.target, self.step) + self.codes.tobytes()

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """Return the codes in `data`.

        Raises
        ------
        DecodeError : wrong tag, no weights, or none with the largest code
        """
        target, step, body = unpack_header(data, cls.tag, cls.kind)
        codes = np.frombuffer(body, dtype=np.uint8)
        if codes.size == 0 or codes.max() != _LEVELS:
            raise DecodeError(f"weights: the largest of the 8-bit weights must be {_LEVELS}")
        return cls(target, step, codes)

    def relative(self) -> FloatArray:
        """Return the weights (m,) over the largest, in (0, 1].

        Code 0 stands for anything below half a quantum and reads as the middle
        of that, so that one camera's rounding cannot rule a particle out.
        """
        return np.maximum(self.codes, 0.25) / _LEVELS
