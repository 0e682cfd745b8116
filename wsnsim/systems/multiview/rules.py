"""What the trackers let a scenario choose: one small section a choice, each with its printed form by name."""

from typing import Annotated, Literal, TypeAlias

from pydantic import BaseModel, Field

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


class MixtureRules(Section):
    """How densities become Gaussian mixtures, and what is done with those (T1 to T4)."""

    components: int = Field(4, ge=1, le=16, description="K: most components of a mixture in a message [-]")
    message_bytes: int | None = Field(
        None,
        ge=1,
        le=100_000,
        description="largest message with a mixture [bytes]: fewer components where K do not fit; null: any",
    )
    order: Literal["tolerance", "argmin"] = Field(
        "tolerance",
        description="tolerance: fewest components with a KL divergence of at most 0.02 more than the best "
        "order's; argmin: the best order, as printed (Eq. 28), which is nearly always K",
    )
    smoothing: float = Field(
        0.25,
        gt=0,
        le=1,
        description="share of the kernels' variance that stays in a mixture; 1, as printed, widens it [-]",
    )
    reduction: Literal["runnalls", "kmeans", "kmeans_best"] = Field(
        "runnalls",
        description="runnalls: greedy merging, then a KL refinement; kmeans: the printed k-means from one "
        "random start (Eqs. 32-35); kmeans_best: the best of ten starts",
    )
    prior: Literal["once", "every_camera"] = Field(
        "once",
        description="once: the prediction that every camera's density contains is divided out of products; "
        "every_camera: stays in, once a camera, as printed (Eq. 30)",
    )


class ProjectedImageSpread(Section):
    """Particles in an image spread as those in space do, seen by the camera."""

    kind: Literal["projected"] = Field(
        "projected", description="projected: the predicted spread in the image"
    )


class FixedImageSpread(Section):
    """Particles in an image always spread alike, near target or far."""

    kind: Literal["fixed"] = Field("fixed", description="fixed: sd_px about the prediction, always")
    sd_px: float = Field(25.0, gt=0, le=1e4, description="standard deviation on each axis [px]")


class ImageTracker(Section):
    """The filter that tracker P runs in each image, knowing nothing of space."""

    histogram: Literal["model", "image"] = Field(
        "model",
        description="model: what the reference model shows from the side seen at the start; image: what the "
        "camera's image shows where the filter starts",
    )
    sd_px: float = Field(12.0, gt=0, le=1e4, description="spread of particles about the prediction [px]")
    scale_sd: float = Field(0.05, ge=0, le=2, description="spread of the logarithm of their size [-]")
    similarity_min: float = Field(
        0.6, ge=0, le=1, description="a filter whose best particle is worse starts anew [-]"
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
ImageSpread: TypeAlias = Annotated[ProjectedImageSpread | FixedImageSpread, Field(discriminator="kind")]


class InitialError(Section):
    """Error of the manual initialisation, drawn once a run."""

    position_sd_m: float = Field(0.0, ge=0, le=1e3, description="standard deviation on each axis [m]")
    velocity_sd_mps: float = Field(0.0, ge=0, le=1e3, description="standard deviation on each axis [m/s]")
