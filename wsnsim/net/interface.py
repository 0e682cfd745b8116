"""What the rest of the simulator sees of a network, whatever its standard.

A network is given datagrams and tells an observer what became of each, once
for every receiver it was meant for.
"""

from dataclasses import dataclass
from enum import Enum
from typing import Protocol

from wsnsim.records import FrameRow
from wsnsim.types import Nanoseconds, NodeId, Seconds


class Outcome(Enum):
    """Why a datagram did not arrive at a receiver."""

    QUEUE = "dropped_queue"
    """No room in the queue of a node on the way."""
    CHANNEL = "dropped_channel_access"
    """CSMA/CA found the channel busy macMaxCSMABackoffs + 1 times."""
    NO_ACK = "dropped_no_ack"
    """macMaxFrameRetries + 1 attempts, none acknowledged."""
    NOT_HEARD = "dropped_not_heard"
    """An unacknowledged broadcast was lost on its way."""
    REASSEMBLY = "dropped_reassembly"
    """Fragments were missing when the reassembly timer ran out."""
    EXPIRED = "dropped_expired"
    """Not sent completely by the time after which nobody wants it."""
    DEAD = "dropped_dead_node"
    """The source, a relay or the receiver has stopped."""


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


class NetworkObserver(Protocol):
    """Hears what the network does. All calls happen at the current time of the event clock."""

    def delivered(self, datagram: Datagram, receiver: NodeId, hops: int) -> None:
        """Take the whole datagram at `receiver`."""

    def dropped(self, datagram: Datagram, receiver: NodeId, outcome: Outcome) -> None:
        """Learn that `receiver` will never get the datagram. Called once for each receiver at most."""

    def frame(self, row: FrameRow) -> None:
        """Record one radio frame; called only where frames are asked for."""


@dataclass(slots=True)
class LinkCounters:
    """What one node's link layer did, in frames and bytes of the MAC (MPDU with FCS, ACKs included)."""

    mac_tx_bytes: int = 0
    mac_rx_bytes: int = 0
    frames_tx: int = 0
    frames_retried: int = 0
    frames_dropped: int = 0


class Network(Protocol):
    """A network that carries datagrams."""

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
