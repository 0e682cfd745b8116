"""Plain data as YAML that reads the same everywhere.

Text that YAML 1.1 or 1.2 could take for something else stands in quotes, and
floats are written with as many digits as they need to come back exactly.
"""

import json
import math
import re
from collections.abc import Mapping
from typing import Any

_PLAIN_TEXT = re.compile(r"[A-Za-z_][A-Za-z0-9_./-]*")
_RESERVED = frozenset({"null", "true", "false", "yes", "no", "on", "off", "y", "n"})
_TO_ESCAPE = re.compile("[\x7f-\x9f\u2028\u2029\ufeff\ufffe\uffff]")


def yaml_text(data: Mapping[str, Any]) -> str:
    """Write a mapping of plain data as a YAML document, keys in their order.

    Parameters
    ----------
    data : mappings with text as keys, lists, text, finite numbers, truth values, None
    """
    return "\n".join(_mapping_lines(data)) + "\n" if data else "{}\n"


def _mapping_lines(data: Mapping[str, Any]) -> list[str]:
    lines = []
    for key, value in data.items():
        name = _scalar(key)
        if _in_one_line(value):
            lines.append(f"{name}: {_flow(value)}")
        else:
            lines.append(f"{name}:")
            lines += [f"  {line}" for line in _lines(value)]
    return lines


def _lines(value: Any) -> list[str]:
    """Write a collection over several lines."""
    if isinstance(value, Mapping):
        return _mapping_lines(value)
    lines = []
    for item in value:
        first, *others = [_flow(item)] if _in_one_line(item) else _lines(item)
        lines.append(f"- {first}")
        lines += [f"  {line}" for line in others]
    return lines


def _in_one_line(value: Any) -> bool:
    """Tell scalars, empty collections and lists of scalars."""
    if isinstance(value, Mapping):
        return not value
    if isinstance(value, list | tuple):
        return all(not isinstance(item, Mapping | list | tuple) for item in value)
    return True


def _flow(value: Any) -> str:
    if isinstance(value, Mapping):
        return "{}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(_scalar(item) for item in value)}]"
    return _scalar(value)


def _scalar(value: Any) -> str:
    if value is None:
        return "null"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        if not math.isfinite(value):
            raise ValueError(f"only finite numbers can be written, got {value}")
        text = repr(value)
        # YAML 1.1 takes 1e-05 for text, 1.0e-05 for a number.
        return text.replace("e", ".0e") if "e" in text and "." not in text else text
    if isinstance(value, int):
        return str(value)
    text = str(value)
    if _PLAIN_TEXT.fullmatch(text) and text.lower() not in _RESERVED:
        return text
    return _TO_ESCAPE.sub(lambda match: f"\\u{ord(match.group()):04x}", json.dumps(text, ensure_ascii=False))
