"""Parameters of the multi-view trackers, as they stand under `system:` in a scenario."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import BaseModel, Field, model_validator

from wsnsim.systems.base import SystemParams
from wsnsim.types import Seconds


class Section(BaseModel, extra="forbid", frozen=True, allow_inf_nan=False):
    """A part of the parameters."""


class RawLikelihood(Section):
    """The similarity itself, as printed: about .5 on background and .9 on the target, little contrast."""

    kind: Literal["raw"] = Field("raw", description="w = ρ, as printed (Algorithm 1, line 7)")


class SharpenedLikelihood(Section):
    """An exponential of the similarity."""

    kind: Literal["bhattacharyya"] = Field("bhattacharyya", description="w = exp(sharpness (ρ − ρ_max))")
    sharpness: float = Field(25.0, gt=0, le=1000, description="λ; the error is flat between 25 and 50 [-]")


class CloudParticipation(Section):
    """Cameras are asked by the whole cloud of particles."""

    kind: Literal["cloud"] = Field("cloud", description="cloud: who has enough of the particles in view")
    share_min: float = Field(0.1, gt=0, le=1, description="share of the particles that must be in view [-]")


class PointParticipation(Section):
    """Cameras are asked by the predicted point: one that could correct a wrong prediction is not."""

    kind: Literal["point"] = Field("point", description="point: who has the predicted position in view")


class ParticleNoise(Section):
    """The filter's measurement covariance is what the particles of the step say, the proposal divided out."""

    kind: Literal["particles"] = Field("particles", description="particles: of each step, from its weights")


class FixedNoise(Section):
    """The filter's measurement covariance is always the same."""

    kind: Literal["fixed"] = Field("fixed", description="fixed: the same at every step")
    sd_m: float = Field(0.1, ge=1e-4, le=1e3, description="standard deviation on each axis [m]")


Likelihood: TypeAlias = Annotated[RawLikelihood | SharpenedLikelihood, Field(discriminator="kind")]
Participation: TypeAlias = Annotated[CloudParticipation | PointParticipation, Field(discriminator="kind")]
MeasurementNoise: TypeAlias = Annotated[ParticleNoise | FixedNoise, Field(discriminator="kind")]

PUBLISHED: Mapping[str, Any] = {
    "colour_space": "hs",
    "likelihood": {"kind": "raw"},
    "participation": {"kind": "point"},
    "measurement_noise": {"kind": "fixed"},
}
"""What `preset: published` puts in where a key is not given: the printed forms."""


class InitialError(Section):
    """Error of the manual initialisation, drawn once a run."""

    position_sd_m: float = Field(0.0, ge=0, le=1e3, description="standard deviation on each axis [m]")
    velocity_sd_mps: float = Field(0.0, ge=0, le=1e3, description="standard deviation on each axis [m/s]")


class MultiviewParams(SystemParams):
    """Parameters of trackers that compare multi-view histograms with images."""

    kind: Literal["multiview"]
    preset: Literal["default", "published"] = Field(
        "default",
        description="published: the printed forms where a key is not given; default: the mended ones",
    )
    variant: Literal["T0"] = Field("T0", description="T0: particle weights go to the base station")
    particles: int = Field(
        1000, ge=10, le=100_000, description="M, drawn alike at every node; fewer have no covariance in space"
    )
    particle_sd_m: float = Field(
        0.22,
        ge=1e-6,
        le=1e3,
        description="standard deviation of the particles about the prediction, each axis [m]",
    )
    colour_space: Literal["hsv", "hs"] = Field(
        "hsv", description="hsv: 110 bins of hue-saturation and value; hs: 100 bins of hue-saturation"
    )
    colour_share: float = Field(0.7, ge=0, le=1, description="α_HS: share of colour against texture")
    likelihood: Likelihood = Field(SharpenedLikelihood(), description="how a similarity becomes a weight")
    estimator: Literal["mmse", "mle", "map"] = Field(
        "mmse", description="mmse: mean of the particles (Eq. 24); mle, map: the best of them (Eqs. 25, 26)"
    )
    encoding: Literal["float64", "uint8"] = Field(
        "float64", description="how weights travel; uint8: relative to the largest, in 1/255ths"
    )
    participation: Participation = Field(CloudParticipation(), description="which cameras are asked")
    measurement_noise: MeasurementNoise = Field(
        ParticleNoise(), description="how far the Kalman filter trusts a step's position"
    )
    acceleration_sd_mps2: float = Field(
        2.0, ge=1e-6, le=1e4, description="process noise of the constant-velocity Kalman filter [m/s²]"
    )
    deadline_s: float | None = Field(
        None,
        ge=1e-3,
        le=3600,
        description="how long after a frame the base station waits for weights [s]; null: 1.8 frame periods",
    )
    initial_error: InitialError = InitialError()

    @model_validator(mode="before")
    @classmethod
    def _fill_in_preset(cls, data: Any) -> Any:
        if isinstance(data, Mapping) and data.get("preset") == "published":
            return {**PUBLISHED, **data}
        return data

    def deadline(self, rate_hz: float) -> Seconds:
        """Return how long after a frame its weights are of use [s].

        The default is longer than a period: over a network too slow for every
        frame the tracker then uses every second one, instead of none.
        """
        return 1.8 / rate_hz if self.deadline_s is None else self.deadline_s
