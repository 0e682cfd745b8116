"""Faults of a scenario: where they are, how a value is shown, what was meant."""

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any, TypeAlias

KeyPath: TypeAlias = tuple[str | int, ...]
"""Keys and list positions from the top of a scenario to a value."""

_SHOWN_CHARACTERS = 60


@dataclass(frozen=True)
class Fault:
    """What is wrong at a path of the scenario, before its place in a file is known."""

    path: KeyPath
    message: str
    of_key: bool = False
    """The key itself is wrong, not what stands under it."""


def path_text(path: KeyPath) -> str:
    """Write a path as a person does: ``cameras[0].focal_px``."""
    text = ""
    for step in path:
        if isinstance(step, int):
            text += f"[{step}]"
        else:
            text += f".{step}" if text else step
    return text


def shown(value: Any) -> str:
    """Write a value as it may stand in an error message: text in quotes, collections by their size."""
    if value is None:
        return "nothing (null)"
    if isinstance(value, float) and not math.isfinite(value):
        return f"{value}"
    if isinstance(value, Mapping):
        return "a mapping" if value else "an empty mapping"
    if isinstance(value, list | tuple):
        return f"a list of {len(value)}" if value else "an empty list"
    text = json.dumps(value, ensure_ascii=False, default=repr)
    return text if len(text) <= _SHOWN_CHARACTERS else f"{text[: _SHOWN_CHARACTERS - 3]}..."


def quoted(text: str) -> str:
    """Write text in quotes, in full."""
    return json.dumps(text, ensure_ascii=False)


def one_of(values: Iterable[str | int]) -> str:
    """Write values as alternatives, text in quotes: ``"a", "b" or "c"``."""
    *others, last = [quoted(value) if isinstance(value, str) else str(value) for value in values]
    return f"{', '.join(others)} or {last}" if others else last


def nearest(word: str, known: Iterable[str]) -> str | None:
    """Return the known name that is most like `word`, or None where none is near."""
    names: dict[str, str] = {}
    for name in known:
        names[name.lower()] = name
        # People leave units away: `capacity` for `capacity_j`.
        names.setdefault(name.lower().rpartition("_")[0], name)
    names.pop("", None)
    near = get_close_matches(word.lower(), names, n=1, cutoff=0.6)
    return names[near[0]] if near else None


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """Return ``; did you mean "x"?`` for the nearest known name, or nothing where none is near."""
    near = nearest(word, known)
    return "" if near is None else f"; did you mean {quoted(near)}?"


def unreadable(file: Path) -> tuple[str, str] | None:
    """Return what must hold of `file` and a hint, or None where it can be read."""
    try:
        if file.exists() and not file.is_dir() and not file.is_file():
            return "must be an ordinary file, not a pipe or a device", ""
        with file.open("rb"):
            return None
    except FileNotFoundError:
        return "must be a file that exists", _neighbour(file)
    except IsADirectoryError:
        return "must be a file, not a folder", ""
    except OSError as error:
        return "must be a file that can be read", f" ({error.strerror})"
    except ValueError as error:
        return "must be a file that can be read", f" ({error})"


def _neighbour(file: Path) -> str:
    """Return a suggestion from the names in the folder of `file`."""
    try:
        return did_you_mean(file.name, sorted(entry.name for entry in file.parent.iterdir()))
    except OSError:
        return ""
