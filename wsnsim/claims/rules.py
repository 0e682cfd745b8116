"""How a claim is decided: intervals against bands, never by eye.

A claim is split into parts. Each part is a number with an interval and a band in
which it must lie: it *holds* if the whole interval lies inside the band, *fails*
if the whole interval lies outside, and is *undecided* otherwise. A claim whose
parts all hold is reproduced, one of whose parts none holds is not reproduced, and
any other is reproduced in part.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum
from math import inf, isnan
from typing import Generic, TypeVar

from wsnsim.metrics.statistics import Interval

E = TypeVar("E")


class Mark(Enum):
    """What became of a part."""

    HOLDS = "holds"
    FAILS = "fails"
    UNDECIDED = "undecided"


class Verdict(Enum):
    """What became of a claim; `NOT_RUN` where the studies hold nothing to tell it from."""

    REPRODUCED = "reproduced"
    IN_PART = "in part"
    NOT_REPRODUCED = "not reproduced"
    NOT_RUN = "not run"


@dataclass(frozen=True)
class Band:
    """Where a number must lie.

    Parameters
    ----------
    low, high : ends; infinite where there is none
    open : the ends themselves lie outside: what is above 1 is not 1
    """

    low: float = -inf
    high: float = inf
    open: bool = False

    def holds(self, value: float) -> bool:
        """Tell whether a number lies inside."""
        return self.low < value < self.high if self.open else self.low <= value <= self.high


@dataclass(frozen=True)
class Part(Generic[E]):
    """One number that a claim turns on.

    Parameters
    ----------
    what : says what the number is
    band : where it must lie if the claim is right
    value : the number with its interval, of an evidence; None where the studies do not hold it
    show : writes a number, with its unit
    """

    what: str
    band: Band
    value: Callable[[E], Interval | None]
    show: Callable[[float], str]


@dataclass(frozen=True)
class Claim(Generic[E]):
    """What a paper says.

    Parameters
    ----------
    key : short name
    text : the claim in our words
    where : in the paper
    parts : what decides it
    """

    key: str
    text: str
    where: str
    parts: tuple[Part[E], ...]


@dataclass(frozen=True)
class Finding(Generic[E]):
    """A part with its number, and what that means; both None where the studies do not hold it."""

    part: Part[E]
    value: Interval | None
    mark: Mark | None


@dataclass(frozen=True)
class Judgement(Generic[E]):
    """A claim, what was found, and the verdict."""

    claim: Claim[E]
    findings: tuple[Finding[E], ...]
    verdict: Verdict


def exact(value: float, n: int = 1) -> Interval:
    """Return a number that was counted, not estimated: an interval without width."""
    return Interval(value, value, value, n)


def mark_of(value: Interval, band: Band) -> Mark:
    """Return what an interval says about a band; one without ends says nothing."""
    if isnan(value.low) or isnan(value.high):
        return Mark.UNDECIDED
    inside = band.holds(value.low), band.holds(value.high)
    if all(inside):
        return Mark.HOLDS
    # an interval wider than its band may have both ends outside and lie on both sides of it
    around = value.low <= band.low and band.high <= value.high
    return Mark.FAILS if not any(inside) and not around else Mark.UNDECIDED


def verdict_of(marks: Sequence[Mark]) -> Verdict:
    """Return what the parts of a claim come to."""
    if not marks:
        return Verdict.NOT_RUN
    holding = sum(mark is Mark.HOLDS for mark in marks)
    if holding == len(marks):
        return Verdict.REPRODUCED
    return Verdict.IN_PART if holding else Verdict.NOT_REPRODUCED


def judged(claim: Claim[E], evidence: E) -> Judgement[E]:
    """Return the verdict on a claim, with all that it rests on."""
    findings = []
    for part in claim.parts:
        value = part.value(evidence)
        mark = mark_of(value, part.band) if value is not None else None
        findings.append(Finding(part, value, mark))
    marks = [finding.mark for finding in findings if finding.mark is not None]
    return Judgement(claim, tuple(findings), verdict_of(marks))
