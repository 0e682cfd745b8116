"""Unslotted CSMA/CA of IEEE 802.15.4-2006 with acknowledgements and retries: the MAC of one node.

For each frame: wait a random number of backoff periods, assess the channel,
turn round, send, wait for the acknowledgement; begin again where the channel
was busy or no acknowledgement came. A frame from above is `submit`ted when the
MAC is idle, and its fate comes back through `Upper.done`.

Beyond the standard: a frame that found the channel busy at every try may begin
its CSMA anew, `max_channel_retries` times, under the same sequence number.
Where the standard leaves a choice: a node that receives a frame for itself
while it is in CSMA answers it first and then begins its CSMA anew; while it
waits for an acknowledgement, its own attempt counts as failed (as in ns-3).
CSMA begins when the receiver is back from sending, and after the space that a
sent frame must be followed by.

References
----------
IEEE Std 802.15.4-2006: CSMA-CA, sec. 7.5.1.4 and fig. 69; spacing, sec.
7.5.1.3; acknowledgement and retries, sec. 7.5.6.4; address filter, sec. 7.5.6.2.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from wsnsim.net.clock import Call, Clock
from wsnsim.net.interface import LinkCounters, Outcome
from wsnsim.net.mac.base import Upper
from wsnsim.net.mac.csma_ca_service import csma_ca_service_ns
from wsnsim.net.mac.exchange import Duplicates, Job
from wsnsim.net.mac.frames import (
    ACK_BYTES,
    DATA_OVERHEAD_BYTES,
    MAX_PAYLOAD_BYTES,
    MacAck,
    MacData,
    decode_frame,
)
from wsnsim.net.phy.base import BROADCAST, Phy, Transmission
from wsnsim.net.phy.ieee802154 import (
    ACK_WAIT_NS,
    CCA_NS,
    O_QPSK,
    TURNAROUND_NS,
    UNIT_BACKOFF_NS,
    interframe_space_ns,
)
from wsnsim.net.phy.medium import Medium, Radio
from wsnsim.types import Nanoseconds
from wsnsim.units import to_ns

_DRAWN_AHEAD = 16
"""Numbers that a MAC draws at a time."""


@dataclass(frozen=True)
class CsmaCaConfig:
    """Backoffs, retries and what frames carry; defaults of IEEE Std 802.15.4-2006, table 86.

    Raises
    ------
    ValueError : a number outside its range
    """

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

    def __post_init__(self) -> None:
        at_least = {
            "min_be": 0,
            "max_be": self.min_be,
            "max_csma_backoffs": 0,
            "max_frame_retries": 0,
            "max_channel_retries": 0,
        }
        for name, least in at_least.items():
            if getattr(self, name) < least:
                raise ValueError(f"{name}: must be at least {least}, got {getattr(self, name)}")
        if not self.duplicate_lifetime_s > 0.0:
            raise ValueError(f"duplicate_lifetime_s: must be positive, got {self.duplicate_lifetime_s} [s]")
        if not 0 <= self.pan_id < 0xFFFF:
            raise ValueError(f"pan_id: must be 0 to 65534, got {self.pan_id}")


class CsmaCaFamily:
    """The medium access of all nodes, as `wsnsim.net.mac.base.MacFamily` asks for it."""

    phy: Phy = O_QPSK
    max_payload_bytes = MAX_PAYLOAD_BYTES
    overhead_bytes = DATA_OVERHEAD_BYTES
    ack_bytes = ACK_BYTES

    def __init__(self, config: CsmaCaConfig | None = None) -> None:
        self._config = CsmaCaConfig() if config is None else config

    def mac(self, clock: Clock, medium: Medium, address: int, rng: np.random.Generator) -> "CsmaCa":
        """Return the MAC of the node with that address."""
        return CsmaCa(clock, medium, self._config, address, rng)

    def service_ns(self, payload_bytes: Sequence[int], contenders: int) -> Nanoseconds:
        """Return the time in which a datagram crosses one hop, as a rule [ns]."""
        mpdu_bytes = [DATA_OVERHEAD_BYTES + size for size in payload_bytes]
        return csma_ca_service_ns(mpdu_bytes, contenders, self._config.min_be)


class CsmaCa:
    """The MAC of one node.

    Parameters
    ----------
    clock : the event clock
    medium : the channel
    config : backoff exponents, limits, PAN identifier
    address : the node's short address, its row in the medium's links
    rng : backoffs and the first sequence number
    """

    __slots__ = (
        "_ack",
        "_address",
        "_answer",
        "_answering",
        "_attempts",
        "_busy",
        "_clock",
        "_config",
        "_drawn",
        "_duplicates",
        "_exponent",
        "_job",
        "_medium",
        "_radio",
        "_restarts",
        "_rng",
        "_sequence",
        "_spaced_ns",
        "_timer",
        "_upper",
        "awaits_ack",
        "counters",
    )

    def __init__(
        self, clock: Clock, medium: Medium, config: CsmaCaConfig, address: int, rng: np.random.Generator
    ) -> None:
        self.counters = LinkCounters()
        self.awaits_ack = False
        self._clock, self._medium, self._config = clock, medium, config
        self._address, self._rng = address, rng
        self._duplicates = Duplicates(to_ns(config.duplicate_lifetime_s))
        self._drawn: list[float] = []
        self._sequence = self._draw(256)
        self._job: Job | None = None
        self._attempts = self._busy = self._exponent = 0
        self._timer: Call | None = None
        self._answer: Call | None = None
        self._ack: Transmission | None = None
        self._answering = False
        self._spaced_ns: Nanoseconds = 0

    def connect(self, radio: Radio, upper: Upper) -> None:
        """Join the MAC to its radio and to the layer above, before anything else."""
        self._radio, self._upper = radio, upper

    @property
    def idle(self) -> bool:
        """Whether a frame may be submitted."""
        return self._job is None

    def submit(self, payload: bytes, destination: int, meant: tuple[int, ...], cargo: Any) -> None:
        """Send a payload to a neighbour or to all; the MAC must be idle.

        Parameters
        ----------
        payload : at most 116 B
        destination : short address, or `BROADCAST`
        meant : nodes whose reception is worth a record
        cargo : kept beside the bytes, for the receiver's upper layer
        """
        self._sequence = (self._sequence + 1) % 256
        unicast = destination != BROADCAST
        frame = MacData(
            self._sequence, self._config.pan_id, destination, self._address, payload, ack_request=unicast
        )
        self._job = Job(frame.encode(), destination, meant, cargo)
        self._attempts = self._restarts = 0
        if not self._answering:
            self._contend()

    def stop(self) -> None:
        """Stop for good."""
        for call in (self._timer, self._answer):
            if call is not None:
                call.cancel()
        self.awaits_ack = False
        self._medium.silence(self._radio)

    def received(self, transmission: Transmission) -> None:
        """Take a frame from the radio."""
        frame, counters = decode_frame(transmission.mpdu), self.counters
        if isinstance(frame, MacAck):
            if self.awaits_ack:
                counters.mac_rx_bytes += len(transmission.mpdu)
                self._acknowledged(frame.sequence)
            return
        counters.mac_rx_bytes += len(transmission.mpdu)
        if frame.ack_request:
            self._prepare_answer(frame)
        if self._duplicates.is_new(frame.source, frame.sequence, self._clock.now):
            self._upper.received(frame.payload, frame.source, transmission.cargo)

    def carrier(self, busy: bool) -> None:
        """Do nothing: this MAC looks at the channel when it needs to."""

    def sent(self, transmission: Transmission) -> None:
        """Learn from the radio that a frame of this node is over."""
        if transmission.kind == "ack":
            self._answering = False
            if self._job is not None:
                self._contend()
        elif transmission.kind == "broadcast":
            self._finish(None)
        else:
            self.awaits_ack = True
            self._timer = self._clock.call(ACK_WAIT_NS, self._unacknowledged)

    def _draw(self, count: int) -> int:
        # `Generator.integers` takes five times as long; a power of two loses nothing this way. Drawn ahead,
        # for in a large network a generator is never in the processor's cache when it is wanted.
        if not self._drawn:
            self._drawn = self._rng.random(_DRAWN_AHEAD)[::-1].tolist()
        return int(self._drawn.pop() * count)

    def _contend(self) -> None:
        self._busy, self._exponent = 0, self._config.min_be
        self._back_off()

    def _back_off(self) -> None:
        now = self._clock.now
        begin = max(now, self._spaced_ns, self._radio.deaf_until_ns)
        end = begin + self._draw(1 << self._exponent) * UNIT_BACKOFF_NS + CCA_NS
        self._timer = self._clock.call(end - now, self._assess)

    def _assess(self) -> None:
        self.counters.cca_total += 1
        if not self._medium.busy(self._radio):
            self._medium.turn(self._radio)
            self._timer = self._clock.call(TURNAROUND_NS, self._transmit)
            return
        self.counters.cca_busy += 1
        self._busy += 1
        if self._busy > self._config.max_csma_backoffs:
            if self._restarts < self._config.max_channel_retries:
                self._restarts += 1
                self._contend()
            else:
                self._finish(Outcome.CHANNEL)
        else:
            self._exponent = min(self._exponent + 1, self._config.max_be)
            self._back_off()

    def _transmit(self) -> None:
        job = self._job
        if job is None:
            return
        self._attempts += 1
        if self._attempts > 1:
            self.counters.frames_retried += 1
        kind = "broadcast" if job.destination == BROADCAST else "data"
        self.counters.attempts += kind == "data"
        self._put_on_air(
            Transmission(self._address, job.mpdu, job.destination, job.meant, kind, self._attempts, job.cargo)
        )

    def _acknowledge(self) -> None:
        ack, self._ack, self._answer = self._ack, None, None
        assert ack is not None
        self._put_on_air(ack)

    def _put_on_air(self, frame: Transmission) -> None:
        self.counters.frames_tx += 1
        self.counters.mac_tx_bytes += len(frame.mpdu)
        self._medium.transmit(frame)

    def _acknowledged(self, sequence: int) -> None:
        if sequence == self._sequence:
            self._finish(None)
        else:
            # Sec. 7.5.6.4.3: an acknowledgement of another frame means that this attempt has failed.
            self._unacknowledged()

    def _unacknowledged(self) -> None:
        self.counters.attempts_failed += 1
        self._stop_waiting()
        if self._attempts > self._config.max_frame_retries:
            self._finish(Outcome.NO_ACK)
        elif not self._answering:
            self._contend()

    def _stop_waiting(self) -> None:
        self.awaits_ack = False
        if self._timer is not None:
            self._timer.cancel()

    def _finish(self, outcome: Outcome | None) -> None:
        self._stop_waiting()
        job, self._job = self._job, None
        if outcome is None and job is not None:
            self._spaced_ns = self._clock.now + interframe_space_ns(len(job.mpdu))
        self._upper.done(outcome)

    def _prepare_answer(self, frame: MacData) -> None:
        """Turn round for an acknowledgement; CSMA begins anew after it."""
        self._answering = True
        self._medium.turn(self._radio)
        self._ack = Transmission(
            self._address, MacAck(frame.sequence).encode(), frame.source, (frame.source,), "ack"
        )
        self._answer = self._clock.call(TURNAROUND_NS, self._acknowledge)
        if self.awaits_ack:
            self._unacknowledged()
        elif self._timer is not None:
            self._timer.cancel()
