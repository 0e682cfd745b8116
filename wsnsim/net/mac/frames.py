"""MAC frames of IEEE 802.15.4-2006, as bytes: data and acknowledgement.

Short addresses and one PAN (PAN identifier compression), no security. A data
frame adds 9 B of header and 2 B of frame check sequence, so that 116 B are
left for its payload.

References
----------
IEEE Std 802.15.4-2006, sec. 7.2: frame control, table 79 and fig. 42; data
frame, sec. 7.2.2.2; acknowledgement, sec. 7.2.2.3; FCS, sec. 7.2.1.9.
"""

from binascii import crc_hqx
from struct import Struct
from typing import NamedTuple

from wsnsim.errors import DecodeError
from wsnsim.net.phy.ieee802154 import MAX_MPDU_BYTES

ACK_BYTES = 5
DATA_OVERHEAD_BYTES = 11
MAX_PAYLOAD_BYTES = MAX_MPDU_BYTES - DATA_OVERHEAD_BYTES

_TYPE_MASK = 0x0007
_TYPE_DATA = 0x0001
_TYPE_ACK = 0x0002
_ACK_REQUEST = 0x0020
_PAN_COMPRESSION = 0x0040
_SHORT_ADDRESSES = 0x8800
_DATA_HEADER = Struct("<HBHHH")
_ACK_HEADER = Struct("<HB")
_FCS = Struct("<H")
_REVERSED = bytes(int(f"{octet:08b}"[::-1], 2) for octet in range(256))


def frame_check(data: bytes) -> int:
    """Return the 16-bit ITU-T CRC of `data`, x^16 + x^12 + x^5 + 1, remainder 0 at first (sec. 7.2.1.9).

    The air sends each octet's low bit first; the library's CRC takes the high
    bit first, hence the octets turned round before and after.
    """
    crc = crc_hqx(data.translate(_REVERSED), 0)
    return _REVERSED[crc >> 8] | _REVERSED[crc & 0xFF] << 8


class MacData(NamedTuple):
    """A data frame."""

    sequence: int
    pan: int
    destination: int
    source: int
    payload: bytes
    ack_request: bool

    def encode(self) -> bytes:
        """Return the MPDU.

        Raises
        ------
        ValueError : the payload is longer than 116 B
        """
        if len(self.payload) > MAX_PAYLOAD_BYTES:
            raise ValueError(f"payload: must fit {MAX_PAYLOAD_BYTES} B of a frame, got {len(self.payload)} B")
        control = _TYPE_DATA | _PAN_COMPRESSION | _SHORT_ADDRESSES
        if self.ack_request:
            control |= _ACK_REQUEST
        header = _DATA_HEADER.pack(control, self.sequence, self.pan, self.destination, self.source)
        body = header + self.payload
        return body + _FCS.pack(frame_check(body))


class MacAck(NamedTuple):
    """An acknowledgement; it names the frame by its sequence number and nobody by address."""

    sequence: int

    def encode(self) -> bytes:
        """Return the MPDU."""
        body = _ACK_HEADER.pack(_TYPE_ACK, self.sequence)
        return body + _FCS.pack(frame_check(body))


def decode_frame(mpdu: bytes) -> MacData | MacAck:
    """Return the frame in `mpdu`.

    Raises
    ------
    DecodeError : impossible length, wrong check sequence, or a frame that is none of these two
    """
    if not ACK_BYTES <= len(mpdu) <= MAX_MPDU_BYTES:
        raise DecodeError(f"MPDU: must have {ACK_BYTES} to {MAX_MPDU_BYTES} B, got {len(mpdu)} B")
    body = mpdu[:-2]
    (found,) = _FCS.unpack(mpdu[-2:])
    wanted = frame_check(body)
    if found != wanted:
        raise DecodeError(f"MPDU: frame check sequence must be 0x{wanted:04x}, got 0x{found:04x}")
    control, sequence = _ACK_HEADER.unpack_from(body)
    if control == _TYPE_ACK and len(mpdu) == ACK_BYTES:
        return MacAck(sequence)
    expected = _TYPE_DATA | _PAN_COMPRESSION | _SHORT_ADDRESSES
    if control & ~_ACK_REQUEST != expected or len(mpdu) < DATA_OVERHEAD_BYTES:
        raise DecodeError(
            f"MPDU: must be an acknowledgement or a data frame with short addresses in one PAN, "
            f"got frame control 0x{control:04x} (type {control & _TYPE_MASK}) in {len(mpdu)} B"
        )
    _, _, pan, destination, source = _DATA_HEADER.unpack_from(body)
    payload = body[_DATA_HEADER.size :]
    return MacData(sequence, pan, destination, source, payload, ack_request=bool(control & _ACK_REQUEST))
