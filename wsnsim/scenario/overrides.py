"""Values from the command line that take the place of a scenario's: ``--set cameras[c1].focal_px=250``.

A path has keys with dots between them and, in brackets, either the number of a
list's item, from 0, or the `id` of the item. Keys that are missing on the way
are made; list items are not. The value is read as YAML.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

from wsnsim.errors import Problem, ScenarioError
from wsnsim.scenario.faults import KeyPath, did_you_mean, one_of, path_text, shown
from wsnsim.scenario.yaml_marks import MAX_DEPTH, read_yaml_text

_PATH = re.compile(r"[^\s.=\[\]]+(\.[^\s.=\[\]]+|\[[^\s=\[\]]+\])*")
_STEP = re.compile(r"(?P<key>[^.\[\]]+)|\[(?P<item>[^\]]+)\]")


@dataclass(frozen=True)
class ItemId:
    """A list's item, named by its `id`."""

    id: str


Step: TypeAlias = str | int | ItemId


@dataclass(frozen=True)
class Override:
    """One value to put into a scenario, and the argument of the command line that says so."""

    argument: str
    steps: tuple[Step, ...]
    value: Any


@dataclass(frozen=True)
class Overridden:
    """A scenario's data with overrides in it."""

    data: Any
    arguments: Mapping[KeyPath, str]
    """The argument that put in or made the value at each path."""
    problems: tuple[Problem, ...]
    """Overrides that had no place to go."""


def parse_override(text: str) -> Override:
    """Read ``path.to[0].key=value``.

    Raises
    ------
    ScenarioError : no ``=``, a path that is none, or a value that is not YAML
    """
    argument = f"--set {text}"
    path, equals, value_text = text.partition("=")
    if not equals:
        raise ScenarioError([Problem("", "must be path=value, got no =", argument=argument)])
    path = path.strip()
    if _PATH.fullmatch(path) is None:
        message = f"the path must look like cameras[0].focal_px, got {shown(path)}"
        raise ScenarioError([Problem("", message, argument=argument)])
    try:
        document = read_yaml_text(value_text)
    except ScenarioError as error:
        problems = [
            Problem(
                path, f"{problem.message}; text with YAML's own characters needs quotes", argument=argument
            )
            for problem in error.problems
        ]
        raise ScenarioError(problems) from None
    if document.problems:
        raise ScenarioError([Problem(path, each.message, argument=argument) for each in document.problems])
    steps: list[Step] = []
    if len(_STEP.findall(path)) > MAX_DEPTH:
        raise ScenarioError([Problem("", f"the path must have at most {MAX_DEPTH} steps", argument=argument)])
    for match in _STEP.finditer(path):
        item = match["item"]
        if item is None:
            steps.append(match["key"])
        else:
            steps.append(int(item) if item.isdecimal() else ItemId(item))
    return Override(argument, tuple(steps), document.data)


def apply_overrides(data: Any, overrides: Sequence[Override]) -> Overridden:
    """Return a copy of `data` with the overrides put in, one after the other."""
    arguments: dict[KeyPath, str] = {}
    problems: list[Problem] = []
    for override in overrides:
        try:
            data, touched = _put(data, override.steps, override.value, ())
        except _NoPlaceError as error:
            problems.append(Problem(path_text(error.path), error.message, argument=override.argument))
        else:
            arguments[touched] = override.argument
    return Overridden(data, arguments, tuple(problems))


class _NoPlaceError(Exception):
    """The path of an override leads nowhere."""

    def __init__(self, path: KeyPath, message: str) -> None:
        super().__init__(message)
        self.path = path
        self.message = message


def _put(node: Any, steps: tuple[Step, ...], value: Any, path: KeyPath) -> tuple[Any, KeyPath]:
    """Return `node` with `value` at the end of `steps`, and the path of the topmost value that is new."""
    if not steps:
        return value, path
    step, rest = steps[0], steps[1:]
    if not isinstance(step, str):
        index = _index(node, step, path)
        item, touched = _put(node[index], rest, value, (*path, index))
        return [*node[:index], item, *node[index + 1 :]], touched
    if node is not None and not isinstance(node, Mapping):
        raise _NoPlaceError(path, f'must be a mapping to take the key "{step}", got {shown(node)}')
    entries = node or {}
    at = (*path, step)
    new, touched = _put(entries.get(step), rest, value, at)
    if node is None:
        touched = path
    elif step not in entries:
        touched = at
    return {**entries, step: new}, touched


def _index(node: Any, step: int | ItemId, path: KeyPath) -> int:
    """Return the position of a list's item."""
    if not isinstance(node, list):
        what = "no such key" if node is None else shown(node)
        wanted = step if isinstance(step, int) else step.id
        raise _NoPlaceError(path, f"must be a list to have the item [{wanted}], got {what}")
    if isinstance(step, int):
        if step >= len(node):
            raise _NoPlaceError(path, f"the item must be one of 0 to {len(node) - 1}, got {step}")
        return step
    ids = [item.get("id") if isinstance(item, Mapping) else None for item in node]
    if step.id not in ids:
        known = [each for each in ids if isinstance(each, str)]
        hint = did_you_mean(step.id, known) or (
            f"; it has {one_of(known)}" if len(known) in range(1, 11) else ""
        )
        raise _NoPlaceError(path, f'must have an item with the id "{step.id}"{hint}')
    return ids.index(step.id)
