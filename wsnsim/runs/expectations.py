"""The `expect:` of a scenario, held against a run's summary."""

from collections.abc import Mapping
from dataclasses import dataclass

from wsnsim.scenario.expectations import parse_comparison


@dataclass(frozen=True)
class Expectation:
    """One comparison and what the run gave."""

    key: str
    comparison: str
    value: float | int | None
    met: bool

    def __str__(self) -> str:
        found = "no such figure in the summary" if self.value is None else f"got {self.value:.6g}"
        return f"{self.key} {self.comparison}: {'met' if self.met else 'NOT met'}, {found}"


def check(expect: Mapping[str, str], summary: Mapping[str, float | int | None]) -> tuple[Expectation, ...]:
    """Hold a summary against comparisons such as ``"< 0.12"``; a figure that is missing fails."""
    return tuple(_check(key, comparison, summary.get(key)) for key, comparison in expect.items())


def _check(key: str, comparison: str, value: float | int | None) -> Expectation:
    met = value is not None and parse_comparison(comparison).holds(value)
    return Expectation(key, comparison, value, met)
