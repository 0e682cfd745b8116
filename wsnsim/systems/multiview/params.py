"""Parameters of the multi-view trackers, as they stand under `system:` in a scenario."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self, TypeAlias

from pydantic import BaseModel, Field, model_validator

from wsnsim.messages.numbers import Encoding
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


class LogRatioLikelihood(Section):
    """Pixel by pixel, how much likelier the target is than the background around it."""

    kind: Literal["log_ratio"] = Field(
        "log_ratio", description="log_ratio: log-likelihood ratio of target against local background, summed"
    )
    sharpness: float = Field(
        8.0,
        gt=0,
        le=10_000,
        description="weight of the sum over a whole target, per mean log ratio of 1 [-]",
    )
    clip: float = Field(
        2.0, gt=0, le=20, description="most that one pixel's log ratio counts, either way [-]"
    )


class FixedSpread(Section):
    """The particles always spread alike: the state message stays at 80 bytes."""

    kind: Literal["fixed"] = Field("fixed", description="fixed: particle_sd_m about the prediction, always")


class PredictedSpread(Section):
    """The particles spread as the filter is uncertain: close together where it is sure, wide where not."""

    kind: Literal["predicted"] = Field(
        "predicted",
        description="predicted: floor_sd_m and the filter's own uncertainty, sent with the state",
    )
    floor_sd_m: float = Field(
        0.15, ge=1e-6, le=1e3, description="standard deviation that is always added, each axis [m]"
    )
    largest_sd_m: float = Field(
        1.5, ge=1e-3, le=1e3, description="the filter's uncertainty counts up to this on each axis [m]"
    )


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


class WahbaOrientation(Section):
    """Directions from all cameras, fused by least squares (Wahba's problem)."""

    kind: Literal["wahba"] = Field("wahba", description="wahba: directions of all cameras in least squares")
    sharpness: float = Field(
        15.0, gt=0, le=1000, description="weight of a viewpoint: exp(sharpness (ρ − ρ_max)) [-]"
    )
    prior_sharpness: float = Field(
        4.0,
        ge=0,
        le=1000,
        description="weight of a viewpoint by the predicted orientation: exp(prior_sharpness cos angle) [-]",
    )
    update: float = Field(
        0.5, gt=0, le=1, description="α: how far the orientation goes towards the measured one a step [-]"
    )
    rate_update: float = Field(
        0.15, ge=0, le=1, description="β: how far the rate of turning does; 0: none is estimated [-]"
    )
    outlier_deg: float = Field(
        60.0,
        gt=0,
        le=180,
        description="a camera that is farther from the fused orientation is left out [deg]",
    )


class AverageOrientation(Section):
    """Quaternions of all cameras, averaged, as printed (Eqs. 18-20)."""

    kind: Literal["average"] = Field("average", description="average: mean of the cameras' quaternions")
    update: float = Field(
        0.5, gt=0, le=1, description="α: how far the orientation goes towards the measured one a step [-]"
    )
    outlier_deg: float = Field(
        60.0, gt=0, le=180, description="a quaternion that is farther from the mean is left out [deg]"
    )


class InitialOrientation(Section):
    """The orientation is not estimated."""

    kind: Literal["initial"] = Field("initial", description="initial: stays as at the start")


class TrackLoss(Section):
    """When a track is given up, and whether the target is then looked for."""

    similarity_min: float = Field(
        0.8, ge=0, le=1, description="a step whose cameras all fit worse than this is a bad one [-]"
    )
    after_s: Seconds = Field(
        2.0, gt=0, le=3600, description="a track is lost after bad or unmeasured steps for so long [s]"
    )
    search: bool = Field(True, description="whether the cameras then look for the target in their images")
    sighting_min: float = Field(
        0.9, ge=0, le=1, description="similarity from which on a camera reports what it found [-]"
    )
    cameras_min: int = Field(
        2, ge=2, le=64, description="cameras whose sightings must agree on a place for a track to start [-]"
    )


Likelihood: TypeAlias = Annotated[
    RawLikelihood | SharpenedLikelihood | LogRatioLikelihood, Field(discriminator="kind")
]
Spread: TypeAlias = Annotated[FixedSpread | PredictedSpread, Field(discriminator="kind")]
Orientation: TypeAlias = Annotated[
    WahbaOrientation | AverageOrientation | InitialOrientation, Field(discriminator="kind")
]
Participation: TypeAlias = Annotated[CloudParticipation | PointParticipation, Field(discriminator="kind")]
MeasurementNoise: TypeAlias = Annotated[ParticleNoise | FixedNoise, Field(discriminator="kind")]

PUBLISHED: Mapping[str, Any] = {
    "colour_space": "hs",
    "likelihood": {"kind": "raw"},
    "participation": {"kind": "point"},
    "measurement_noise": {"kind": "fixed"},
    "spread": {"kind": "fixed"},
    "orientation": {"kind": "average"},
    "loss": None,
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
        description="standard deviation of particles of fixed spread about the prediction, each axis [m]",
    )
    colour_space: Literal["hsv", "hs"] = Field(
        "hsv", description="hsv: 110 bins of hue-saturation and value; hs: 100 bins of hue-saturation"
    )
    colour_share: float = Field(0.7, ge=0, le=1, description="α_HS: share of colour against texture")
    likelihood: Likelihood = Field(SharpenedLikelihood(), description="how a similarity becomes a weight")
    estimator: Literal["mmse", "mle", "map"] = Field(
        "mmse", description="mmse: mean of the particles (Eq. 24); mle, map: the best of them (Eqs. 25, 26)"
    )
    encoding: Encoding = Field(
        "float64", description="how the numbers in messages travel; uint8: weights in 1/255ths of the largest"
    )
    spread: Spread = Field(PredictedSpread(), description="how far the particles spread")
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
    usable_px_min: float = Field(
        30.0, ge=0, le=1e6, description="a camera in which the target would be smaller takes no part [px]"
    )
    orientation: Orientation = Field(
        WahbaOrientation(), description="how the target's orientation is estimated"
    )
    smoothing_scans: int = Field(
        5, ge=0, le=1000, description="steps that the smoothed history lags behind; 0: no smoothing [-]"
    )
    start: Literal["given", "automatic"] = Field(
        "given", description="given: where the scenario puts the target; automatic: where cameras find it"
    )
    loss: TrackLoss | None = Field(TrackLoss(), description="when a track is given up; null: never")
    initial_error: InitialError = InitialError()

    @model_validator(mode="before")
    @classmethod
    def _fill_in_preset(cls, data: Any) -> Any:
        if isinstance(data, Mapping) and data.get("preset") == "published":
            return {**PUBLISHED, **data}
        return data

    @model_validator(mode="after")
    def _search_for_a_start(self) -> Self:
        if self.start == "automatic" and (self.loss is None or not self.loss.search):
            raise ValueError("start automatic needs loss with search: true, which says how targets are found")
        return self

    @property
    def searching(self) -> TrackLoss:
        """How targets are found; the defaults where nothing is ever lost."""
        return TrackLoss() if self.loss is None else self.loss

    def deadline(self, rate_hz: float) -> Seconds:
        """Return how long after a frame its weights are of use [s].

        The default is longer than a period: over a network too slow for every
        frame the tracker then uses every second one, instead of none.
        """
        return 1.8 / rate_hz if self.deadline_s is None else self.deadline_s
