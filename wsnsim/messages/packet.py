"""A packet that only fills the air: origin, number and time of creation, and then zeros.

Ten bytes tell one packet from another and how old it is: tag (1), origin (2), number (3), time in
microseconds modulo 2³² (4), little endian. The rest is padding.
"""

from dataclasses import dataclass
from typing import ClassVar, Self

from wsnsim.errors import DecodeError, EncodeError

_ORIGIN_BYTES, _NUMBER_BYTES, _TIME_BYTES = 2, 3, 4
SMALLEST_BYTES = 1 + _ORIGIN_BYTES + _NUMBER_BYTES + _TIME_BYTES
"""A packet without padding."""
LARGEST_BYTES = 0x7FFFF
"""The longest datagram that the network's widest fragment header can tell."""

_TIMES = 1 << 8 * _TIME_BYTES


@dataclass(frozen=True)
class PacketPayload:
    """A packet of a given length.

    Parameters
    ----------
    origin : number of the node that made it, below 65,536
    number : of its packets from 0 on, below 2²⁴
    created_us : when it was made, by its maker's clock [µs]; what is read from bytes lacks multiples of 2³²
    size_bytes : of the whole packet [B]
    """

    origin: int
    number: int
    created_us: int
    size_bytes: int

    tag: ClassVar[int] = 0x20
    kind: ClassVar[str] = "packet"

    def encode(self) -> bytes:
        """Return `size_bytes` bytes.

        Raises
        ------
        EncodeError : too short or too long a packet, or a number beyond its field
        """
        if not SMALLEST_BYTES <= self.size_bytes <= LARGEST_BYTES:
            raise EncodeError(
                f"packet: must have {SMALLEST_BYTES} to {LARGEST_BYTES} bytes, got {self.size_bytes}"
            )
        try:
            front = (
                bytes([self.tag])
                + self.origin.to_bytes(_ORIGIN_BYTES, "little")
                + self.number.to_bytes(_NUMBER_BYTES, "little")
                + (self.created_us % _TIMES).to_bytes(_TIME_BYTES, "little")
            )
        except OverflowError as error:
            raise EncodeError(
                f"packet: origin must be below 2^16, number below 2^24, got {self.origin} and {self.number}"
            ) from error
        return front.ljust(self.size_bytes, b"\0")

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """Return the packet in `data`.

        Raises
        ------
        DecodeError : wrong tag or too short
        """
        if len(data) < SMALLEST_BYTES or data[0] != cls.tag:
            raise DecodeError(
                f"packet: must have {SMALLEST_BYTES} bytes or more and the tag 0x{cls.tag:02x}, "
                f"got {len(data)} bytes: {data[:1].hex()}..."
            )
        at, numbers = 1, []
        for size in (_ORIGIN_BYTES, _NUMBER_BYTES, _TIME_BYTES):
            numbers.append(int.from_bytes(data[at : at + size], "little"))
            at += size
        origin, number, created_us = numbers
        return cls(origin, number, created_us, len(data))
