"""What the routing protocol says, in bytes: beacons, joins, probes, and the header it adds to packets.

Its frames begin with an octet whose first two bits are 0, which RFC 4944 leaves
to other protocols (sec. 5.1: not a LoWPAN frame). Costs are ETX in units of
1/128, in 16 bits (RFC 6551, sec. 4.3.2); all ones: no way.

beacon  dispatch 1, flags 1 (bit 0: pull), sequence 1, parent 2, cost 2   7 B
join    dispatch 1, count 1, addresses 2 each: these are below the sender
probe   dispatch 1, padding: sent to be counted by those that hear it

A unicast packet carries, after its mesh header, the cost that its last sender
sees before it (all ones on the way down) and a number that its origin counts
for each destination: what the data frame of the Collection Tree Protocol has for finding loops and
duplicates (TEP 123, sec. 4.1: ETX and sequence number; time has lived is the mesh
header's hops left). One that is disseminated carries the broadcast header of
6LoWPAN (RFC 4944, sec. 11.1: LOWPAN_BC0 and a number).
"""

from dataclasses import dataclass
from math import inf, isfinite
from struct import Struct

from wsnsim.errors import DecodeError

BEACON, JOIN, PROBE = 0x01, 0x02, 0x03
NOBODY = 0xFFFF
ROUTE_BYTES = 3
BROADCAST_BYTES = 2

_BEACON = Struct(">BBBHH")
_ROUTE = Struct(">HB")
_BC0 = 0b0101_0000
_UNITS = 128
_NO_WAY = 0xFFFF
_PULL = 0x01


def encode_cost(cost: float) -> int:
    """Return an ETX in 16 bits."""
    return min(round(cost * _UNITS), _NO_WAY - 1) if isfinite(cost) else _NO_WAY


def decode_cost(code: int) -> float:
    """Return the ETX in 16 bits; infinite where there is no way."""
    return inf if code == _NO_WAY else code / _UNITS


@dataclass(frozen=True, slots=True)
class Beacon:
    """What a node tells all others of its way to the base station."""

    sequence: int
    parent: int | None
    cost: float
    pull: bool = False
    """Whether it asks all who hear it to say where they are soon."""

    def encode(self) -> bytes:
        """Return 7 B."""
        parent = NOBODY if self.parent is None else self.parent
        flags = _PULL if self.pull else 0
        return _BEACON.pack(BEACON, flags, self.sequence, parent, encode_cost(self.cost))


def decode_beacon(packet: bytes) -> Beacon:
    """Return the beacon in `packet`.

    Raises
    ------
    DecodeError : another length
    """
    if len(packet) != _BEACON.size:
        raise DecodeError(f"beacon: must have {_BEACON.size} B, got {len(packet)} B")
    _, flags, sequence, parent, code = _BEACON.unpack(packet)
    return Beacon(sequence, None if parent == NOBODY else parent, decode_cost(code), bool(flags & _PULL))


def encode_join(addresses: tuple[int, ...]) -> bytes:
    """Return a join of at most 255 addresses."""
    return bytes((JOIN, len(addresses))) + b"".join(address.to_bytes(2, "big") for address in addresses)


def decode_join(packet: bytes) -> tuple[int, ...]:
    """Return the addresses in a join.

    Raises
    ------
    DecodeError : another length than it says
    """
    if len(packet) < 2 or len(packet) != 2 + 2 * packet[1]:
        raise DecodeError(f"join: must have 2 B and 2 B an address, got {len(packet)} B")
    return tuple(int.from_bytes(packet[at : at + 2], "big") for at in range(2, len(packet), 2))


def encode_route(cost: float, sequence: int) -> bytes:
    """Return the 3 B that a unicast packet carries after its mesh header."""
    return _ROUTE.pack(encode_cost(cost), sequence)


def decode_route(packet: bytes) -> tuple[float, int, bytes]:
    """Split what follows the mesh header of a unicast packet: cost, number, rest.

    Raises
    ------
    DecodeError : too few bytes
    """
    if len(packet) < ROUTE_BYTES:
        raise DecodeError(f"route header: must have {ROUTE_BYTES} B, got {len(packet)} B")
    code, sequence = _ROUTE.unpack_from(packet)
    return decode_cost(code), sequence, packet[ROUTE_BYTES:]


def encode_broadcast(sequence: int) -> bytes:
    """Return the 2 B that a disseminated packet carries after its mesh header."""
    return bytes((_BC0, sequence))


def decode_broadcast(packet: bytes) -> tuple[int, bytes]:
    """Split what follows the mesh header of a disseminated packet: number, rest.

    Raises
    ------
    DecodeError : no broadcast header
    """
    if len(packet) < BROADCAST_BYTES or packet[0] != _BC0:
        raise DecodeError(
            f"broadcast header: must begin with 0x{_BC0:02x}, got {packet[:2].hex() or 'nothing'}"
        )
    return packet[1], packet[BROADCAST_BYTES:]
