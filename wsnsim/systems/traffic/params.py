"""Parameters of the traffic tool, as they stand under `system:` in a scenario."""

from typing import Literal

from pydantic import Field

from wsnsim.messages.packet import LARGEST_BYTES, SMALLEST_BYTES
from wsnsim.systems.base import SystemParams


class TrafficParams(SystemParams):
    """Who sends how much how often to the base station."""

    kind: Literal["traffic"]
    payload_bytes: int = Field(
        100,
        ge=SMALLEST_BYTES,
        le=LARGEST_BYTES,
        description=f"length of a packet above the network, {SMALLEST_BYTES} for origin, number and time; "
        "what does not fit a frame is fragmented [bytes]",
    )
    period_s: float = Field(1.0, ge=1e-6, le=1e7, description="mean time from one packet to the next [s]")
    jitter: Literal["uniform", "none", "poisson"] = Field(
        "uniform",
        description="uniform: packet k leaves at a random time of the k-th period; none: at its beginning, "
        "all sources at once; poisson: after exponential gaps",
    )
    saturated: bool = Field(
        False,
        description="true: each source has its next packet ready when its link layer is done with the last; "
        "period_s and jitter then say when it begins",
    )
    start_s: float = Field(0.0, ge=0, le=1e7, description="when the sources begin [s]")
    drain_s: float = Field(
        5.0,
        ge=0,
        le=1e6,
        description="how long the run goes on after the last period, for what is queued [s]",
    )
    sources: Literal["all"] | tuple[str, ...] = Field(
        "all", description="who sends: all, every mote; or the names of some"
    )
    to: Literal["base"] = Field("base", description="base: all packets are for the base station")
