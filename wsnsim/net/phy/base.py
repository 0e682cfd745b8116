"""What the channel, the MACs and the routing know of a physical layer, whatever its standard."""

from dataclasses import dataclass
from typing import Any, Protocol

from wsnsim.hardware.ledger import StateTimes
from wsnsim.types import Nanoseconds

BROADCAST = 0xFFFF
"""The address that every node takes for its own (IEEE Std 802.15.4-2006, sec. 7.5.6.2)."""


class Phy(Protocol):
    """A physical layer. A `mode` is one of its bit rates; every frame has one. Mode 0 is that of data."""

    @property
    def turnaround_ns(self) -> Nanoseconds:
        """How long a transceiver is deaf after it has sent [ns]."""

    @property
    def cca_ns(self) -> Nanoseconds:
        """Length of the window of clear channel assessment [ns]."""

    @property
    def preamble_ns(self) -> Nanoseconds:
        """How long a receiver that has noticed a frame can still turn to a stronger one [ns]."""

    @property
    def max_mpdu_bytes(self) -> int:
        """Longest frame, frame check sequence included [B]."""

    @property
    def control_mode(self) -> int:
        """The mode of acknowledgements and broadcasts."""

    @property
    def bit_rate_bps(self) -> float:
        """What the channel carries while a data frame is on the air [bit/s]."""

    def air_time_ns(self, mpdu_bytes: int, mode: int = 0) -> Nanoseconds:
        """Return how long a frame is on the air, preamble and headers included [ns]."""

    def log_success(self, sinr: float, since_ns: Nanoseconds, until_ns: Nanoseconds, mode: int = 0) -> float:
        """Return the logarithm of the probability that a stretch of a frame is received without error.

        Parameters
        ----------
        sinr : signal over noise and interference all through it, as a ratio
        since_ns, until_ns : its begin and end, counted from the begin of the frame [ns]
        mode : the frame's bit rate
        """

    def frame_success(self, sinr: float, mpdu_bytes: int, mode: int = 0) -> float:
        """Return the probability that a whole frame is received without error at one SINR (a ratio)."""


class RadioMeter(Protocol):
    """Keeps the account of one radio; it asks for the times of its states when it needs them.

    States: `listen` (receiver on: waiting, in backoff, assessing the channel or turning round),
    `receive` (locked on a frame), `transmit`, `sleep` (off) and `start` (its crystal starts). Their
    times add up to all that has passed since the radio was switched on.
    """

    def attend(self, times: StateTimes) -> None:
        """Begin the account: the radio has just been switched on."""


class Listener(Protocol):
    """The MAC above a radio."""

    awaits_ack: bool
    """Whether it takes an acknowledgement that names nobody; it becomes true in `sent` only."""

    def received(self, transmission: "Transmission") -> None:
        """Take a frame that was received without error."""

    def sent(self, transmission: "Transmission") -> None:
        """Learn that the node's own frame is over; receivers have been told before."""

    def carrier(self, busy: bool) -> None:
        """Learn that the channel has become busy or idle; called only while the radio is watched."""


@dataclass(slots=True, eq=False)
class Transmission:
    """A frame on the air."""

    sender: int
    mpdu: bytes
    address: int
    """Whom the MAC header names, or `BROADCAST`; an acknowledgement's is who waits for it."""
    meant: tuple[int, ...]
    """Nodes whose reception is worth a record."""
    kind: str
    """`data`, `broadcast`, `ack`, or what else a MAC says."""
    attempt: int = 1
    cargo: Any = None
    """What the sender's upper layers keep beside the bytes; the medium never looks at it."""
    mode: int = 0
    """The bit rate, as the physical layer numbers them."""
    start_ns: Nanoseconds = 0
    end_ns: Nanoseconds = 0
