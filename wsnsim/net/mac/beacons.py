"""The beacon of IEEE 802.15.4-2006 as bytes: short source address, no guaranteed slots, nothing pending.

References
----------
IEEE Std 802.15.4-2006, sec. 7.2.2.1: beacon frame, and its superframe specification (beacon and superframe
order 15: the sender's slots are not the standard's own superframe).
"""

from dataclasses import dataclass
from struct import Struct

from wsnsim.errors import DecodeError
from wsnsim.net.mac.frames import frame_check

BEACON_BYTES = 13
_CONTROL = 0x8000
_NO_SUPERFRAME = 0x00FF
_HEADER = Struct("<HBHHHBB")
_FCS = Struct("<H")


@dataclass(frozen=True, slots=True)
class MacBeacon:
    """A frame by which others set their clocks."""

    sequence: int
    pan: int
    source: int

    def encode(self) -> bytes:
        """Return the MPDU."""
        body = _HEADER.pack(_CONTROL, self.sequence, self.pan, self.source, _NO_SUPERFRAME, 0, 0)
        return body + _FCS.pack(frame_check(body))


def decode_beacon(mpdu: bytes) -> MacBeacon | None:
    """Return the beacon in an MPDU; None if it is another frame.

    Raises
    ------
    DecodeError : a beacon of another length or form, or with a wrong check sequence
    """
    if len(mpdu) < 2 or int.from_bytes(mpdu[:2], "little") != _CONTROL:
        return None
    body = mpdu[:-2]
    if len(mpdu) != BEACON_BYTES or _FCS.unpack(mpdu[-2:])[0] != frame_check(body):
        raise DecodeError(f"beacon: must have {BEACON_BYTES} B and a right check sequence, got {mpdu.hex()}")
    _, sequence, pan, source, _, _, _ = _HEADER.unpack(body)
    return MacBeacon(sequence, pan, source)
