"""Schema of `network:`: radio, channel, medium access and routing. The sensitivity is the CC2420's."""

from typing import Literal, Self

from pydantic import Field, model_validator

from wsnsim.scenario.schema_base import Part, wrong
from wsnsim.scenario.schema_channel import Fading, Noise, TableNoise
from wsnsim.scenario.schema_mac import CsmaCa, Mac, Tdma
from wsnsim.scenario.schema_propagation import LinkTable, LogDistance, Propagation
from wsnsim.scenario.schema_routing import Dissemination, EtxTree, MinHopTree, Routing


class NetworkParams(Part):
    """How messages travel."""

    standard: Literal["ieee802154", "ieee80211b", "ideal"] = Field(
        "ieee802154",
        description="ieee802154: IEEE 802.15.4 at 2.4 GHz; ieee80211b: IEEE 802.11b, with defaults of its "
        "own for mac, radio, power, noise and sensitivity; ideal: no loss, no delay",
    )
    tx_power_dbm: float = Field(
        0.0, ge=-60, le=40, description="power of the transmitter; ieee80211b: 15 [dBm]"
    )
    noise_dbm: float = Field(
        -95.4,
        ge=-180,
        le=0,
        description="noise at the receiver, its noise figure included; ieee80211b: -89 [dBm]",
    )
    sensitivity_dbm: float = Field(
        -95.0, ge=-150, le=0, description="weakest frame that a receiver locks on to; ieee80211b: -91 [dBm]"
    )
    lock_sinr_db: float = Field(
        -5.0,
        ge=-50,
        le=50,
        description="smallest signal over interference and noise at which a receiver synchronises [dB]",
    )
    propagation: Propagation = Field(LogDistance(), description="what arrives of a node's power at others")
    noise: Noise | None = Field(
        None, description="noise that changes in time, in place of noise_dbm; null: constant"
    )
    fading: Fading | None = Field(None, description="links whose power changes in time; null: none do")
    link_margin_db: float = Field(
        10.0,
        ge=0,
        le=200,
        description="how far below noise_dbm a link still counts in networks of more than 300 nodes [dB]",
    )
    mac: Mac = Field(CsmaCa(), description="medium access")
    collision: Literal["sinr", "destructive", "capture"] = Field(
        "sinr",
        description="sinr: bit errors by signal over interference and noise; destructive: any overlap loses; "
        "capture: an overlap loses unless a frame is capture_db above all others",
    )
    capture_db: float = Field(
        3.0,
        ge=0.0,
        le=100.0,
        description="how far above all others together a frame must be to survive them under capture [dB]",
    )
    routing: Routing = Field(MinHopTree(), description="which way frames go")
    dissemination: Dissemination = Field(Dissemination(), description="how messages for all motes are spread")
    queue_policy: Literal["drop_newest", "drop_oldest", "drop_random"] = Field(
        "drop_newest",
        description="what is lost where a queue is full: drop_newest: the newcomer; drop_oldest: what has "
        "waited longest; drop_random: one of all, the newcomer among them",
    )
    mesh_header_bytes: Literal[0, 5] = Field(
        5,
        description="5: 6LoWPAN's mesh header names origin and destination; 0: they cost nothing [bytes]",
    )
    reassembly_timeout_s: float = Field(
        10.0, gt=0, le=3600, description="how long a receiver waits for a message's missing fragments [s]"
    )

    @model_validator(mode="after")
    def _noise_has_a_table(self) -> Self:
        if isinstance(self.noise, TableNoise) and not isinstance(self.propagation, LinkTable):
            raise wrong("noise by link_table needs a propagation of that kind, whose file gives it")
        return self

    @model_validator(mode="after")
    def _slots_keep_the_tree(self) -> Self:
        if not isinstance(self.mac, Tdma):
            return self
        why = "where mac is tdma: its slots belong to the first tree"
        if self.routing.repair is not None:
            raise wrong(f"routing.repair must be left out {why}")
        if isinstance(self.routing, EtxTree) and self.routing.estimate == "probes":
            raise wrong(f"routing.estimate must be model {why}")
        return self
