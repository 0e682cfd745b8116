"""What the scan-line system lets a scenario choose: one small section a choice, with its published form."""

from collections.abc import Callable, Mapping
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import AfterValidator, BaseModel, BeforeValidator, Field

Metres: TypeAlias = Annotated[float, Field(gt=0, le=1e6)]
Share: TypeAlias = Annotated[float, Field(ge=0, le=1)]


def _listed(value: Any) -> Any:
    """Take a list for a tuple also behind the preset, which has seen the section and left JSON behind."""
    return tuple(value) if isinstance(value, list) else value


def _exclusive(chances: tuple[float, float]) -> tuple[float, float]:
    """Ask for probabilities of which one at most comes true."""
    if sum(chances) > 1.0:
        raise ValueError(f"must be probabilities of sum 1 at most, got {list(chances)}")
    return chances


_LISTS = BeforeValidator(_listed)
Shares: TypeAlias = Annotated[tuple[Share, Share], _LISTS, AfterValidator(_exclusive)]
Corner: TypeAlias = Annotated[
    tuple[Annotated[float, Field(ge=-1e6, le=1e6)], Annotated[float, Field(ge=-1e6, le=1e6)]], _LISTS
]
Polygon: TypeAlias = Annotated[tuple[Corner, ...], _LISTS]


def kind_or(kind: str) -> Callable[[Any], Any]:
    """Return what puts a kind into a section that does not name one."""

    def filled_in(data: Any) -> Any:
        return {"kind": kind, **data} if isinstance(data, Mapping) else data

    return filled_in


class Section(BaseModel, extra="forbid", frozen=True, allow_inf_nan=False):
    """A part of the parameters."""


class Noise(Section):
    """Errors of Eq. 2 that are added to true measurements, and that the tracker reckons with."""

    position_sd_m: float = Field(
        0.2, ge=0, le=1e3, description="σ_pos: of a camera's position, each axis; the paper's 1 unit [m]"
    )
    angle_sd_rad: float = Field(
        0.01, ge=0, le=0.5, description="σ_θ: of the direction in which a camera looks [rad]"
    )
    read_sd_px: float = Field(2.0, gt=0, le=100, description="σ_read: of the place in the scan line [px]")


class MeasurementFrontEnd(Section):
    """Measurements by Eqs. 1 and 2, from the truth, without pixels."""

    kind: Literal["measurement"] = Field(
        "measurement", description="measurement: Eqs. 1 and 2 from the truth, no image is made"
    )
    pose_error: Literal["white", "bias"] = Field(
        "white",
        description="white: errors of the pose are drawn for every frame, as published; bias: once for the "
        "run, as they are in reality",
    )


class NoPriors(Section):
    """Nothing is known of the occluders."""

    kind: Literal["none"] = Field("none", description="none: any camera may be blind at any time, no bytes")


class PerfectPriors(Section):
    """Each occluder's place is measured exactly."""

    kind: Literal["perfect"] = Field(
        "perfect",
        description="perfect: the mote nearest to each occluder measures its place without an error and "
        "sends it, 6 bytes each and frame; an upper bound, nobody can build it",
    )


class KalmanPriors(Section):
    """A Kalman filter an occluder, on virtual measurements of its place."""

    kind: Literal["kalman"] = Field(
        description="kalman: the mote nearest to each occluder measures its place and sends it, 6 bytes each "
        "and frame; the head runs a Kalman filter an occluder"
    )
    sensor_sd_m: Metres = Field(
        1.6, description="σ_v: of a measured place, each axis; the paper's 8 units [m]"
    )
    acceleration_sd_mps2: Annotated[float, Field(gt=0, le=1e4)] | None = Field(
        None,
        description="of the filter's model, each axis; null: what fits the crowd's motion, .22 of its speed "
        "a frame period [m/s²]",
    )


class StationaryPriors(Section):
    """Each occluder is somewhere in the room."""

    kind: Literal["stationary"] = Field(
        description="stationary: each occluder is somewhere in the room, normal about its middle, no bytes"
    )
    sd_m: Metres | None = Field(
        None, description="of an occluder's place, each axis; null: 21.3 hundredths of the room's sides [m]"
    )


class HullPriors(Section):
    """The visual hull of whole scan lines."""

    kind: Literal["hull"] = Field(
        description="hull: cameras send whole scan lines, 4 bytes more a blob; the pieces that they leave of "
        "the floor are the priors"
    )
    shape: Literal["ellipses", "polygons"] = Field(
        "ellipses", description="ellipses: normal with a piece's moments; polygons: uniform over the piece"
    )
    margin_px: float = Field(
        7.0,
        ge=0,
        le=1000,
        description="by which blobs are widened on either side, for the poses' errors [px]",
    )
    phantoms: Literal["remove", "keep"] = Field(
        "remove", description="remove: pieces that no blob needs are left out"
    )
    own_blob: Literal["remove", "keep"] = Field(
        "remove", description="remove: the piece that the object itself makes is left out"
    )


