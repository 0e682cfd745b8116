"""Every joule of a node by component and cause, and the instant its battery empties.

Amounts are kept as integers, so that any number of transitions adds up without
rounding: a power is rounded once to 1e-18 W, a time is a whole number of
nanoseconds, and their products are summed exactly. Left out: the battery's own
losses (self-discharge, rate and temperature effects) and harvesting.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

from wsnsim.errors import SimulationError
from wsnsim.types import Nanoseconds, Seconds
from wsnsim.units import to_s

COMPONENTS = ("radio", "cpu", "camera", "board")

_UNITS_PER_W = 10**18
_UNITS_PER_J = _UNITS_PER_W * 10**9


class StateTimes(Protocol):
    """The times of a component that changes its state too often to tell of each change."""

    @property
    def state(self) -> str:
        """The cause of what it draws now."""

    def spent_ns(self, now_ns: Nanoseconds) -> Mapping[str, Nanoseconds]:
        """Return the time spent in each state until now [ns]."""


@dataclass
class _Draw:
    """What a component is doing: its state since the ledger was last settled."""

    cause: str
    power: int


@dataclass
class _Metered:
    """A component whose times are asked for, and what was booked of them so far."""

    times: StateTimes
    powers: Mapping[str, int]
    booked_ns: Mapping[str, Nanoseconds]
    power: int
    """What it drew when the ledger was last settled."""


@dataclass(frozen=True)
class _Share:
    """What a component drew for one cause, and for how long, since the ledger was last settled."""

    key: tuple[str, str]
    drawn: int
    spent_ns: Nanoseconds


class EnergyLedger:
    """The energy account of one node.

    A component is in one state (a cause and a power) from one `enter` to the
    next, or keeps the times of its states itself (`meter`) and is asked for
    them. A battery that empties stops the account at that instant by itself;
    whatever a stopped node is told to do costs nothing. Where a component is
    asked for its times, the instant is exact if the account is looked at
    within a nanosecond of it; else that component counts as if it had drawn
    its mean power since the last look.

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
        self._metered: dict[str, _Metered] = {}
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
        _check(component, cause, power_w)
        self._settle(now_ns)
        if self._stopped:
            return
        self._draws[component] = _Draw(cause, _exact(power_w, _UNITS_PER_W))
        self._open(component, cause)

    def meter(
        self, now_ns: Nanoseconds, component: str, times: StateTimes, powers_w: Mapping[str, float]
    ) -> None:
        """Ask a component for the times of its states from now on.

        Parameters
        ----------
        now_ns : time on the event clock [ns]
        component : one of `COMPONENTS`, of which nothing has been entered
        times : what it keeps; what was spent before now is not booked
        powers_w : all that it draws, by state [W]

        Raises
        ------
        SimulationError : time runs backwards
        ValueError : unknown component, or a power that is negative or not finite
        """
        for cause, power_w in powers_w.items():
            _check(component, cause, power_w)
        self._settle(now_ns)
        if self._stopped:
            return
        powers = {cause: _exact(power_w, _UNITS_PER_W) for cause, power_w in powers_w.items()}
        state = times.state
        self._metered[component] = _Metered(times, powers, times.spent_ns(now_ns), powers[state])
        self._open(component, state)

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
        if self._capacity is None or self._stopped:
            return None
        power = sum(draw.power for draw in self._draws.values())
        power += sum(metered.power for metered in self._metered.values())
        return None if power == 0 else self._now + _ceil_div(self._capacity - self._drawn, power)

    def _open(self, component: str, cause: str) -> None:
        self._drawn_by.setdefault((component, cause), 0)
        self._ns_by.setdefault((component, cause), 0)

    def _settle(self, now_ns: Nanoseconds) -> None:
        """Book what was drawn since the last call, up to the battery's end."""
        if now_ns < self._now:
            raise SimulationError(
                f"time must not run backwards, got {now_ns} ns after {self._now} ns", to_s(now_ns)
            )
        if self._stopped:
            self._now = now_ns
            return
        since_ns, self._now = self._now, now_ns
        # A metered component may have changed its state since, though no time has passed.
        shares = self._shares(now_ns, now_ns - since_ns)
        if now_ns == since_ns:
            return
        drawn = sum(share.drawn for share in shares)
        left = None if self._capacity is None else self._capacity - self._drawn
        if left is not None and drawn >= left:
            lasted = _ceil_div(left * (now_ns - since_ns), drawn) if drawn else now_ns - since_ns
            shares = _cut(shares, left, lasted, now_ns - since_ns)
            drawn, self._emptied_at = left, since_ns + lasted
        self._drawn += drawn
        for share in shares:
            self._open(*share.key)
            self._drawn_by[share.key] += share.drawn
            self._ns_by[share.key] += share.spent_ns
        if self._emptied_at is not None:
            self._freeze()

    def _shares(self, now_ns: Nanoseconds, elapsed_ns: Nanoseconds) -> list[_Share]:
        """Return what each component drew for each cause since the last call, and bring meters up to date."""
        shares = [
            _Share((component, draw.cause), draw.power * elapsed_ns, elapsed_ns)
            for component, draw in self._draws.items()
        ]
        for component, metered in self._metered.items():
            spent_ns, metered.power = metered.times.spent_ns(now_ns), metered.powers[metered.times.state]
            for cause, until_ns in spent_ns.items():
                newly_ns = until_ns - metered.booked_ns[cause]
                if newly_ns:
                    shares.append(_Share((component, cause), metered.powers[cause] * newly_ns, newly_ns))
            metered.booked_ns = spent_ns
        return shares

    def _freeze(self) -> None:
        self._stopped = True
        self._draws = {}
        self._metered = {}


def _cut(shares: list[_Share], left: int, lasted_ns: Nanoseconds, elapsed_ns: Nanoseconds) -> list[_Share]:
    """Share out a battery's rest in proportion to what was asked of it, to the last unit.

    Parameters
    ----------
    left : in the battery, not more than was asked
    lasted_ns : how long it lasted, of `elapsed_ns`
    """
    asked = sum(share.drawn for share in shares)
    asked_so_far = shared = 0
    spent_ns: dict[str, Nanoseconds] = {}
    booked_ns: dict[str, Nanoseconds] = {}
    cut = []
    for share in shares:
        asked_so_far += share.drawn
        upto = left * asked_so_far // asked if asked else 0
        component = share.key[0]
        spent_ns[component] = spent_ns.get(component, 0) + share.spent_ns
        until_ns = spent_ns[component] * lasted_ns // elapsed_ns
        cut.append(_Share(share.key, upto - shared, until_ns - booked_ns.get(component, 0)))
        booked_ns[component], shared = until_ns, upto
    return cut


def _check(component: str, cause: str, power_w: float) -> None:
    if component not in COMPONENTS:
        raise ValueError(f"component must be one of {', '.join(COMPONENTS)}, got {component!r}")
    if not (math.isfinite(power_w) and power_w >= 0):
        raise ValueError(f"{component} {cause}: power must be a finite number >= 0, got {power_w} W")


def _exact(value: float, units: int) -> int:
    """Return `value` in whole units, rounded once."""
    numerator, denominator = value.as_integer_ratio()
    return (2 * numerator * units + denominator) // (2 * denominator)


def _ceil_div(numerator: int, denominator: int) -> int:
    return -(-numerator // denominator)
