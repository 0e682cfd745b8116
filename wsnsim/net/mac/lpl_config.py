"""Parameters of low-power listening, and the times that its parts must leave for each other."""

from dataclasses import dataclass

from wsnsim.net.mac.napping import START_UP_NS
from wsnsim.net.phy.ieee802154 import ACK_WAIT_NS, CCA_NS, MAX_MPDU_BYTES, TURNAROUND_NS, air_time_ns
from wsnsim.types import Nanoseconds
from wsnsim.units import to_ns, to_s


def step_ns(mpdu_bytes: int) -> Nanoseconds:
    """Return the time from one copy of a unicast frame to the next in a train [ns].

    Parameters
    ----------
    mpdu_bytes : length of the frame, frame check sequence included [B]
    """
    return air_time_ns(mpdu_bytes) + ACK_WAIT_NS + TURNAROUND_NS


def quiet_ns() -> Nanoseconds:
    """Return the time for which the channel must be quiet before a train begins [ns].

    The longest gap between two copies of another train, and a window of clear channel assessment.
    """
    return ACK_WAIT_NS + TURNAROUND_NS + CCA_NS


@dataclass(frozen=True)
class LplConfig:
    """How often nodes look, and how long senders try.

    Raises
    ------
    ValueError : a number outside its range
    """

    wake_interval_s: float = 0.1
    """Time from one look at the channel to the next [s]."""
    check_s: float = 5.5e-3
    """How long a node listens each time [s]. The default covers the begin of a copy of the longest frame,
    so that a frame is found that is too weak for the carrier sense; TinyOS: 400 assessments, 5.8 to 11 ms."""
    after_receive_s: float = 0.02
    """How long a node stays awake after it noticed energy, got a frame, or sent one [s]; TinyOS: 0.1 s."""
    min_be: int = 4
    """The first backoff is 0 to 2^min_be - 1 periods of 320 µs: one exponent more than where a collision
    costs a single frame. TinyOS: 0.3 to 1.5 ms, before each copy."""
    max_be: int = 6
    """Limit of its growth while the channel is busy."""
    patience_intervals: int = 5
    """Wake-up intervals for which a sender waits for a free channel, before each train."""
    max_frame_retries: int = 3
    """How often an unanswered train is repeated."""
    duplicate_margin_s: float = 0.5
    """How long beyond two intervals a receiver remembers a sender's last sequence number [s]."""
    pan_id: int = 0xCAFE
    """PAN identifier in every frame."""

    def __post_init__(self) -> None:
        at_least = {"min_be": 0, "max_be": self.min_be, "patience_intervals": 1, "max_frame_retries": 0}
        for name, least in at_least.items():
            if getattr(self, name) < least:
                raise ValueError(f"{name}: must be at least {least}, got {getattr(self, name)}")
        for name, shortest_ns, why in self._shortest():
            if to_ns(getattr(self, name)) < shortest_ns:
                shortest = f"{1e3 * to_s(shortest_ns):g} ms"
                raise ValueError(f"{name}: must be at least {shortest}, {why}, got {getattr(self, name)} [s]")
        if not self.duplicate_margin_s >= 0.0:
            raise ValueError(f"duplicate_margin_s: must not be negative, got {self.duplicate_margin_s} [s]")
        if not 0 <= self.pan_id < 0xFFFF:
            raise ValueError(f"pan_id: must be 0 to 65534, got {self.pan_id}")

    def _shortest(self) -> tuple[tuple[str, Nanoseconds, str], ...]:
        step = step_ns(MAX_MPDU_BYTES)
        awake_ns = START_UP_NS + to_ns(self.check_s)
        return (
            ("check_s", quiet_ns(), "the gap between two copies of a frame and a CCA"),
            ("after_receive_s", 2 * step, "two copies of the longest frame"),
            ("wake_interval_s", awake_ns + step, "start-up, check and a copy of the longest frame"),
        )
