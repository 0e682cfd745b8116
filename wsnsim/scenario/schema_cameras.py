"""Schema of `cameras:`: where they stand and look, their lens, their sensor, and what is behind the scene."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self, TypeAlias

from pydantic import Discriminator, Field, Tag, model_validator

from wsnsim.scenario.schema_base import InputFile, Name, Part, PhotoOrFile, Position, Seed, wrong

Degrees: TypeAlias = Annotated[float, Field(ge=-360, le=360)]
Coefficient: TypeAlias = Annotated[float, Field(ge=-100, le=100)]
RadiusPx: TypeAlias = Annotated[float, Field(ge=1, le=1000)]

_FOCAL_PX = 300.0
"""With 320 px it makes a field of view of 56 degrees."""
_ANGLES = ("yaw_deg", "pitch_deg", "roll_deg")


class Clutter(Part):
    """Things in the background that look like targets and are none."""

    decoys: int = Field(10, ge=0, le=1000, description="number of decoys: ellipsoids in the targets' colours")
    radius_px: tuple[RadiusPx, RadiusPx] = Field(
        (7.0, 24.0), description="smallest and largest long semi-axis of a decoy in the image [px]"
    )
    seed: Seed | None = Field(None, description="seed of the decoys; null: the run's own seed")

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        low, high = self.radius_px
        if low > high:
            raise wrong(f"radius_px must be the smallest and then the largest, got {low:g} and {high:g}")
        return self


class PictureBackground(Part):
    """A picture that never changes, with or without clutter on it."""

    kind: Literal["picture"] = Field(description="picture: a photograph, and clutter on it")
    source: PhotoOrFile = Field("photo/coffee", description="photo/NAME of the package, or an image file")
    clutter: Clutter | None = Field(None, description="decoys painted on it; null: none")


class VideoBackground(Part):
    """A film that runs in simulated time."""

    kind: Literal["video"] = Field(description="video: the frame nearest in time (needs wsnsim[vision])")
    file: InputFile = Field(description="the film, found from the scenario's folder")
    start_s: float = Field(0.0, ge=0, le=1e9, description="time of the film at which the run begins [s]")
    loop: bool = Field(False, description="begin again after the last frame")


def _background_form(value: Any) -> str | None:
    """Tell text from the two kinds of mapping, in data and in what was made of it."""
    if isinstance(value, str):
        return "text"
    kind = value.get("kind") if isinstance(value, Mapping) else getattr(value, "kind", None)
    return kind if kind in ("picture", "video") else None


Background: TypeAlias = Annotated[
    Annotated[PhotoOrFile, Tag("text")]
    | Annotated[PictureBackground, Tag("picture")]
    | Annotated[VideoBackground, Tag("video")],
    Discriminator(
        _background_form,
        custom_error_type="background",
        custom_error_message='must be photo/NAME, an image file, or a mapping of kind "picture" or "video"',
    ),
]


class SinusoidalDrift(Part):
    """Light that swells and fades."""

    kind: Literal["sinusoid"] = Field(description="sinusoid: 1 + amplitude · sin(2π t / period_s + phase)")
    amplitude: float = Field(0.2, ge=0, lt=1, description="share by which brightness rises and falls [-]")
    period_s: float = Field(60.0, gt=0, le=1e9, description="from one rise to the next [s]")
    phase_deg: Degrees | None = Field(
        None, description="at time 0; null: drawn for each camera by the run's seed [deg]"
    )


class RandomDrift(Part):
    """Light that wanders about."""

    kind: Literal["ornstein_uhlenbeck"] = Field(
        description="ornstein_uhlenbeck: exp of a stationary Gaussian process of exponential correlation"
    )
    sd: float = Field(0.1, ge=0, le=2, description="standard deviation of brightness's logarithm [-]")
    correlation_s: float = Field(
        30.0, gt=0, le=1e9, description="time in which the correlation falls to 1/e [s]"
    )


Drift: TypeAlias = Annotated[SinusoidalDrift | RandomDrift, Field(discriminator="kind")]


class Camera(Part):
    """A camera that never moves.

    It looks at a point with the horizon level, or along yaw and pitch with a roll.
    """

    id: Name = Field(description="name of the camera and of the mote that carries it")
    position_m: Position = Field(description="centre of projection [m]")
    look_at_m: Position | None = Field(
        None, description="point in the middle of the image [m]; or else yaw, pitch and roll"
    )
    yaw_deg: Degrees | None = Field(
        None, description="direction of view, anticlockwise from x as seen from above [deg]"
    )
    pitch_deg: Annotated[float, Field(ge=-90, le=90)] | None = Field(
        None, description="direction of view above the horizontal [deg]; 0 where another angle is given"
    )
    roll_deg: Degrees | None = Field(
        None,
        description="turn of the camera about its line of sight, clockwise as seen from behind it [deg]; "
        "0 where another angle is given",
    )
    resolution_px: tuple[
        Annotated[int, Field(ge=8, le=4096)],
        Annotated[int, Field(ge=8, le=4096)],
    ] = Field((320, 240), description="width and height of the image [px]")
    focal_px: Annotated[float, Field(ge=1, le=1e6)] | None = Field(
        None, description="focal length [px]; 300 where fov_deg is not given either"
    )
    fov_deg: Annotated[float, Field(ge=0.01, le=175)] | None = Field(
        None, description="horizontal field of view without the lens's distortion [deg]"
    )
    distortion: tuple[Coefficient, Coefficient] = Field(
        (0.0, 0.0), description="k1 and k2 of the lens's radial distortion, as in OpenCV [-]"
    )
    rate_hz: float = Field(4.0, gt=0, le=1000, description="images a second, the same for all cameras [Hz]")
    background: Background = Field(
        "photo/coffee",
        description="what is behind the scene: photo/NAME of the package, an image file, or a mapping",
    )
    illumination_drift: Drift | None = Field(
        None, description="slow change of the images' brightness; null: none"
    )
    noise_sd: float = Field(
        5.0, ge=0, le=255, description="standard deviation of a pixel's noise [grey levels of 255]"
    )
    gain_jitter: float = Field(0.02, ge=0, le=1, description="standard deviation of an image's gain [-]")

    @model_validator(mode="after")
    def _written_out(self) -> Self:
        """Fill in the defaults that depend on what else is given."""
        filled: dict[str, float] = {}
        if self.focal_px is None and self.fov_deg is None:
            filled["focal_px"] = _FOCAL_PX
        if any(getattr(self, angle) is not None for angle in _ANGLES):
            filled |= {angle: 0.0 for angle in _ANGLES if getattr(self, angle) is None}
        for key, value in filled.items():
            # still under construction: frozen for everybody else
            object.__setattr__(self, key, value)
        return self

    @model_validator(mode="after")
    def _looks_somewhere(self) -> Self:
        turned = [
            angle for angle in _ANGLES if angle in self.model_fields_set and getattr(self, angle) is not None
        ]
        if self.look_at_m is None and not turned:
            raise wrong("must look somewhere: give look_at_m, or yaw_deg, pitch_deg and roll_deg")
        if self.look_at_m is not None and turned:
            raise wrong(
                f"must look one way: look_at_m or angles, got both look_at_m and {' and '.join(turned)}; "
                "leave one out or make it null"
            )
        if self.position_m == self.look_at_m:
            raise wrong("must look at a point other than its own position")
        return self

    @model_validator(mode="after")
    def _sees_with_every_pixel(self) -> Self:
        from wsnsim.scenario.cameras import pinhole

        if self.focal_px is not None and self.fov_deg is not None:
            raise wrong(
                "must have focal_px or fov_deg, got both: "
                f"{self.focal_px:g} px and {self.fov_deg:g}°; leave one out or make it null"
            )
        try:
            pinhole(self)
        except ValueError as error:
            raise wrong(str(error)) from None
        return self
