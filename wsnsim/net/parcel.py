"""What the links of a network hand to each other, and what they all know."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from wsnsim.net.config import LinkConfig
from wsnsim.net.flights import Flight, Flights, Load
from wsnsim.net.mesh import MeshHeader, mesh_bytes
from wsnsim.net.routing.tree import Tree
from wsnsim.types import NodeId


@dataclass(slots=True, eq=False)
class Parcel:
    """One frame's load at one node, and what is kept beside its bytes."""

    flight: Flight
    header: MeshHeader
    body: bytes
    own: bool
    hops: int = 1
    """From where it was made to who takes it next."""
    taken_by: list[NodeId] = field(default_factory=list)
    """Neighbours that took it on, whatever its sender came to know."""
    load: Load | None = None
    """The account of its copies, where copies are counted."""
    sequence: int = 0
    """By which those that hear it know it again, where that is asked."""
    cost: float = 0.0
    """What its sender's way to the base station costs; infinite on the way down."""
    tries: int = 0
    """How often the MAC has given it up."""
    repeats: int = 0
    """How often it is still to be broadcast after the next time."""


@dataclass(frozen=True)
class Directory:
    """What all nodes of a network share."""

    tree: Tree
    """The tree as it was planned."""
    names: tuple[NodeId, ...]
    """By short address."""
    addresses: Mapping[NodeId, int]
    stopped: set[NodeId]
    flights: Flights

    @property
    def base(self) -> int:
        """Address of the base station."""
        return self.addresses[self.tree.root]


def fragment_room_bytes(max_payload_bytes: int, config: LinkConfig, hops: int, extra_bytes: int = 0) -> int:
    """Return what a frame has left for a fragment on a way of `hops` hops [B].

    Parameters
    ----------
    max_payload_bytes : what one frame of the MAC carries [B]
    extra_bytes : what comes between the mesh header and the fragment [B]
    """
    if config.mesh_header_bytes == 0:
        return max_payload_bytes
    return max_payload_bytes - mesh_bytes(hops) - extra_bytes
