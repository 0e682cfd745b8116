from zlib import crc32

import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsnsim.errors import DecodeError
from wsnsim.net.mac.frames80211 import MAX_PAYLOAD_BYTES, DcfAck, DcfData, decode_frame, duration_us
from wsnsim.net.phy.base import BROADCAST


def data_frame(payload=b"payload", **changes):
    fields = {"sequence": 0x123, "destination": 0x0102, "source": 0x0304, "duration_us": 314}
    return DcfData(payload=payload, **(fields | changes))


def with_check(body):
    return body + crc32(body).to_bytes(4, "little")


def test_check_sequence_is_ethernets():
    """The check value of CRC-32, and the residue that any intact frame leaves."""
    assert crc32(b"123456789") == 0xCBF43926
    assert crc32(data_frame().encode()) == 0x2144DF1C


def test_an_acknowledgement_by_hand():
    ack = DcfAck(0x0102).encode()
    assert ack[:10].hex(" ") == "d4 00 00 00 02 00 00 00 01 02"
    assert len(ack) == 14
    assert decode_frame(ack) == DcfAck(0x0102)


def test_a_data_frame_by_hand():
    mpdu = data_frame(b"\xb1rest").encode()
    assert mpdu[:4].hex() == "0800" + "3a01"
    assert mpdu[4:22].hex() == "020000000102" + "020000000304" + "02ffffffffff"
    assert mpdu[22:24].hex() == "3012"
    assert mpdu[24:32].hex() == "aaaa03" + "000000" + "a0ed"
    assert mpdu[32:-4] == b"\xb1rest"
    assert len(mpdu) == 24 + 8 + 5 + 4
    assert duration_us(mpdu) == 314
    assert data_frame(retry=True).encode()[:2].hex() == "0808"


def test_a_broadcast_is_for_all():
    mpdu = data_frame(destination=BROADCAST).encode()
    assert mpdu[4:10] == b"\xff" * 6
    assert decode_frame(mpdu).destination == BROADCAST


@given(
    sequence=st.integers(0, 4095),
    destination=st.integers(0, 0xFFFF),
    source=st.integers(0, 0xFFFD),
    duration=st.integers(0, 0x7FFF),
    payload=st.binary(max_size=60),
    retry=st.booleans(),
)
def test_frames_come_back_as_they_were(sequence, destination, source, duration, payload, retry):
    frame = DcfData(sequence, destination, source, payload, duration, retry)
    assert decode_frame(frame.encode()) == frame


def test_the_longest_frame_carries_an_msdu_of_2304_bytes_and_one_more_does_not_fit():
    assert len(data_frame(bytes(MAX_PAYLOAD_BYTES)).encode()) == 24 + 2304 + 4
    assert MAX_PAYLOAD_BYTES + 8 == 2304
    with pytest.raises(ValueError, match="2296 B"):
        data_frame(bytes(MAX_PAYLOAD_BYTES + 1)).encode()


@pytest.mark.parametrize("at", range(14))
def test_any_flipped_bit_is_noticed(at):
    for mpdu in (data_frame().encode(), DcfAck(1).encode()):
        broken = bytearray(mpdu)
        broken[at] ^= 0x10
        with pytest.raises(DecodeError, match="check sequence"):
            decode_frame(bytes(broken))


DATA, ACK = data_frame().encode()[:-4], DcfAck(1).encode()[:-4]


@pytest.mark.parametrize(
    "body",
    [
        pytest.param(b"\x80" + DATA[1:], id="a beacon"),
        pytest.param(DATA[:30] + b"\x08\x00" + DATA[32:], id="another protocol"),
        pytest.param(DATA[:1] + b"\x01" + DATA[2:], id="over an access point"),
        pytest.param(DATA[:20], id="without LLC"),
        pytest.param(ACK + b"more", id="an ACK with more"),
        pytest.param(DATA[:4] + b"\x00" + DATA[5:], id="an address of another kind"),
    ],
)
def test_other_frames_are_refused(body):
    with pytest.raises(DecodeError, match=r"MPDU|address"):
        decode_frame(with_check(body))


@pytest.mark.parametrize("length", [0, 13, 2333])
def test_lengths_that_no_frame_has_are_refused(length):
    with pytest.raises(DecodeError, match="14 to 2332 B"):
        decode_frame(bytes(length))
