"""The six bytes that every tracking message starts with.

tag (1), target number (1), step (4), little endian. The step number is what
keeps messages of different steps apart: weights of particles drawn for one
step say nothing about the particles of another. The two upper bits of the tag
tell how the numbers behind the header are encoded.
"""

import struct
from typing import NamedTuple

from wsnsim.errors import DecodeError
from wsnsim.messages.numbers import ENCODINGS, Encoding

_LAYOUT = struct.Struct("<BBI")
SIZE = _LAYOUT.size
_TAG_BITS = 6
TAG_MASK = (1 << _TAG_BITS) - 1
"""The part of the first byte that tells what kind of message it is."""


class Opened(NamedTuple):
    """A message behind its tag: whom and when it is about, how it is encoded, and the rest."""

    target: int
    step: int
    encoding: Encoding
    body: memoryview


def pack_header(tag: int, target: int, step: int, encoding: Encoding = "float64") -> bytes:
    """Encode the header of a message on `target` (its number, 0–255) at `step`."""
    return _LAYOUT.pack(tag | ENCODINGS.index(encoding) << _TAG_BITS, target, step)


def unpack_header(data: bytes, tag: int, kind: str) -> Opened:
    """Open a message.

    Raises
    ------
    DecodeError : too short, or another tag than `tag`
    """
    if len(data) < SIZE:
        raise DecodeError(f"{kind}: a message must hold {SIZE} bytes of header, got {len(data)}")
    first, target, step = _LAYOUT.unpack_from(data)
    if first & TAG_MASK != tag:
        raise DecodeError(f"{kind}: the tag must be 0x{tag:02x}, got 0x{first & TAG_MASK:02x}")
    return Opened(target, step, ENCODINGS[first >> _TAG_BITS], memoryview(data)[SIZE:])
