"""How long functions take beside each other: by turns, in CPU time, medians."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from statistics import median

_SHORTEST_S = 0.02
"""A turn repeats its function for so long: what the clock and the turn's beginning cost does not show."""
_LEAST_S = 1e-5


@dataclass(frozen=True)
class Times:
    """CPU time of one call in each turn.

    Parameters
    ----------
    seconds : by the function's name, one value a turn [s]
    """

    seconds: Mapping[str, tuple[float, ...]]

    def typical(self, name: str) -> float:
        """Return the median over the turns [s]."""
        return median(self.seconds[name])

    def ratio(self, name: str, to: str) -> float:
        """Return the median over the turns of one function's time over another's."""
        pairs = zip(self.seconds[name], self.seconds[to], strict=True)
        return median(above / below for above, below in pairs)


def by_turns(functions: Mapping[str, Callable[[], object]], turns: int) -> Times:
    """Time functions in the same minutes, so that what slows the machine slows all.

    Parameters
    ----------
    functions : by name; each is called once before it is timed, to compile and to warm caches
    turns : how often each is timed
    """
    repeats = {}
    for name, function in functions.items():
        function()
        repeats[name] = max(1, round(_SHORTEST_S / max(_cpu_seconds(function, 1), _LEAST_S)))
    seconds: dict[str, list[float]] = {name: [] for name in functions}
    for turn in range(turns):
        # each second turn runs backwards: whoever comes first has no advantage
        for name in list(functions)[:: 1 if turn % 2 == 0 else -1]:
            seconds[name].append(_cpu_seconds(functions[name], repeats[name]) / repeats[name])
    return Times({name: tuple(values) for name, values in seconds.items()})


def _cpu_seconds(function: Callable[[], object], repeats: int) -> float:
    start = time.process_time()
    for _ in range(repeats):
        function()
    return time.process_time() - start
