"""What the parts of the schema share: their base, their common types, their checks against the outside.

Numbers are never read from text and whole numbers never from fractions: the
loader validates in pydantic's strict JSON mode.
"""

import math
import os
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, TypeAlias

from pydantic import AfterValidator, BaseModel, Discriminator, Field, GetJsonSchemaHandler, ValidationInfo
from pydantic_core import CoreSchema, PydanticCustomError

from wsnsim.scenario.faults import did_you_mean, nearest, one_of, quoted, shown, unreadable

PHOTO_PREFIX = "photo/"
"""A background that begins so is one of the package's photographs, not a file."""


_SHORTEST = 1e-6
"""Length from which on a vector has a direction."""


class Part(BaseModel, extra="forbid", frozen=True, allow_inf_nan=False):
    """A section of a scenario: frozen, without unknown keys, all numbers finite."""


def wrong(message: str) -> PydanticCustomError:
    """Return the error by which a validator says what must hold."""
    return PydanticCustomError("scenario", "{message}", {"message": message})


def kind_or(default: str) -> Discriminator:
    """Return a discriminator between tagged sections by which the kind may be left out."""

    def kind(value: Any) -> Any:
        return value.get("kind", default) if isinstance(value, Mapping) else getattr(value, "kind", default)

    return Discriminator(kind)


def _unit_quaternion(q: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
    """Scale to length 1; what has it within rounding stays, so that a resolved scenario reads the same."""
    largest = max(abs(c) for c in q)
    if largest == 0:
        raise wrong("must be a quaternion other than zero, got all zeros")
    norm = math.hypot(*(c / largest for c in q))
    if abs(norm * largest - 1) < 1e-12:
        return q
    w, x, y, z = (c / largest / norm for c in q)
    return (w, x, y, z)


def _non_zero(v: tuple[float, float, float]) -> tuple[float, float, float]:
    if math.hypot(*v) < _SHORTEST:
        raise wrong(f"must be a direction of length {_SHORTEST:g} or more, got {list(v)}")
    return v


def _known(name: str, what: str, known: Collection[str]) -> str:
    if name not in known:
        names = one_of(sorted(known))
        raise wrong(f"must be a known {what}: {names}, got {shown(name)}{did_you_mean(name, known)}")
    return name


@dataclass(frozen=True)
class _Offered:
    """What the JSON Schema says of a text, put in when somebody asks for the schema."""

    words: Callable[[], dict[str, Any]]

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        return {**handler(schema), **self.words()}


def _platforms() -> dict[str, Any]:
    from wsnsim.hardware.profiles import PLATFORMS

    return {"enum": sorted(PLATFORMS)}


def _radios() -> dict[str, Any]:
    from wsnsim.hardware.profiles import RADIOS

    return {"enum": sorted(RADIOS)}


def _photos() -> dict[str, Any]:
    from wsnsim.vision.photos import PHOTO_NAMES

    return {"anyOf": [{"enum": list(PHOTO_NAMES)}, {"not": {"pattern": f"^{PHOTO_PREFIX}"}}]}


def _known_platform(name: str) -> str:
    from wsnsim.hardware.profiles import PLATFORMS

    return _known(name, "platform", PLATFORMS)


def _known_radio(name: str) -> str:
    from wsnsim.hardware.profiles import RADIOS

    return _known(name, "radio", RADIOS)


def _existing_file(text: str, info: ValidationInfo) -> str:
    """Make a path absolute from the folder in the context; without one it stays as it is."""
    if info.context is None:
        return text
    base_dir: Path = info.context["base_dir"]
    file = os.path.normpath(base_dir.absolute() / text)
    reason = unreadable(Path(file))
    if reason is not None:
        must, hint = reason
        raise wrong(f"{must}, got {quoted(file)}{hint}")
    return file


def _photo_or_file(text: str, info: ValidationInfo) -> str:
    if not text.startswith(PHOTO_PREFIX):
        return _existing_file(text, info)
    from wsnsim.vision.photos import PHOTO_NAMES

    if text in PHOTO_NAMES:
        return text
    # What all names have in common would make any two of them alike.
    near = nearest(text.removeprefix(PHOTO_PREFIX), [name.removeprefix(PHOTO_PREFIX) for name in PHOTO_NAMES])
    hint = "" if near is None else f"; did you mean {quoted(PHOTO_PREFIX + near)}?"
    raise wrong(f"must be a known photograph: {one_of(PHOTO_NAMES)}, got {shown(text)}{hint}")


Name: TypeAlias = Annotated[str, Field(pattern=r"^[^\W\d][\w.-]*$", max_length=64)]
"""Name of a thing inside a scenario: a letter or _, then letters, digits, _ . -"""
Coordinate: TypeAlias = Annotated[float, Field(ge=-1e6, le=1e6)]
Position: TypeAlias = tuple[Coordinate, Coordinate, Coordinate]
Extent: TypeAlias = Annotated[float, Field(gt=0, le=1e6)]
SemiAxis: TypeAlias = Annotated[float, Field(ge=1e-3, le=1e3)]
Direction: TypeAlias = Annotated[Position, AfterValidator(_non_zero)]
Quaternion: TypeAlias = Annotated[
    tuple[Coordinate, Coordinate, Coordinate, Coordinate], AfterValidator(_unit_quaternion)
]
Seed: TypeAlias = Annotated[int, Field(ge=0, le=2**63 - 1)]
PlatformName: TypeAlias = Annotated[str, AfterValidator(_known_platform), _Offered(_platforms)]
RadioName: TypeAlias = Annotated[str, AfterValidator(_known_radio), _Offered(_radios)]
InputFile: TypeAlias = Annotated[str, Field(min_length=1), AfterValidator(_existing_file)]
PhotoOrFile: TypeAlias = Annotated[
    str, Field(min_length=1), AfterValidator(_photo_or_file), _Offered(_photos)
]
