"""Schema of `motes.layout:`: many motes at once, from a file or by a rule.

A layout stands for entries of `motes.nodes`, `motes.base` and, of a file, `network`: it is written out
as these when a scenario is loaded, so that what is resolved has none.
"""

from collections.abc import Mapping
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import Discriminator, Field, Tag

from wsnsim.scenario.schema_base import Coordinate, Extent, InputFile, Part, Seed

Count: TypeAlias = Annotated[int, Field(ge=2, le=60_000)]
_NODES = "number of nodes n0, n1, ... in all, the base station among them [-]"
_SINK = "number of the node that is the base station [-]"
_HEIGHT = "height at which all stand [m]"


class GridLayout(Part):
    """Rows and columns of a square."""

    kind: Literal["grid"] = Field("grid", description="grid: row by row in a square, n0 in its corner")
    nodes: Count = Field(description=_NODES)
    spacing_m: Extent = Field(description="from one row or column to the next [m]")
    sink: int = Field(0, ge=0, description=_SINK)
    height_m: Coordinate = Field(0.0, description=_HEIGHT)


class LineLayout(Part):
    """All in a row."""

    kind: Literal["line"] = Field("line", description="line: one after the other along x")
    nodes: Count = Field(description=_NODES)
    spacing_m: Extent = Field(description="from one node to the next [m]")
    sink: int = Field(0, ge=0, description=_SINK)
    height_m: Coordinate = Field(0.0, description=_HEIGHT)


class StarLayout(Part):
    """A circle round the base station."""

    kind: Literal["star"] = Field("star", description="star: n0, the base station, in the middle of a circle")
    nodes: Count = Field(description=_NODES)
    radius_m: Extent = Field(description="of the circle [m]")
    height_m: Coordinate = Field(0.0, description=_HEIGHT)


class RandomLayout(Part):
    """Anywhere in a square."""

    kind: Literal["random"] = Field(
        "random", description="random: anywhere in a square, n0, the base station, in its middle"
    )
    nodes: Count = Field(description=_NODES)
    side_m: Extent = Field(description="of the square [m]")
    seed: Seed | None = Field(None, description="seed of the places; null: the run's own seed")
    height_m: Coordinate = Field(0.0, description=_HEIGHT)


def _form(value: Any) -> str | None:
    """Tell a file from the rules; anything else has no form."""
    if isinstance(value, str):
        return "text"
    kind = value.get("kind") if isinstance(value, Mapping) else getattr(value, "kind", None)
    return kind if isinstance(kind, str) else None


Generated: TypeAlias = GridLayout | LineLayout | StarLayout | RandomLayout
Layout: TypeAlias = Annotated[
    Annotated[InputFile, Tag("text")]
    | Annotated[GridLayout, Tag("grid")]
    | Annotated[LineLayout, Tag("line")]
    | Annotated[StarLayout, Tag("star")]
    | Annotated[RandomLayout, Tag("random")],
    Discriminator(
        _form,
        custom_error_type="layout",
        custom_error_message='must be a JSON file, or a mapping of kind "grid", "line", "star" or "random"',
    ),
]


class LayoutHolder(Part):
    """What a layout is checked in before there is a scenario."""

    layout: Layout
