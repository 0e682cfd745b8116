import pytest

from wsnsim.errors import DecodeError
from wsnsim.net.fragmentation import Fragment, Reassembler, fragment, fragment_count, parse_fragment


def test_headers_by_hand():
    first = Fragment(size=300, tag=0xABCD, offset=0, data=b"x" * 8)
    later = Fragment(size=300, tag=0xABCD, offset=96, data=b"x" * 8)
    assert first.encode()[:-8].hex() == "c12cabcd"
    assert later.encode()[:-8].hex() == "e12cabcd0c"
    wide_first = Fragment(size=0x12345, tag=1, offset=0, data=b"x" * 8)
    wide_later = Fragment(size=0x12345, tag=1, offset=0x8000, data=b"x" * 8)
    assert wide_first.encode()[:-8].hex() == "d123450001"
    assert wide_later.encode()[:-8].hex() == "d9234500011000"
    for piece in (first, later, wide_first, wide_later):
        assert parse_fragment(piece.encode()) == piece


@pytest.mark.parametrize(
    ("data_bytes", "room", "frames"),
    [(0, 116, 1), (116, 116, 1), (117, 116, 2), (112 + 104, 116, 2), (112 + 105, 116, 3), (8006, 111, 77)],
)
def test_number_of_frames(data_bytes, room, frames):
    assert fragment_count(data_bytes, room) == frames
    packets = fragment(bytes(data_bytes), 1, room)
    assert len(packets) == frames
    assert all(len(packet) <= room for packet in packets)


@pytest.mark.parametrize("octet", [0xC0, 0xC7, 0xD0, 0xD8, 0xDF, 0xE0, 0xE7])
def test_data_that_looks_like_a_fragment_travels_as_one(octet):
    data = bytes([octet]) * 50
    (packet,) = fragment(data, 9, 111)
    assert len(packet) == 54
    piece = parse_fragment(packet)
    assert piece is not None
    assert Reassembler().add((0, piece.size, piece.tag), piece) == data


def test_a_discarded_datagram_begins_anew():
    one, two = (parse_fragment(packet) for packet in fragment(bytes(range(150)), 4, 111))
    key = (1, 150, 4)
    reassembler = Reassembler()
    assert reassembler.add(key, one) is None
    reassembler.discard(key)
    assert reassembler.add(key, two) is None
    assert reassembler.add(key, two) is None
    assert reassembler.add(key, one) == bytes(range(150))


@pytest.mark.parametrize(
    "packet", ["c0", "c008", "c0080001", "d00000", "c0080001" + "00" * 9, "e00800010100"]
)
def test_bad_fragments(packet):
    with pytest.raises(DecodeError, match="fragment"):
        parse_fragment(bytes.fromhex(packet))


def test_a_datagram_too_long_for_any_header():
    with pytest.raises(ValueError, match="524287 B"):
        fragment(bytes(0x80000), 1, 111)
