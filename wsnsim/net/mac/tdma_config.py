"""Parameters of TDMA, and the times inside a slot.

A slot is start-up, turnaround, guard, the longest frame, the wait for its
acknowledgement, guard. A sender begins its frame one guard after the receivers
are ready, so that their clocks may differ by one guard either way.
"""

from dataclasses import dataclass

from wsnsim.net.mac.napping import START_UP_NS
from wsnsim.net.phy.ieee802154 import ACK_WAIT_NS, MAX_MPDU_BYTES, SYNC_NS, TURNAROUND_NS, air_time_ns
from wsnsim.types import Nanoseconds, Seconds
from wsnsim.units import to_ns, to_s


@dataclass(frozen=True)
class TdmaConfig:
    """Slots, guards and clocks.

    Raises
    ------
    ValueError : a number outside its range, a slot too short for a frame, or a guard too short for the drift
    """

    slot_s: Seconds | None = None
    """Length of a slot [s]; None: as short as guards, the longest frame and its acknowledgement let it be."""
    guard_s: Seconds = 1e-3
    """How far the clocks of two nodes may be apart [s]."""
    drift_ppm: float = 20.0
    """Each node's clock but the base station's runs fast or slow by up to this, evenly distributed
    [parts per million]. IEEE Std 802.15.4-2006, sec. 6.9.4, allows 40."""
    resync_s: Seconds = 2.0
    """Time after which a node that has sent nothing to all its children sends them a beacon [s]."""
    interference_dbm: float | None = None
    """Power from which on a node disturbs another [dBm]; None: 10 dB below the radios' sensitivity, where
    another node adds less than half a decibel to the noise under the weakest frame."""
    proportional: bool = True
    """Whether a node gets a turn to send up for each node that sends through it, itself included, or one."""
    max_frame_retries: int = 3
    """How often an unacknowledged frame is sent again, in the node's next slot."""
    pan_id: int = 0xCAFE
    """PAN identifier in every frame."""

    def __post_init__(self) -> None:
        if not self.guard_s > 0.0:
            raise ValueError(f"guard_s: must be positive, got {self.guard_s} [s]")
        if not self.drift_ppm >= 0.0:
            raise ValueError(f"drift_ppm: must not be negative, got {self.drift_ppm} [ppm]")
        if not self.resync_s > 0.0:
            raise ValueError(f"resync_s: must be positive, got {self.resync_s} [s]")
        if self.max_frame_retries < 0:
            raise ValueError(f"max_frame_retries: must be at least 0, got {self.max_frame_retries}")
        if not 0 <= self.pan_id < 0xFFFF:
            raise ValueError(f"pan_id: must be 0 to 65534, got {self.pan_id}")
        if self.slot_s is not None and to_ns(self.slot_s) < self.busy_ns:
            raise ValueError(
                f"slot_s: must be at least {to_s(self.busy_ns):g} s for start-up, two guards of "
                f"{self.guard_s:g} s, the longest frame and its acknowledgement, got {self.slot_s:g} [s]"
            )
        self.check_guard(1, 0)

    @property
    def begin_ns(self) -> Nanoseconds:
        """From the begin of a slot to that of its frame [ns]."""
        return START_UP_NS + TURNAROUND_NS + to_ns(self.guard_s)

    @property
    def window_ns(self) -> Nanoseconds:
        """How long a receiver that is ready waits for a frame's header to have come [ns]."""
        return 2 * to_ns(self.guard_s) + SYNC_NS

    @property
    def busy_ns(self) -> Nanoseconds:
        """From the begin of a slot until all must be over [ns]."""
        return self.begin_ns + air_time_ns(MAX_MPDU_BYTES) + ACK_WAIT_NS + to_ns(self.guard_s)

    @property
    def slot_ns(self) -> Nanoseconds:
        """Length of a slot [ns]."""
        return self.busy_ns if self.slot_s is None else to_ns(self.slot_s)

    def check_guard(self, height: int, superframe_ns: Nanoseconds) -> None:
        """Make sure that the guard covers the drift.

        A node hears its parent at least every `resync_s` and two superframes, and is then as wrong as its
        parent. So a node d hops from the base is wrong by at most d·drift·(resync + 2 superframes), and two
        nodes differ by twice as much at most. (Beacons that are lost to noise are not allowed for.)

        Parameters
        ----------
        height : hops from the base to the farthest node
        superframe_ns : length of the superframe [ns]

        Raises
        ------
        ValueError : it does not
        """
        every_s = self.resync_s + 2.0 * to_s(superframe_ns)
        apart_s = 2e-6 * height * self.drift_ppm * every_s
        if self.guard_s < apart_s:
            hops = "1 hop" if height == 1 else f"{height} hops"
            raise ValueError(
                f"guard_s: must be at least {apart_s:.4g} s, by which clocks of {self.drift_ppm:g} ppm "
                f"differ over {hops} when set every {every_s:g} s, got {self.guard_s:g} [s]; make it longer, "
                "or resync_s shorter"
            )
