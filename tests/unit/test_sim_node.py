"""A node at work: one processor, inputs that wait, a battery that ends everything at its instant."""

from collections.abc import Callable

import pytest
import simpy

from wsnsim.errors import SimulationError
from wsnsim.hardware.profiles import IMAGERS, PLATFORMS, RADIOS
from wsnsim.hardware.work import Work
from wsnsim.net.clock import Clock
from wsnsim.records import EventRow, MemorySink
from wsnsim.sim.node import Node
from wsnsim.sim.power import NodePower
from wsnsim.systems.base import Context, Note, Received, Role, Send, Step, Timer
from wsnsim.units import NS_PER_S, to_ns, to_s
from wsnsim.vision.frame import Frame

PLATFORM = PLATFORMS["imote2_416"]
ONE_SECOND = Work(int_ops=PLATFORM.clock_hz / PLATFORM.cycles_per_int_op)


class Script:
    """A program that does what a test says and writes down what it was given, and when."""

    def __init__(self, work: Work | None = None, timers: tuple[Timer, ...] = ()) -> None:
        self.work = work or Work()
        self.timers = timers
        self.seen: list[tuple[float, str]] = []

    def on_start(self, ctx: Context) -> Step:
        self.seen.append((ctx.now, "start"))
        return Step(timers=self.timers)

    def on_frame(self, ctx: Context, frame: Frame) -> Step:
        self.seen.append((ctx.now, f"frame {frame.step}"))
        return Step(work=self.work, notes=(Note("looked", str(frame.step)),))

    def on_payload(self, ctx: Context, message: Received) -> Step:
        self.seen.append((ctx.now, "payload"))
        return Step()

    def on_timer(self, ctx: Context, key: str) -> Step:
        self.seen.append((ctx.now, f"timer {key}"))
        return Step()


class Bench:
    """One node on a clock of its own."""

    def __init__(self, program: object, capacity_j: float | None = None) -> None:
        self.env = simpy.Environment()
        self.clock = Clock(self.env)
        self.sink = MemorySink()
        self.deaths: list[float] = []
        self.sent: list[Send] = []
        self.power = NodePower(self.clock, capacity_j, PLATFORM, RADIOS["cc2420"], 0.0, IMAGERS["cmos"])
        self.node = Node(
            self.clock,
            "n",
            Role.CAMERA,
            program,  # type: ignore[arg-type]
            PLATFORM,
            self.power,
            self.sink,
            self.sent.append,
            lambda node: self.deaths.append(to_s(self.clock.now)),
        )

    def at(self, time_s: float, action: Callable[[], None]) -> None:
        self.clock.call(to_ns(time_s) - self.clock.now, action)

    def run(self, until_s: float) -> None:
        self.env.run(until=to_ns(until_s))

    def events(self) -> list[tuple[float, str]]:
        return [(row.time_s, row.kind) for row in self.sink.rows if isinstance(row, EventRow)]


def frame(step: int) -> Frame:
    return Frame(step, 0.0, "n", lambda: pytest.fail("nobody looks"))


def test_inputs_wait_for_the_processor_and_come_in_order() -> None:
    script = Script(ONE_SECOND)
    bench = Bench(script)
    bench.at(1.0, lambda: bench.node.take_frame(frame(1)))
    bench.at(1.5, lambda: bench.node.take_message(Received("m", None)))  # type: ignore[arg-type]
    bench.at(1.6, lambda: bench.node.take_frame(frame(2)))
    bench.run(10.0)
    assert script.seen == [(1.0, "frame 1"), (2.0, "payload"), (2.0, "frame 2")]
    # what a step says takes effect when its work is done
    assert bench.events() == [(2.0, "looked"), (3.0, "looked")]
    assert bench.power.ledger.seconds(to_ns(10.0))["cpu", "work"] == 2.0


def test_the_processors_joules_are_its_powers_times_its_times() -> None:
    bench = Bench(Script(ONE_SECOND))
    bench.at(1.0, lambda: bench.node.take_frame(frame(1)))
    bench.run(10.0)
    drawn = bench.power.ledger.drawn_j(to_ns(10.0))
    assert drawn["cpu", "work"] == pytest.approx(PLATFORM.cpu_active_w * 1.0, rel=1e-12)
    assert drawn["cpu", "idle"] == pytest.approx(PLATFORM.cpu_idle_w * 9.0, rel=1e-12)
    assert drawn["board", "base load"] == pytest.approx(PLATFORM.board_w * 10.0, rel=1e-12)


def test_timers_come_at_their_time_or_at_once() -> None:
    script = Script(timers=(Timer("late", 0.7), Timer("past", -5.0)))
    bench = Bench(script)
    bench.at(0.2, bench.node.start)
    bench.run(1.0)
    assert script.seen == [(0.2, "start"), (0.2, "timer past"), (0.7, "timer late")]


