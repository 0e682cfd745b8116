"""What every payload can do: become bytes, and come back from them.

The first byte of an encoded payload holds its tag in the lower six bits; a system
names its payload types, and `decode_any` finds the type by the tag. Decoding gives codes only:
what is relative to a prediction is resolved by the program that has it.
"""

from collections.abc import Iterable
from typing import ClassVar, Protocol, Self

from wsnsim.errors import DecodeError
from wsnsim.messages.batch import BatchPayload
from wsnsim.messages.header import TAG_MASK


class Payload(Protocol):
    """An application message."""

    tag: ClassVar[int]
    """Lower six bits of the first byte on the air, unique within a system."""
    kind: ClassVar[str]
    """Name of the message in records and reports."""

    def encode(self) -> bytes:
        """Return what travels, the tag first."""

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """Return the payload in `data`.

        Raises
        ------
        DecodeError : wrong tag, wrong length or impossible numbers
        """


def decode_any(data: bytes, payload_types: Iterable[type[Payload]]) -> Payload:
    """Decode `data` by its tag; a batch is a message of every system, and its parts are of these types.

    Raises
    ------
    DecodeError : no payload type has the tag, or its own decoding fails
    """
    if not data:
        raise DecodeError("a message must hold at least its tag, got 0 bytes")
    if data[0] & TAG_MASK == BatchPayload.tag:
        return BatchPayload.decode(data, payload_types)
    for payload_type in payload_types:
        if payload_type.tag == data[0] & TAG_MASK:
            return payload_type.decode(data)
    raise DecodeError(f"message tag must be one of this system's, got 0x{data[0] & TAG_MASK:02x}")
