"""Low-power listening in the manner of B-MAC and BoX-MAC-2: the MAC of one node whose radio sleeps.

A node looks at the channel once in every wake-up interval: it switches its
radio on, listens for a short while, and sleeps again if all is quiet. Where it
notices energy or a frame it stays awake for a while (the delay after receive),
and again after each frame that it gets. A sender repeats its data frame, with
room for an acknowledgement after each copy, until one comes or every receiver
must have looked: a train. A broadcast is repeated all that time.

As in TinyOS 2 (`DefaultLpl` and `PowerCycle` of its CC2420 stack): the preamble
is made of whole data frames with one sequence number; receivers look by energy
and by frames in progress; a sender stays awake for the delay after receive as
well; a wake-up that falls into a waking time is left out; duplicates are
rejected by sequence number.

Simplified or different:

- Looks lie on a fixed grid of each node's own (in TinyOS the interval begins
  when the radio goes to sleep), and all nodes have one interval.
- Backoff and carrier sense come before a train, not before each copy. The
  sender listens for the longest gap inside other trains, so that it never
  begins in one that it hears; TinyOS assesses the channel anew for each copy.
- A sender that cannot find the channel free gives up after `patience_intervals`;
  TinyOS tries for ever. An unanswered train is repeated `max_frame_retries` times,
  each time after a random part of an interval, which TinyOS leaves to its packet
  link layer.
- A train lasts the wake-up interval, a start-up and two copies; TinyOS: the
  interval and 20 ms.
- In its train a node takes no data for itself. Drift of clocks, and what the
  microcontroller does meanwhile, are left out.

References
----------
Polastre, Hill, Culler, Versatile low power media access for wireless sensor
networks (SenSys 2004): low-power listening by energy (B-MAC). Moss, Levis,
BoX-MACs: exploiting physical and link layer boundaries in low-power networking
(Stanford SING-08-00, 2008): packetised preamble with acknowledgements. TinyOS
TEP 105, Low power listening.
"""

from typing import Any

import numpy as np

from wsnsim.net.clock import Call, Clock
from wsnsim.net.interface import LinkCounters, Outcome
from wsnsim.net.mac.base import Upper
from wsnsim.net.mac.exchange import Duplicates, Job
from wsnsim.net.mac.frames import MacAck, MacData, decode_frame
from wsnsim.net.mac.lpl_config import LplConfig, quiet_ns, step_ns
from wsnsim.net.mac.napping import START_UP_NS, Napper
from wsnsim.net.phy.base import BROADCAST, Transmission
from wsnsim.net.phy.ieee802154 import (
    ACK_WAIT_NS,
    TURNAROUND_NS,
    UNIT_BACKOFF_NS,
    interframe_space_ns,
)
from wsnsim.net.phy.medium import Medium, Radio
from wsnsim.types import Nanoseconds
from wsnsim.units import to_ns


