"""The six bytes that every tracking message starts with.

tag (1), target number (1), step (4), little endian. The step number is what
keeps messages of different steps apart: weights of particles drawn for one
step say nothing about the particles of another.
"""

import struct

from wsnsim.errors import DecodeError

_LAYOUT = struct.Struct("<BBI")
SIZE = _LAYOUT.size


def pack_header(tag: int, target: int, step: int) -> bytes:
    """Encode the header of a message on `target` (its number, 0–255) at `step`."""
    return _LAYOUT.pack(tag, target, step)


def unpack_header(data: bytes, tag: int, kind: str) -> tuple[int, int, memoryview]:
    """Return target, step and the rest of a message.

    Raises
    ------
    DecodeError : too short, or another tag than `tag`
    """
    if len(data) < SIZE:
        raise DecodeError(f"{kind}: a message must hold {SIZE} bytes of header, got {len(data)}")
    found, target, step = _LAYOUT.unpack_from(data)
    if found != tag:
        raise DecodeError(f"{kind}: the tag must be 0x{tag:02x}, got 0x{found:02x}")
    return target, step, memoryview(data)[SIZE:]
