"""Python data as a YAML file would hold it: mappings, lists, text, numbers, truth values, None."""

from collections.abc import Mapping
from pathlib import PurePath
from typing import Any

from wsnsim.errors import Problem, ScenarioError
from wsnsim.scenario.faults import Fault, KeyPath, path_text, shown
from wsnsim.scenario.yaml_marks import MAX_DEPTH


def plain_data(data: Any) -> Any:
    """Return a plain copy; tuples and NumPy arrays become lists, paths text.

    Raises
    ------
    ScenarioError : keys that are no text, values of other types, text that is not Unicode, too deep
    """
    faults: list[Fault] = []
    plain = _plain(data, (), faults)
    if faults:
        raise ScenarioError([Problem(path_text(fault.path), fault.message) for fault in faults])
    return plain


def _plain(value: Any, path: KeyPath, faults: list[Fault]) -> Any:
    if len(path) > MAX_DEPTH:
        faults.append(Fault(path[:1], f"must be nested at most {MAX_DEPTH} deep"))
        return None
    if isinstance(value, Mapping):
        odd = [key for key in value if not isinstance(key, str)]
        faults += [Fault(path, f"a key must be text, got {shown(key)}") for key in odd]
        return {key: _plain(each, (*path, key), faults) for key, each in value.items() if key not in odd}
    if isinstance(value, list | tuple):
        return [_plain(each, (*path, index), faults) for index, each in enumerate(value)]
    if isinstance(value, PurePath):
        return str(value)
    if isinstance(value, str):
        if any(0xD800 <= ord(character) <= 0xDFFF for character in value):
            faults.append(Fault(path, "must be Unicode text, got half a surrogate pair"))
        return str(value)
    if value is None or isinstance(value, bool | int | float):
        return value
    if hasattr(value, "tolist"):
        return _plain(value.tolist(), path, faults)
    faults.append(Fault(path, f"must be text, a number, a list or a mapping, got {type(value).__name__}"))
    return None
