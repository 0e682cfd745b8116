"""Several messages in one: sizes, order of the parts, and what makes the whole undecodable."""

import struct

import numpy as np
import pytest

from wsnsim.errors import DecodeError, EncodeError
from wsnsim.messages.base import Payload, decode_any
from wsnsim.messages.batch import BatchPayload, batched, parts_of
from wsnsim.messages.ray import RayPayload
from wsnsim.messages.search import SearchPayload
from wsnsim.messages.weights import WeightsPayload

TYPES = (WeightsPayload, SearchPayload, RayPayload)
PARTS: tuple[Payload, ...] = (
    WeightsPayload(0, 7, np.array([0.5, 1.0])),
    SearchPayload(2, 7),
    RayPayload(1, 7, np.array([3.0, 4.0]), np.array([1.0, 0.5, 2.0]), 0.5, "uint8"),
)


def test_a_batch_comes_back_part_by_part_in_order() -> None:
    data = BatchPayload(PARTS).encode()
    back = decode_any(data, TYPES)
    assert isinstance(back, BatchPayload)
    assert [part.encode() for part in back.parts] == [part.encode() for part in PARTS]
    assert [type(part) for part in back.parts] == [type(part) for part in PARTS]
    assert back.encode() == data


def test_a_batch_takes_two_bytes_and_two_a_part_more_than_its_parts() -> None:
    data = BatchPayload(PARTS).encode()
    assert len(data) == 2 + sum(2 + len(part.encode()) for part in PARTS)
    assert data[:2] == b"\x3f\x03"


def test_one_message_alone_is_no_batch() -> None:
    assert batched(PARTS[:1]) is PARTS[0]
    assert parts_of(PARTS[0]) == PARTS[:1]
    assert parts_of(batched(PARTS)) == PARTS


@pytest.mark.parametrize(
    ("parts", "says"),
    [
        ((), "got 0"),
        ((SearchPayload(0, 1),) * 256, "got 256"),
        ((SearchPayload(0, 1), BatchPayload(PARTS)), "must not be a batch"),
        ((WeightsPayload(0, 1, np.ones(8200)),), "send it alone"),
        ((WeightsPayload(0, 1, np.zeros(2)),), "one above 0"),
    ],
)
def test_what_is_no_batch_is_not_sent(parts: tuple[Payload, ...], says: str) -> None:
    with pytest.raises(EncodeError, match=says):
        BatchPayload(parts).encode()


SEARCH = SearchPayload(0, 1).encode()
ONE = struct.pack("<H", len(SEARCH)) + SEARCH


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (b"\x3f", "got 1 bytes"),
        (b"\x3f\x00", "have a part"),
        (b"\x7f\x01" + ONE, "begin with 0x3f"),
        (b"\x3f\x02" + ONE, "part 2 of 2 is cut short"),
        (b"\x3f\x02" + ONE + b"\x06", "part 2 of 2 is cut short"),
        (b"\x3f\x02" + ONE + ONE[:-1], "part 2 of 2 is cut short"),
        (b"\x3f\x01" + ONE + b"\x00", "behind the last part, got 1 bytes"),
        (b"\x3f\x01\x00\x00", "0 bytes"),
        (b"\x3f\x01\x05\x00" + SEARCH[:5], "6 bytes"),
        (b"\x3f\x01\x08\x00\x3f\x01\x04\x00\x3f\x00\x00\x00", "must not be a batch"),
        (b"\x3f\x01\x02\x00\xbf\x01", "begin with 0x3f"),
        (b"\x3f\x02" + ONE + struct.pack("<H", 6) + b"\x01" + SEARCH[1:], "0x01"),
    ],
)
def test_one_broken_part_makes_the_whole_undecodable(data: bytes, says: str) -> None:
    with pytest.raises(DecodeError, match=says):
        decode_any(data, TYPES)


def test_without_a_systems_types_no_part_can_be_read() -> None:
    with pytest.raises(DecodeError, match="one of this system's"):
        BatchPayload.decode(BatchPayload(PARTS).encode())
