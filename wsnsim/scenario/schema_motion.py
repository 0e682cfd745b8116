"""Schema of `motion:`: where a target or a person is at any time, and how it is turned."""

from typing import Annotated, Literal, Self, TypeAlias

from pydantic import Field, model_validator

from wsnsim.scenario.schema_base import (
    Coordinate,
    Direction,
    Extent,
    InputFile,
    Part,
    Position,
    Quaternion,
    wrong,
)

_SPEED = 1000.0
"""Greatest speed [m/s]."""

Speed: TypeAlias = Annotated[float, Field(gt=0, le=_SPEED)]
Deviation: TypeAlias = Annotated[float, Field(ge=0, le=_SPEED)]
Component: TypeAlias = Annotated[float, Field(ge=-_SPEED, le=_SPEED)]


class Spin(Part):
    """A turn at constant rate, besides the orientation that the motion has."""

    axis: Direction = Field((0.0, 0.0, 1.0), description="axis of the turn in the world, of any length [-]")
    rate_radps: float = Field(
        0.0, ge=-1e4, le=1e4, description="rate of the turn, right-handed about the axis [rad/s]"
    )


Orientation: TypeAlias = Annotated[
    Quaternion,
    Field(description="turns the body into the world at time 0, (w, x, y, z), of any length but 0 [-]"),
]
Spinning: TypeAlias = Annotated[Spin, Field(description="how the body turns as time goes on")]
Start: TypeAlias = Annotated[
    Position | None, Field(description="place at time 0 [m]; null: drawn in the area, outside the occluders")
]
AreaCorners: TypeAlias = Annotated[
    tuple[Position, Position] | None,
    Field(
        description="two opposite corners of the box that the body's centre stays in [m]; "
        "null: the floor plan less half the body, which stands on the floor"
    ),
]

UPRIGHT = (1.0, 0.0, 0.0, 0.0)


class Waypoints(Part):
    """Motion along straight lines from point to point."""

    kind: Literal["waypoints"] = Field(description="waypoints: straight lines from point to point")
    points_m: tuple[Position, ...] = Field(
        min_length=1, description="points to visit, the first at time 0 [m]; a single one: the target stands"
    )
    speed_mps: Speed = Field(1.0, description="speed along the lines [m/s]")
    jitter_m: float = Field(
        0.0,
        ge=0,
        le=1e6,
        description="standard deviation of each point's displacement by the seed, each axis [m]",
    )
    orientation: Orientation = UPRIGHT
    spin: Spinning = Spin()


class ConstantVelocity(Part):
    """Motion along one straight line."""

    kind: Literal["constant_velocity"] = Field(description="constant_velocity: one straight line")
    start_m: Position = Field(description="place at time 0 [m]")
    velocity_mps: tuple[Component, Component, Component] = Field(description="velocity along x, y, z [m/s]")
    orientation: Orientation = UPRIGHT
    spin: Spinning = Spin()


class RandomWaypoint(Part):
    """Motion to points that are drawn; it starts outside the occluders, but avoids nothing on its way."""

    kind: Literal["random_waypoint"] = Field(description="random_waypoint: straight lines to points drawn")
    area_m: AreaCorners = None
    start_m: Start = None
    speed_mps: tuple[Speed, Speed] = Field(
        (0.5, 1.5), description="least and greatest speed of a line, uniformly distributed between [m/s]"
    )
    pause_s: float = Field(0.0, ge=0, le=1e7, description="rest at each point [s]")
    orientation: Orientation = UPRIGHT
    spin: Spinning = Spin()

    @model_validator(mode="after")
    def _speeds_in_order(self) -> Self:
        least, greatest = self.speed_mps
        if least > greatest:
            raise wrong(f"speed_mps must name the least speed first, got {least:g} and {greatest:g}")
        return self


class GaussMarkov(Part):
    """Motion whose velocity changes a little at a time; the sides of its area throw it back, nothing else."""

    kind: Literal["gauss_markov"] = Field(description="gauss_markov: a velocity that drifts about its mean")
    area_m: AreaCorners = None
    start_m: Start = None
    mean_speed_mps: Deviation = Field(1.0, description="length of the mean velocity, horizontal [m/s]")
    heading_deg: float | None = Field(
        None,
        ge=-360,
        le=360,
        description="direction of the mean velocity from x towards y [deg]; null: drawn",
    )
    sd_mps: tuple[Deviation, Deviation, Deviation] = Field(
        (0.3, 0.3, 0.0), description="standard deviation of the velocity about its mean, x, y and z [m/s]"
    )
    memory: float = Field(
        0.75, ge=0, le=1, description="share of a deviation that is left after one interval [-]"
    )
    interval_s: float = Field(1.0, ge=1e-3, le=1e6, description="time for which a velocity lasts [s]")
    orientation: Orientation = UPRIGHT
    spin: Spinning = Spin()


class Recorded(Part):
    """Motion along a track that was recorded."""

    kind: Literal["recorded"] = Field(description="recorded: a track from a file")
    file: InputFile = Field(
        description="the track, found from the scenario's folder; before its first and after its last time "
        "the body stands"
    )
    format: Literal["csv", "obsmat", "motchallenge"] | None = Field(
        None,
        description="csv: a header with time_s, x_m, y_m; obsmat: of ETH and UCY; motchallenge: boxes or "
        "places; null: told by the name, NAME.csv, obsmat.txt, gt.txt or det.txt, or by such a header",
    )
    track_id: Annotated[int, Field(ge=-(2**31), le=2**31)] | None = Field(
        None, description="which track of an obsmat or motchallenge file; null: the only one"
    )
    frame_rate_hz: Annotated[float, Field(gt=0, le=1e6)] | None = Field(
        None, description="images a second of an obsmat or motchallenge recording (UCY: 25, ETH: 15) [Hz]"
    )
    homography: InputFile | None = Field(
        None,
        description="3 × 3 matrix from image to floor, for boxes of a motchallenge file without places; "
        "found from the scenario's folder",
    )
    height_m: Coordinate = Field(
        1.0, description="height of the body's centre above the recorded floor, where a csv has no z_m [m]"
    )
    scale: Extent = Field(1.0, description="factor on the track's coordinates [-]")
    offset_m: Position = Field((0.0, 0.0, 0.0), description="added to the scaled track [m]")
    start_s: Annotated[float, Field(ge=0, le=1e9)] | None = Field(
        0.0, description="time of the recording at which the run begins [s]; null: when the track begins"
    )
    orientation: Orientation = UPRIGHT
    spin: Spinning = Spin()


class CrowdWalk(Part):
    """Motion as one of `world.crowd`, on the floor: to points that are drawn, round walls and the others."""

    kind: Literal["crowd"] = Field(description="crowd: walks with all others of world.crowd, upright")


OwnMotion: TypeAlias = Waypoints | ConstantVelocity | RandomWaypoint | GaussMarkov | Recorded
"""Motions of one body alone."""
Motion: TypeAlias = Annotated[OwnMotion | CrowdWalk, Field(discriminator="kind")]
