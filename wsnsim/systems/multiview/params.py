"""Parameters of the multi-view trackers, as they stand under `system:` in a scenario."""

from typing import Literal

from pydantic import BaseModel, Field

from wsnsim.systems.base import SystemParams
from wsnsim.types import Seconds


class Likelihood(BaseModel, extra="forbid", frozen=True, allow_inf_nan=False):
    """How a histogram similarity becomes a particle's weight."""

    kind: Literal["bhattacharyya"] = Field("bhattacharyya", description="w = exp(sharpness (ρ − ρ_max))")
    sharpness: float = Field(
        25.0,
        gt=0,
        le=1000,
        description="λ; a raw coefficient (about .5 to .9) has too little contrast to be a weight",
    )


class InitialError(BaseModel, extra="forbid", frozen=True, allow_inf_nan=False):
    """Error of the manual initialisation, drawn once a run."""

    position_sd_m: float = Field(0.0, ge=0, le=1e3, description="standard deviation on each axis [m]")
    velocity_sd_mps: float = Field(0.0, ge=0, le=1e3, description="standard deviation on each axis [m/s]")


class MultiviewParams(SystemParams):
    """Parameters of trackers that compare multi-view histograms with images."""

    kind: Literal["multiview"]
    variant: Literal["T0"] = Field("T0", description="T0: particle weights go to the base station")
    particles: int = Field(
        1000, ge=10, le=100_000, description="M, drawn alike at every node; fewer have no covariance in space"
    )
    particle_sd_m: float = Field(
        0.22,
        gt=0,
        description="standard deviation of the particles about the prediction, each axis [m]",
    )
    colour_space: Literal["hsv", "hs"] = Field(
        "hsv", description="hsv: 110 bins of hue-saturation and value; hs: 100 bins of hue-saturation"
    )
    colour_share: float = Field(0.7, ge=0, le=1, description="α_HS: share of colour against texture")
    likelihood: Likelihood = Likelihood()
    encoding: Literal["float64", "uint8"] = Field(
        "float64", description="how weights travel; uint8: relative to the largest, in 1/255ths"
    )
    participation_min: float = Field(
        0.1,
        gt=0,
        le=1,
        description="share of the particles that a camera must have in view to take part",
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

    def deadline(self, rate_hz: float) -> Seconds:
        """Return how long after a frame its weights are of use [s].

        The default is longer than a period: over a network too slow for every
        frame the tracker then uses every second one, instead of none.
        """
        return 1.8 / rate_hz if self.deadline_s is None else self.deadline_s
