"""Parameters of the multi-view trackers, as they stand under `system:` in a scenario."""

from collections.abc import Mapping
from typing import Any, Literal, Self

from pydantic import Field, model_validator

from wsnsim.messages.numbers import Encoding
from wsnsim.systems.base import SystemParams
from wsnsim.systems.multiview.rules import (
    CloudParticipation,
    ImageSpread,
    ImageTracker,
    InitialError,
    Likelihood,
    MeasurementNoise,
    MixtureRules,
    Orientation,
    Participation,
    ParticleNoise,
    PredictedSpread,
    ProjectedImageSpread,
    SharpenedLikelihood,
    Spread,
    TrackLoss,
    WahbaOrientation,
)
from wsnsim.types import Seconds

IN_IMAGE = ("P", "T3", "T4")
"""Trackers whose cameras need the predicted outline in their image."""

PUBLISHED: Mapping[str, Any] = {
    "colour_space": "hs",
    "likelihood": {"kind": "raw"},
    "participation": {"kind": "point"},
    "measurement_noise": {"kind": "fixed"},
    "spread": {"kind": "fixed"},
    "orientation": {"kind": "average"},
    "mixtures": {"order": "argmin", "smoothing": 1.0, "reduction": "kmeans", "prior": "every_camera"},
    "image_spread": {"kind": "fixed"},
    "image_tracker": {"histogram": "image"},
    "map_solver": "printed",
    "loss": None,
}
"""What `preset: published` puts in where a key is not given: the printed forms."""


def _filled_in(printed: Any, given: Any) -> Any:
    """Return a section as given, the printed form in place of what it leaves out, unless of another kind."""
    if not isinstance(printed, Mapping) or not isinstance(given, Mapping):
        return given
    return {**printed, **given} if given.get("kind", printed.get("kind")) == printed.get("kind") else given


class MultiviewParams(SystemParams):
    """Parameters of trackers that compare multi-view histograms with images."""

    kind: Literal["multiview"]
    preset: Literal["default", "published"] = Field(
        "default",
        description="published: the printed forms where a key is not given; default: the mended ones",
    )
    variant: Literal["P", "T0", "T1", "T2", "T3", "T4"] = Field(
        "T0",
        description="what cameras send. P: rays of independent trackers in the images; T0: particle weights; "
        "T1: mixtures in space; T2: the same, fused on their way; T3: as T2, from particles in the images; "
        "T4: mixtures in the images",
    )
    particles: int = Field(
        1000, ge=10, le=100_000, description="M, drawn alike at every node; fewer than 10 have no covariance"
    )
    particle_sd_m: float = Field(
        0.22,
        ge=1e-6,
        le=1e3,
        description="standard deviation of particles of fixed spread about the prediction, each axis [m]",
    )
    image_particles: int = Field(
        500, ge=10, le=100_000, description="particles in an image, of each camera on its own (P, T3, T4)"
    )
    colour_space: Literal["hsv", "hs"] = Field(
        "hsv", description="hsv: 110 bins of hue-saturation and value; hs: 100 bins of hue-saturation"
    )
    colour_share: float = Field(0.7, ge=0, le=1, description="α_HS: share of colour against texture")
    likelihood: Likelihood = Field(SharpenedLikelihood(), description="how a similarity becomes a weight")
    estimator: Literal["mmse", "mle", "map"] = Field(
        "mmse",
        description="mmse: mean of particles or mixture (Eq. 24); mle, map: the best particle (Eqs. 25, 26), "
        "or, of a mixture, its component likeliest without the prediction, its highest mode with it "
        "(Eq. 29); those of T4 and P are always map",
    )
    encoding: Encoding = Field(
        "float64", description="how the numbers in messages travel; uint8: weights in 1/255ths of the largest"
    )
    spread: Spread = Field(PredictedSpread(), description="how far the particles spread")
    participation: Participation = Field(CloudParticipation(), description="which cameras are asked")
    measurement_noise: MeasurementNoise = Field(
        ParticleNoise(), description="how far the Kalman filter trusts a step's position"
    )
    mixtures: MixtureRules = Field(MixtureRules(), description="mixtures of T1 to T4")
    image_spread: ImageSpread = Field(
        ProjectedImageSpread(), description="how far the particles of T3 and T4 spread in an image"
    )
    image_tracker: ImageTracker = Field(ImageTracker(), description="tracker P's filter in each image")
    map_solver: Literal["gauss_newton", "printed"] = Field(
        "gauss_newton",
        description="how T4 finds the best place: gauss_newton; printed: one step of Eq. 45",
    )
    acceleration_sd_mps2: float = Field(
        2.0, ge=1e-6, le=1e4, description="process noise of the constant-velocity Kalman filter [m/s²]"
    )
    deadline_s: float | None = Field(
        None,
        ge=1e-3,
        le=3600,
        description="how long after a frame the base station waits for messages [s]; null: 1.8 frame "
        "periods for T0, 0.9 for the others",
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
        if not isinstance(data, Mapping) or data.get("preset") != "published":
            return data
        # T1 to T3 take the highest mode of their mixture (Eq. 29)
        mode = {"estimator": "map"} if data.get("variant") in ("T1", "T2", "T3") else {}
        given = {key: _filled_in(PUBLISHED[key], value) for key, value in data.items() if key in PUBLISHED}
        return {**PUBLISHED, **mode, **data, **given}

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
        """Return how long after a frame what cameras send of it is of use [s].

        T0's default is longer than a period: over a network too slow for every
        frame it then uses every second one, instead of none. The other trackers'
        messages are short: one that has not come within a period is lost.
        """
        if self.deadline_s is not None:
            return self.deadline_s
        return (1.8 if self.variant == "T0" else 0.9) / rate_hz
