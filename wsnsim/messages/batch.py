"""Several messages in one: those of several targets at one step share a packet's headers."""

import struct
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Self

from wsnsim.errors import DecodeError, EncodeError

if TYPE_CHECKING:
    from wsnsim.messages.base import Payload

_FRONT = struct.Struct("<BB")
_LENGTH = struct.Struct("<H")
_MOST_PARTS = 255
_LONGEST_PART = 65_535


@dataclass(frozen=True, eq=False)
class BatchPayload:
    """Messages that travel together.

    Parameters
    ----------
    parts : 1 to 255 payloads, none of them a batch, of up to 65,535 bytes each
    """

    parts: "tuple[Payload, ...]"

    tag: ClassVar[int] = 0x3F
    kind: ClassVar[str] = "batch"

    def encode(self) -> bytes:
        """Return tag and count, then each part behind its length: 2 bytes, and 2 a part more than the parts.

        Raises
        ------
        EncodeError : no part or too many, a batch as a part, a part that is too long or has its own error
        """
        if not 1 <= len(self.parts) <= _MOST_PARTS:
            raise EncodeError(f"batch: there must be 1 to {_MOST_PARTS} parts, got {len(self.parts)}")
        pieces = [_FRONT.pack(self.tag, len(self.parts))]
        for part in self.parts:
            if part.tag == self.tag:
                raise EncodeError("batch: a part must not be a batch; put its parts in its place")
            data = part.encode()
            if len(data) > _LONGEST_PART:
                raise EncodeError(
                    f"batch: a part may have {_LONGEST_PART} bytes, got {len(data)}; send it alone"
                )
            pieces += [_LENGTH.pack(len(data)), data]
        return b"".join(pieces)

    @classmethod
    def decode(cls, data: bytes, payload_types: "Iterable[type[Payload]]" = ()) -> Self:
        """Return the batch in `data`; one broken part breaks it.

        Parameters
        ----------
        payload_types : what the parts may be

        Raises
        ------
        DecodeError : wrong tag, count or length, or a part that does not decode
        """
        from wsnsim.messages.base import decode_any

        types = tuple(payload_types)
        return cls(tuple(decode_any(part, types) for part in _split(data, cls.tag)))


def batched(payloads: "Sequence[Payload]") -> "Payload":
    """Return one payload that holds all of one or more; one alone stands for itself."""
    return payloads[0] if len(payloads) == 1 else BatchPayload(tuple(payloads))


def parts_of(payload: "Payload") -> "tuple[Payload, ...]":
    """Return what a message holds: the parts of a batch, else itself."""
    return payload.parts if isinstance(payload, BatchPayload) else (payload,)


def _split(data: bytes, tag: int) -> list[bytes]:
    """Return the parts' bytes.

    Raises
    ------
    DecodeError : wrong tag, count or length, or a batch as a part
    """
    if len(data) < _FRONT.size:
        raise DecodeError(f"batch: a message must hold its tag and count, got {len(data)} bytes")
    first, count = _FRONT.unpack_from(data)
    if first != tag or count < 1:
        raise DecodeError(
            f"batch: must begin with 0x{tag:02x} and have a part, got 0x{first:02x} and {count}"
        )
    parts, at = [], _FRONT.size
    for number in range(count):
        start = at + _LENGTH.size
        size = _LENGTH.unpack_from(data, at)[0] if start <= len(data) else 1
        at = start + size
        if at > len(data):
            raise DecodeError(f"batch: part {number + 1} of {count} is cut short")
        parts.append(data[start:at])
    if at != len(data):
        raise DecodeError(f"batch: nothing may stand behind the last part, got {len(data) - at} bytes")
    if any(part[:1] == bytes([tag]) for part in parts):
        raise DecodeError("batch: a part must not be a batch")
    return parts
