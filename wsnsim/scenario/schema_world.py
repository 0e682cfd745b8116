"""Schema of `world:`: the room, its light, what stands in it, and who moves in it."""

import math
from typing import Annotated, Literal, Self, TypeAlias

from pydantic import Field, Tag, model_validator

from wsnsim.scenario.schema_base import (
    Coordinate,
    Direction,
    Extent,
    InputFile,
    Name,
    Part,
    Position,
    Seed,
    SemiAxis,
    kind_or,
    wrong,
)
from wsnsim.scenario.schema_motion import Motion, Waypoints

_SHORTEST_M = 1e-3
"""Length of a wall at least [m]."""


class Light(Part):
    """One distant light, and light that comes from everywhere."""

    direction: Direction = Field((0.3, -0.5, 0.8), description="vector towards the light, of any length [-]")
    ambient: float = Field(0.6, ge=0, le=1, description="share of the light that comes from everywhere [-]")


class PatchTexture(Part):
    """Coloured patches on a body's surface."""

    kind: Literal["patches"] = Field("patches", description="patches: plain colours around random centres")
    colours: int = Field(9, ge=1, le=64, description="number of different colours [-]")
    patches: int = Field(18, ge=1, le=1000, description="number of patches [-]")
    seed: Seed | None = Field(None, description="seed of the pattern; null: the run's own seed")

    @model_validator(mode="after")
    def _colours_all_used(self) -> Self:
        if self.colours > self.patches:
            raise wrong(f"colours must be at most patches, got {self.colours} and {self.patches}")
        return self


GreyLevel: TypeAlias = Annotated[float, Field(ge=0, le=255)]


class PlainTexture(Part):
    """One colour all over."""

    kind: Literal["plain"] = Field("plain", description="plain: one colour all over")
    colour: tuple[GreyLevel, GreyLevel, GreyLevel] = Field(
        (150.0, 148.0, 142.0), description="red, green and blue [grey levels of 255]"
    )


_Texture: TypeAlias = Annotated[PatchTexture, Tag("patches")] | Annotated[PlainTexture, Tag("plain")]
MoverTexture: TypeAlias = Annotated[_Texture, kind_or("patches")]
"""Patches where the kind is left out."""
OccluderTexture: TypeAlias = Annotated[_Texture, kind_or("plain")]
"""Plain where the kind is left out."""


class Shape(Part):
    """A solid with its axes along the body's own; trackers model each by the ellipsoid of its semi-axes."""

    kind: Literal["ellipsoid", "box", "cylinder"] = Field(
        description="ellipsoid, box, or cylinder, which stands along z"
    )
    semi_axes_m: tuple[SemiAxis, SemiAxis, SemiAxis] = Field(
        description="semi-axes or half extents along x, y and z of the body [m]"
    )
    texture: MoverTexture = Field(PatchTexture(), description="what the surface looks like")


class Target(Part):
    """A body to track."""

    id: Name = Field(description="name, unique in the world")
    shape: Shape = Field(description="form and surface")
    motion: Motion = Field(description="where it is at any time")
    learn_from: InputFile | None = Field(
        None,
        description="album of pictures from which trackers learn what it looks like, a CSV file with "
        "file, x_m, y_m, z_m and focal_px of each; null: pictures are taken before the run",
    )


