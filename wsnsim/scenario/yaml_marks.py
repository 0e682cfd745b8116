"""YAML 1.2 (core schema) as plain data, with the line and column of every key and value.

PyYAML parses; what YAML 1.1 would make of plain text is undone: `off`, `yes`,
`12:30` and `1_000` are text, `1e6` is a number. Duplicate keys and keys that
are no text are faults. Merge keys (`<<`) and aliases work. Directives and tags
other than YAML's own scalars and collections have no meaning in a scenario.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, TypeAlias

import yaml

from wsnsim.errors import Problem, ScenarioError
from wsnsim.scenario.faults import KeyPath, path_text, shown, unreadable

Place: TypeAlias = tuple[int, int]
"""Line and column, both from 1."""

_TAG = "tag:yaml.org,2002:"
_MERGE = _TAG + "merge"
_SCALARS: dict[str, tuple[str, re.Pattern[str], str]] = {
    _TAG + "null": ("null", re.compile(r"~|null|Null|NULL|"), "~nN"),
    _TAG + "bool": ("true or false", re.compile(r"true|True|TRUE|false|False|FALSE"), "tTfF"),
    _TAG + "int": ("a whole number", re.compile(r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+"), "-+0123456789"),
    _TAG + "float": (
        "a number",
        re.compile(
            r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)"
        ),
        "-+.0123456789",
    ),
}
_PRINTABLE = re.compile("[^\t\n\r\x20-\x7e\x85\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_MAX_VALUES = 3_000_000
"""Aliases of aliases can stand for more values than fit any memory."""

MAX_DEPTH = 50
"""A scenario needs a tenth of it; the checks behind recurse."""

_BaseLoader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


class _TooDeepError(Exception):
    """A node stands in too many collections."""

    def __init__(self, node: yaml.Node) -> None:
        super().__init__()
        self.node = node


class _CoreLoader(_BaseLoader):  # type: ignore[misc]
    """PyYAML's parser with the implicit types of YAML 1.2's core schema alone."""

    yaml_implicit_resolvers: ClassVar[dict[str, list[tuple[str, re.Pattern[str]]]]] = {}
    depth = 0

    def descend_resolver(self, parent: yaml.Node, index: Any) -> None:
        """Count the depth: PyYAML's composer recurses in C, where an overflow ends the process."""
        self.depth += 1
        if self.depth > MAX_DEPTH:
            raise _TooDeepError(parent)

    def ascend_resolver(self) -> None:
        """Leave a collection."""
        self.depth -= 1


for _tag, (_, _pattern, _first) in _SCALARS.items():
    _CoreLoader.add_implicit_resolver(
        _tag, re.compile(f"(?:{_pattern.pattern})$"), [*_first, ""] if _tag.endswith("null") else list(_first)
    )
_CoreLoader.add_implicit_resolver(_MERGE, re.compile(r"<<$"), ["<"])


@dataclass(frozen=True)
class Document:
    """A YAML document: its data, and the place of everything in it."""

    data: Any
    values: Mapping[KeyPath, Place]
    keys: Mapping[KeyPath, Place]
    problems: tuple[Problem, ...]
    """Faults that leave the rest readable: duplicate keys, keys that are no text, unknown tags."""
    file: Path | None


def read_yaml(file: Path) -> Document:
    """Read a YAML file.

    Parameters
    ----------
    file : UTF-8, with or without byte order mark, any line ends

    Raises
    ------
    ScenarioError : no such file, a folder, unreadable, not UTF-8, not YAML, several documents
    """
    reason = unreadable(file)
    if reason is not None:
        raise ScenarioError([Problem("", "".join(reason), file)])
    raw = file.read_bytes().removeprefix(b"\xef\xbb\xbf")
    try:
        text = raw.decode("utf-8")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        before = raw[raw.rfind(b"\n", 0, error.start) + 1 : error.start]
        message = f"must be UTF-8 text, got the byte 0x{raw[error.start]:02x}"
        column = len(before.decode("utf-8")) + 1
        raise ScenarioError([Problem("", message, file, line, column)]) from None
    return read_yaml_text(text, file)


def read_yaml_text(text: str, file: Path | None = None) -> Document:
    """Read YAML text; `file` is where it came from.

    Raises
    ------
    ScenarioError : not YAML, several documents, aliases that contain themselves
    """
    odd = _PRINTABLE.search(text)
    if odd is not None:
        line = text.count("\n", 0, odd.start()) + 1
        column = odd.start() - text.rfind("\n", 0, odd.start())
        message = f"must be printable text, got the character U+{ord(odd.group()):04X}"
        raise ScenarioError([Problem("", message, file, line, column)])
    builder = _Builder(file)
    try:
        root = yaml.compose(text, _CoreLoader)
        data = None if root is None else builder.build(root, ())
    except yaml.MarkedYAMLError as error:
        raise ScenarioError([_syntax_problem(error, text, file)]) from None
    except _TooDeepError as error:
        message = f"must be nested at most {MAX_DEPTH} deep"
        raise ScenarioError([Problem("", message, file, *_place(error.node))]) from None
    return Document(data, builder.values, builder.keys, tuple(builder.problems.values()), file)


