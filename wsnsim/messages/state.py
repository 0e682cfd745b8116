"""The target state that a base station sends to its cameras.

Position, velocity and orientation: ten numbers, in float64 the 24 + 24 + 32 = 80
bytes of Kushwaha & Koutsoukos 2013, Sec. 4.2.1, behind the six-byte header. Where the
base station lets the particles spread as its filter is uncertain, six numbers more
tell how.

The 8-bit form has the position as whole metres (two bytes an axis) and the rest of a
metre in 8 bits, so that it needs no earlier message to be read.
"""

from dataclasses import dataclass, field
from typing import ClassVar, Self

import numpy as np

from wsnsim.errors import DecodeError, EncodeError
from wsnsim.messages.header import pack_header, unpack_header
from wsnsim.messages.numbers import Encoding, block_bytes, pack_block, unpack_block
from wsnsim.types import FloatArray

_METRES = "<i2"
_FARTHEST_8_BIT_M = 32_767.0
_FARTHEST_M, _FASTEST_MPS = 1e7, 1e5
"""Beyond these a number is no message of anybody, in float64 the mark of a flipped exponent."""


def _nothing() -> FloatArray:
    return np.empty(0)


@dataclass(frozen=True, eq=False)
class StatePayload:
    """A target's state, the start of step `step`.

    Parameters
    ----------
    target : the target's number
    step : the tracking step that is to be predicted from this state
    position : (3,) up to 10⁷ m, in 8 bits 32,767 m from the origin [m]
    velocity : (3,) up to 10⁵ m/s [m/s]
    orientation : (4,) unit quaternion (w, x, y, z), as predicted for `step`
    spread : (6,) lower triangle, row by row, of the Cholesky factor of the particles' covariance [m];
        up to 10⁷ m; empty where all nodes know it from the scenario
    encoding : of all numbers
    """

    target: int
    step: int
    position: FloatArray
    velocity: FloatArray
    orientation: FloatArray
    spread: FloatArray = field(default_factory=_nothing)
    encoding: Encoding = "float64"

    tag: ClassVar[int] = 0x01
    kind: ClassVar[str] = "state"

    def encode(self) -> bytes:
        """Return header and numbers: 80 bytes in float64, 48 more with a spread.

        Raises
        ------
        EncodeError : a number is none of those above, or too large for the encoding
        """
        fault = self._fault()
        if fault:
            raise EncodeError(f"state: {fault}")
        blocks = [self.velocity, self.orientation, *([self.spread] if self.spread.size else [])]
        return (
            pack_header(self.tag, self.target, self.step, self.encoding)
            + _pack_position(self.position, self.encoding)
            + b"".join(pack_block(block, self.encoding) for block in blocks)
        )

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """Return the state in `data`.

        Raises
        ------
        DecodeError : wrong tag or length, a number that nobody sends, a quaternion not of unit length
        """
        target, step, encoding, body = unpack_header(data, cls.tag, cls.kind)
        sizes = [_position_bytes(encoding), block_bytes(3, encoding), block_bytes(4, encoding)]
        spread_bytes = block_bytes(6, encoding)
        if len(body) == sum(sizes) + spread_bytes:
            sizes.append(spread_bytes)
        if len(body) != sum(sizes):
            raise DecodeError(f"state: the body must hold {sum(sizes)} bytes, got {len(body)}")
        parts = []
        for size in sizes:
            parts.append(body[:size])
            body = body[size:]
        position = _unpack_position(parts[0], encoding)
        velocity, orientation, *spread = (unpack_block(part, encoding) for part in parts[1:])
        state = cls(
            target,
            step,
            position,
            velocity,
            _unit(orientation, encoding),
            spread[0] if spread else _nothing(),
            encoding,
        )
        fault = state._fault()
        if fault:
            raise DecodeError(f"state: {fault}")
        return state

    def _fault(self) -> str:
        """Return what makes the numbers the message of nobody; nothing where they are sound."""
        farthest = _FARTHEST_8_BIT_M if self.encoding == "uint8" else _FARTHEST_M
        for name, numbers, limit, unit in (
            ("position", self.position, farthest, "m"),
            ("velocity", self.velocity, _FASTEST_MPS, "m/s"),
            ("spread", self.spread, _FARTHEST_M, "m"),
        ):
            if not (np.abs(numbers) <= limit).all():
                return f"the {name} must lie within {limit:g} {unit}, got {numbers.tolist()} [{unit}]"
        return ""


def _position_bytes(encoding: Encoding) -> int:
    whole = 3 * np.dtype(_METRES).itemsize if encoding == "uint8" else 0
    return whole + block_bytes(3, encoding)


def _pack_position(position: FloatArray, encoding: Encoding) -> bytes:
    if encoding != "uint8":
        return pack_block(position, encoding)
    metres = np.rint(position)
    return metres.astype(_METRES).tobytes() + pack_block(position - metres, encoding)


def _unpack_position(data: memoryview, encoding: Encoding) -> FloatArray:
    if encoding != "uint8":
        return unpack_block(data, encoding)
    whole = 3 * np.dtype(_METRES).itemsize
    metres = np.frombuffer(data[:whole], dtype=_METRES)
    return metres + unpack_block(data[whole:], encoding)


def _unit(orientation: FloatArray, encoding: Encoding) -> FloatArray:
    """Scale a quaternion to length 1 where rounding may have changed it."""
    # squares of a flipped exponent's number would not fit into a float64
    norm = float(np.linalg.norm(np.clip(orientation, -2.0, 2.0)))
    tolerance = {"float64": 1e-6, "float32": 1e-5, "float16": 1e-2, "uint8": 5e-2}[encoding]
    if not abs(norm - 1.0) < tolerance:
        raise DecodeError("state: the orientation must be a unit quaternion")
    return orientation if encoding == "float64" else orientation / norm
