"""The agenda does what SimPy's environment does: same events, same order, same times, ends and errors."""

import pytest
import simpy
from hypothesis import given
from hypothesis import strategies as st
from simpy.core import EmptySchedule
from simpy.events import NORMAL, URGENT

from wsnsim.sim.agenda import Agenda

DELAYS = st.one_of(st.sampled_from([0, 5, 10]), st.integers(0, 60), st.sampled_from([100, 5_000]))
PLANS = st.lists(st.tuples(DELAYS, st.booleans(), st.integers(0, 3)), min_size=1, max_size=40)
"""Delay, whether urgent, and how many further events each event brings."""
PAGES = st.sampled_from([1, 5, 10, 10_000_000])


class Play:
    """Schedules a plan, each event the next ones of it, and writes down what happens."""

    def __init__(self, env, plan):
        self.env, self.left, self.lines = env, list(enumerate(plan)), []
        self.add(1 + len(plan) // 3)

    def add(self, count):
        for _ in range(min(count, len(self.left))):
            number, (delay, urgent, follow) = self.left.pop(0)
            event = simpy.Event(self.env)
            event._ok, event._value = True, number
            event.callbacks.append(lambda event, follow=follow: self.happen(event, follow))
            self.env.schedule(event, URGENT if urgent else NORMAL, delay)

    def happen(self, event, follow):
        self.lines.append((self.env.now, event.value))
        self.add(follow)


def played(plan, page, act):
    plays = []
    for env in (simpy.Environment(), Agenda(page)):
        play = Play(env, plan)
        play.lines.append(act(env, play))
        plays.append((play.lines, env.now, env.peek()))
    return plays


@given(plan=PLANS, page=PAGES)
def test_all_happens_as_in_simpy(plan, page):
    simpys, ours = played(plan, page, lambda env, play: env.run())
    assert ours == simpys


@given(plan=PLANS, page=PAGES, stops=st.lists(st.integers(1, 70), max_size=5))
def test_run_stops_and_goes_on_as_in_simpy(plan, page, stops):
    def act(env, play):
        seen = []
        for stop in stops:
            env.run(until=env.now + stop)
            seen.append((env.now, env.peek(), len(play.lines)))
            play.add(1)
        return seen

    simpys, ours = played(plan, page, act)
    assert ours == simpys


@given(plan=PLANS, page=PAGES)
def test_steps_are_simpys(plan, page):
    def act(env, play):
        seen = []
        while env.peek() < float("inf"):
            seen.append(env.peek())
            env.step()
        with pytest.raises(EmptySchedule):
            env.step()
        return seen

    simpys, ours = played(plan, page, act)
    assert ours == simpys


@given(page=PAGES, delays=st.lists(DELAYS, min_size=1, max_size=12), cut=st.integers(1, 80))
def test_processes_conditions_and_interrupts_work(page, delays, cut):
    def story(env):
        lines = []

        def walk(name):
            try:
                for delay in delays:
                    yield env.timeout(delay) | env.timeout(7)
                    lines.append((name, env.now))
            except simpy.Interrupt as interrupt:
                lines.append((name, env.now, interrupt.cause))
            return name

        walks = [env.process(walk(name)) for name in "ab"]

        def disturb():
            yield env.timeout(cut)
            if walks[0].is_alive:
                walks[0].interrupt("cut")

        env.process(disturb())
        lines.append(env.run(until=walks[1]))
        lines.append(env.run(until=walks[1]))
        env.run()
        return lines, env.now

    assert story(Agenda(page)) == story(simpy.Environment())


@pytest.mark.parametrize("make", [simpy.Environment, Agenda, lambda: Agenda(1)])
def test_ends_and_errors_are_simpys(make):
    env = make()
    with pytest.raises(ValueError, match="until"):
        env.run(until=0)
    with pytest.raises(RuntimeError, match="until"):
        env.run(until=env.event())
    env.event().fail(KeyError("lost"))
    with pytest.raises(KeyError, match="lost"):
        env.run()

    # who waits for the same event as the run hears of it when time goes on
    bell, heard = env.timeout(3), []
    stop = env.process(waits(env, bell, heard))
    env.run(until=bell)
    bell_heard = list(heard)
    env.run(until=stop)
    assert (bell_heard, heard) == ([], [3])


def waits(env, bell, heard):
    yield bell
    heard.append(env.now)