def test_a_battery_that_empties_stops_the_node_at_that_instant() -> None:
    """Idle power until 1 s, then work: the instant follows by arithmetic."""
    idle_w = PLATFORM.board_w + PLATFORM.cpu_idle_w + IMAGERS["cmos"].idle_w()
    work_w = idle_w - PLATFORM.cpu_idle_w + PLATFORM.cpu_active_w
    capacity = idle_w * 1.0 + work_w * 0.25
    script = Script(ONE_SECOND)
    bench = Bench(script, capacity)
    bench.node.start()
    bench.at(1.0, lambda: bench.node.take_frame(frame(1)))
    bench.at(1.1, lambda: bench.node.take_message(Received("m", None)))  # type: ignore[arg-type]
    bench.at(3.0, lambda: bench.node.take_frame(frame(2)))
    bench.run(10.0)
    assert bench.deaths == [pytest.approx(1.25, abs=2e-9)]
    assert bench.node.died_at_s == bench.deaths[0]
    assert not bench.node.alive
    assert script.seen == [(0.0, "start"), (1.0, "frame 1")]
    assert bench.events() == [(bench.deaths[0], "death")]  # the work it died over says nothing
    ledger = bench.power.ledger
    assert ledger.seconds(to_ns(10.0))["cpu", "work"] == pytest.approx(0.25, abs=2e-9)
    assert ledger.total_drawn_j(to_ns(10.0)) == pytest.approx(capacity, rel=1e-12)
    assert ledger.left_j(to_ns(10.0)) == pytest.approx(0.0, abs=1e-12)


def test_an_empty_battery_never_starts() -> None:
    script = Script()
    bench = Bench(script, 0.0)
    bench.node.start()
    bench.run(1.0)
    assert bench.deaths == [0.0]
    assert script.seen == []


def test_watching_the_battery_costs_few_events() -> None:
    """A lifetime of days at constant power is found in a handful of looks, not by polling."""
    bench = Bench(Script(), 18_720.0)
    bench.node.start()
    looks = 0
    while bench.env.peek() < 1e9 * NS_PER_S:
        bench.env.step()
        looks += 1
    assert len(bench.deaths) == 1
    assert looks < 500


def test_a_program_that_fails_is_named_with_time_and_node() -> None:
    class Broken(Script):
        def on_timer(self, ctx: Context, key: str) -> Step:
            raise ZeroDivisionError("by a user's tracker")

    bench = Bench(Broken(timers=(Timer("t", 0.5),)))
    bench.node.start()
    with pytest.raises(SimulationError, match=r"t = 0\.500000 s: node 'n': .*by a user's tracker"):
        bench.run(1.0)


@pytest.mark.parametrize("fault", ["nothing", "work", "send"])
def test_a_program_that_answers_nonsense_is_named_too(fault: str) -> None:
    class Nonsense(Script):
        def on_payload(self, ctx: Context, message: Received) -> Step:
            if fault == "work":
                return Step(work=Work(int_ops=float("nan")))
            return None if fault == "nothing" else Step(sends=(Send("n", None),))  # type: ignore[return-value,arg-type]

    bench = Bench(Nonsense())

    def refuse(send: Send) -> None:
        raise AttributeError("a payload that cannot be encoded")

    bench.node._send = refuse  # the network's side of the bench
    bench.at(0.5, lambda: bench.node.take_message(Received("m", None)))  # type: ignore[arg-type]
    with pytest.raises(SimulationError, match=r"t = 0\.500000 s: node 'n': the program failed"):
        bench.run(1.0)


def test_a_thousand_inputs_that_cost_nothing_are_taken_in_turn() -> None:
    script = Script(ONE_SECOND)
    bench = Bench(script)
    bench.at(0.0, lambda: bench.node.take_frame(frame(1)))
    for k in range(1000):
        bench.at(0.5 + k * 1e-4, lambda: bench.node.take_message(Received("m", None)))  # type: ignore[arg-type]
    bench.run(2.0)
    assert script.seen[1:] == [(1.0, "payload")] * 1000


def test_work_that_the_end_of_the_run_cuts_off_counts_as_far_as_it_went() -> None:
    bench = Bench(Script(ONE_SECOND))
    bench.at(1.0, lambda: bench.node.take_frame(frame(1)))
    bench.run(1.25)
    assert bench.power.ledger.seconds(to_ns(1.25))["cpu", "work"] == 0.25


def test_power_that_rises_in_the_last_instant_does_not_put_off_the_death() -> None:
    """The battery is empty 300 ns after the work began: death is booked there, not at the next look."""
    idle_w = PLATFORM.board_w + PLATFORM.cpu_idle_w + IMAGERS["cmos"].idle_w()
    bench = Bench(Script(ONE_SECOND), idle_w * (1.0 + 600e-9))
    bench.node.start()
    bench.at(1.0, lambda: bench.node.take_frame(frame(1)))
    bench.run(2.0)
    busy_w = idle_w - PLATFORM.cpu_idle_w + PLATFORM.cpu_active_w
    assert bench.node.died_at_s == pytest.approx(1.0 + 600e-9 * idle_w / busy_w, abs=2e-9)
    assert bench.power.ledger.left_j(to_ns(2.0)) == pytest.approx(0.0, abs=1e-15)


def test_what_comes_of_an_effect_waits_its_turn_without_end_of_stack() -> None:
    """Each input gives the processor something more to do, which is done after what waits already."""
    bench = Bench(Script(ONE_SECOND))
    done: list[str] = []
    node = bench.node

    def follow(name: str) -> None:
        if len(done) < 3000:
            done.append("input")
            node.take(lambda ctx: (Work(), lambda: done.append("more")))
            assert done[-1] == "input"

    node._settled = follow  # what the network would do
    bench.at(0.0, lambda: node.take_frame(frame(1)))
    for _ in range(2):
        bench.at(0.5, lambda: node.take_message(Received("m", None)))  # type: ignore[arg-type]
    bench.run(2.0)
    # two messages wait behind the frame; what each conclusion adds comes after them
    assert done[:6] == ["input", "input", "input", "more", "input", "more"]
    assert len(done) >= 3000
