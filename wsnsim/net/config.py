"""Every parameter of an IEEE 802.15.4 network, with its default and where that comes from."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

from wsnsim.net.phy import MAX_MPDU_BYTES

CollisionModel: TypeAlias = Literal["sinr", "destructive"]
CcaModel: TypeAlias = Literal["whole_window", "end_of_window"]


@dataclass(frozen=True)
class Ieee802154Config:
    """Radio, MAC and link layer of all nodes.

    Defaults are those of the CC2420 (Texas Instruments, data sheet SWRS041) for
    the radio and of IEEE Std 802.15.4-2006, table 86, for the MAC.

    Raises
    ------
    ValueError : a number outside its range
    """

    tx_power_dbm: float = 0.0
    """Largest output power of the CC2420 [dBm]."""
    sensitivity_dbm: float = -95.0
    """Weakest frame that a receiver notices [dBm] (CC2420: typical sensitivity)."""
    noise_dbm: float = -95.4
    """Noise in the receiver [dBm]: what makes 1 % of 20 B frames fail at the CC2420's sensitivity, as
    the standard defines it (sec. 6.1.7), under the standard's error formula; the losses of a real
    demodulator are in it. Thermal noise alone is -107 dBm in 5 MHz."""
    lock_sinr_db: float = -5.0
    """Smallest SINR at which a receiver synchronises with a preamble [dB]."""
    cca_threshold_dbm: float = -77.0
    """Power that makes the channel busy [dBm] (CC2420: CCA_THR = -32, RSSI offset -45)."""
    cca: CcaModel = "whole_window"
    """`whole_window`: busy if there was power at any time of the 8 symbols, as the standard has it.
    `end_of_window`: only what is there at the end or begins inside counts, as in ns-3 and INET."""
    collision: CollisionModel = "sinr"
    """`sinr`: bits fail by the SINR at each instant. `destructive`: any overlap with a frame above the
    sensitivity is fatal."""
    min_be: int = 3
    """macMinBE: the first backoff is 0 to 2^min_be - 1 periods of 320 µs."""
    max_be: int = 5
    """macMaxBE."""
    max_csma_backoffs: int = 4
    """macMaxCSMABackoffs: how often a busy channel is tried again."""
    max_frame_retries: int = 3
    """macMaxFrameRetries: how often an unacknowledged frame is sent again."""
    max_channel_retries: int = 0
    """How often a frame that found the channel busy at every try begins its CSMA anew; 0: it is lost,
    as the bare standard leaves it. TinyOS's CC2420 driver never gives up."""
    duplicate_lifetime_s: float = 0.5
    """How long a receiver remembers a sender's last sequence number [s]; less than 256 frames take."""
    pan_id: int = 0xCAFE
    """PAN identifier in every frame."""
    mesh_header_bytes: int = 5
    """5 for the mesh header of 6LoWPAN (one octet more from 15 hops on). 0 leaves it out: origin and
    final address then travel beside the frame and cost nothing, as in simulators that charge none."""
    queue_frames: int = 30
    """Frames that a node holds for sending, the one on the air included."""
    outbox_datagrams: int = 8
    """Datagrams of its own that a node holds until their fragments are in the queue."""
    reassembly_timeout_s: float = 10.0
    """How long fragments wait for the others of their datagram [s]; RFC 4944, sec. 5.3, allows up to 60."""
    link_success_min: float = 0.9
    """Share of the longest frames that a link of the routing tree must carry, without interference; for a
    tree by ETX the chance that a frame of `etx_frame_bytes` is acknowledged."""
    etx_frame_bytes: int | None = None
    """Length of the frames by which the ETX of a link is measured [B]; None for a tree of fewest hops."""
    record_frames: bool = False
    """Whether the observer hears of every frame."""

    def __post_init__(self) -> None:
        at_least = {
            "min_be": 0,
            "max_be": self.min_be,
            "max_csma_backoffs": 0,
            "max_frame_retries": 0,
            "max_channel_retries": 0,
            "queue_frames": 1,
            "outbox_datagrams": 1,
        }
        for name, least in at_least.items():
            if getattr(self, name) < least:
                raise ValueError(f"{name}: must be at least {least}, got {getattr(self, name)}")
        for name in ("duplicate_lifetime_s", "reassembly_timeout_s"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name}: must be positive, got {getattr(self, name)} [s]")
        if self.mesh_header_bytes not in (0, 5):
            raise ValueError(f"mesh_header_bytes: must be 0 or 5, got {self.mesh_header_bytes}")
        if not 0.0 < self.link_success_min < 1.0:
            raise ValueError(f"link_success_min: must be between 0 and 1, got {self.link_success_min}")
        if self.etx_frame_bytes is not None and not 1 <= self.etx_frame_bytes <= MAX_MPDU_BYTES:
            raise ValueError(f"etx_frame_bytes: must be 1 to {MAX_MPDU_BYTES}, got {self.etx_frame_bytes}")
        if not 0 <= self.pan_id < 0xFFFF:
            raise ValueError(f"pan_id: must be 0 to 65534, got {self.pan_id}")
