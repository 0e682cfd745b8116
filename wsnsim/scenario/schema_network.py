"""Schema of `network:`: radio, channel, medium access and routing. The sensitivity is the CC2420's."""

from collections.abc import Mapping
from typing import Any, Literal

from pydantic import Field, field_validator

from wsnsim.scenario.schema_base import Part
from wsnsim.scenario.schema_mac import CsmaCa
from wsnsim.scenario.schema_propagation import LogDistance
from wsnsim.scenario.schema_routing import MinHopTree, Routing


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
