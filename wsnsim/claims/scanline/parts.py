"""What parts of claims are made of: limits that words stand for, and how a number is written."""

from collections.abc import Callable
from itertools import pairwise

from wsnsim.claims.rules import Band, Claim, Part
from wsnsim.claims.scanline.evidence import Evidence
from wsnsim.claims.scanline.measures import Measure, Where, ratio
from wsnsim.claims.scanline.studies import PRIORS
from wsnsim.report.wording import number

SLACK = 1.05
"""A ratio of errors that is still no disorder."""
POOR = 1.5
"""A ratio of errors that a reader of the paper's charts would call poor, one of times that is not close."""
LITTLE = 1.25
"""A ratio of errors, joules or bytes that is marginal."""
BOTH = "RMSE over both axes"
"""The convention of all limits in units; ratios are the same in either."""

LESS = Band(high=1.0, open=True)
RISES, FALLS = Band(low=0.0, open=True), Band(high=0.0, open=True)

ScanlineClaim = Claim[Evidence]
ScanlinePart = Part[Evidence]


def times(value: float) -> str:
    """Write a ratio."""
    return f"× {number(value)}"


def units(value: float) -> str:
    """Write a length in the room."""
    return f"{number(value)} units"


def inches(value: float) -> str:
    """Write a length in the lab."""
    return f"{number(value)} inches"


def part(what: str, band: Band, value: Measure, show: Callable[[float], str] = times) -> ScanlinePart:
    """Return a part of a claim, a ratio where nothing else is said."""
    return Part(what, band, value, show)


def ordered(where: Callable[[int, str], Where], cameras: tuple[int, ...]) -> tuple[ScanlinePart, ...]:
    """Return the parts that say that better priors are better, at each number of cameras."""
    return tuple(
        part(
            f"N = {n}: error with {better} over {worse}",
            Band(high=SLACK),
            ratio(where(n, better), where(n, worse)),
        )
        for n in cameras
        for worse, better in pairwise(PRIORS)
    )
