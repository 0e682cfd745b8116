"""Schema of `world:`: the room, its light, what stands in it, and who moves in it."""

import math
from typing import Annotated, Literal, Self, TypeAlias

from pydantic import AfterValidator, Field, Tag, model_validator

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
from wsnsim.scenario.schema_motion import Motion, Speed, Waypoints

_SHORTEST_M = 1e-3
"""Length of a wall, or of a prism's side, at least [m]."""
_STRAIGHT = 1e-6
"""Turn below which a corner is straight [rad]."""

FloorPlace: TypeAlias = tuple[Coordinate, Coordinate]


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
        1, ge=0, le=10_000, description="how many there are, each with a motion of its own; 0: nobody [-]"
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
        drawn = motion.kind in {"random_waypoint", "gauss_markov", "crowd"}
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


def _convex(corners: tuple[FloorPlace, ...]) -> tuple[FloorPlace, ...]:
    """Ask for corners that turn the same way at each, and once round in all."""
    befores, afters = (corners[-1], *corners[:-1]), (*corners[1:], corners[0])
    for before, corner in zip(befores, corners, strict=True):
        if math.dist(before, corner) < _SHORTEST_M:
            must = f"must have sides of {_SHORTEST_M:g} m or more"
            raise wrong(f"{must}, got two corners at {list(corner)} [m]; name each once")
    total = 0.0
    for number, (before, corner, after) in enumerate(zip(befores, corners, afters, strict=True), 1):
        place = f"{list(corner)} (corner {number})"
        turn = _turn(before, corner, after)
        if math.pi - abs(turn) < _STRAIGHT:
            raise wrong(f"must make a polygon with an area, got one that folds back at {place} [m]")
        if abs(turn) < _STRAIGHT:
            raise wrong(f"must turn at each corner, got a straight one at {place} [m]; leave it out")
        if total * turn < 0.0:
            must = "must make a convex polygon"
            raise wrong(f"{must}, got one that turns back at {place} [m]; divide it into convex ones")
        total += turn
    if abs(total) > 3.0 * math.pi:
        raise wrong("must go round once, got a polygon that crosses itself; divide it into convex ones")
    return corners


def _turn(start: FloorPlace, corner: FloorPlace, end: FloorPlace) -> float:
    """Return the angle from one side to the next, within ±π, to the left above 0 [rad]."""
    (ax, ay), (bx, by), (cx, cy) = start, corner, end
    ux, uy, vx, vy = bx - ax, by - ay, cx - bx, cy - by
    return math.atan2(ux * vy - uy * vx, ux * vx + uy * vy)


Corners: TypeAlias = Annotated[
    tuple[FloorPlace, ...], Field(min_length=3, max_length=32), AfterValidator(_convex)
]


class Prism(Part):
    """What stands upright on a convex polygon."""

    id: Name = Field(description="name, unique in the world")
    kind: Literal["prism"] = Field(description="prism: upright on a convex polygon")
    corners_m: Corners = Field(
        description="x and y of the corners, in either order; the polygon is convex, no corner straight [m]"
    )
    height_m: Extent = Field(2.5, description="from its lower to its upper end [m]")
    base_m: Coordinate = Field(0.0, description="height of its lower end [m]")
    texture: OccluderTexture = Field(PlainTexture(), description="what the surface looks like")
    attenuation_db: Attenuation | None = Field(None, description=_ATTENUATION)


Occluder: TypeAlias = Annotated[Wall | Box | Pillar | Prism, Field(discriminator="kind")]


class Crowd(Part):
    """How all with the motion `crowd` walk: to points that are drawn, and round each other.

    Nobody enters an occluder, leaves the area or walks over a camera; bodies with other motions are not
    heeded. All keep as far apart as the widest two of them must, twice its largest horizontal semi-axis.
    """

    speed_mps: Speed = Field(1.5, description="speed of everybody, without noise [m/s]")
    noise_sd_m: float = Field(
        0.066,
        ge=0,
        le=1e3,
        description="standard deviation of what is added to each step, x and y each [m]",
    )
    step_s: Annotated[float, Field(ge=1e-3, le=1e4)] | None = Field(
        None, description="time of one step; null: one frame period of the cameras [s]"
    )
    area_m: tuple[FloorPlace, FloorPlace] | None = Field(
        None, description="two opposite corners, x and y, of where they walk [m]; null: the floor plan"
    )


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
    crowd: Crowd | None = Field(
        None, description="how those walk whose motion is crowd; null: nobody has this motion"
    )
    leaving: Literal["error", "allow"] = Field(
        "error",
        description="error: whoever is outside the world's size at the instant of an image is refused before "
        "the run; allow: targets and people may start outside, leave and come back",
    )
