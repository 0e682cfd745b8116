"""Values from the command line that take the place of a scenario's: ``--set cameras[c1].focal_px=250``.

A path has keys with dots between them and, in brackets, either the number of a
list's item, from 0, or the `id` of the item, or `*` for all items. Keys that are
missing on the way are made; list items are not. The value is read as YAML; for a
list, ``{only: [c1, c3]}`` keeps the items with these ids.
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


@dataclass(frozen=True)
class EveryItem:
    """All items of a list."""


Step: TypeAlias = str | int | ItemId | EveryItem


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
    try:
        steps = parse_path(path)
    except ValueError as error:
        raise ScenarioError([Problem("", str(error), argument=argument)]) from None
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
    return Override(argument, steps, document.data)


def parse_path(path: str) -> tuple[Step, ...]:
    """Read a path such as ``cameras[c1].focal_px``.

    Raises
    ------
    ValueError : what it must look like
    """
    if _PATH.fullmatch(path) is None:
        raise ValueError(f"the path must look like cameras[0].focal_px, got {shown(path)}")
    if len(_STEP.findall(path)) > MAX_DEPTH:
        raise ValueError(f"the path must have at most {MAX_DEPTH} steps")
    return tuple(_step(match) for match in _STEP.finditer(path))


def _step(match: re.Match[str]) -> Step:
    item = match["item"]
    if item is None:
        return match["key"]
    if item == "*":
        return EveryItem()
    return int(item) if item.isdecimal() else ItemId(item)


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
            arguments |= dict.fromkeys(touched, override.argument)
    return Overridden(data, arguments, tuple(problems))


class _NoPlaceError(Exception):
    """The path of an override leads nowhere."""

    def __init__(self, path: KeyPath, message: str) -> None:
        super().__init__(message)
        self.path = path
        self.message = message


def _put(node: Any, steps: tuple[Step, ...], value: Any, path: KeyPath) -> tuple[Any, tuple[KeyPath, ...]]:
    """Return `node` with `value` at the end of `steps`, and the paths of the topmost values that are new."""
    if not steps:
        return (_chosen(node, value["only"], path) if _is_choice(node, value) else value), (path,)
    step, rest = steps[0], steps[1:]
    if isinstance(step, EveryItem):
        return _put_everywhere(node, rest, value, path)
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
        touched = (path,)
    elif step not in entries:
        touched = (at,)
    return {**entries, step: new}, touched


def _put_everywhere(
    node: Any, steps: tuple[Step, ...], value: Any, path: KeyPath
) -> tuple[list[Any], tuple[KeyPath, ...]]:
    if not isinstance(node, list):
        what = "no such key" if node is None else shown(node)
        raise _NoPlaceError(path, f"must be a list to have items [*], got {what}")
    items = [_put(item, steps, value, (*path, index)) for index, item in enumerate(node)]
    return [item for item, _ in items], tuple(place for _, touched in items for place in touched)


def _is_choice(node: Any, value: Any) -> bool:
    """Tell ``{only: [...]}``, put where a list stands, from a value of its own."""
    return isinstance(node, list) and isinstance(value, Mapping) and set(value) == {"only"}


def _chosen(items: list[Any], wanted: Any, path: KeyPath) -> list[Any]:
    """Return the items that are wanted, in their order in the list."""
    if not isinstance(wanted, list) or not all(isinstance(each, str) for each in wanted):
        raise _NoPlaceError(path, f"only: must be a list of ids, got {shown(wanted)}")
    kept = {_index(items, ItemId(each), path) for each in wanted}
    return [item for index, item in enumerate(items) if index in kept]


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
