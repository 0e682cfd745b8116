"""CPU times of the tracker's step, as `wsnsim bench scanline --json` measured them."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from wsnsim.errors import OutputError
from wsnsim.types import Seconds


@dataclass(frozen=True)
class Speed:
    """What a step of the filter costs.

    Parameters
    ----------
    step_s : by kind of prior and number of cameras [s]
    over_twin : how many times as long the likelihoods of a step with Gaussian priors take in plain Python,
        by number of cameras
    """

    step_s: Mapping[tuple[str, int], Seconds]
    over_twin: Mapping[int, float] = field(default_factory=dict)

    def growth(self, prior: str, low: int, high: int) -> float | None:
        """Return the ratio of the times with `high` and `low` cameras; None where one was not measured."""
        below, above = self.step_s.get((prior, low)), self.step_s.get((prior, high))
        return None if below is None or above is None else above / below

    def over(self, prior: str, other: str, cameras: int) -> float | None:
        """Return the ratio of the times with two kinds of priors; None where one was not measured."""
        above, below = self.step_s.get((prior, cameras)), self.step_s.get((other, cameras))
        return None if below is None or above is None else above / below


NAMES = {"no prior": "none", "Gaussian priors": "kalman", "known places": "perfect"}
"""Kinds of priors, from the bench's words to the page's."""
_STEP, _CAMERAS = "a step, ", "N = "


def read_speed(path: Path) -> Speed | None:
    """Return the times in a file, None where there is no such file.

    Raises
    ------
    OutputError : the file holds no such times
    """
    if not path.is_file():
        return None
    try:
        rows = json.loads(path.read_text("utf-8"))
        steps = [
            (NAMES[row["what"].removeprefix(_STEP)], int(row["setup"].removeprefix(_CAMERAS)), row)
            for row in rows
            if row["what"].startswith(_STEP)
        ]
        times = {(prior, cameras): 1e-3 * row["cpu_ms"] for prior, cameras, row in steps}
        twins = {cameras: float(row["ratio"]) for _, cameras, row in steps if row.get("ratio") is not None}
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise OutputError(f"{path}: must be what `wsnsim bench scanline --json` prints; {error!r}") from error
    if not times:
        raise OutputError(f"{path}: must hold times of whole steps; run: wsnsim bench scanline --json")
    return Speed(times, twins)
