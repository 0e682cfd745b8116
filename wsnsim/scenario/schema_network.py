"""Schema of `network:`: radio, channel, medium access and routing.

Defaults of the medium access are those of IEEE 802.15.4-2006, table 86, but for
`max_channel_retries`: the bare standard gives a frame up that never found a free
channel. The threshold of carrier sensing and the sensitivity are the CC2420's.
"""

from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self, TypeAlias

from pydantic import Field, field_validator, model_validator

from wsnsim.scenario.schema_base import Name, Part, wrong


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


class MinHopTree(Part):
    """The tree with the fewest hops over links that work."""

    kind: Literal["min_hop_tree"] = Field(
        "min_hop_tree", description="min_hop_tree: fewest hops to the base station"
    )
    link_success_min: float = Field(
        0.9, gt=0, lt=1, description="chance of a full frame that a link must have to be used [-]"
    )


class EtxTree(Part):
    """The tree on whose ways a frame is sent least often (De Couto et al. 2003)."""

    kind: Literal["etx_tree"] = Field(
        "etx_tree", description="etx_tree: fewest transmissions to the base station, repeats counted"
    )
    frame_bytes: int = Field(
        127, ge=12, le=127, description="frames that the links are measured by, headers included [bytes]"
    )
    link_success_min: float = Field(
        0.1, gt=0, lt=1, description="chance of such a frame and its ACK that a link must have to be used [-]"
    )


class GivenTree(Part):
    """A tree by hand."""

    kind: Literal["tree"] = Field("tree", description="tree: the parents that are given here")
    parents: dict[Name, Name] = Field(
        description="next node on the way to the base station, for each node but the base"
    )


Routing: TypeAlias = Annotated[MinHopTree | EtxTree | GivenTree, Field(discriminator="kind")]


class NetworkParams(Part):
    """How messages travel."""

    standard: Literal["ieee802154", "ideal"] = Field(
        "ieee802154", description="ieee802154: IEEE 802.15.4 at 2.4 GHz; ideal: no loss, no delay"
    )
    tx_power_dbm: float = Field(0.0, ge=-60, le=40, description="power of the transmitter [dBm]")
    noise_dbm: float = Field(
        -95.4, ge=-180, le=0, description="noise at the receiver, its noise figure included [dBm]"
    )
    sensitivity_dbm: float = Field(
        -95.0, ge=-150, le=0, description="weakest frame that a receiver locks on to [dBm]"
    )
    propagation: LogDistance = Field(LogDistance(), description="how power falls with distance")
    mac: CsmaCa = Field(CsmaCa(), description="medium access")
    collision: Literal["sinr", "destructive"] = Field(
        "sinr",
        description="sinr: bit errors by signal over interference and noise; destructive: any overlap loses",
    )
    routing: Routing = Field(MinHopTree(), description="which way frames go")
    mesh_header_bytes: Literal[0, 5] = Field(
        5,
        description="5: 6LoWPAN's mesh header names origin and destination; 0: they cost nothing [bytes]",
    )
    reassembly_timeout_s: float = Field(
        10.0, gt=0, le=3600, description="how long a receiver waits for a message's missing fragments [s]"
    )

    @field_validator("routing", mode="before")
    @classmethod
    def _fewest_hops_unless_said_otherwise(cls, routing: Any) -> Any:
        if isinstance(routing, Mapping) and "kind" not in routing:
            return {"kind": MinHopTree.model_fields["kind"].default, **routing}
        return routing