class Person(Part):
    """Somebody who hides what is behind, and is not tracked; or a crowd of such."""

    id: Name = Field(description="name, unique in the world; those of a crowd are NAME-1, NAME-2, ...")
    count: int = Field(
        1, ge=1, le=10_000, description="how many there are, each with a motion of its own [-]"
    )
    shape: Shape = Field(description="form and surface")
    motion: Motion = Field(description="where it is at any time")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of everybody."""
        return (self.id,) if self.count == 1 else tuple(f"{self.id}-{n}" for n in range(1, self.count + 1))

    @model_validator(mode="after")
    def _crowds_spread(self) -> Self:
        motion = self.motion
        drawn = motion.kind in {"random_waypoint", "gauss_markov"}
        if self.count > 1 and not drawn and not (isinstance(motion, Waypoints) and motion.jitter_m > 0):
            must = "must have a motion that is drawn for each (waypoints: with jitter_m)"
            raise wrong(f"a count of {self.count} {must}, got {motion.kind}")
        return self


Attenuation: TypeAlias = Annotated[float, Field(ge=0, le=200)]
_ATTENUATION = (
    "what it costs radio links across it, where network.propagation has walls; null: their loss_db [dB]"
)


class Wall(Part):
    """A wall along a straight line, with square ends."""

    id: Name = Field(description="name, unique in the world")
    kind: Literal["wall"] = Field(description="wall: upright along a straight line")
    from_m: tuple[Coordinate, Coordinate] = Field(description="x and y where its middle line begins [m]")
    to_m: tuple[Coordinate, Coordinate] = Field(description="x and y where its middle line ends [m]")
    height_m: Extent = Field(2.5, description="from its lower to its upper edge [m]")
    thickness_m: Extent = Field(0.1, description="across its line, half on either side [m]")
    base_m: Coordinate = Field(0.0, description="height of its lower edge [m]")
    texture: OccluderTexture = Field(PlainTexture(), description="what the surface looks like")
    attenuation_db: Attenuation | None = Field(None, description=_ATTENUATION)

    @model_validator(mode="after")
    def _has_a_length(self) -> Self:
        if math.dist(self.from_m, self.to_m) < _SHORTEST_M:
            raise wrong(
                f"must be {_SHORTEST_M:g} m long or more, got a wall from {list(self.from_m)} to itself"
            )
        return self


class Box(Part):
    """A box that stands upright."""

    id: Name = Field(description="name, unique in the world")
    kind: Literal["box"] = Field(description="box: upright, turned by yaw_deg")
    centre_m: Position = Field(description="its middle [m]")
    size_m: tuple[Extent, Extent, Extent] = Field(description="extent along its own x, y and z [m]")
    yaw_deg: float = Field(0.0, ge=-360, le=360, description="turn from x towards y [deg]")
    texture: OccluderTexture = Field(PlainTexture(), description="what the surface looks like")
    attenuation_db: Attenuation | None = Field(None, description=_ATTENUATION)


class Pillar(Part):
    """An upright cylinder."""

    id: Name = Field(description="name, unique in the world")
    kind: Literal["pillar"] = Field(description="pillar: an upright cylinder")
    centre_m: tuple[Coordinate, Coordinate] = Field(description="x and y of its middle [m]")
    radius_m: Extent = Field(description="of its circle [m]")
    height_m: Extent = Field(2.5, description="from its lower to its upper end [m]")
    base_m: Coordinate = Field(0.0, description="height of its lower end [m]")
    texture: OccluderTexture = Field(PlainTexture(), description="what the surface looks like")
    attenuation_db: Attenuation | None = Field(None, description=_ATTENUATION)


Occluder: TypeAlias = Annotated[Wall | Box | Pillar, Field(discriminator="kind")]


class World(Part):
    """Ground truth, which no camera and no tracker changes."""

    size_m: tuple[Extent, Extent, Extent] = Field(description="extent of the world from the origin [m]")
    light: Light = Field(Light(), description="what lights the targets")
    occluders: tuple[Occluder, ...] = Field(
        (), max_length=1000, description="what stands about and hides what is behind it"
    )
    targets: tuple[Target, ...] = Field(
        (), max_length=256, description="bodies to track; none for systems that need no cameras"
    )
    people: tuple[Person, ...] = Field(
        (), max_length=1000, description="who moves about, hides what is behind, and is not tracked"
    )
    leaving: Literal["error", "allow"] = Field(
        "error",
        description="error: whoever is outside the world's size at the instant of an image is refused before "
        "the run; allow: targets and people may start outside, leave and come back",
    )
