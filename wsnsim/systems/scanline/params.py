"""Parameters of the scan-line system, as they stand under `system:` in a scenario."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self, TypeAlias

from pydantic import BeforeValidator, Field, model_validator

from wsnsim.systems.base import Site, SystemParams
from wsnsim.systems.scanline.choices import (
    BaseHead,
    Head,
    MeasurementFrontEnd,
    Noise,
    NoPriors,
    ParticleTracker,
    Priors,
    Tracker,
    VirtualOccluders,
    Walk,
    kind_or,
)
from wsnsim.systems.scanline.rules import PixelFrontEnd
from wsnsim.types import Seconds

PUBLISHED: Mapping[str, Any] = {
    "tracker": {"kind": "printed", "joint": "printed", "visibility_exponent": 1.0},
    "walk": {"memory": 0.7, "noise_sd_m": 0.066},
}
"""What `preset: published` puts in where a key is not given: the printed forms."""
FrontEndRules: TypeAlias = Annotated[
    MeasurementFrontEnd | PixelFrontEnd, Field(discriminator="kind"), BeforeValidator(kind_or("measurement"))
]

_TRACK_PERIODS = 2.0
"""How long after a frame's deadline the base station waits for the track of a head that is a mote, in frame
periods: one for the head's work, one for the way."""
_WHOLE_LINES = ("hull", "scan_lines")
"""Priors that need whole scan lines."""


class ScanlineParams(SystemParams):
    """Parameters of one object's tracker among occluders, by scan lines."""

    kind: Literal["scanline"]
    preset: Literal["default", "published"] = Field(
        "default",
        description="published: the printed forms where a key is not given, the walk's noise of .33 units "
        "for units of .2 m; default: the mended ones",
    )
    unit_m: Annotated[float, Field(gt=0, le=1e6)] = Field(
        1.0, description="length that counts as one unit where figures stand beside the paper's [m]"
    )
    front_end: FrontEndRules = Field(
        MeasurementFrontEnd(), description="how a camera comes to its measurement"
    )
    noise: Noise = Field(Noise(), description="errors of the measurements")
    detected: Annotated[float, Field(gt=0, le=1)] = Field(
        1.0,
        description="probability that a camera recognises the object where it could see it (Sec. 4.3) [-]",
    )
    message: Literal["bearing", "scan_line", "jpeg"] | None = Field(
        None,
        description="what a camera sends: bearing, 4 bytes; scan_line: 1 byte more, and 4 a blob; jpeg: the "
        "image, from which the head takes the rest; null: what the priors need",
    )
    jpeg_quality: int = Field(75, ge=1, le=95, description="of jpeg messages, as libjpeg counts [-]")
    jpeg_part_bytes: int = Field(
        1000, ge=64, le=60_000, description="of an image's file in one message at most [bytes]"
    )
    priors: Priors = Field(NoPriors(), description="what is known of the moving occluders, and from where")
    head: Head = Field(BaseHead(), description="cluster head: the node that tracks")
    tracker: Tracker = Field(ParticleTracker(), description="the filter")
    walk: Walk = Field(Walk(), description="how the object is believed to move")
    start: Literal["unknown", "given"] = Field(
        "unknown", description="unknown: the object may be anywhere; given: where the scenario puts it"
    )
    virtual_occluders: VirtualOccluders | None = Field(
        None, description="occluders that only delete measurements (Sec. 6); null: none"
    )
    deadline_s: float | None = Field(
        None,
        ge=1e-3,
        le=3600,
        description="how long after a frame the head waits for reports; later ones count as not reported; "
        "null: .9 frame periods; 1.2 where the head is a mote, to which reports go up the tree and down [s]",
    )

    @model_validator(mode="before")
    @classmethod
    def _fill_in_preset(cls, data: Any) -> Any:
        if not isinstance(data, Mapping) or data.get("preset") != "published":
            return data
        given = {key: _filled_in(PUBLISHED[key], value) for key, value in data.items() if key in PUBLISHED}
        return {**PUBLISHED, **data, **given}

    @model_validator(mode="after")
    def _priors_have_their_messages(self) -> Self:
        if self.priors.kind in _WHOLE_LINES and self.message == "bearing":
            raise ValueError(
                f"message must be scan_line, jpeg or null where priors are {self.priors.kind}, got bearing"
            )
        return self

    @model_validator(mode="after")
    def _images_are_looked_at(self) -> Self:
        if self.message == "jpeg" and self.front_end.kind != "pixels":
            raise ValueError(
                f"front_end must be of kind pixels where message is jpeg, got {self.front_end.kind}"
            )
        if self.message == "jpeg" and self.virtual_occluders is not None:
            raise ValueError("virtual_occluders must be null where message is jpeg: they are in no image")
        if self.says_lines and self.looks_at_pixels and self.virtual_occluders is not None:
            raise ValueError(
                "virtual_occluders must be null where whole scan lines come of pixels: they are in no image"
            )
        return self

    def told(self, site: Site) -> tuple[str, ...]:
        """Return preset, message, probability of detection, cameras and occluders, each in a few words."""
        message = "scan line" if self.says_lines else self.message or "bearing"
        virtual = self.virtual_occluders
        number, width_m, kind = site.floor.people, 2.0 * site.floor.person_radius_m, ""
        if virtual is not None:
            number, width_m, kind = virtual.count, virtual.diameter_m, "virtual "
        occluders = f"{number or 'no'} {kind}occluder{'' if number == 1 else 's'}"
        if number:
            occluders += f" {width_m:.3g} m wide"
        blocks = 0 if virtual is None else len(virtual.blocks_m)
        return (
            *(() if self.preset == "default" else (f"preset “{self.preset}”",)),
            f"message “{message}”",
            f"probability of detection {self.detected:g}",
            f"{len(site.cameras)} camera{'' if len(site.cameras) == 1 else 's'}",
            occluders,
            *(() if not blocks else (f"{blocks} virtual block{'' if blocks == 1 else 's'}",)),
        )

    @property
    def says_lines(self) -> bool:
        """Whether cameras send whole scan lines."""
        return self.message == "scan_line" or (self.message is None and self.priors.kind in _WHOLE_LINES)

    @property
    def measures_occluders(self) -> bool:
        """Whether motes measure the occluders' places."""
        return self.priors.kind in ("perfect", "kalman")

    @property
    def looks_at_pixels(self) -> bool:
        """Whether anybody looks at an image."""
        return isinstance(self.front_end, PixelFrontEnd)

    def deadline(self, rate_hz: float) -> Seconds:
        """Return how long after a frame the head waits [s], from the frame rate [Hz]."""
        if self.deadline_s is not None:
            return self.deadline_s
        return (0.9 if self.head.kind == "base" else 1.2) / rate_hz

    def settle_s(self, rate_hz: float) -> Seconds:
        """Return how long after a frame the base station waits for its estimate [s]."""
        way_s = 0.0 if self.head.kind == "base" else _TRACK_PERIODS / rate_hz
        return self.deadline(rate_hz) + way_s


def _filled_in(printed: Mapping[str, Any], given: Any) -> Any:
    """Return a section as given, the printed form in place of what it leaves out, unless of another kind."""
    if not isinstance(given, Mapping):
        return given
    return {**printed, **given} if given.get("kind", printed.get("kind")) == printed.get("kind") else given
