"""pydantic's errors in plain words: what must hold, and what was found."""

from collections.abc import Callable, Mapping
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from wsnsim.scenario.faults import Fault, did_you_mean, one_of, shown
from wsnsim.scenario.locate import Spot, locate

_PLAIN = {
    "finite_number": "must be a finite number",
    "float_type": "must be a number",
    "float_parsing": "must be a number",
    "int_type": "must be a whole number",
    "int_parsing": "must be a whole number",
    "int_parsing_size": "must be a whole number of fewer digits",
    "int_from_float": "must be a whole number",
    "bool_type": "must be true or false",
    "bool_parsing": "must be true or false",
    "string_type": "must be text",
    "list_type": "must be a list",
    "tuple_type": "must be a list",
    "set_type": "must be a list",
    "dict_type": "must be a mapping",
    "mapping_type": "must be a mapping",
    "model_type": "must be a mapping",
    "model_attributes_type": "must be a mapping",
    "none_required": "must be null",
}

_BOUNDS: dict[str, Callable[[Mapping[str, Any]], str]] = {
    "greater_than": lambda ctx: f"must be greater than {_number(ctx['gt'])}",
    "greater_than_equal": lambda ctx: f"must be at least {_number(ctx['ge'])}",
    "less_than": lambda ctx: f"must be less than {_number(ctx['lt'])}",
    "less_than_equal": lambda ctx: f"must be at most {_number(ctx['le'])}",
    "multiple_of": lambda ctx: f"must be a multiple of {_number(ctx['multiple_of'])}",
    "string_too_short": lambda ctx: f"must have at least {_count(ctx['min_length'], 'character')}",
    "string_too_long": lambda ctx: f"must have at most {_count(ctx['max_length'], 'character')}",
}

_PATTERNS = {
    r"^[^\W\d][\w.-]*$": "must be a letter or _ and then letters, digits or _ . - only",
    r"^\w[\w.-]*$": "must be a letter, digit or _ and then letters, digits or _ . - only",
}


def faults_of(error: ValidationError, model: type[BaseModel], data: Any) -> list[Fault]:
    """Say in words what pydantic found.

    Parameters
    ----------
    error : from validating `data`
    model : what `data` was to become
    data : plain data; paths are relative to it
    """
    faults = []
    for each in error.errors(include_url=False):
        if each["type"] == "missing" and isinstance(each["loc"][-1], int):
            # pydantic calls an item of a list of fixed length missing; people count items.
            faults.append(_too_few(each["input"], locate(model, data, each["loc"][:-1])))
        elif each["type"] != "too_short" or len(each["input"]) < each["ctx"]["min_length"]:
            # pydantic counts the valid items only; a list whose items are all wrong is not too short.
            faults.append(_fault(each, locate(model, data, each["loc"])))
    return list(dict.fromkeys(faults))


def _fault(error: ErrorDetails, spot: Spot) -> Fault:
    kind, value, context = error["type"], error["input"], error.get("ctx", {})
    if kind == "json_invalid":
        # Python's text can hold what UTF-8 cannot; nothing else that was read as YAML fails as JSON.
        return Fault(spot.path, "must be Unicode text throughout, got half a surrogate pair")
    if kind == "missing":
        return _missing(spot)
    if kind == "extra_forbidden":
        return Fault(spot.path, f"unknown key{_known_keys(str(spot.path[-1]), spot)}", of_key=True)
    if kind == "union_tag_not_found":
        discriminator = context["discriminator"].strip("'")
        message = f"must be given: {one_of(_tags(spot, discriminator))}"
        return Fault((*spot.path, discriminator), message)
    if kind == "union_tag_invalid":
        discriminator = context["discriminator"].strip("'()")  # ...() where a function names the kind
        return Fault(
            (*spot.path, discriminator), _choice(value.get(discriminator), _tags(spot, discriminator))
        )
    choices = [arg for each in spot.members if get_origin(each) is Literal for arg in get_args(each)]
    if kind == "literal_error" and choices:
        return Fault(spot.path, _choice(value, choices))
    if kind in {"too_short", "too_long"}:
        return Fault(spot.path, _length(kind, context, spot))
    if kind in {"scenario", "value_error", "assertion_error"}:
        return Fault(spot.path, str(context.get("error", error["msg"])))
    if kind == "string_pattern_mismatch":
        must = _PATTERNS.get(context["pattern"], f"must match the pattern {context['pattern']}")
    elif kind in _BOUNDS:
        must = _BOUNDS[kind](context)
    else:
        must = _PLAIN.get(kind) or error["msg"].replace("Input should", "must")
    return Fault(spot.path, f"{must}, got {shown(value)}")


def _missing(spot: Spot) -> Fault:
    """Name a key that is not there, and what it means."""
    field = spot.model.model_fields.get(str(spot.path[-1])) if spot.model is not None else None
    what = f" ({field.description})" if field is not None and field.description else ""
    return Fault(spot.path, f"must be given{what}")


def _too_few(value: list[Any], spot: Spot) -> Fault:
    """Say how long a list of fixed length must be."""
    lengths = [len(get_args(each)) for each in spot.members if get_origin(each) is tuple]
    return Fault(spot.path, f"must have exactly {_count(lengths[0], 'item')}, got {len(value)}")


def _known_keys(key: str, spot: Spot) -> str:
    """Name the key that was meant, or else all that may stand there."""
    known = list(spot.model.model_fields) if spot.model is not None else []
    return did_you_mean(key, known) or (f"; must be {one_of(known)}" if known else "")


def _tags(spot: Spot, discriminator: str) -> list[str]:
    """Return the kinds that the sections allowed at `spot` have."""
    annotations = [each.model_fields[discriminator].annotation for each in spot.members]
    return [str(tag) for annotation in annotations for tag in get_args(annotation)]


def _choice(value: Any, choices: list[Any]) -> str:
    near = did_you_mean(value, [str(each) for each in choices]) if isinstance(value, str) else ""
    return f"must be {one_of(choices)}, got {shown(value)}{near}"


def _length(kind: str, context: Mapping[str, Any], spot: Spot) -> str:
    """Say how long a list or mapping must be."""
    got = context["actual_length"]
    fixed = any(get_origin(each) is tuple and Ellipsis not in get_args(each) for each in spot.members)
    limit = context["min_length"] if kind == "too_short" else context["max_length"]
    extent = "exactly" if fixed else "at least" if kind == "too_short" else "at most"
    return f"must have {extent} {_count(limit, 'item')}, got {got}"


def _number(value: Any) -> str:
    """Write a bound without the fraction that it does not have."""
    return (
        f"{value:.0f}"
        if isinstance(value, float) and value.is_integer() and abs(value) < 1e15
        else f"{value}"
    )


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"
