"""The event clock as the radio uses it: integer nanoseconds and plain callbacks.

One call is one SimPy event; a process for each action would cost ten times as
much. Calls of one instant run in the order they were made, except that those
marked `first` come before the others: what ends at an instant is over before
anything begins at it.
"""

from collections.abc import Callable
from typing import Any

from simpy import Environment
from simpy.events import NORMAL, URGENT

from wsnsim.types import Nanoseconds


def _run(call: "Call") -> None:
    action, call.action = call.action, None
    if action is not None:
        action()


class Call:
    """One action that is going to happen, unless it is cancelled.

    It is an event with no more than what SimPy's loop asks of one: who is to be
    called back, and that it has not failed. Nothing can wait for it.
    """

    __slots__ = ("action", "callbacks")
    _ok = True

    def __init__(self, action: Callable[[], None]) -> None:
        self.action: Callable[[], None] | None = action
        self.callbacks = (_run,)

    def cancel(self) -> None:
        """Make the action never happen; harmless once it has."""
        self.action = None


class Clock:
    """Tells the time and calls back.

    Parameters
    ----------
    env : the SimPy environment, whose time counts nanoseconds
    """

    def __init__(self, env: Environment) -> None:
        # SimPy's types know neither integer times nor the bare events of this module.
        self._env: Any = env

    @property
    def now(self) -> Nanoseconds:
        """The current time [ns]."""
        now: Nanoseconds = self._env.now
        return now

    def call(self, delay_ns: Nanoseconds, action: Callable[[], None], *, first: bool = False) -> Call:
        """Run `action` in `delay_ns` [ns] and return the handle that can cancel it."""
        call = Call(action)
        self._env.schedule(call, URGENT if first else NORMAL, delay_ns)
        return call
