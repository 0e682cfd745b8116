"""One line of the comparison: what ours comes to, what a peer says, and how far apart they may be."""

import csv
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from io import StringIO
from math import isnan, nan

import numpy as np
from numpy.typing import ArrayLike

THEORY, MONTE_CARLO, FIXED_POINT, NS3 = "theory", "Monte Carlo", "fixed point", "ns-3.37"
"""Sources: what follows from the standard; an exact Monte Carlo of the protocol; a closed-form model; the
lr-wpan module of ns-3 3.37."""
DIGITS = 7


@dataclass(frozen=True)
class Estimate:
    """A number from several runs.

    Parameters
    ----------
    value : their mean, or what was counted
    standard_error : of the mean; NaN where a single number tells no spread, 0 where it is exact
    runs : that it rests on
    """

    value: float
    standard_error: float = 0.0
    runs: int = 1


@dataclass(frozen=True)
class Allowed:
    """How far two numbers may be apart.

    Parameters
    ----------
    amount : the most, in the number's unit or as a share of the reference
    relative : whether it is a share
    """

    amount: float
    relative: bool = False

    def of(self, reference: float) -> float:
        """Return the most in the number's unit."""
        return self.amount * abs(reference) if self.relative else self.amount

    def __str__(self) -> str:
        return f"± {100 * self.amount:g} %" if self.relative else f"± {self.amount:g}"


@dataclass(frozen=True)
class Row:
    """Ours beside one reference.

    Parameters
    ----------
    section : of the report
    case : what was run
    figure : what was measured, its unit in the name
    ours : what came out
    source : who says what it should be
    reference : what it should be
    allowed : how far apart they may be; None where the reference stands there for information
    """

    section: str
    case: str
    figure: str
    ours: Estimate
    source: str
    reference: Estimate
    allowed: Allowed | None

    @property
    def difference(self) -> float:
        """Ours less the reference."""
        return self.ours.value - self.reference.value

    @property
    def passed(self) -> bool | None:
        """Whether the two are close enough; None where nothing is asked."""
        if self.allowed is None:
            return None
        return abs(self.difference) <= self.allowed.of(self.reference.value)


def mean_of(values: ArrayLike) -> Estimate:
    """Return the mean of independent runs with its standard error."""
    numbers = np.asarray(values, dtype=np.float64)
    error = float(numbers.std(ddof=1) / np.sqrt(numbers.size)) if numbers.size > 1 else nan
    return Estimate(float(numbers.mean()), error, int(numbers.size))


@cache
def peers() -> Mapping[tuple[str, str, str], Estimate]:
    """Return what peers gave, by case, figure and source.

    `peers.csv` holds it: runs of ns-3 3.37 (its lr-wpan module, error formula replaced where frames destroy
    each other), and of an exact Monte Carlo of the protocol without a simulator's event loop.
    """
    text = files(__package__).joinpath("peers.csv").read_text("utf-8")
    return {
        (row["case"], row["figure"], row["source"]): Estimate(
            float(row["value"]), float(row["standard_error"] or nan)
        )
        for row in csv.DictReader(StringIO(text))
    }


def beside_peers(
    section: str,
    case: str,
    runs: Sequence[Mapping[str, float]],
    allowed: Mapping[tuple[str, str], Allowed | None],
) -> list[Row]:
    """Return the rows of a case: each figure beside each source that has it.

    Parameters
    ----------
    runs : the figures of each run
    allowed : by figure and source, in the order of the rows
    """
    rows = []
    for (figure, source), tolerance in allowed.items():
        ours = mean_of([run[figure] for run in runs])
        rows.append(Row(section, case, figure, ours, source, peers()[case, figure, source], tolerance))
    return rows


def record(rows: Iterable[Row]) -> str:
    """Return all rows as the text of a CSV file."""
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    heads = ["section", "case", "figure", "ours", "standard_error", "runs", "source", "reference"]
    writer.writerow([*heads, "reference_standard_error", "difference", "allowed", "passed"])
    for row in rows:
        allowed = None if row.allowed is None else row.allowed.of(row.reference.value)
        numbers = [row.ours.value, row.ours.standard_error]
        others = [row.reference.value, row.reference.standard_error, row.difference, allowed]
        writer.writerow(
            [row.section, row.case, row.figure, *map(_shown, numbers), row.ours.runs, row.source]
            + [*map(_shown, others), "" if row.passed is None else str(row.passed).lower()]
        )
    return text.getvalue()


def _shown(number: float | None) -> str:
    return "" if number is None or isnan(number) else f"{number:.{DIGITS}g}"