class ScanLinePriors(Section):
    """Whole scan lines, without a prior."""

    kind: Literal["scan_lines"] = Field(
        description="scan_lines: cameras send whole scan lines, 4 bytes more a blob; a blind camera must "
        "show a blob where the object would be"
    )
    width_test: bool = Field(True, description="narrower blobs than an occluder's there do not count")
    missed: Share = Field(1e-3, description="probability of a blind camera without such a blob [-]")


Priors: TypeAlias = Annotated[
    NoPriors | PerfectPriors | KalmanPriors | StationaryPriors | HullPriors | ScanLinePriors,
    Field(discriminator="kind"),
]


class BaseHead(Section):
    """The base station is the cluster head."""

    kind: Literal["base"] = Field("base", description="base: the base station")


class NodeHead(Section):
    """A mote is the cluster head."""

    kind: Literal["node"] = Field(description="node: a mote by its name")
    id: str = Field(min_length=1, max_length=64, description="a camera's or a relay's name")


class ElectedHead(Section):
    """The mote with most energy left is the cluster head, until the next election."""

    kind: Literal["elected"] = Field(
        description="elected: the mote with most energy left; motes tell the base station, which announces it"
    )
    period_s: float = Field(
        60.0,
        ge=1,
        le=1e6,
        description="from one election to the next; until the first, at 0 s, is decided the base tracks [s]",
    )
    margin: Share = Field(
        0.02, description="share by which a mote must have more than the head to take its place [-]"
    )


Head: TypeAlias = Annotated[BaseHead | NodeHead | ElectedHead, Field(discriminator="kind")]


class ParticleTracker(Section):
    """The auxiliary particle filter of Fig. 4, and its relatives."""

    kind: Literal["auxiliary", "printed", "plain"] = Field(
        "auxiliary",
        description="auxiliary: Fig. 4 with floors; printed: without; plain: sampling-importance-resampling",
    )
    particles: int = Field(1000, ge=10, le=100_000, description="L")
    visibility_floor: Annotated[float, Field(ge=0, lt=1)] = Field(1e-3, description="least p(η) [-]")
    first_stage_floor: Annotated[float, Field(ge=0, lt=1)] = Field(
        0.02, description="least first-stage likelihood, as a share of its mean [-]"
    )
    joint: Literal["subsets", "covering", "printed"] = Field(
        "subsets",
        description="how Eq. 6 is evaluated: subset sums; the covering recursion, without a subtraction; or "
        "as printed, without the rescaling of Eq. 5",
    )
    visibility_exponent: Annotated[float, Field(gt=0, le=1)] = Field(
        0.25,
        description="of p(η) of priors that spread the occluders; 1 as published takes the occlusions of "
        "successive frames as independent, but they last some frames: one over these keeps the tracker from "
        "being too sure [-]",
    )
    lost_sd: Annotated[float, Field(gt=0, le=1e3)] = Field(
        6.0, description="standard deviations by which all particles misfit when all are drawn anew [-]"
    )


class KalmanTracker(Section):
    """What Sec. 4 finds wanting."""

    kind: Literal["extended", "unscented", "map"] = Field(
        description="extended or unscented Kalman filter, or maximum a posteriori with a Kalman filter; none "
        "of them makes use of priors"
    )
    acceleration_sd_mps2: Annotated[float, Field(gt=0, le=1e4)] | None = Field(
        None, description="of the filter's model, each axis; null: half of its speed a frame period [m/s²]"
    )


Tracker: TypeAlias = Annotated[
    ParticleTracker | KalmanTracker, Field(discriminator="kind"), BeforeValidator(kind_or("auxiliary"))
]


class Walk(Section):
    """How the tracker believes the object and the occluders to move (Sec. 4.1)."""

    speed_mps: Annotated[float, Field(gt=0, le=1e3)] = Field(
        1.5, description="of a particle that was just placed [m/s]"
    )
    noise_sd_m: Metres = Field(
        0.08,
        description="σ_ν: added to each step, each axis; more than the walkers' own, for they go round each "
        "other too [m]",
    )
    memory: Share = Field(
        0.3,
        description="φ: weight of the length just walked in the new speed; .7 as published hardly smooths, "
        "and the speed drifts upward [-]",
    )
    reached: Shares = Field(
        (0.05, 0.9),
        description="β₁, λ₁: of going on toward the target, and of a new one, where it is reached; else wait",
    )
    under_way: Shares = Field((0.9, 0.05), description="β₂, λ₂: the same elsewhere")


class VirtualOccluders(Section):
    """Occluders that are in no image: measurements that they would have hidden are thrown away (Sec. 6)."""

    count: int = Field(20, ge=0, le=1000, description="M, how many walk about")
    diameter_m: Metres = Field(0.3048, description="D of each; the paper's 12 inches [m]")
    speed_mps: Annotated[float, Field(gt=0, le=1e3)] = Field(0.5, description="at which they walk [m/s]")
    noise_sd_m: float = Field(0.02, ge=0, le=1e3, description="added to each of their steps, each axis [m]")
    blocks_m: Annotated[tuple[Polygon, ...], _LISTS] = Field(
        (), max_length=100, description="convex polygons on the floor that stand in the way, corners x, y [m]"
    )
