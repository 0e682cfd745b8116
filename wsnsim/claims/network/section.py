"""A section of the report: runs that do not depend on each other, and the rows that they give."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, TypeAlias

from wsnsim.claims.network.rows import Allowed, Row, beside_peers
from wsnsim.claims.network.runs import Case, run

Tolerances: TypeAlias = Mapping[tuple[str, str], Allowed | None]
"""By figure and source: how far apart ours and the reference may be."""


@dataclass(frozen=True)
class Section:
    """One part of the report.

    Parameters
    ----------
    title : its heading
    words : what stands before its table
    tasks : what is to be computed; each may be sent to another process
    rows : makes the rows of the tasks' results, which come in their order
    """

    title: str
    words: str
    tasks: tuple[Callable[[], Any], ...]
    rows: Callable[[Sequence[Any]], list[Row]]


@dataclass(frozen=True)
class Study:
    """A case, how often it runs, and what its figures are held against."""

    case: Case
    seeds: int
    allowed: Tolerances


def section_of(title: str, words: str, studies: Sequence[Study]) -> Section:
    """Return a section whose rows are figures of cases beside peers."""

    def rows(results: Sequence[Any]) -> list[Row]:
        found: list[Row] = []
        rest: Iterator[Any] = iter(results)
        for study in studies:
            runs = [next(rest) for _ in range(study.seeds)]
            found += beside_peers(title, study.case.name, runs, study.allowed)
        return found

    tasks = tuple(partial(run, study.case, seed) for study in studies for seed in range(study.seeds))
    return Section(title, words, tasks, rows)


def shortened(study: Study, duration_s: float, seeds: int) -> Study:
    """Return a study that takes less time; figures that count what happened in all have no reference then."""
    kept = {key: allowed for key, allowed in study.allowed.items() if key[0] != "frames"}
    return Study(replace(study.case, duration_s=duration_s), seeds, kept)
