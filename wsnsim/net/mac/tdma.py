"""TDMA on the routing tree: the MAC of one node that sends in slots of its own and sleeps in others'.

Slots come from `wsnsim.net.mac.slots` before a run; superframes follow each
other without end. A node's radio is on in three kinds of slots only: its own,
if it has something to send; its children's turns up; and its parent's turns
down. A receiver that has heard no frame begin within two guards sleeps again.
There is no carrier sense. A frame that is not acknowledged is sent again in the
next own slot of its direction; a broadcast is sent once, to the children (by a
node without children: to its parent), and other neighbours sleep through it.

Each node has a clock that runs fast or slow; that of the base station and of
the sinks wired to it is right. A node sets its clock by every beacon, broadcast and frame for itself that it
hears from its parent, which begins at a known time of its slot. (An
acknowledgement tells nothing, for it follows the node's own frame.) A node with
children sends them a beacon when it has sent to all of them nothing else for a
while. A node whose clock is off by more than the guard misses its neighbours,
and they miss it; nothing finds it again but chance, when it is a whole superframe off.

Left out: how nodes join and learn the slots (all know them, and the time, at
the beginning); new slots when the tree changes: the timetable is fixed.

References
----------
IEEE Std 802.15.4-2006, sec. 7.5.6.4: acknowledgement; sec. 7.2.2.1: beacon.
Time by the instant at which a parent's frame arrives: as in the time-slotted
channel hopping of IEEE Std 802.15.4e-2012.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from wsnsim.hardware.clocks import DriftingClock
from wsnsim.net.clock import Call, Clock
from wsnsim.net.interface import LinkCounters, Outcome
from wsnsim.net.mac.base import Upper
from wsnsim.net.mac.beacons import MacBeacon, decode_beacon
from wsnsim.net.mac.exchange import Duplicates, Job
from wsnsim.net.mac.frames import MacAck, MacData, decode_frame
from wsnsim.net.mac.napping import Napper
from wsnsim.net.mac.slots import Duty, Part, Timetable
from wsnsim.net.mac.tdma_config import TdmaConfig
from wsnsim.net.phy.base import BROADCAST, Transmission
from wsnsim.net.phy.ieee802154 import ACK_WAIT_NS, TURNAROUND_NS, air_time_ns
from wsnsim.net.phy.medium import Medium, Radio
from wsnsim.types import Nanoseconds
from wsnsim.units import to_ns


class Tdma:
    """The MAC of one node.

    Parameters
    ----------
    clock : the event clock
    medium : the channel
    config : slots, guards and clocks
    table : who sends when
    address : the node's short address, its row in the medium's links
    rng : the drift of the clock and the first sequence number
    """

    awaits_ack = False

    def __init__(
        self,
        clock: Clock,
        medium: Medium,
        config: TdmaConfig,
        table: Timetable,
        address: int,
        rng: np.random.Generator,
    ) -> None:
        self.counters = LinkCounters()
        self._clock, self._medium, self._config = clock, medium, config
        self._address = address
        self._parent, self._children = table.parents[address], table.children[address]
        self._duties = table.duties(address)
        self._superframe_ns = table.length * config.slot_ns
        self._duplicates = Duplicates(2 * (config.max_frame_retries + 1) * self._superframe_ns)
        drift_ppm = config.drift_ppm * (2.0 * rng.random() - 1.0)
        self.time = DriftingClock(0.0 if self._parent is None else drift_ppm)
        self._sequence = int(rng.random() * 256)
        self._job: Job | None = None
        self._part = Part.SEND_UP
        """In which of its own slots the node sends it."""
        self._attempts = 0
        self._superframe, self._next_duty = 0, 0
        self._duty: Duty | None = None
        self._slot_ns: Nanoseconds = 0
        """When the present slot begins, by the node's clock."""
        self._told_children_ns: Nanoseconds = 0
        self._beaconed = False
        """Whether the last frame down was a beacon; a frame that waits goes next, whatever is due."""
        self._timer: Call | None = None

    def connect(self, radio: Radio, upper: Upper) -> None:
        """Join the MAC to its radio and to the layer above, and let the radio sleep."""
        self._radio, self._upper = radio, upper
        self._napper = Napper(self._clock, self._medium, radio)
        self._napper.sleep()
        self._await_duty()

    @property
    def idle(self) -> bool:
        """Whether a frame may be submitted."""
        return self._job is None

    def submit(self, payload: bytes, destination: int, meant: tuple[int, ...], cargo: Any) -> None:
        """Send a payload to the parent, a child or all children; the MAC must be idle.

        Parameters
        ----------
        payload : at most 116 B
        destination : short address, or `BROADCAST`
        meant : nodes whose reception is worth a record
        cargo : kept beside the bytes, for the receiver's upper layer
        """
        unicast = destination != BROADCAST
        frame = MacData(
            self._number(), self._config.pan_id, destination, self._address, payload, ack_request=unicast
        )
        up = destination == self._parent or not self._children
        self._part = Part.SEND_UP if up else Part.SEND_DOWN
        self._job = Job(frame.encode(), destination, meant, cargo)
        self._attempts = 0
        if not self._duties:
            self._timer = self._clock.call(0, lambda: self._finish(Outcome.NO_ACK))

    def stop(self) -> None:
        """Stop for good."""
        self._stop_timer()
        self.awaits_ack = False
        self._napper.stop()

    def carrier(self, busy: bool) -> None:
        """Do nothing: this MAC knows when it may send."""

    def received(self, transmission: Transmission) -> None:
        """Take a frame from the radio."""
        beacon = decode_beacon(transmission.mpdu)
        frame = decode_frame(transmission.mpdu) if beacon is None else beacon
        if isinstance(frame, MacAck):
            if self.awaits_ack:
                self.counters.mac_rx_bytes += len(transmission.mpdu)
                if frame.sequence == self._job_sequence:
                    self._finish(None)
            return
        self.counters.mac_rx_bytes += len(transmission.mpdu)
        if self._duty is not None and self._duty.part is Part.HEAR_PARENT and frame.source == self._parent:
            begun_ns = self._slot_ns + self._config.begin_ns
            self.time.set(self._clock.now, begun_ns + air_time_ns(len(transmission.mpdu)))
        if isinstance(frame, MacData) and frame.ack_request:
            self._prepare_answer(frame)
        else:
            self._close()
        if isinstance(frame, MacData) and self._duplicates.is_new(
            frame.source, frame.sequence, self._clock.now
        ):
            self._upper.received(frame.payload, frame.source, transmission.cargo)

    def sent(self, transmission: Transmission) -> None:
        """Learn from the radio that a frame of this node is over."""
        if transmission.address == BROADCAST:
            self._told_children_ns = self._slot_ns
        if transmission.kind == "broadcast":
            self._finish(None)
        elif transmission.kind == "data":
            self.counters.attempts += 1
            self.awaits_ack = True
            self._timer = self._clock.call(ACK_WAIT_NS, self._unanswered)
        else:
            self._close()

    def _number(self) -> int:
        self._sequence = (self._sequence + 1) % 256
        return self._sequence

    @property
    def _job_sequence(self) -> int | None:
        return None if self._job is None else self._job.mpdu[2]

    def _await_duty(self) -> None:
        """Wait for the next slot in which this node has something to do."""
        if not self._duties:
            return
        duty = self._duties[self._next_duty]
        self._duty = duty
        self._slot_ns = self._superframe * self._superframe_ns + duty.slot * self._config.slot_ns
        self._next_duty += 1
        if self._next_duty == len(self._duties):
            self._next_duty, self._superframe = 0, self._superframe + 1
        if duty.part in (Part.SEND_UP, Part.SEND_DOWN):
            # a sender that wakes now has started and turned round when its frame must begin
            self._call_at(to_ns(self._config.guard_s), self._speak)
        else:
            self._call_at(TURNAROUND_NS, self._hear)

    def _call_at(self, after_ns: Nanoseconds, action: Callable[[], None]) -> None:
        """Do something at a time of the present slot by the node's clock, or at once if that has passed."""
        delay_ns = self.time.true_ns(self._slot_ns + after_ns) - self._clock.now
        self._timer = self._clock.call(max(0, delay_ns), action)

    def _speak(self) -> None:
        assert self._duty is not None
        part, job = self._duty.part, self._job
        may_send = job is not None and self._part is part
        if part is Part.SEND_DOWN and self._beacon_is_due() and not (may_send and self._beaconed):
            self._beaconed = True
            self._napper.wake(self._send_beacon, TURNAROUND_NS)
        elif may_send:
            self._beaconed = False
            self._napper.wake(self._send_job, TURNAROUND_NS)
        else:
            self._await_duty()

    def _beacon_is_due(self) -> bool:
        """Whether the children need a beacon, and what waits to be sent would not do as well."""
        if self._job is not None and self._job.destination == BROADCAST:
            return False
        return self._slot_ns - self._told_children_ns >= to_ns(self._config.resync_s)

    def _hear(self) -> None:
        self._napper.wake(self._listen)

    def _listen(self) -> None:
        ready_ns = self._config.begin_ns - to_ns(self._config.guard_s)
        self._call_at(ready_ns + self._config.window_ns, self._decide)

    def _decide(self) -> None:
        """Sleep if no frame has begun; else wait for it to end."""
        if self._medium.watch(self._radio):
            self._call_at(self._config.busy_ns, self._close)
        else:
            self._close()

    def _send_beacon(self) -> None:
        beacon = MacBeacon(self._number(), self._config.pan_id, self._address)
        self._put_on_air(Transmission(self._address, beacon.encode(), BROADCAST, self._children, "beacon"))

    def _send_job(self) -> None:
        job = self._job
        assert job is not None
        self._attempts += 1
        if self._attempts > 1:
            self.counters.frames_retried += 1
        kind = "broadcast" if job.destination == BROADCAST else "data"
        self._put_on_air(
            Transmission(self._address, job.mpdu, job.destination, job.meant, kind, self._attempts, job.cargo)
        )

    def _put_on_air(self, frame: Transmission) -> None:
        self.counters.frames_tx += 1
        self.counters.mac_tx_bytes += len(frame.mpdu)
        self._medium.transmit(frame)

    def _unanswered(self) -> None:
        self.counters.attempts_failed += 1
        if self._attempts > self._config.max_frame_retries:
            self._finish(Outcome.NO_ACK)
        else:
            self._close()

    def _finish(self, outcome: Outcome | None) -> None:
        self._job = None
        if self._duties:
            self._close()
        self._upper.done(outcome)

    def _close(self) -> None:
        """Sleep until the next duty."""
        self._stop_timer()
        self.awaits_ack = False
        self._napper.sleep()
        self._await_duty()

    def _stop_timer(self) -> None:
        if self._timer is not None:
            self._timer.cancel()

    def _prepare_answer(self, frame: MacData) -> None:
        self._stop_timer()
        self._medium.turn(self._radio)
        ack = Transmission(
            self._address, MacAck(frame.sequence).encode(), frame.source, (frame.source,), "ack"
        )
        self._timer = self._clock.call(TURNAROUND_NS, lambda: self._put_on_air(ack))
