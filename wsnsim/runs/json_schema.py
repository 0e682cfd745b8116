"""A scenario's JSON Schema, by which an editor completes keys and finds mistakes.

It holds what one value or one section must be. What must hold between sections,
and the files that a scenario names, only the loader checks. Sections that come
in kinds are written as ``if`` and ``then``, so that an editor offers the keys of
the kind that stands there, and complains of that kind alone.
"""

from collections.abc import Mapping
from typing import Any

from wsnsim.metrics.figures import SUMMARY_KEYS
from wsnsim.scenario.registry import BUILT_IN, find_system
from wsnsim.scenario.schema import Scenario

DRAFT = "https://json-schema.org/draft/2020-12/schema"

_LETTER, _REST = r"[^\x00-@\[-^`{-\x7f]", r"[^\x00-,/:-@\[-^`{-\x7f]"
r"""``\w`` without digits, and ``[\w.-]``, of Python, where a browser's engine knows ASCII letters only."""

_PATTERNS = {r"^[^\W\d][\w.-]*$": f"^{_LETTER}{_REST}*$", r"^\w[\w.-]*$": f"^(?![.-]){_REST}+$"}

_COMPARISON = r"^\s*(<=|>=|==|!=|<|>)\s*[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?\s*$"


def scenario_json_schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of a scenario, its tracking system's keys included."""
    schema = Scenario.model_json_schema()
    sections = schema.pop("$defs")
    systems = {}
    for kind in sorted(BUILT_IN):
        system = find_system(kind)
        params = system.params.model_json_schema(ref_template=f"#/$defs/{kind}.{{model}}")
        params["properties"]["kind"]["description"] = f"{system.name}: {system.citation}"
        sections |= {f"{kind}.{name}": section for name, section in params.pop("$defs", {}).items()}
        sections[kind] = params
        systems[kind] = {"$ref": f"#/$defs/{kind}"}
    keys = schema["properties"]
    keys["system"] = {**_system(systems), "description": keys["system"]["description"]}
    keys["expect"]["propertyNames"] = {"enum": sorted(SUMMARY_KEYS)}
    keys["expect"]["additionalProperties"] = {"type": "string", "pattern": _COMPARISON}
    # the loader takes it from the file's name
    schema["required"].remove("name")
    # and this from a layout, where there is one
    sections["Motes"]["required"].remove("base")
    return {
        "$schema": DRAFT,
        "title": "wsnsim scenario",
        **_tidied(schema, sections),
        "description": "Everything a run of wsnsim depends on.",
        "$defs": {name: _tidied(section, sections) for name, section in sections.items()},
    }


def _system(systems: Mapping[str, Any]) -> dict[str, Any]:
    """Return the section of the tracking system: the package's kinds, or a user's with keys of its own."""
    kinds = {"anyOf": [{"enum": list(systems)}, {"type": "string", "pattern": r"^[^:]+:[^:]+$"}]}
    return {
        "type": "object",
        "required": ["kind"],
        "properties": {"kind": {**kinds, "description": 'its name, or your own "package.module:ATTRIBUTE"'}},
        "allOf": [_if_kind(kind, section) for kind, section in systems.items()],
    }


def _tidied(node: Any, sections: Mapping[str, Any]) -> Any:
    """Return a part of a schema in words that editors of all drafts know, kinds as ``if`` and ``then``."""
    if isinstance(node, list):
        return [_tidied(each, sections) for each in node]
    if not isinstance(node, dict):
        return node
    if isinstance(node.get("properties"), dict):
        # what stands in there are keys of a scenario, not words of the schema
        rest = {word: value for word, value in node.items() if word != "properties"}
        properties = {key: _tidied(value, sections) for key, value in node["properties"].items()}
        return {**_tidied(rest, sections), "properties": properties}
    kinds = _kinds(node.get("oneOf"), sections)
    tidy = {
        word: value if word in ("default", "enum", "required", "examples") else _tidied(value, sections)
        for word, value in node.items()
        if word not in ("title", "discriminator", "prefixItems") and not (kinds and word == "oneOf")
    }
    if "prefixItems" in node:
        tidy |= _items(_tidied(node["prefixItems"], sections))
    if isinstance(tidy.get("pattern"), str):
        tidy["pattern"] = _PATTERNS.get(tidy["pattern"], tidy["pattern"])
    if kinds:
        tidy |= _one_kind(kinds, "discriminator" in node, sections)
    return tidy


def _items(items: list[Any]) -> dict[str, Any]:
    """Return how the items of a list of fixed length are written: once where they are all alike."""
    if all(item == items[0] for item in items):
        return {"items": items[0]}
    return {"prefixItems": items, "items": False}


def _kinds(choices: Any, sections: Mapping[str, Any]) -> dict[str, Any]:
    """Return the sections of a choice by their `kind`; none where they are not told apart by it."""
    found = {}
    for choice in choices or []:
        name = str(choice.get("$ref", "")).removeprefix("#/$defs/")
        kind = sections.get(name, {}).get("properties", {}).get("kind", {}).get("const")
        if kind is None:
            return {}
        found[kind] = choice
    return found


def _one_kind(kinds: Mapping[str, Any], named: bool, sections: Mapping[str, Any]) -> dict[str, Any]:
    """Return what holds of a section that comes in kinds.

    Parameters
    ----------
    kinds : reference of each kind's section
    named : whether the kind must be given
    sections : by name
    """
    names = [reference["$ref"].removeprefix("#/$defs/") for reference in kinds.values()]
    words = [sections[name]["properties"]["kind"].get("description", "") for name in names]
    section = {
        "type": "object",
        "properties": {
            "kind": {"enum": list(kinds), "enumDescriptions": words, "description": "; ".join(words)}
        },
        "allOf": [_if_kind(kind, reference) for kind, reference in kinds.items()],
    }
    if named:
        return {**section, "required": ["kind"]}
    return {**section, "if": {"not": {"required": ["kind"]}}, "then": {"anyOf": list(kinds.values())}}


def _if_kind(kind: str, section: Any) -> dict[str, Any]:
    return {"if": {"properties": {"kind": {"const": kind}}, "required": ["kind"]}, "then": section}
