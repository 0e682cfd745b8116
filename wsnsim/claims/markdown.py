"""Tables and numbers as Markdown."""

from collections.abc import Sequence
from math import isnan
from textwrap import fill

from wsnsim.metrics.statistics import Interval
from wsnsim.report.wording import number

NONE = "–"
_WIDTH = 110


def table(heads: Sequence[str], rows: Sequence[Sequence[str]], numbers_from: int = 1) -> str:
    """Return a table; columns from `numbers_from` on are set right."""
    marks = ["---" if at < numbers_from else "--:" for at in range(len(heads))]
    lines = [heads, marks, *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def mean_text(interval: Interval, places: int = 3) -> str:
    """Return ``0.061 ± 0.006``, to so many decimal places."""
    if isnan(interval.value):
        return NONE
    text = f"{interval.value:.{places}f}"
    half = interval.high - interval.value
    return text if isnan(half) else f"{text} ± {half:.{places}f}"


def ratio_text(interval: Interval) -> str:
    """Return ``1.23 (1.10 to 1.37)``."""
    if isnan(interval.value):
        return NONE
    text = signed(interval.value)
    if isnan(interval.low) or interval.high <= interval.low:
        return text
    return f"{text} ({signed(interval.low)} to {signed(interval.high)})"


def signed(value: float) -> str:
    """Return a number of two digits with a real minus sign."""
    return number(value, 2).replace("-", "−")


def picture(name: str, words: str) -> str:
    """Return an image of the report's folder with its caption."""
    return f"![{words}]({name})\n"


def paragraph(text: str) -> str:
    """Return text in lines of a readable length, ended by an empty one."""
    return fill(text, _WIDTH, break_long_words=False, break_on_hyphens=False) + "\n"
