"""A part of a compressed image: what a camera that reads nothing itself sends, in pieces that fit a radio.

Four bytes in front: tag (1), lowest byte of the frame's number (1), number of the part (1), how many there
are (1). All parts of an image must arrive; none is repeated here.
"""

import struct
from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar, Self

from wsnsim.errors import DecodeError, EncodeError

_FRONT = struct.Struct("<BBBB")
FRONT_BYTES = _FRONT.size
"""Of a part that are not the image's."""
MOST_PARTS = 255


@dataclass(frozen=True)
class ImagePartPayload:
    """Some bytes of an image's file.

    Parameters
    ----------
    step : lowest byte of the frame's number
    part : number of the part, from 0
    parts : how many there are, 1 to 255
    data : the bytes, at least one
    """

    step: int
    part: int
    parts: int
    data: bytes

    tag: ClassVar[int] = 0x26
    kind: ClassVar[str] = "image_part"

    def encode(self) -> bytes:
        """Return the four bytes in front, and the data.

        Raises
        ------
        EncodeError : no data, or a number that its byte does not hold
        """
        fault = _fault(self.part, self.parts, self.data)
        if not 0 <= self.step <= 255:
            fault = f"the frame's number must be its lowest byte, got {self.step}"
        if fault:
            raise EncodeError(f"image_part: {fault}")
        return _FRONT.pack(self.tag, self.step, self.part, self.parts) + self.data

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """Return the part in `data`.

        Raises
        ------
        DecodeError : wrong tag, too short, or a part that there is not
        """
        if len(data) < _FRONT.size:
            raise DecodeError(
                f"image_part: a message must hold {_FRONT.size} bytes at least, got {len(data)}"
            )
        first, step, part, parts = _FRONT.unpack_from(data)
        if first != cls.tag:
            raise DecodeError(f"image_part: the tag must be 0x{cls.tag:02x}, got 0x{first:02x}")
        body = bytes(data[_FRONT.size :])
        fault = _fault(part, parts, body)
        if fault:
            raise DecodeError(f"image_part: {fault}")
        return cls(step, part, parts, body)


def parts_of_image(step: int, data: bytes, part_bytes: int) -> tuple[ImagePartPayload, ...]:
    """Cut an image's file into parts.

    Parameters
    ----------
    step : of the frame; its lowest byte travels
    data : the file, not empty
    part_bytes : most bytes of the file in one part; the last part has the rest [bytes]

    Raises
    ------
    EncodeError : no data, no room in a part, or more parts than 255
    """
    if not data or part_bytes < 1:
        raise EncodeError(
            f"image_part: an image and its parts must have bytes, got {len(data)} and {part_bytes} [bytes]"
        )
    count = -(-len(data) // part_bytes)
    if count > MOST_PARTS:
        raise EncodeError(
            f"image_part: an image must fit into {MOST_PARTS} parts, got {len(data)} bytes in parts of "
            f"{part_bytes}; lower the quality or take longer parts"
        )
    pieces = (data[at : at + part_bytes] for at in range(0, len(data), part_bytes))
    return tuple(ImagePartPayload(step & 255, part, count, piece) for part, piece in enumerate(pieces))


def joined(parts: Iterable[ImagePartPayload]) -> bytes | None:
    """Return an image's file from the parts of one frame, in any order; None where one is missing.

    A part that is there twice counts once, the first one.

    Raises
    ------
    DecodeError : parts of different frames, or that do not agree on how many there are
    """
    found: dict[int, bytes] = {}
    of: set[tuple[int, int]] = set()
    for each in parts:
        found.setdefault(each.part, each.data)
        of.add((each.step, each.parts))
    if not of:
        return None
    if len(of) > 1:
        raise DecodeError(
            f"image_part: parts must be of one image, got frames and numbers of parts {sorted(of)}"
        )
    ((_, count),) = of
    if len(found) < count:
        return None
    return b"".join(found[part] for part in range(count))


def _fault(part: int, parts: int, data: bytes) -> str:
    """Return what makes a part the message of nobody; nothing where it is sound."""
    if not 0 <= part < parts <= MOST_PARTS:
        return f"the part must be one of 1 to {MOST_PARTS}, got part {part} of {parts}"
    return "" if data else "a part must hold a byte at least, got none"
