"""The mesh header of 6LoWPAN: who made a packet, whom it is for, and how many hops it may still take.

References
----------
RFC 4944, sec. 5.2 and fig. 3 (16-bit addresses: 5 B; 6 B with Deep Hops Left,
from 15 hops on); sec. 9 and 12 (multicast and unicast short addresses).
"""

from dataclasses import dataclass
from struct import Struct

from wsnsim.errors import DecodeError

MESH_BYTES = 5
DEEP_MESH_BYTES = 6
MAX_SHALLOW_HOPS = 14
"""Hops that fit the four bits of the short form; 15 announces the deep one."""
MAX_HOPS = 255
ALL_NEIGHBOURS = 0x8001
"""Everybody in radio reach, and nobody beyond: the multicast address of all nodes on the link (ff02::1; RFC
4944, sec. 9). Unicast addresses begin with a 0 bit (sec. 12)."""
MAX_UNICAST = 0x8000
"""Short addresses that are no multicast addresses."""

_DISPATCH = 0b1011_0000
"""`10` for mesh, then V = F = 1: both addresses are short."""
_ADDRESSES = Struct(">HH")


@dataclass(frozen=True, slots=True)
class MeshHeader:
    """Origin and final address of a packet on its way over several hops."""

    hops_left: int
    origin: int
    final: int

    def encode(self) -> bytes:
        """Return 5 B, or 6 B from 15 hops on.

        Raises
        ------
        ValueError : more hops than one octet can count
        """
        if not 0 < self.hops_left <= MAX_HOPS:
            raise ValueError(f"hops left: must be 1 to {MAX_HOPS}, got {self.hops_left}")
        if self.hops_left <= MAX_SHALLOW_HOPS:
            hops = bytes((_DISPATCH | self.hops_left,))
        else:
            hops = bytes((_DISPATCH | 0x0F, self.hops_left))
        return hops + _ADDRESSES.pack(self.origin, self.final)

    def after_hop(self) -> "MeshHeader":
        """Return the header as a relay sends it on."""
        return MeshHeader(self.hops_left - 1, self.origin, self.final)


def mesh_bytes(hops: int) -> int:
    """Return how long the header is that allows so many hops [B]."""
    return MESH_BYTES if hops <= MAX_SHALLOW_HOPS else DEEP_MESH_BYTES


def decode_mesh(packet: bytes) -> tuple[MeshHeader, bytes]:
    """Split a packet into its mesh header and the rest.

    Raises
    ------
    DecodeError : no mesh header with short addresses, or too few bytes for one
    """
    if not packet or packet[0] & 0xF0 != _DISPATCH:
        got = f"0x{packet[0]:02x}" if packet else "nothing"
        raise DecodeError(f"mesh header: first octet must be 0xb0 to 0xbf, got {got}")
    hops, at = packet[0] & 0x0F, 1
    if hops > MAX_SHALLOW_HOPS and len(packet) > 1:
        hops, at = packet[1], 2
    if len(packet) < at + _ADDRESSES.size:
        raise DecodeError(f"mesh header: must have {at + _ADDRESSES.size} B, got {len(packet)} B")
    origin, final = _ADDRESSES.unpack_from(packet, at)
    return MeshHeader(hops, origin, final), packet[at + _ADDRESSES.size :]
