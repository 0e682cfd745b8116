"""What the rest of the simulator sees of a network, whatever its standard.

A network is given datagrams and tells an observer what became of each, once
for every receiver it was meant for.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
from typing import TYPE_CHECKING, Protocol

from wsnsim.records import FrameRow
from wsnsim.types import Nanoseconds, NodeId, Seconds

if TYPE_CHECKING:
    from wsnsim.net.routing.tree import Tree


class Outcome(Enum):
    """Why a datagram did not arrive at a receiver."""

    QUEUE = "dropped_queue"
    """No room in the queue of a node on the way."""
    CHANNEL = "dropped_channel_access"
    """The MAC found the channel busy as often, or for as long, as it tries."""
    NO_ACK = "dropped_no_ack"
    """As many attempts as the MAC makes, none acknowledged."""
    NOT_HEARD = "dropped_not_heard"
    """An unacknowledged broadcast was lost on its way."""
    REASSEMBLY = "dropped_reassembly"
    """Fragments were missing when the reassembly timer ran out."""
    EXPIRED = "dropped_expired"
    """Not sent completely by the time after which nobody wants it."""
    BUDGET = "dropped_budget"
    """A mote on the way had sent as much as it may."""
    DEAD = "dropped_dead_node"
    """The source, a relay or the receiver has stopped."""
    NO_ROUTE = "dropped_no_route"
    """A node on the way knew no way on."""
    HOP_LIMIT = "dropped_hop_limit"
    """It has taken all the hops that its header allows, in a loop or on a detour."""


@dataclass(frozen=True, slots=True)
class Datagram:
    """Bytes on their way from one node to one or many."""

    number: int
    """Unique in the run."""
    source: NodeId
    destinations: tuple[NodeId, ...]
    """One node: unicast along the tree. Several: dissemination down the tree from `source`."""
    data: bytes
    disseminate: bool = False
    expires_ns: Nanoseconds | None = None
    """Time on the event clock after which the source need not send what is left of it."""
    one_hop: bool = False
    """Broadcast once, unacknowledged, to those of `destinations` that hear the source, and no further."""
    left: Callable[[], None] | None = field(default=None, compare=False)
    """Called once when the source's link layer has done with it, sent or given up; never after its death."""


class NetworkObserver(Protocol):
    """Hears what the network does. All calls happen at the current time of the event clock."""

    def delivered(self, datagram: Datagram, receiver: NodeId, hops: int) -> None:
        """Take the whole datagram at `receiver`."""

    def dropped(self, datagram: Datagram, receiver: NodeId, outcome: Outcome) -> None:
        """Learn that `receiver` will never get the datagram. Called once for each receiver at most."""

    def frame(self, row: FrameRow) -> None:
        """Record one radio frame; called only where frames are asked for."""

    def reparented(self, node: NodeId, old: NodeId | None, new: NodeId | None, why: str) -> None:
        """Learn that a node has another parent now, or none; the network's `tree` shows it already."""


@dataclass(slots=True)
class LinkCounters:
    """What one node's link layer did, in frames and bytes of the MAC (MPDU with FCS, ACKs included)."""

    mac_tx_bytes: int = 0
    mac_rx_bytes: int = 0
    frames_tx: int = 0
    frames_retried: int = 0
    frames_dropped: int = 0
    attempts: int = 0
    """Data frames sent that ask for an acknowledgement, repeats included."""
    attempts_failed: int = 0
    """Those of them that were not acknowledged."""
    copies: int = 0
    """Data frames and broadcasts that only repeat one for receivers that may be asleep."""
    cca_total: int = 0
    """Looks at the channel before sending."""
    cca_busy: int = 0
    """Those of them that found it busy."""
    control_frames_tx: int = 0
    """Of `frames_tx`, those that the routing protocol sent for itself: beacons, joins and probes."""
    control_tx_bytes: int = 0
    """Of `mac_tx_bytes`, those of such frames."""
    duplicates: int = 0
    """Packets that came again and were thrown away above the MAC."""


class Network(Protocol):
    """A network that carries datagrams."""

    @property
    def tree(self) -> "Tree":
        """Who sends to whom now."""

    def neighbours(self, node: NodeId) -> tuple[NodeId, ...]:
        """Return the nodes that a node can speak with directly, as far as it knows."""

    def fragments(self, data_bytes: int) -> int:
        """Return the number of radio frames a datagram of that size takes on one hop."""

    def hop_service_s(self, data_bytes: int, node: NodeId) -> Seconds:
        """Return the time in which a datagram of that size goes from a node to its parent, as a rule [s].

        All nodes of the same depth that share the channel are taken to send one too. The base
        station has no such hop.
        """

    def send(self, datagram: Datagram) -> None:
        """Take a datagram at its source."""

    def stop_node(self, node: NodeId) -> None:
        """Silence a node for good: its radio is dead, its queue is lost."""

    def counters(self, node: NodeId) -> LinkCounters:
        """Return what the node's link layer has done so far."""

    def allowance_bytes(self, node: NodeId) -> float:
        """Return how much the node's program may say now where it has a budget to keep [B]; else infinity."""

    def budget_wait_s(self, node: NodeId) -> Seconds:
        """Return how long frames of the node have waited for its budget [s]."""