def _syntax_problem(error: yaml.MarkedYAMLError, text: str, file: Path | None) -> Problem:
    """Say in words what the parser stumbled over."""
    mark = error.problem_mark or error.context_mark
    if mark is None:
        return Problem("", f"must be YAML, but {error.problem}", file)
    lines = text.splitlines()
    at = lines[mark.line][mark.column : mark.column + 1] if mark.line < len(lines) else ""
    if error.context == "expected a single document in the stream":
        message = "must hold one document, got a second one"
    elif at == "\t":
        message = "must be indented with spaces, got a tab"
    elif at in {"@", "`", "%"}:
        message = f"text that begins with {at} must stand in quotes"
    else:
        message = f"must be YAML, but {error.problem}"
        if error.context and error.context_mark is not None:
            begin = error.context_mark
            message += f" {error.context} that begins at {begin.line + 1}:{begin.column + 1}"
    return Problem("", message, file, mark.line + 1, mark.column + 1)


class _Builder:
    """Turns composed nodes into data and notes places and faults on the way."""

    def __init__(self, file: Path | None) -> None:
        self.values: dict[KeyPath, Place] = {}
        self.keys: dict[KeyPath, Place] = {}
        self.problems: dict[tuple[Place, str], Problem] = {}
        self._file = file
        self._open: set[int] = set()
        self._count = 0

    def build(self, node: yaml.Node, path: KeyPath) -> Any:
        """Return the data of `node`, which stands at `path`."""
        self._count += 1
        if self._count > _MAX_VALUES:
            message = f"must hold at most {_MAX_VALUES} values when its aliases are written out"
            raise ScenarioError([Problem("", message, self._file)])
        self.values[path] = _place(node)
        if isinstance(node, yaml.ScalarNode):
            return self._scalar(node, path)
        self._enter(node, path)
        if node.tag not in {_TAG + "map", _TAG + "seq"}:
            self._fault(node, path, f"must carry no tag, got {node.tag}")
        data: Any
        if isinstance(node, yaml.MappingNode):
            data = {}
            for key, (key_node, value_node) in self._entries(node, path).items():
                at = (*path, key)
                self.keys[at] = _place(key_node)
                data[key] = self.build(value_node, at)
        else:
            data = [self.build(item, (*path, index)) for index, item in enumerate(node.value)]
        self._open.discard(id(node))
        return data

    def _entries(self, node: yaml.MappingNode, path: KeyPath) -> dict[str, tuple[yaml.Node, yaml.Node]]:
        """Return the key and value nodes of a mapping; merged ones behind its own, which win."""
        own: dict[str, tuple[yaml.Node, yaml.Node]] = {}
        merge: tuple[yaml.Node, yaml.Node] | None = None
        for key_node, value_node in node.value:
            if key_node.tag == _MERGE:
                if merge is not None:
                    self._duplicate(key_node, merge[0], path)
                merge = merge or (key_node, value_node)
            elif not isinstance(key_node, yaml.ScalarNode):
                self._fault(key_node, path, "a key must be text, got a collection")
            elif key_node.tag != _TAG + "str":
                self._fault(
                    key_node, path, f"a key must be text, got {key_node.value or 'nothing'}; put it in quotes"
                )
            elif key_node.value in own:
                self._duplicate(key_node, own[key_node.value][0], path)
            else:
                own[key_node.value] = (key_node, value_node)
        if merge is None:
            return own
        merged: dict[str, tuple[yaml.Node, yaml.Node]] = {}
        value = merge[1]
        for source in value.value if isinstance(value, yaml.SequenceNode) else [value]:
            if not isinstance(source, yaml.MappingNode):
                self._fault(source, path, "<< must name a mapping or a list of mappings")
                continue
            self._enter(source, path)
            merged = self._entries(source, path) | merged
            self._open.discard(id(source))
        return own | {key: nodes for key, nodes in merged.items() if key not in own}

    def _enter(self, node: yaml.Node, path: KeyPath) -> None:
        """Note that `node` is being read, so that it cannot contain itself."""
        if id(node) in self._open:
            line, column = _place(node)
            message = "must not contain itself through an alias"
            raise ScenarioError([Problem(path_text(path), message, self._file, line, column)])
        self._open.add(id(node))
        if len(self._open) > MAX_DEPTH:
            raise _TooDeepError(node)

    def _scalar(self, node: yaml.ScalarNode, path: KeyPath) -> Any:
        """Return the text, number, truth value or null of a scalar."""
        text: str = node.value
        if node.tag == _TAG + "str":
            return text
        if node.tag not in _SCALARS:
            self._fault(
                node, path, f"must carry no tag, got {node.tag}" if node.tag != _MERGE else "must not be <<"
            )
            return text
        kind, pattern, _ = _SCALARS[node.tag]
        try:
            if pattern.fullmatch(text) is None:
                raise ValueError
            return _scalar_value(node.tag.removeprefix(_TAG), text)
        except ValueError:
            self._fault(node, path, f"must be {kind} that can be read, got {shown(text)}")
            return None

    def _duplicate(self, node: yaml.Node, first: yaml.Node, path: KeyPath) -> None:
        line, column = _place(first)
        message = f"key must stand once in its mapping, got it again (first at {line}:{column})"
        self._fault(node, (*path, node.value), message)

    def _fault(self, node: yaml.Node, path: KeyPath, message: str) -> None:
        """Note a fault at `node`, once however many aliases lead there."""
        place = _place(node)
        self.problems.setdefault((place, message), Problem(path_text(path), message, self._file, *place))


def _place(node: yaml.Node) -> Place:
    return (node.start_mark.line + 1, node.start_mark.column + 1)


def _scalar_value(kind: str, text: str) -> bool | int | float | None:
    """Return the value of text that matches its type's pattern."""
    if kind == "null":
        return None
    if kind == "bool":
        return text.lower() == "true"
    if kind == "int":
        return int(text, {"0o": 8, "0x": 16}.get(text[:2], 10))
    return float(text.lower().replace(".inf", "inf").replace(".nan", "nan"))
