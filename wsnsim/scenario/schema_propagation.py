"""Schema of `network.propagation:`: what lies between two antennas."""

from typing import Literal

from pydantic import Field

from wsnsim.scenario.schema_base import Part


class LogDistance(Part):
    """Path loss that grows with the logarithm of the distance."""

    kind: Literal["log_distance"] = Field(
        "log_distance", description="log_distance: reference loss + 10 exponent log10(d / reference distance)"
    )
    exponent: float = Field(3.0, gt=0, le=10, description="path-loss exponent; 2 in free space [-]")
    reference_loss_db: float = Field(40.05, ge=0, le=200, description="loss at the reference distance [dB]")
    reference_distance_m: float = Field(1.0, gt=0, le=1e4, description="reference distance [m]")
    shadowing_db: float = Field(
        0.0,
        ge=0,
        le=50,
        description="standard deviation of what a link loses beyond that, by seed; 4 outdoors [dB]",
    )
    asymmetry_db: float = Field(
        0.0,
        ge=0,
        le=50,
        description="standard deviation of the difference between a link's two directions, by seed [dB]",
    )
