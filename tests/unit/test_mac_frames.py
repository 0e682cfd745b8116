import struct

import pytest

from wsnsim.errors import DecodeError
from wsnsim.net.mac.frames import MAX_PAYLOAD_BYTES, MacAck, MacData, decode_frame, frame_check
from wsnsim.net.mesh import MeshHeader, decode_mesh

REAL_ACK = bytes.fromhex("020080b031")
"""From a capture of a Zigbee network, with its check sequence."""


def data_frame(payload=b"payload", ack_request=True):
    return MacData(7, 0xCAFE, 0x0001, 0x0002, payload, ack_request)


def test_check_sequence_of_the_usual_nine_digits():
    assert frame_check(b"123456789") == 0x2189


def test_an_acknowledgement_is_what_real_radios_send():
    assert MacAck(128).encode() == REAL_ACK
    assert decode_frame(REAL_ACK) == MacAck(128)


@pytest.mark.parametrize(("ack_request", "control"), [(True, "6188"), (False, "4188")])
def test_a_data_frame_adds_eleven_octets(ack_request, control):
    frame = data_frame(ack_request=ack_request)
    mpdu = frame.encode()
    assert mpdu[:9].hex() == control + "07" + "feca" + "0100" + "0200"
    assert len(mpdu) == 11 + len(frame.payload)
    assert decode_frame(mpdu) == frame


def test_the_longest_frame_fits_and_one_octet_more_does_not():
    assert len(data_frame(bytes(MAX_PAYLOAD_BYTES)).encode()) == 127
    with pytest.raises(ValueError, match="116 B"):
        data_frame(bytes(MAX_PAYLOAD_BYTES + 1)).encode()


@pytest.mark.parametrize("at", range(5))
def test_any_flipped_bit_is_noticed(at):
    for mpdu in (data_frame().encode(), REAL_ACK):
        broken = bytearray(mpdu)
        broken[at] ^= 0x10
        with pytest.raises(DecodeError, match="check sequence"):
            decode_frame(bytes(broken))


@pytest.mark.parametrize("body", ["0080", "000080", "01cc07feca0100020003", "618807"])
def test_other_frames_are_refused(body):
    octets = bytes.fromhex(body)
    with pytest.raises(DecodeError, match="MPDU"):
        decode_frame(octets + frame_check(octets).to_bytes(2, "little"))


def test_lengths_that_no_frame_has_are_refused():
    for length in (0, 4, 128):
        with pytest.raises(DecodeError, match="5 to 127 B"):
            decode_frame(bytes(length))


def test_captured_frames_decode_to_the_same_bytes(shared):
    capture = (shared / "data" / "pcap154" / "killerbee_control4-sample.pcap").read_bytes()
    at, intact, same = 24, 0, 0
    while at < len(capture):
        (length,) = struct.unpack_from("<8xI", capture, at)
        mpdu = capture[at + 16 : at + 16 + length]
        at += 16 + length
        if len(mpdu) < 5 or frame_check(mpdu[:-2]) != int.from_bytes(mpdu[-2:], "little"):
            continue
        intact += 1
        try:
            same += decode_frame(mpdu).encode() == mpdu
        except DecodeError:
            continue
    assert (intact, same) == (377, 362)


@pytest.mark.parametrize(("hops", "length"), [(1, 5), (14, 5), (15, 6), (255, 6)])
def test_mesh_header_grows_by_one_octet_on_long_ways(hops, length):
    header = MeshHeader(hops, 3, 0xFFFF)
    packet = header.encode() + b"rest"
    assert len(packet) == length + 4
    assert decode_mesh(packet) == (header, b"rest")


def test_mesh_header_by_hand():
    assert MeshHeader(2, 0x0102, 0x0304).encode().hex() == "b201020304"
    assert MeshHeader(2, 1, 0).after_hop() == MeshHeader(1, 1, 0)


def test_bad_mesh_headers():
    for hops in (0, 256):
        with pytest.raises(ValueError, match="hops left"):
            MeshHeader(hops, 0, 1).encode()
    for packet in (b"", b"\x00\x01\x02\x03\x04", b"\xb1\x00\x01\x00", b"\xbf"):
        with pytest.raises(DecodeError, match="mesh header"):
            decode_mesh(packet)
