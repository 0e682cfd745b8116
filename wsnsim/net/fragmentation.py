"""Fragments of a datagram that is too long for one frame, and how they become a datagram again.

The headers are those of 6LoWPAN: 4 B on the first fragment, 5 B on later
ones, offsets in units of 8 B, so that every fragment but the last carries a
multiple of 8 B. Two things go beyond the RFC:

* A datagram of more than 2047 B does not fit the header's 11-bit size. It
  takes a wide header of 5 B (first) or 7 B (later), with 19 bits of size and
  16 of offset, under dispatch values that the RFC reserves.
* A datagram that fits one frame travels bare, without an octet to say so. If
  its own first octet looks like a fragment's, it is sent as a datagram of one
  fragment instead.

Only the final receiver puts datagrams together (mesh-under): a relay forwards
fragments one by one. Time is not kept here; whoever holds a `Reassembler`
decides when to `discard` what stays incomplete.

References
----------
RFC 4944, sec. 5.1 (dispatch), sec. 5.3 and figs. 4-5 (fragment headers).
"""

from dataclasses import dataclass, field
from itertools import pairwise
from struct import Struct
from typing import TypeAlias

from wsnsim.errors import DecodeError

UNIT_BYTES = 8
MAX_NARROW_BYTES = 0x7FF
MAX_DATAGRAM_BYTES = 0x7FFFF

_FIRST, _LATER = 0b11000_000, 0b11100_000
_WIDE_FIRST, _WIDE_LATER = 0b11010_000, 0b11011_000
_DISPATCHES = (_FIRST, _LATER, _WIDE_FIRST, _WIDE_LATER)
_DISPATCH_MASK = 0b11111_000
_SIZE_MASK = 0b111

_HEADERS = {
    _FIRST: Struct(">HH"),
    _LATER: Struct(">HHB"),
    _WIDE_FIRST: Struct(">BHH"),
    _WIDE_LATER: Struct(">BHHH"),
}


@dataclass(frozen=True, slots=True)
class Fragment:
    """A piece of a datagram of `size` [B], which begins at `offset` [B]."""

    size: int
    tag: int
    offset: int
    data: bytes

    def encode(self) -> bytes:
        """Return header and data."""
        units = self.offset // UNIT_BYTES
        if self.size <= MAX_NARROW_BYTES:
            if self.offset == 0:
                return _HEADERS[_FIRST].pack(_FIRST << 8 | self.size, self.tag) + self.data
            return _HEADERS[_LATER].pack(_LATER << 8 | self.size, self.tag, units) + self.data
        high, low = self.size >> 16, self.size & 0xFFFF
        if self.offset == 0:
            return _HEADERS[_WIDE_FIRST].pack(_WIDE_FIRST | high, low, self.tag) + self.data
        return _HEADERS[_WIDE_LATER].pack(_WIDE_LATER | high, low, self.tag, units) + self.data


def _capacities(data_bytes: int, room_bytes: int) -> tuple[int, int]:
    """Return what the first and each later fragment can carry [B]."""
    wide = data_bytes > MAX_NARROW_BYTES
    first = room_bytes - _HEADERS[_WIDE_FIRST if wide else _FIRST].size
    later = room_bytes - _HEADERS[_WIDE_LATER if wide else _LATER].size
    return first // UNIT_BYTES * UNIT_BYTES, later // UNIT_BYTES * UNIT_BYTES


def _looks_fragmented(data: bytes) -> bool:
    return bool(data) and data[0] & _DISPATCH_MASK in _DISPATCHES


