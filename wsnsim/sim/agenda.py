"""SimPy's environment for many events that wait long: what is far off lies in pages, not in the heap.

SimPy keeps all events in one heap. Where each of thousands of nodes waits for
its next packet, every event climbs past all of them, through memory that the
processor has long forgotten. Here only the events of the current page of time
are in SimPy's heap; later ones lie unordered, page by page, until theirs is
turned up.

References
----------
Brown, Calendar queues: a fast O(1) priority queue implementation for the
simulation event set problem (CACM 31(10), 1988), for the idea; there, pages
are as wide as the events ask for.
"""

from heapq import heapify, heappop, heappush
from typing import Any

from simpy import Environment
from simpy.core import Infinity, StopSimulation
from simpy.events import NORMAL, URGENT, Event, EventPriority

from wsnsim.types import Nanoseconds

_PAGE_NS: Nanoseconds = 40_000_000
"""Some frames and their acknowledgements long: what a node does next is on the page as a rule, its next
packet is not. Pages of 10 ms cost more in networks of 50 motes, those of 160 ms in networks of 10,000."""


class Agenda(Environment):
    """A SimPy environment whose time counts integer nanoseconds; no delay is infinite.

    Events happen in the order in which SimPy's own environment has them: by
    time, by priority, and as they were scheduled.

    Parameters
    ----------
    page_ns : how much time a page holds [ns]
    """

    # SimPy's types know neither integer times nor events that are no `Event`.
    _now: Any
    _queue: Any

    def __init__(self, page_ns: Nanoseconds = _PAGE_NS) -> None:
        super().__init__()
        self._page_ns = page_ns
        self._until_ns: Nanoseconds = 0
        """All events before that time are in SimPy's heap, and no others."""
        self._pages: dict[int, list[Any]] = {}
        self._numbers: list[int] = []
        """A heap of the pages' numbers."""

    def schedule(self, event: Event, priority: EventPriority = NORMAL, delay: Any = 0) -> None:
        """Let an event happen in `delay` [ns]."""
        at = self._now + delay
        entry = (at, priority, next(self._eid), event)
        if at < self._until_ns:
            heappush(self._queue, entry)
            return
        number = at // self._page_ns
        page = self._pages.get(number)
        if page is None:
            self._pages[number] = [entry]
            heappush(self._numbers, number)
        else:
            page.append(entry)

    def peek(self) -> Any:
        """Return the time of the next event [ns], infinity if there is none."""
        return self._queue[0][0] if self._queue or self._turn() else Infinity

    def step(self) -> None:
        """Let the next event happen.

        Raises
        ------
        EmptySchedule : there is none
        """
        if not self._queue:
            self._turn()
        super().step()

    def run(self, until: Any = None) -> Any:
        """Let events happen until a time [ns] or an event, or to the last.

        SimPy's own loop, with the step written out: a call for each event takes
        as long as the rest of a step.

        Returns
        -------
        the value of the event

        Raises
        ------
        ValueError : the time is not in the future
        RuntimeError : no events are left, and the one that was waited for has not happened
        """
        end = until
        if until is not None and not isinstance(until, Event):
            if until <= self._now:
                raise ValueError(f"until: must be later than {self._now} ns, got {until} ns")
            end = Event(self)
            end._ok, end._value = True, None
            self.schedule(end, URGENT, until - self._now)
        if end is not None:
            if end.callbacks is None:
                return end.value
            end.callbacks.append(StopSimulation.callback)
        while self._queue or self._turn():
            self._now, _, _, event = heappop(self._queue)
            callbacks, event.callbacks = event.callbacks, None
            try:
                for callback in callbacks:
                    callback(event)
            except StopSimulation as stop:
                # the rest of what the event was to do comes first when time goes on
                event.callbacks = callbacks[callbacks.index(callback) + 1 :]
                self.schedule(event, EventPriority(-1))
                return stop.args[0]
            if not event._ok and not hasattr(event, "_defused"):
                raise type(event._value)(*event._value.args) from event._value
        if end is not None:
            raise RuntimeError(f"until: must happen, but no events are left and it has not: {end}")
        return None

    def _turn(self) -> bool:
        """Turn up the next page, and return whether there is one; all of the current one has happened."""
        if not self._numbers:
            return False
        number = heappop(self._numbers)
        self._queue = self._pages.pop(number)
        heapify(self._queue)
        self._until_ns = (number + 1) * self._page_ns
        return True
