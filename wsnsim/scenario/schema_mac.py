"""Schema of `network.mac:`: who may send when.

Defaults of unslotted CSMA/CA are those of IEEE 802.15.4-2006, table 86, but for
`max_channel_retries`: the bare standard gives a frame up that never found a free
channel. The threshold of carrier sensing is the CC2420's.
"""

from typing import Literal, Self

from pydantic import Field, model_validator

from wsnsim.scenario.schema_base import Part, wrong


class CsmaCa(Part):
    """Unslotted CSMA/CA with acknowledgements."""

    kind: Literal["csma_ca"] = Field("csma_ca", description="csma_ca: unslotted CSMA/CA of IEEE 802.15.4")
    min_be: int = Field(3, ge=0, le=8, description="macMinBE: first backoff exponent [-]")
    max_be: int = Field(5, ge=0, le=8, description="macMaxBE: largest backoff exponent [-]")
    max_csma_backoffs: int = Field(
        4, ge=0, le=20, description="macMaxCSMABackoffs: backoffs before giving up [-]"
    )
    max_frame_retries: int = Field(
        3, ge=0, le=20, description="macMaxFrameRetries: retries without an ACK [-]"
    )
    max_channel_retries: int = Field(
        5,
        ge=0,
        le=100,
        description="how often a frame that never found a free channel starts again; 0: it is lost [-]",
    )
    cca_threshold_dbm: float = Field(
        -77.0, ge=-150, le=0, description="energy that makes the channel busy [dBm]"
    )
    queue_frames: int = Field(
        30, ge=1, le=100_000, description="frames that a node's link layer can hold [-]"
    )
    outbox_datagrams: int = Field(
        8, ge=1, le=100_000, description="messages of its own that wait above the link layer [-]"
    )

    @model_validator(mode="after")
    def _exponents_in_order(self) -> Self:
        if self.min_be > self.max_be:
            raise wrong(f"min_be must be at most max_be, got {self.min_be} and {self.max_be}")
        return self
