"""What a scenario expects of its run: comparisons such as ``< 0.12`` with figures of the summary."""

import math
import operator
import re
from collections.abc import Callable
from dataclasses import dataclass

_OPERATORS: dict[str, Callable[[float, float], bool]] = {
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
    "==": operator.eq,
    "!=": operator.ne,
}
_COMPARISON = re.compile(r"\s*(<=|>=|==|!=|<|>)\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*", re.ASCII)


@dataclass(frozen=True)
class Comparison:
    """A bound, and on which side of it a figure must be."""

    relation: str
    """One of ``<``, ``<=``, ``>``, ``>=``, ``==``, ``!=``."""
    bound: float

    def holds(self, value: float) -> bool:
        """Return whether `value` is on the right side; one that is not a number never is."""
        return not math.isnan(value) and _OPERATORS[self.relation](value, self.bound)


def parse_comparison(text: str) -> Comparison:
    """Read a comparison such as ``< 0.12``.

    Raises
    ------
    ValueError : not a comparison, or its bound is not finite
    """
    match = _COMPARISON.fullmatch(text)
    if match is None:
        raise ValueError('must be a comparison such as "< 0.12", ">= 0" or "== 0"')
    bound = float(match[2])
    if not math.isfinite(bound):
        raise ValueError("must compare with a finite number")
    return Comparison(match[1], bound)
