"""Parameters of a network's radios, queues and routes, in plain values.

Those of a medium access stand beside it in `wsnsim.net.mac`.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, TypeAlias

from wsnsim.types import NodeId

CollisionModel: TypeAlias = Literal["sinr", "destructive", "capture"]
CcaModel: TypeAlias = Literal["whole_window", "end_of_window"]
QueuePolicy: TypeAlias = Literal["drop_newest", "drop_oldest", "drop_random"]


@dataclass(frozen=True)
class RadioConfig:
    """The transceivers of all nodes, and what overlapping frames do to each other.

    Defaults are those of the CC2420 (Texas Instruments, data sheet SWRS041).
    """

    tx_power_dbm: float = 0.0
    """Largest output power of the CC2420 [dBm]."""
    sensitivity_dbm: float = -95.0
    """Weakest frame that a receiver notices [dBm] (CC2420: typical sensitivity)."""
    noise_dbm: float = -95.4
    """Noise in the receiver [dBm]: what makes 1 % of 20 B frames fail at the CC2420's sensitivity, as
    the standard defines it (IEEE Std 802.15.4-2006, sec. 6.1.7), under the standard's error formula; the
    losses of a real demodulator are in it. Thermal noise alone is -107 dBm in 5 MHz."""
    lock_sinr_db: float = -5.0
    """Smallest SINR at which a receiver synchronises with a preamble [dB]."""
    cca_threshold_dbm: float = -77.0
    """Power that makes the channel busy [dBm] (CC2420: CCA_THR = -32, RSSI offset -45)."""
    cca: CcaModel = "whole_window"
    """`whole_window`: busy if there was power at any time of the 8 symbols, as the standard has it.
    `end_of_window`: only what is there at the end or begins inside counts, as in ns-3 and INET."""
    collision: CollisionModel = "sinr"
    """`sinr`: bits fail by the SINR at each instant. `destructive`: any overlap with a frame above the
    sensitivity is fatal. `capture`: fatal unless the frame is `capture_db` stronger than all others
    together; and a frame that much stronger takes over a receiver that is still at the preamble of
    another."""
    capture_db: float = 3.0
    """How much stronger than all others a frame must be to survive them in mode `capture` [dB] (CC2420:
    co-channel rejection -3 dB)."""


@dataclass(frozen=True)
class LinkConfig:
    """What lies between a node's MAC and the whole network: queue, fragments, forwarding.

    Raises
    ------
    ValueError : a number outside its range
    """

    mesh_header_bytes: int = 5
    """5 for the mesh header of 6LoWPAN (one octet more from 15 hops on). 0 leaves it out: origin and
    final address then travel beside the frame and cost nothing, as in simulators that charge none."""
    queue_frames: int = 30
    """Frames that a node holds for sending, the one on the air included."""
    outbox_datagrams: int = 8
    """Datagrams of its own that a node holds until their fragments are in the queue."""
    queue_policy: QueuePolicy = "drop_newest"
    """What is lost where queue or outbox is full: the newcomer, what has waited longest, or one of all at
    random; never what the MAC has in hand."""
    reassembly_timeout_s: float = 10.0
    """How long fragments wait for the others of their datagram [s]; RFC 4944, sec. 5.3, allows up to 60."""

    def __post_init__(self) -> None:
        for name in ("queue_frames", "outbox_datagrams"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name}: must be at least 1, got {getattr(self, name)}")
        if not self.reassembly_timeout_s > 0.0:
            raise ValueError(f"reassembly_timeout_s: must be positive, got {self.reassembly_timeout_s} [s]")
        if self.mesh_header_bytes not in (0, 5):
            raise ValueError(f"mesh_header_bytes: must be 0 or 5, got {self.mesh_header_bytes}")


@dataclass(frozen=True)
class Draw:
    """What a radio draws that somebody has to save; zeros on mains."""

    transmit_w: float
    receive_w: float


@dataclass(frozen=True)
class RouteConfig:
    """How a routing tree is found.

    Raises
    ------
    ValueError : a number outside its range
    """

    link_success_min: float = 0.9
    """Share of the longest frames that a link of the routing tree must carry, without interference; for a
    tree by ETX the chance that a frame of `etx_frame_bytes` is acknowledged."""
    etx_frame_bytes: int | None = None
    """Length of the frames by which the ETX of a link is measured [B]; None for a tree of fewest hops."""
    draws: Mapping[NodeId, Draw] | None = None
    """What all nodes' radios draw, for a tree of least energy; it needs `etx_frame_bytes`."""
    sinks: tuple[NodeId, ...] = ()
    """Nodes beside the base station at which ways may end."""

    def __post_init__(self) -> None:
        if not 0.0 < self.link_success_min < 1.0:
            raise ValueError(f"link_success_min: must be between 0 and 1, got {self.link_success_min}")
        if self.etx_frame_bytes is not None and self.etx_frame_bytes < 1:
            raise ValueError(f"etx_frame_bytes: must be at least 1, got {self.etx_frame_bytes}")
