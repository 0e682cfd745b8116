"""The target state that a base station sends to its cameras.

Position, velocity and orientation as ten float64: the 24 + 24 + 32 = 80 bytes
of Kushwaha & Koutsoukos 2013, Sec. 4.2.1, behind the six-byte header.
"""

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from wsnsim.errors import DecodeError
from wsnsim.messages.header import pack_header, unpack_header
from wsnsim.types import FloatArray

_NUMBERS = 10


@dataclass(frozen=True, eq=False)
class StatePayload:
    """A target's state, the start of step `step`.

    Parameters
    ----------
    target : the target's number
    step : the tracking step that is to be predicted from this state
    position : (3,) [m]
    velocity : (3,) [m/s]
    orientation : (4,) unit quaternion (w, x, y, z)
    """

    target: int
    step: int
    position: FloatArray
    velocity: FloatArray
    orientation: FloatArray

    tag: ClassVar[int] = 0x01
    kind: ClassVar[str] = "state"

    def encode(self) -> bytes:
        """Return header and 80 bytes of state."""
        numbers = np.concatenate([self.position, self.velocity, self.orientation]).astype("<f8")
        return pack_header(self.tag, self.target, self.step) + numbers.tobytes()

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """Return the state in `data`.

        Raises
        ------
        DecodeError : wrong tag or length, a number that is not finite, a quaternion not of unit length
        """
        target, step, body = unpack_header(data, cls.tag, cls.kind)
        if len(body) != 8 * _NUMBERS:
            raise DecodeError(f"state: the body must hold {8 * _NUMBERS} bytes, got {len(body)}")
        numbers = np.frombuffer(body, dtype="<f8").astype(np.float64)
        if not np.isfinite(numbers).all():
            raise DecodeError("state: every number must be finite")
        if not abs(float(np.linalg.norm(numbers[6:])) - 1.0) < 1e-6:
            raise DecodeError("state: the orientation must be a unit quaternion")
        return cls(target, step, numbers[:3], numbers[3:6], numbers[6:])
