"""Particle weights of one camera and one step (Kushwaha & Koutsoukos 2013, Sec. 4.2.1).

The particles themselves never travel: all nodes draw the same ones. Weights
matter up to a common factor only, so the 8-bit form sends each relative to the
largest and drops the scale. Behind the weights stands what else the camera has
to tell: how well its best particle fits, and from where it sees the target.
"""

from dataclasses import dataclass, field
from typing import ClassVar, Self

import numpy as np

from wsnsim.errors import DecodeError, EncodeError
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

_LEVELS = 255
FACING_NUMBERS = (0, 3, 4)
"""Of how many numbers a camera says how the target stands: none, a direction, a quaternion."""


@dataclass(frozen=True, eq=False)
class WeightsPayload:
    """One weight a particle.

    Parameters
    ----------
    target : the target's number
    step : the step the particles were drawn for
    weights : (m,) non-negative, finite, not all zero
    similarity : of the best particle to the reference model [0–1]
    facing : empty, or what the camera says of the orientation, in [-1, 1]: (3,) the direction from the
        target to the camera in the target's axes, as long as it is sure; (4,) a quaternion
    encoding : of all numbers
    """

    target: int
    step: int
    weights: FloatArray
    similarity: float = 1.0
    facing: FloatArray = field(default_factory=lambda: np.empty(0))
    encoding: Encoding = "float64"

    tag: ClassVar[int] = 0x10
    kind: ClassVar[str] = "weights"

    def encode(self) -> bytes:
        """Return header, weights and shares: 8M bytes of weights in float64, M in 8 bits.

        One byte in front of the weights counts the shares behind them.

        Raises
        ------
        EncodeError : a number is none of those above, or too large or small for the encoding
        """
        if self.facing.size not in FACING_NUMBERS:
            raise EncodeError(f"weights: a facing has 0, 3 or 4 numbers, got {self.facing.size}")
        if not (self.weights >= 0.0).all() or not self.weights.any():
            raise EncodeError("weights: all must be at least 0, and one above 0")
        shares = np.concatenate([[self.similarity], self.facing])
        if self.encoding == "uint8":
            codes = np.rint(self.weights / self.weights.max() * _LEVELS).astype(np.uint8)
            weights: bytes = codes.tobytes()
        else:
            weights = pack_floats(self.weights, self.encoding)
            if not any(weights):
                raise EncodeError(
                    f"encoding: {self.encoding} cannot tell weights from 0 of which the largest is "
                    f"{self.weights.max():g}; send them relative to the largest"
                )
        return (
            pack_header(self.tag, self.target, self.step, self.encoding)
            + bytes([shares.size])
            + weights
            + pack_shares(shares, self.encoding)
        )

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """Return the weights in `data`; those of 8 bits are relative to the largest.

        The code 0 stands for anything below half a quantum and reads as the middle
        of that, so that one camera's rounding cannot rule a particle out.

        Raises
        ------
        DecodeError : wrong tag or length; a weight that is negative or not finite; all weights zero
        """
        target, step, encoding, body = unpack_header(data, cls.tag, cls.kind)
        size = float_bytes(encoding)
        count = body[0] if len(body) else 0
        room = len(body) - 1 - count * size
        if count < 1 or room < size or room % size:
            raise DecodeError(f"weights: the body must hold {size} bytes a number, got {len(body)} bytes")
        if count - 1 not in FACING_NUMBERS:
            raise DecodeError(f"weights: a facing has 0, 3 or 4 numbers, got {count - 1}")
        weights_data, shares_data = body[1 : 1 + room], body[1 + room :]
        if encoding == "uint8":
            codes = np.frombuffer(weights_data, dtype=np.uint8)
            if codes.max() != _LEVELS:
                raise DecodeError(f"weights: the largest of the 8-bit weights must be {_LEVELS}")
            weights = np.maximum(codes, 0.25) / _LEVELS
        else:
            weights = unpack_floats(weights_data, encoding)
        if (weights < 0).any() or not weights.any():
            raise DecodeError("weights: all must be at least 0, and one above 0")
        shares = unpack_shares(shares_data, encoding)
        return cls(target, step, weights, as_similarity(shares[0]), shares[1:], encoding)

    def relative(self) -> FloatArray:
        """Return the weights (m,) over the largest, in [0, 1]."""
        return np.asarray(self.weights / self.weights.max(), dtype=np.float64)
