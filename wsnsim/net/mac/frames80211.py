"""MAC frames of IEEE 802.11, as bytes: data between stations of one network, and acknowledgement.

A data frame adds 24 B of header, 8 B of LLC and SNAP and 4 B of frame check
sequence to its payload; the payload is 6LoWPAN's and named so by its EtherType.
Stations have locally administered addresses that end in their number. Left out:
fragments, encryption, quality of service and frames over an access point.

References
----------
IEEE Std 802.11-2007: frame control, sec. 7.1.3.1; duration, 7.1.3.2; sequence control, 7.1.3.4; FCS,
7.1.3.7; acknowledgement, 7.2.1.3; data, 7.2.2. IEEE Std 802-2001, sec. 10.3 (SNAP). RFC 7973 (EtherType
of LoWPAN encapsulation).
"""

from binascii import crc32
from dataclasses import dataclass
from struct import Struct

from wsnsim.errors import DecodeError
from wsnsim.net.phy.base import BROADCAST
from wsnsim.net.phy.ieee80211b import MAX_MPDU_BYTES

ACK_BYTES = 14
DATA_OVERHEAD_BYTES = 24 + 8 + 4
MAX_PAYLOAD_BYTES = MAX_MPDU_BYTES - DATA_OVERHEAD_BYTES
SEQUENCES = 1 << 12

_DATA = 0x0008
_ACK = 0x00D4
_RETRY = 0x0800
_DATA_HEADER = Struct("<HH6s6s6sH")
_ACK_HEADER = Struct("<HH6s")
_FCS = Struct("<I")
_SNAP = bytes.fromhex("aaaa03 000000 a0ed")
_STATION = bytes.fromhex("02000000")
"""Locally administered, for one station; its number follows."""
_EVERYBODY = bytes.fromhex("ffffffffffff")
_BSSID = bytes.fromhex("02ffffffffff")
"""Of the one network that there is; locally administered too (sec. 11.1.3)."""


def _address_bytes(address: int) -> bytes:
    return _EVERYBODY if address == BROADCAST else _STATION + address.to_bytes(2, "big")


def _address(octets: bytes) -> int:
    """Return the number of a station.

    Raises
    ------
    DecodeError : an address that is not one of ours
    """
    if octets == _EVERYBODY:
        return BROADCAST
    if not octets.startswith(_STATION):
        raise DecodeError(f"address: must begin with {_STATION.hex(':')}, got {octets.hex(':')}")
    return int.from_bytes(octets[len(_STATION) :], "big")


@dataclass(frozen=True, slots=True)
class DcfData:
    """A data frame."""

    sequence: int
    """0 to 4095."""
    destination: int
    source: int
    payload: bytes
    duration_us: int
    """For how long after this frame the channel is taken [µs]."""
    retry: bool = False

    def encode(self) -> bytes:
        """Return the MPDU.

        Raises
        ------
        ValueError : the payload is too long
        """
        if len(self.payload) > MAX_PAYLOAD_BYTES:
            raise ValueError(f"payload: must fit {MAX_PAYLOAD_BYTES} B of a frame, got {len(self.payload)} B")
        header = _DATA_HEADER.pack(
            _DATA | (_RETRY if self.retry else 0),
            self.duration_us,
            _address_bytes(self.destination),
            _address_bytes(self.source),
            _BSSID,
            self.sequence << 4,
        )
        body = header + _SNAP + self.payload
        return body + _FCS.pack(crc32(body))


@dataclass(frozen=True, slots=True)
class DcfAck:
    """An acknowledgement; it names whom it is for, and no sequence number."""

    receiver: int
    duration_us: int = 0

    def encode(self) -> bytes:
        """Return the MPDU."""
        body = _ACK_HEADER.pack(_ACK, self.duration_us, _address_bytes(self.receiver))
        return body + _FCS.pack(crc32(body))


def decode_frame(mpdu: bytes) -> DcfData | DcfAck:
    """Return the frame in `mpdu`.

    Raises
    ------
    DecodeError : impossible length, wrong check sequence, or a frame that is none of these two
    """
    if not ACK_BYTES <= len(mpdu) <= MAX_MPDU_BYTES:
        raise DecodeError(f"MPDU: must have {ACK_BYTES} to {MAX_MPDU_BYTES} B, got {len(mpdu)} B")
    body = mpdu[: -_FCS.size]
    (found,) = _FCS.unpack_from(mpdu, len(body))
    wanted = crc32(body)
    if found != wanted:
        raise DecodeError(f"MPDU: frame check sequence must be 0x{wanted:08x}, got 0x{found:08x}")
    control = int.from_bytes(body[:2], "little")
    if control == _ACK and len(mpdu) == ACK_BYTES:
        _, duration_us, receiver = _ACK_HEADER.unpack(body)
        return DcfAck(_address(receiver), duration_us)
    begin = _DATA_HEADER.size + len(_SNAP)
    if control & ~_RETRY != _DATA or body[_DATA_HEADER.size : begin] != _SNAP:
        raise DecodeError(
            f"MPDU: must be an acknowledgement or a data frame of LoWPAN between stations, "
            f"got frame control 0x{control:04x} in {len(mpdu)} B"
        )
    _, duration_us, destination, source, _, sequence_control = _DATA_HEADER.unpack_from(body)
    return DcfData(
        sequence=sequence_control >> 4,
        destination=_address(destination),
        source=_address(source),
        payload=body[begin:],
        duration_us=duration_us,
        retry=bool(control & _RETRY),
    )


def duration_us(mpdu: bytes) -> int:
    """Return for how long a frame says that the channel is taken after it [µs]."""
    return int.from_bytes(mpdu[2:4], "little")
