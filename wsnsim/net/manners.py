"""What the links of a network with routers agree on: limits, headers, and which packets they know again."""

from collections import OrderedDict
from dataclasses import dataclass

from wsnsim.net.mesh import ALL_NEIGHBOURS
from wsnsim.net.parcel import Parcel
from wsnsim.net.phy.base import BROADCAST
from wsnsim.net.routing.config import DisseminationConfig
from wsnsim.net.routing.control import BROADCAST_BYTES, ROUTE_BYTES

_REMEMBERED = 128
"""Packets that a node knows again: fewer than a number of 8 bits can tell apart."""


@dataclass(frozen=True)
class Manners:
    """What the links of a network with routers have alike."""

    spread: DisseminationConfig
    hop_limit: int
    overhead_bytes: int
    """What the MAC adds to a packet [B]."""
    tries: int = 1
    """How often a frame is given to the MAC."""
    hold: bool = True
    """Whether what has no way waits for one."""


class Memory:
    """The packets that a node has had, the last of them."""

    def __init__(self) -> None:
        self._known: OrderedDict[tuple[int, int, int, int], None] = OrderedDict()

    def add(self, packet: tuple[int, int, int, int]) -> bool:
        """Remember a packet by origin, final address, number and hops left; return whether it is new."""
        if packet in self._known:
            return False
        self._known[packet] = None
        if len(self._known) > _REMEMBERED:
            self._known.popitem(last=False)
        return True


def is_unicast(parcel: Parcel) -> bool:
    """Return whether a frame is for one node."""
    return parcel.header.final not in (BROADCAST, ALL_NEIGHBOURS)


def extra_bytes(final: int) -> int:
    """Return what stands between the mesh header and the fragment [B]."""
    return {BROADCAST: BROADCAST_BYTES, ALL_NEIGHBOURS: 0}.get(final, ROUTE_BYTES)
