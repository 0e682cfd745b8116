"""Numbers as a person reads them: three significant digits and a fitting unit."""

import math
from collections.abc import Sequence

_PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))
_DURATIONS = ((365.25 * 86_400.0, "years"), (86_400.0, "days"), (3_600.0, "hours"), (60.0, "minutes"))
_NONE = "–"
_SPACE = "\u202f"
"""A narrow space that does not break, between a number and its unit."""


def number(value: float | None, digits: int = 3) -> str:
    """Return a number with `digits` significant digits, thousands set apart, no exponent."""
    if value is None or math.isnan(value):
        return _NONE
    if value == 0:
        return "0"
    decimals = digits - 1 - math.floor(math.log10(abs(value)))
    rounded = round(value, decimals)
    if rounded != 0:
        # 0.9996 becomes 1.00 and needs a decimal less than its first digit said.
        decimals = digits - 1 - math.floor(math.log10(abs(rounded)))
    return f"{value:,.{max(decimals, 0)}f}".replace(",", _SPACE)


def quantity(value: float | None, unit: str, digits: int = 3) -> str:
    """Return a number in the multiple of `unit` that suits it: ``1.03 Mbit/s``, ``195 µJ``."""
    if value is None or math.isnan(value):
        return _NONE
    if value == 0:
        return f"0{_SPACE}{unit}"
    for scale, prefix in _PREFIXES:
        if abs(value) >= 0.9995 * scale:
            return f"{number(value / scale, digits)}{_SPACE}{prefix}{unit}"
    scale, prefix = _PREFIXES[-1]
    return f"{number(value / scale, digits)}{_SPACE}{prefix}{unit}"


_NOTHING_M = 1e-6
"""Distances below this are rounding."""


def length(value_m: float | None) -> str:
    """Return a distance in metres, or in centimetres below half a metre."""
    if value_m is None or math.isnan(value_m) or value_m >= 0.5:
        return with_unit(value_m, "m")
    if value_m < _NOTHING_M:
        return with_unit(0, "cm")
    return with_unit(100 * value_m, "cm")


def with_unit(value: float | None, unit: str, digits: int = 3) -> str:
    """Return a number and its unit, unscaled."""
    text = number(value, digits)
    return text if text == _NONE else f"{text}{_SPACE}{unit}"


def duration(value_s: float | None) -> str:
    """Return a time in years, days, hours, minutes, seconds or parts of a second."""
    if value_s is not None and not math.isnan(value_s):
        for scale, word in _DURATIONS:
            if value_s >= 2 * scale:
                return with_unit(value_s / scale, word)
    return quantity(value_s, "s")


def percent(share: float | None) -> str:
    """Return a share as a percentage that is 0 or 100 only when it is exactly that."""
    if share is None or math.isnan(share):
        return _NONE
    if 0 < share < 0.001:
        return f"less than 0.1{_SPACE}%"
    if 0.999 < share < 1:
        return f"more than 99.9{_SPACE}%"
    digits = 0 if share in (0, 1) else 1
    return f"{100 * share:.{digits}f}{_SPACE}%"


def count(value: int | float | None) -> str:
    """Return a whole number, thousands set apart."""
    return _NONE if value is None else f"{int(value):,}".replace(",", _SPACE)


def plural(value: int, word: str) -> str:
    """Return ``1 step`` or ``2 steps``."""
    return f"{count(value)} {word}{'' if value == 1 else 's'}"


def listed(items: Sequence[str], most: int = 5) -> str:
    """Return ``a, b and c``, or the first few and the number of others."""
    shown = list(items[:most])
    if len(items) > most:
        shown.append(f"{len(items) - most} more")
    return shown[0] if len(shown) == 1 else f"{', '.join(shown[:-1])} and {shown[-1]}"