def fragment_count(data_bytes: int, room_bytes: int) -> int:
    """Return how many frames a datagram takes (one that need not be told from a fragment).

    Parameters
    ----------
    data_bytes : length of the datagram [B]
    room_bytes : what one frame has left for a fragment, header included [B]
    """
    if data_bytes <= room_bytes:
        return 1
    first, later = _capacities(data_bytes, room_bytes)
    return 1 + -(-(data_bytes - first) // later)


def data_within(air_bytes: int, room_bytes: int, overhead_bytes: int) -> int:
    """Return a length that a datagram may have for all its frames to take no more than `air_bytes` [B].

    Parameters
    ----------
    air_bytes : for all frames, each sent once [B]
    room_bytes : what one frame has left for a fragment, header included [B]
    overhead_bytes : what a frame has beside that [B]
    """
    if air_bytes <= room_bytes + overhead_bytes:
        return max(0, air_bytes - overhead_bytes)
    whole, spare = divmod(air_bytes, room_bytes + overhead_bytes)

    def carried(wide: bool) -> int:
        first, later = _capacities(MAX_NARROW_BYTES + wide, room_bytes)
        header = _HEADERS[_WIDE_LATER if wide else _LATER].size
        return first + (whole - 1) * later + min(later, max(0, spare - overhead_bytes - header))

    narrow = carried(wide=False)
    if narrow <= MAX_NARROW_BYTES:
        return max(room_bytes, narrow)
    return min(MAX_DATAGRAM_BYTES, max(MAX_NARROW_BYTES, carried(wide=True)))


def fragment(data: bytes, tag: int, room_bytes: int) -> list[bytes]:
    """Cut a datagram into what single frames carry.

    Parameters
    ----------
    data : the datagram
    tag : number that tells this datagram of its origin from others, 0 to 65535
    room_bytes : what one frame has left for a fragment, header included [B]

    Raises
    ------
    ValueError : more bytes than a header can count
    """
    if len(data) > MAX_DATAGRAM_BYTES:
        raise ValueError(f"datagram: must have at most {MAX_DATAGRAM_BYTES} B, got {len(data)} B")
    looks_fragmented = _looks_fragmented(data)
    if len(data) <= room_bytes and not looks_fragmented:
        return [data]
    first, later = _capacities(len(data), room_bytes)
    if len(data) <= room_bytes - _HEADERS[_FIRST].size:
        first = len(data)
    cuts = [0, *range(first, len(data), later), len(data)]
    return [Fragment(len(data), tag, begin, data[begin:end]).encode() for begin, end in pairwise(cuts)]


def parse_fragment(packet: bytes) -> Fragment | None:
    """Return the fragment in `packet`, or None where it is a whole datagram.

    Raises
    ------
    DecodeError : a fragment that is cut short or reaches beyond its datagram
    """
    if not _looks_fragmented(packet):
        return None
    dispatch = packet[0] & _DISPATCH_MASK
    header = _HEADERS[dispatch]
    if len(packet) < header.size:
        raise DecodeError(f"fragment: header must have {header.size} B, got {len(packet)} B")
    fields = header.unpack_from(packet)
    if dispatch in (_FIRST, _LATER):
        size, tag, units = fields[0] & MAX_NARROW_BYTES, fields[1], fields[2:]
    else:
        size, tag, units = (fields[0] & _SIZE_MASK) << 16 | fields[1], fields[2], fields[3:]
    offset = units[0] * UNIT_BYTES if units else 0
    data = packet[header.size :]
    if not data or offset + len(data) > size:
        raise DecodeError(
            f"fragment: must lie within its datagram of {size} B, got bytes {offset} to {offset + len(data)}"
        )
    return Fragment(size, tag, offset, data)


DatagramKey: TypeAlias = tuple[int, int, int]
"""Origin, size and tag (RFC 4944, sec. 5.3)."""


@dataclass(slots=True)
class _Partial:
    buffer: bytearray
    missing: int
    offsets: set[int] = field(default_factory=set)


class Reassembler:
    """The datagrams a node has received in part."""

    __slots__ = ("_partial",)

    def __init__(self) -> None:
        self._partial: dict[DatagramKey, _Partial] = {}

    def add(self, key: DatagramKey, piece: Fragment) -> bytes | None:
        """Take a fragment in any order and return the datagram once it is whole.

        A fragment that is here already changes nothing.
        """
        partial = self._partial.get(key)
        if partial is None:
            partial = self._partial[key] = _Partial(bytearray(piece.size), piece.size)
        if piece.offset in partial.offsets:
            return None
        partial.offsets.add(piece.offset)
        partial.buffer[piece.offset : piece.offset + len(piece.data)] = piece.data
        partial.missing -= len(piece.data)
        if partial.missing:
            return None
        return bytes(self._partial.pop(key).buffer)

    def discard(self, key: DatagramKey) -> None:
        """Forget an incomplete datagram."""
        self._partial.pop(key, None)
