"""From pydantic's location of an error to the path a person wrote, and the fields that stand there.

pydantic puts names of union members between the keys; a walk along the types
and the data together tells them from keys.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel

from wsnsim.scenario.faults import KeyPath


@dataclass(frozen=True)
class Spot:
    """Where an error is."""

    path: KeyPath
    model: type[BaseModel] | None
    """The section that the last key of the path stands in, where it is one."""
    members: tuple[Any, ...]
    """The types that are allowed at the path."""


def locate(model: type[BaseModel], data: Any, location: tuple[int | str, ...]) -> Spot:
    """Follow pydantic's `location` through `data`, which was to become a `model`."""
    members: tuple[Any, ...] = (model,)
    section: type[BaseModel] | None = None
    path: KeyPath = ()
    for number, step in enumerate(location):
        sections = [each for each in members if isinstance(each, type) and issubclass(each, BaseModel)]
        last = number == len(location) - 1
        if len(members) > 1 and isinstance(step, str):
            # A union: this step names the member, a section by its kind or its class.
            chosen = [each for each in sections if step == each.__name__ or step in _kinds(each)]
            members = tuple(chosen[:1] or [each for each in members if each not in sections])
            continue
        if sections and isinstance(step, str):
            section = sections[0]
            path = (*path, step)
            field = section.model_fields.get(step)
            members = () if field is None else member_types(field.annotation)
            data = data.get(step) if isinstance(data, Mapping) else None
        elif isinstance(step, int) and (isinstance(data, list) or last):
            section = None
            path = (*path, step)
            members = _item_types(members, step)
            data = data[step] if isinstance(data, list) and step < len(data) else None
        elif isinstance(data, Mapping) and step in data:
            section = None
            path = (*path, step)
            members = _value_types(members)
            data = data[step]
    return Spot(path, section, members)


def member_types(annotation: Any) -> tuple[Any, ...]:
    """Return the types that an annotation allows, None and metadata left out."""
    origin = get_origin(annotation)
    if origin is Annotated:
        return member_types(get_args(annotation)[0])
    if origin is Union or origin is UnionType:
        return tuple(each for part in get_args(annotation) for each in member_types(part))
    return () if annotation is NoneType else (annotation,)


def _kinds(model: type[BaseModel]) -> set[Any]:
    """Return the literal values by which a union tells `model` from its other members."""
    literals = (each for field in model.model_fields.values() for each in member_types(field.annotation))
    return {value for each in literals if get_origin(each) is Literal for value in get_args(each)}


def _item_types(members: tuple[Any, ...], index: int) -> tuple[Any, ...]:
    """Return the types of a list's item."""
    for each in members:
        arguments = get_args(each)
        if get_origin(each) is tuple and arguments[-1] is not Ellipsis:
            return member_types(arguments[index]) if index < len(arguments) else ()
        if get_origin(each) in {tuple, list}:
            return member_types(arguments[0])
    return ()


def _value_types(members: tuple[Any, ...]) -> tuple[Any, ...]:
    """Return the types of a free mapping's values."""
    for each in members:
        if get_origin(each) is dict:
            return member_types(get_args(each)[1])
    return ()
