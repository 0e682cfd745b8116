"""A node at work: one processor, one program, inputs that wait while it is busy."""

import math
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial

from wsnsim.errors import OutputError, SimulationError, WsnsimError
from wsnsim.hardware.profiles import Platform
from wsnsim.hardware.work import Work
from wsnsim.net.clock import Clock
from wsnsim.records import EstimateRow, EventRow, Sink
from wsnsim.sim.power import NodePower
from wsnsim.systems.base import Context, Program, Received, Role, Send, Step, TrackEstimate
from wsnsim.types import Nanoseconds, NodeId
from wsnsim.units import to_ns, to_s
from wsnsim.vision.frame import Frame

Job = Callable[[Context], tuple[Work, Callable[[], None]]]
"""Something for the processor: called when it begins, returns the work and what takes effect after it."""


def _nobody(node: NodeId) -> None:
    """Tell nobody."""


def _alone(node: NodeId) -> tuple[NodeId, ...]:
    """Name nobody."""
    return ()


def _unlimited(node: NodeId) -> float:
    """Set no limit to what a program says."""
    return math.inf


class Node:
    """Runs a program on a platform.

    What the program does with an input takes effect when the processor has
    done the work of it. Messages and timers that arrive meanwhile wait; a frame
    that finds the processor busy is skipped.

    Parameters
    ----------
    send : hands a message of this node to the network
    on_death : told when the node's battery is empty
    settled : told when an input has taken effect
    allowance_bytes : says how much a node's program may say now [B]
    neighbours : names whom a node can speak with directly
    """

    def __init__(
        self,
        clock: Clock,
        node: NodeId,
        role: Role,
        program: Program,
        platform: Platform,
        power: NodePower,
        sink: Sink,
        send: Callable[[Send], None],
        on_death: Callable[[NodeId], None],
        settled: Callable[[NodeId], None] = _nobody,
        allowance_bytes: Callable[[NodeId], float] = _unlimited,
        neighbours: Callable[[NodeId], tuple[NodeId, ...]] = _alone,
    ) -> None:
        self.id = node
        self.role = role
        self.power = power
        self.platform = platform
        self.busy = False
        """Whether the processor has work."""
        self.died_at_s: float | None = None
        self.work_longest_ns: Nanoseconds = 0
        """Longest time that the work on one input takes, or would have taken."""
        self.images_taken = 0
        self.images_skipped = 0
        self._clock = clock
        self._program = program
        self._sink = sink
        self._send = send
        self._on_death = on_death
        self._settled = settled
        self._allowance_bytes = allowance_bytes
        self._neighbours = neighbours
        self._waiting: deque[Job] = deque()
        self._concluding = False

    @property
    def alive(self) -> bool:
        """Whether the node still runs."""
        return self.died_at_s is None

    def start(self) -> None:
        """Begin the program, if the battery holds anything."""
        self.power.watch(self._die)
        self._ask(self._program.on_start)

    def take_frame(self, frame: Frame) -> None:
        """Give the program an image."""
        self._ask(lambda ctx: self._program.on_frame(ctx, frame))

    def take_message(self, message: Received) -> None:
        """Give the program a message."""
        self._ask(lambda ctx: self._program.on_payload(ctx, message))

    def take_key(self, key: str) -> None:
        """Call the program by a key that it set."""
        self._ask(lambda ctx: self._program.on_timer(ctx, key))

    def take(self, job: Job) -> None:
        """Give the processor something to do, in its turn."""
        if self.alive:
            self._waiting.append(job)
            self._work_on()

    def skip_frame(self, step: int, why: str) -> None:
        """Count a frame that could not be taken."""
        self.images_skipped += 1
        self.tell("frame_skipped", f"frame {step}: {why}")

    def tell(self, kind: str, detail: str, step: int | None = None) -> None:
        """Record an event of this node, of a tracking step where figures are made of it."""
        self._sink.write(EventRow(to_s(self._clock.now), self.id, kind, detail, step))

    def _die(self) -> None:
        """Stop at once: nothing waits, nothing finishes."""
        empty = self.power.ledger.empty_at_ns()
        self.died_at_s = to_s(self._clock.now if empty is None else min(empty, self._clock.now))
        self.tell("death", "the battery is empty")
        self._waiting.clear()
        self._on_death(self.id)

    def _ask(self, program: Callable[[Context], Step]) -> None:
        """Give the program an input in its turn."""

        def job(ctx: Context) -> tuple[Work, Callable[[], None]]:
            step = program(ctx)
            return step.work, partial(self._take_effect, step)

        self.take(job)

    def _work_on(self) -> None:
        """Do what waits, until something takes time."""
        # what comes while something takes effect waits until all of it has
        while self._waiting and not self.busy and not self._concluding:
            job = self._waiting.popleft()
            with self.blamed():
                work, conclude = job(self._context())
                duration = to_ns(self.platform.seconds(work))
            self.work_longest_ns = max(self.work_longest_ns, duration)
            if duration == 0:
                self._conclude(conclude)
            else:
                self.busy = True
                self.power.cpu(busy=True)
                self._clock.call(duration, partial(self._end, conclude))

    def _context(self) -> Context:
        now_s, left_j = to_s(self._clock.now), self.power.left_j()
        return Context(self.id, now_s, left_j, self._allowance_bytes(self.id), self._neighbours(self.id))

    def _end(self, conclude: Callable[[], None]) -> None:
        if self.alive:
            self.busy = False
            self.power.cpu(busy=False)
            self._conclude(conclude)
            self._work_on()

    def _conclude(self, conclude: Callable[[], None]) -> None:
        """Let something take effect, now that its work is done."""
        self._concluding = True
        with self.blamed():
            conclude()
            self._settled(self.id)
        self._concluding = False

    def _take_effect(self, step: Step) -> None:
        for note in step.notes:
            self.tell(note.kind, note.detail, note.step)
        for estimate in step.estimates:
            self._sink.write(self._row(estimate))
        for timer in step.timers:
            self._set_timer(timer.key, timer.at)
        for send in step.sends:
            self._send(send)

    @contextmanager
    def blamed(self) -> Iterator[None]:
        """Name time and node where a program fails, or asks for what cannot be done."""
        try:
            yield
        except (SimulationError, OutputError):
            raise
        except Exception as error:
            reason = str(error) if isinstance(error, WsnsimError) else repr(error)
            raise SimulationError(f"the program failed: {reason}", to_s(self._clock.now), self.id) from error

    def _set_timer(self, key: str, at: float) -> None:
        delay = max(0, to_ns(at) - self._clock.now)
        self._clock.call(delay, partial(self.take_key, key))

    def _row(self, estimate: TrackEstimate) -> EstimateRow:
        belief, cov = estimate.belief, estimate.cov
        x, y, z = (float(value) for value in belief.position)
        vx, vy, vz = (float(value) for value in belief.velocity)
        qw, qx, qy, qz = (float(value) for value in belief.orientation)
        return EstimateRow(
            time_s=estimate.time,
            made_at_s=to_s(self._clock.now),
            node=self.id,
            track=estimate.track,
            x_m=x,
            y_m=y,
            z_m=z,
            vx_mps=vx,
            vy_mps=vy,
            vz_mps=vz,
            cov_xx_m2=float(cov[0, 0]),
            cov_xy_m2=float(cov[0, 1]),
            cov_xz_m2=float(cov[0, 2]),
            cov_yy_m2=float(cov[1, 1]),
            cov_yz_m2=float(cov[1, 2]),
            cov_zz_m2=float(cov[2, 2]),
            qw=qw,
            qx=qx,
            qy=qy,
            qz=qz,
            asked=estimate.asked,
            heard=estimate.heard,
            kind=estimate.basis.value,
        )
