"""Every joule of a node by component and cause, and the instant its battery empties.

Amounts are kept as integers, so that any number of transitions adds up without
rounding: a power is rounded once to 1e-18 W, a time is a whole number of
nanoseconds, and their products are summed exactly. Left out: the battery's own
losses (self-discharge, rate and temperature effects) and harvesting.
"""

import math
from dataclasses import dataclass

from wsnsim.errors import SimulationError
from wsnsim.types import Nanoseconds, Seconds
from wsnsim.units import to_s

COMPONENTS = ("radio", "cpu", "camera", "board")

_UNITS_PER_W = 10**18
_UNITS_PER_J = _UNITS_PER_W * 10**9


@dataclass
class _Draw:
    """What a component is doing: its state since the ledger was last settled."""

    cause: str
    power: int


class EnergyLedger:
    """The energy account of one node.

    A component is in one state (a cause and a power) from one `enter` to the
    next. A battery that empties stops the account at that instant by itself;
    whatever a stopped node is told to do costs nothing.

    Parameters
    ----------
    capacity_j : energy at time 0 [J]; None on mains
    """

    def __init__(self, capacity_j: float | None) -> None:
        if capacity_j is not None and not (math.isfinite(capacity_j) and capacity_j >= 0):
            raise ValueError(f"capacity_j must be a finite number >= 0 or None, got {capacity_j}")
        self.capacity_j = capacity_j
        self._capacity = None if capacity_j is None else _exact(capacity_j, _UNITS_PER_J)
        self._now: Nanoseconds = 0
        self._stopped = False
        self._emptied_at: Nanoseconds | None = None
        self._draws: dict[str, _Draw] = {}
        self._power = 0
        self._drawn = 0
        self._drawn_by: dict[tuple[str, str], int] = {}
        self._ns_by: dict[tuple[str, str], Nanoseconds] = {}

    def enter(self, now_ns: Nanoseconds, component: str, cause: str, power_w: float) -> None:
        """Put a component in a state from now on.

        Parameters
        ----------
        now_ns : time on the event clock [ns]
        component : one of `COMPONENTS`
        cause : what the component does, such as `listen` or `transmit`
        power_w : all that it draws in this state [W]

        Raises
        ------
        SimulationError : time runs backwards
        ValueError : unknown component, or a power that is negative or not finite
        """
        if component not in COMPONENTS:
            raise ValueError(f"component must be one of {', '.join(COMPONENTS)}, got {component!r}")
        if not (math.isfinite(power_w) and power_w >= 0):
            raise ValueError(f"{component} {cause}: power must be a finite number >= 0, got {power_w} W")
        self._settle(now_ns)
        if self._stopped:
            return
        power = _exact(power_w, _UNITS_PER_W)
        before = self._draws.get(component)
        self._power += power - (before.power if before else 0)
        self._draws[component] = _Draw(cause, power)
        self._drawn_by.setdefault((component, cause), 0)
        self._ns_by.setdefault((component, cause), 0)

    def stop(self, now_ns: Nanoseconds) -> None:
        """Freeze the account: nothing is drawn from now on.

        Raises
        ------
        SimulationError : time runs backwards
        """
        self._settle(now_ns)
        self._freeze()

    @property
    def stopped(self) -> bool:
        """Whether the node was stopped or its battery was found empty."""
        return self._stopped

    def drawn_j(self, now_ns: Nanoseconds) -> dict[tuple[str, str], float]:
        """Return the energy drawn until now [J] by (component, cause)."""
        self._settle(now_ns)
        return {key: units / _UNITS_PER_J for key, units in self._drawn_by.items()}

    def seconds(self, now_ns: Nanoseconds) -> dict[tuple[str, str], Seconds]:
        """Return the time spent until now [s] by (component, cause)."""
        self._settle(now_ns)
        return {key: to_s(spent) for key, spent in self._ns_by.items()}

    def total_drawn_j(self, now_ns: Nanoseconds) -> float:
        """Return all energy drawn until now [J]."""
        self._settle(now_ns)
        return self._drawn / _UNITS_PER_J

    def left_j(self, now_ns: Nanoseconds) -> float:
        """Return what the battery still holds [J]; infinite on mains."""
        self._settle(now_ns)
        return math.inf if self._capacity is None else (self._capacity - self._drawn) / _UNITS_PER_J

    def empty_at_ns(self) -> Nanoseconds | None:
        """Return when the battery empties if no state changes again, rounded up [ns].

        None on mains, when nothing draws, and for a node that was stopped
        before; the instant itself once it has come.
        """
        if self._emptied_at is not None:
            return self._emptied_at
        if self._capacity is None or self._power == 0 or self._stopped:
            return None
        return self._now + _ceil_div(self._capacity - self._drawn, self._power)

    def _settle(self, now_ns: Nanoseconds) -> None:
        """Book what was drawn since the last call, up to the battery's end."""
        if now_ns < self._now:
            raise SimulationError(
                f"time must not run backwards, got {now_ns} ns after {self._now} ns", to_s(now_ns)
            )
        elapsed = 0 if self._stopped else now_ns - self._now
        self._now = now_ns
        if elapsed == 0:
            return
        left = None if self._capacity is None else self._capacity - self._drawn
        if left is None or self._power * elapsed < left:
            for component, draw in self._draws.items():
                self._drawn_by[component, draw.cause] += draw.power * elapsed
                self._ns_by[component, draw.cause] += elapsed
            self._drawn += self._power * elapsed
        else:
            self._drain(left, elapsed, now_ns - elapsed)

    def _drain(self, left: int, elapsed: Nanoseconds, since_ns: Nanoseconds) -> None:
        """Share out the battery's rest in proportion to the powers, to the last unit."""
        lasted = _ceil_div(left, self._power) if self._power else elapsed
        powers_so_far = shared = 0
        for component, draw in self._draws.items():
            powers_so_far += draw.power
            upto = left * powers_so_far // self._power if self._power else 0
            self._drawn_by[component, draw.cause] += upto - shared
            self._ns_by[component, draw.cause] += lasted
            shared = upto
        self._drawn += shared
        self._emptied_at = since_ns + lasted
        self._freeze()

    def _freeze(self) -> None:
        self._stopped = True
        self._draws = {}
        self._power = 0


def _exact(value: float, units: int) -> int:
    """Return `value` in whole units, rounded once."""
    numerator, denominator = value.as_integer_ratio()
    return (2 * numerator * units + denominator) // (2 * denominator)


def _ceil_div(numerator: int, denominator: int) -> int:
    return -(-numerator // denominator)
