"""The event clock as the radio uses it: integer nanoseconds and plain callbacks.

One call is one SimPy event; a process for each action would cost ten times as
much. Calls of one instant run in the order they were made, except that those
marked `first` come before the others: what ends at an instant is over before
anything begins at it.
"""

from collections.abc import Callable
from typing import cast

from simpy import Environment, Event
from simpy.events import NORMAL, URGENT

from wsnsim.types import Nanoseconds


class Call(Event):
    """One action that is going to happen, unless it is cancelled."""

    def __init__(
        self, env: Environment, delay_ns: Nanoseconds, action: Callable[[], None], first: bool
    ) -> None:
        super().__init__(env)
        self._ok = True
        self._value = None
        self._action: Callable[[], None] | None = action
        self.callbacks.append(Call._run)
        env.schedule(self, URGENT if first else NORMAL, delay_ns)

    def cancel(self) -> None:
        """Make the action never happen; harmless once it has."""
        self._action = None

    @staticmethod
    def _run(event: Event) -> None:
        call = cast(Call, event)
        action = call._action
        call._action = None
        if action is not None:
            action()


class Clock:
    """Tells the time and calls back.

    Parameters
    ----------
    env : the SimPy environment, whose time counts nanoseconds
    """

    def __init__(self, env: Environment) -> None:
        self._env = env

    @property
    def now(self) -> Nanoseconds:
        """The current time [ns]."""
        return cast(int, self._env.now)

    def call(self, delay_ns: Nanoseconds, action: Callable[[], None], *, first: bool = False) -> Call:
        """Run `action` in `delay_ns` [ns] and return the handle that can cancel it."""
        return Call(self._env, delay_ns, action, first)
