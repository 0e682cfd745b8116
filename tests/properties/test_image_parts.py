"""Images in parts: they come back whole in any order, or not at all, and damage never breaks a decoder."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wsnsim.errors import DecodeError, EncodeError
from wsnsim.messages.base import Payload, decode_any
from wsnsim.messages.image_part import FRONT_BYTES, MOST_PARTS, ImagePartPayload, joined, parts_of_image
from wsnsim.systems.scanline.jpeg import compressed, opened

files = st.binary(min_size=1, max_size=2000)
steps = st.integers(0, 2**32 - 1)


@st.composite
def cut(draw: st.DrawFn) -> tuple[int, bytes, int]:
    data = draw(files)
    least = -(-len(data) // MOST_PARTS)
    return draw(steps), data, draw(st.integers(least, len(data) + 10))


def test_it_is_a_payload():
    payload: type[Payload] = ImagePartPayload
    assert decode_any(payload(3, 0, 1, b"x").encode(), (payload,)) == ImagePartPayload(3, 0, 1, b"x")


@given(cut(), st.randoms(use_true_random=False))
def test_parts_come_back_whole_in_any_order(image, random):
    step, data, part_bytes = image
    parts = parts_of_image(step, data, part_bytes)
    assert len(parts) == -(-len(data) // part_bytes)
    messages = [part.encode() for part in parts]
    assert max(map(len, messages)) <= part_bytes + FRONT_BYTES
    assert sum(map(len, messages)) == len(data) + FRONT_BYTES * len(parts)
    back = [ImagePartPayload.decode(message) for message in messages]
    assert tuple(back) == parts
    assert {part.step for part in back} == {step % 256}
    random.shuffle(back)
    assert joined(back) == data
    assert joined(back + back[:1]) == data


@given(cut(), st.data())
def test_a_lost_part_is_told(image, chosen):
    parts = list(parts_of_image(*image))
    del parts[chosen.draw(st.integers(0, len(parts) - 1))]
    assert joined(parts) is None


@given(st.binary(max_size=40) | st.binary(max_size=40).map(lambda tail: b"\x26" + tail))
def test_bytes_decode_or_are_refused(data):
    try:
        part = ImagePartPayload.decode(data)
    except DecodeError:
        return
    assert part.encode() == data


@pytest.mark.parametrize(
    ("data", "told"),
    [
        (b"\x26\x00\x00", "4 bytes at least, got 3"),
        (b"\x25\x00\x00\x01x", "tag must be 0x26, got 0x25"),
        (b"\x26\x00\x02\x02x", "part 2 of 2"),
        (b"\x26\x00\x00\x00x", "part 0 of 0"),
        (b"\x26\x00\x00\x01", "a byte at least, got none"),
    ],
)
def test_damage_is_told(data, told):
    with pytest.raises(DecodeError, match=told):
        ImagePartPayload.decode(data)


@pytest.mark.parametrize(
    "part",
    [ImagePartPayload(256, 0, 1, b"x"), ImagePartPayload(0, 1, 1, b"x"), ImagePartPayload(0, 0, 1, b"")],
)
def test_what_does_not_fit_is_not_encoded(part):
    with pytest.raises(EncodeError, match="image_part"):
        part.encode()


def test_too_many_parts_are_refused():
    assert len(parts_of_image(0, bytes(MOST_PARTS * 10), 10)) == MOST_PARTS
    with pytest.raises(EncodeError, match="lower the quality or take longer parts"):
        parts_of_image(0, bytes(MOST_PARTS * 10 + 1), 10)
    with pytest.raises(EncodeError, match="must have bytes"):
        parts_of_image(0, b"", 10)
    with pytest.raises(EncodeError, match="must have bytes"):
        parts_of_image(0, b"x", 0)


def test_parts_of_different_images_are_refused():
    one, other = parts_of_image(1, b"ab", 1), parts_of_image(2, b"ab", 1)
    with pytest.raises(DecodeError, match="of one image"):
        joined((one[0], other[1]))
    with pytest.raises(DecodeError, match="of one image"):
        joined((one[0], *parts_of_image(1, b"abc", 1)))
    assert joined(()) is None


PICTURE = np.random.default_rng(0).integers(0, 256, (24, 32, 3), dtype=np.uint8)
FILE, _ = compressed(PICTURE, 75)
SIZE = (32, 24)


@given(st.integers(0, len(FILE) - 1))
def test_a_file_that_is_cut_short_is_refused(size):
    if size > len(FILE) - 3:  # the marker of the end alone may be missing
        return
    with pytest.raises(DecodeError, match="must be a whole JPEG file"):
        opened(FILE[:size], SIZE)


@settings(max_examples=300)
@given(st.lists(st.tuples(st.integers(0, len(FILE) - 1), st.integers(0, 255)), min_size=1, max_size=8))
def test_a_damaged_file_is_an_image_or_refused(changes):
    data = bytearray(FILE)
    for at, value in changes:
        data[at] = value
    try:
        image = opened(bytes(data), SIZE)
    except DecodeError:
        return
    assert image.dtype == np.uint8
    assert image.shape == PICTURE.shape