class Lpl:
    """The MAC of one node.

    Parameters
    ----------
    clock : the event clock
    medium : the channel
    config : intervals, limits, PAN identifier
    address : the node's short address, its row in the medium's links
    rng : when the node first looks, backoffs, and the first sequence number
    """

    def __init__(
        self, clock: Clock, medium: Medium, config: LplConfig, address: int, rng: np.random.Generator
    ) -> None:
        self.counters = LinkCounters()
        self.awaits_ack = False
        self._clock, self._medium, self._config = clock, medium, config
        self._address, self._rng = address, rng
        self._interval_ns = to_ns(config.wake_interval_s)
        self._check_ns = to_ns(config.check_s)
        self._after_ns = to_ns(config.after_receive_s)
        self._patience_ns = config.patience_intervals * self._interval_ns
        self._duplicates = Duplicates(2 * self._interval_ns + to_ns(config.duplicate_margin_s))
        self._phase_ns = self._draw(self._interval_ns)
        self._sequence = self._draw(256)
        self._job: Job | None = None
        self._copies = self._trains = self._exponent = 0
        self._wanted_since_ns: Nanoseconds = 0
        self._train_until_ns: Nanoseconds = 0
        self._deaf_until_ns: Nanoseconds = 0
        self._looking: Call | None = None
        """The next wake-up."""
        self._resting: Call | None = None
        """The radio going to sleep."""
        self._timer: Call | None = None
        """The next move of the frame in hand."""
        self._answer: Call | None = None
        self._checking = self._hushed = self._in_train = self._answering = False
        self._first = False
        """Whether no copy of the train that begins has been sent."""

    def connect(self, radio: Radio, upper: Upper) -> None:
        """Join the MAC to its radio and to the layer above, and let the radio sleep."""
        self._radio, self._upper = radio, upper
        self._napper = Napper(self._clock, self._medium, radio)
        self._napper.sleep()
        self._looking = self._clock.call(self._phase_ns, self._look)

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
        self._copies = self._trains = 0
        if self._napper.asleep:
            self._napper.wake(self._ready)
        elif not (self._napper.starting or self._answering):
            self._begin_contention()

    def stop(self) -> None:
        """Stop for good."""
        for call in (self._looking, self._resting, self._timer, self._answer):
            if call is not None:
                call.cancel()
        self.awaits_ack = self._checking = self._hushed = False
        self._napper.stop()

    def carrier(self, busy: bool) -> None:
        """Learn that the channel has become busy or idle."""
        if not busy:
            return
        if self._checking:
            self._stay()
        elif self._hushed:
            self._congested()

    def received(self, transmission: Transmission) -> None:
        """Take a frame from the radio."""
        frame = decode_frame(transmission.mpdu)
        if isinstance(frame, MacAck):
            if self.awaits_ack:
                self.counters.mac_rx_bytes += len(transmission.mpdu)
                if frame.sequence == self._sequence:
                    self._finish(None)
            return
        self.counters.mac_rx_bytes += len(transmission.mpdu)
        if frame.ack_request and self._in_train:
            return
        self._stay()
        if frame.ack_request:
            self._prepare_answer(frame)
        if self._duplicates.is_new(frame.source, frame.sequence, self._clock.now):
            self._upper.received(frame.payload, frame.source, transmission.cargo)

    def sent(self, transmission: Transmission) -> None:
        """Learn from the radio that a frame of this node is over."""
        now = self._clock.now
        self._deaf_until_ns = now + TURNAROUND_NS
        if transmission.kind == "ack":
            self._answering = False
            if self._job is not None:
                self._begin_contention()
        elif transmission.kind == "broadcast":
            space_ns = interframe_space_ns(len(transmission.mpdu))
            if now + space_ns > self._train_until_ns:
                self._finish(None)
            else:
                self._medium.turn(self._radio)
                self._timer = self._clock.call(space_ns, self._transmit)
        else:
            self.counters.attempts += 1
            self.awaits_ack = True
            self._timer = self._clock.call(ACK_WAIT_NS, self._unanswered)

    def _draw(self, count: int) -> int:
        return int(self._rng.random() * count)

    def _look(self) -> None:
        """Look whether anybody sends, unless the radio is on anyway."""
        now = self._clock.now
        looks = (now - self._phase_ns) // self._interval_ns
        self._looking = self._clock.call(self._phase_ns + (looks + 1) * self._interval_ns - now, self._look)
        if self._napper.asleep:
            self._napper.wake(self._ready)

    def _ready(self) -> None:
        busy = self._medium.watch(self._radio)
        if self._job is not None:
            self._begin_contention()
        elif busy:
            self._stay()
        else:
            self._checking = True
            self._resting = self._clock.call(self._check_ns, self._rest)

    def _stay(self) -> None:
        """Keep the radio on for the delay after receive, from now on."""
        self._checking = False
        if self._resting is not None:
            self._resting.cancel()
        self._resting = self._clock.call(self._after_ns, self._rest)

    def _rest(self) -> None:
        self._checking = False
        self._resting = None
        if self._job is None and not self._answering:
            self._napper.sleep()

    def _begin_contention(self) -> None:
        self._checking = False
        self._wanted_since_ns = self._clock.now
        self._exponent = self._config.min_be
        self._back_off()

    def _back_off(self) -> None:
        now = self._clock.now
        begin = max(now, self._deaf_until_ns) + self._draw(1 << self._exponent) * UNIT_BACKOFF_NS
        self._timer = self._clock.call(begin - now, self._hush)

    def _hush(self) -> None:
        """Listen for longer than a train of others is silent."""
        self.counters.cca_total += 1
        if self._medium.watch(self._radio):
            self._congested()
        else:
            self._hushed = True
            self._timer = self._clock.call(quiet_ns(), self._begin_train)

    def _congested(self) -> None:
        self.counters.cca_busy += 1
        self._stop_timer()
        if self._clock.now - self._wanted_since_ns > self._patience_ns:
            # not from inside the medium's call, which is about to tell others of the same frame
            self._timer = self._clock.call(0, lambda: self._finish(Outcome.CHANNEL))
        else:
            self._exponent = min(self._exponent + 1, self._config.max_be)
            self._back_off()

    def _begin_train(self) -> None:
        job = self._job
        assert job is not None
        self._hushed, self._in_train, self._first = False, True, True
        train_ns = self._interval_ns + START_UP_NS + 2 * step_ns(len(job.mpdu))
        self._train_until_ns = self._clock.now + TURNAROUND_NS + train_ns
        self._medium.turn(self._radio)
        self._timer = self._clock.call(TURNAROUND_NS, self._transmit)

    def _transmit(self) -> None:
        job = self._job
        assert job is not None
        self._copies += 1
        kind = "broadcast" if job.destination == BROADCAST else "data"
        self.counters.frames_retried += self._copies > 1 and kind == "data"
        self.counters.copies += not self._first
        self._first = False
        self._put_on_air(
            Transmission(self._address, job.mpdu, job.destination, job.meant, kind, self._copies, job.cargo)
        )

    def _put_on_air(self, frame: Transmission) -> None:
        self.counters.frames_tx += 1
        self.counters.mac_tx_bytes += len(frame.mpdu)
        self._medium.transmit(frame)

    def _unanswered(self) -> None:
        self.awaits_ack = False
        self.counters.attempts_failed += 1
        if self._clock.now + TURNAROUND_NS <= self._train_until_ns:
            self._medium.turn(self._radio)
            self._timer = self._clock.call(TURNAROUND_NS, self._transmit)
            return
        self._in_train = False
        self._trains += 1
        if self._trains > self._config.max_frame_retries:
            self._finish(Outcome.NO_ACK)
        else:
            # two senders that do not hear each other would otherwise collide again, all train long
            self._timer = self._clock.call(self._draw(self._interval_ns), self._begin_contention)

    def _finish(self, outcome: Outcome | None) -> None:
        self.awaits_ack = self._in_train = False
        self._stop_timer()
        self._job = None
        self._stay()
        self._upper.done(outcome)

    def _stop_timer(self) -> None:
        self._hushed = False
        if self._timer is not None:
            self._timer.cancel()

    def _prepare_answer(self, frame: MacData) -> None:
        """Turn round for an acknowledgement; contention begins anew after it."""
        self._answering = True
        self._stop_timer()
        self._medium.turn(self._radio)
        ack = Transmission(
            self._address, MacAck(frame.sequence).encode(), frame.source, (frame.source,), "ack"
        )
        self._answer = self._clock.call(TURNAROUND_NS, lambda: self._put_on_air(ack))
