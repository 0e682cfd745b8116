"""The `expect:` of a scenario, held against a run's summary."""

from collections.abc import Mapping
from dataclasses import dataclass

from wsnsim.errors import ScenarioError
from wsnsim.metrics.figures import SUMMARY_KEYS
from wsnsim.scenario.expectations import parse_comparison
from wsnsim.scenario.faults import did_you_mean
from wsnsim.scenario.load import LoadedScenario


@dataclass(frozen=True)
class Expectation:
    """One comparison and what the run gave."""

    key: str
    comparison: str
    value: float | int | None
    met: bool

    def __str__(self) -> str:
        found = "this run has no such figure" if self.value is None else f"got {self.value:.6g}"
        return f"{self.key} {self.comparison}: {'met' if self.met else 'NOT met'}, {found}"


def check_keys(loaded: LoadedScenario) -> None:
    """Refuse expectations of figures that no summary has, before the run.

    Raises
    ------
    ScenarioError : every such key, with what may have been meant
    """
    problems = [
        problem
        for key in loaded.scenario.expect
        if key not in SUMMARY_KEYS
        for problem in loaded.error(
            ("expect", key), f"must be a figure of summary.json, got {key!r}{did_you_mean(key, SUMMARY_KEYS)}"
        ).problems
    ]
    if problems:
        raise ScenarioError(problems)


def check(expect: Mapping[str, str], summary: Mapping[str, float | int | None]) -> tuple[Expectation, ...]:
    """Hold a summary against comparisons such as ``"< 0.12"``; a figure that is missing fails."""
    return tuple(_check(key, comparison, summary.get(key)) for key, comparison in expect.items())


def _check(key: str, comparison: str, value: float | int | None) -> Expectation:
    met = value is not None and parse_comparison(comparison).holds(value)
    return Expectation(key, comparison, value, met)
