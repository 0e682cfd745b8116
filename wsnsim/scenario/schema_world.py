"""Schema of `world:`: the room, its light, and the targets that move in it."""

from typing import Annotated, Literal, Self, TypeAlias

from pydantic import Field, model_validator

from wsnsim.scenario.schema_base import (
    Coordinate,
    Direction,
    Extent,
    InputFile,
    Name,
    Part,
    Position,
    Quaternion,
    Seed,
    SemiAxis,
    wrong,
)


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


class Ellipsoid(Part):
    """An ellipsoid with its axes along the body's own."""

    kind: Literal["ellipsoid"] = Field(description="ellipsoid")
    semi_axes_m: tuple[SemiAxis, SemiAxis, SemiAxis] = Field(
        description="semi-axes along x, y and z of the body [m]"
    )
    texture: PatchTexture = Field(PatchTexture(), description="what the surface looks like")


class Waypoints(Part):
    """Motion along straight lines from point to point."""

    kind: Literal["waypoints"] = Field(description="waypoints: straight lines from point to point")
    points_m: tuple[Position, ...] = Field(
        min_length=1, description="points to visit, the first at time 0 [m]; a single one: the target stands"
    )
    speed_mps: float = Field(1.0, gt=0, le=1000, description="speed along the lines [m/s]")
    jitter_m: float = Field(
        0.0,
        ge=0,
        le=1e6,
        description="standard deviation of each point's displacement by the seed, each axis [m]",
    )
    orientation: Quaternion = Field(
        (1.0, 0.0, 0.0, 0.0),
        description="turns the body into the world, (w, x, y, z), of any length but 0 [-]",
    )


class Recorded(Part):
    """Motion along a track that was recorded."""

    kind: Literal["recorded"] = Field(description="recorded: a track from a file")
    file: InputFile = Field(description="the track, found from the scenario's folder")
    height_m: Coordinate = Field(1.0, description="height of the body's centre where the track has none [m]")
    scale: Extent = Field(1.0, description="factor on the track's coordinates [-]")
    offset_m: Position = Field((0.0, 0.0, 0.0), description="added to the scaled track [m]")
    start_s: float = Field(0.0, ge=0, le=1e9, description="time of the recording at which the run begins [s]")


Motion: TypeAlias = Annotated[Waypoints | Recorded, Field(discriminator="kind")]


class Target(Part):
    """A body to track."""

    id: Name = Field(description="name, unique among the targets")
    shape: Ellipsoid = Field(description="form and surface")
    motion: Motion = Field(description="where it is at any time")


class World(Part):
    """Ground truth, which no camera and no tracker changes."""

    size_m: tuple[Extent, Extent, Extent] = Field(description="extent of the world from the origin [m]")
    light: Light = Field(Light(), description="what lights the targets")
    targets: tuple[Target, ...] = Field(min_length=1, max_length=256, description="bodies to track")
