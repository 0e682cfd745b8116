"""Schema of `network.routing:`: which way frames go."""

from typing import Annotated, Literal, Self, TypeAlias

from pydantic import Field, Tag, model_validator

from wsnsim.scenario.schema_base import Name, Part, kind_or, wrong


class Repair(Part):
    """Routes that keep up with the network, as the Collection Tree Protocol's do (Gnawali et al. 2009)."""

    initial: Literal["tree", "discover"] = Field(
        "tree",
        description="tree: the motes know the tree at first; discover: they find their ways themselves",
    )
    beacon_min_s: float | None = Field(
        None,
        gt=0,
        le=1e4,
        description="shortest interval of the Trickle timer (RFC 6206); null: 0.128, over lpl twenty times "
        "the wake_interval_s, for which each beacon holds the channel [s]",
    )
    beacon_doublings: int = Field(
        8, ge=0, le=24, description="how often the interval doubles while nothing changes [-]"
    )
    redundancy: int = Field(
        0,
        ge=0,
        le=100,
        description="Trickle's k: so many beacons without news from others silence the own one; 0: it is "
        "always sent [-]",
    )
    switch_etx: float = Field(
        1.5,
        ge=0,
        le=100,
        description="transmissions that another way must save before a mote changes its parent [-]",
    )
    link_etx_max: float = Field(
        5.0, ge=1, le=100, description="ETX above which a link is used only where there is no other [-]"
    )
    path_etx_max: float = Field(
        100.0, ge=1, le=500, description="ETX of a whole way above which it counts as none [-]"
    )
    lost_after: int = Field(
        5,
        ge=1,
        le=1000,
        description="frames in a row, each with all its retries, without ACK: the neighbour is gone [-]",
    )
    tries: int = Field(
        10,
        ge=1,
        le=1000,
        description="how often a frame is given to the MAC, by the best way then, before it is lost [-]",
    )
    hop_limit: int = Field(32, ge=1, le=255, description="hops that a packet may take [-]")
    silent_intervals: float = Field(
        3.0,
        gt=1,
        le=1000,
        description="a neighbour not heard for so many longest beacon intervals is gone [-]",
    )
    no_route: Literal["hold", "drop"] = Field(
        "hold", description="hold: what has no way waits in the queue for one; drop: it is lost"
    )


_REPAIR = "keeps routes up while the network runs; {} for the defaults; null: the tree stays as it is"


class MinHopTree(Part):
    """The tree with the fewest hops over links that work."""

    kind: Literal["min_hop_tree"] = Field(
        "min_hop_tree", description="min_hop_tree: fewest hops to the base station"
    )
    link_success_min: float = Field(
        0.9, gt=0, lt=1, description="chance of a full frame that a link must have to be used [-]"
    )
    repair: Repair | None = Field(None, description=_REPAIR)


class EtxTree(Part):
    """The tree on whose ways a frame is sent least often (De Couto et al. 2003)."""

    kind: Literal["etx_tree"] = Field(
        "etx_tree", description="etx_tree: fewest transmissions to the base station, repeats counted"
    )
    frame_bytes: int = Field(
        127,
        ge=12,
        le=2332,
        description="frames that the links are measured by, headers included; IEEE 802.15.4: at most 127 "
        "[bytes]",
    )
    link_success_min: float = Field(
        0.1, gt=0, lt=1, description="chance of such a frame and its ACK that a link must have to be used [-]"
    )
    estimate: Literal["model", "probes"] = Field(
        "model",
        description="model: ETX by power and noise, undisturbed; probes: by broadcasts that all motes send "
        "and count before anything else",
    )
    probes: int = Field(20, ge=1, le=10_000, description="so many from each mote [-]")
    probe_interval_s: float = Field(
        0.5, gt=0, le=1e4, description="each mote sends one probe in each such interval [s]"
    )
    repair: Repair | None = Field(None, description=_REPAIR)

    @model_validator(mode="after")
    def _one_way_to_measure(self) -> Self:
        if self.estimate == "probes" and self.repair is not None:
            raise wrong("estimate must be model where repair is given: its beacons measure the links")
        return self


class MinEnergyTree(Part):
    """The tree on whose ways a frame costs the least energy (Singh et al. 1998, Banerjee and Misra 2002)."""

    kind: Literal["min_energy_tree"] = Field(
        "min_energy_tree",
        description="min_energy_tree: least energy to the base station, sending and receiving, repeats "
        "counted; what stands on mains costs nothing",
    )
    frame_bytes: int = Field(
        127,
        ge=12,
        le=2332,
        description="frames whose energy counts, headers included; IEEE 802.15.4: at most 127 [bytes]",
    )
    link_success_min: float = Field(
        0.1, gt=0, lt=1, description="chance of such a frame and its ACK that a link must have to be used [-]"
    )
    repair: Repair | None = Field(None, description=_REPAIR)


class GivenTree(Part):
    """A tree by hand."""

    kind: Literal["tree"] = Field("tree", description="tree: the parents that are given here")
    parents: dict[Name, Name] = Field(
        description="next node on the way to the base station, for each node but the base and other sinks"
    )
    repair: Repair | None = Field(None, description=_REPAIR)


class Dissemination(Part):
    """How messages for all motes are spread."""

    repeats: int = Field(
        0, ge=0, le=100, description="how often each node broadcasts a frame again after the first time [-]"
    )
    pause_s: float = Field(
        0.1, gt=0, le=1e4, description="longest of the random pauses before each repetition [s]"
    )
    accept: Literal["parent", "anyone"] = Field(
        "parent",
        description="parent: a node takes, and spreads, what its parent broadcasts; anyone: what it hears "
        "first from any node, as it always does with routing.repair",
    )


Routing: TypeAlias = Annotated[
    Annotated[MinHopTree, Tag("min_hop_tree")]
    | Annotated[EtxTree, Tag("etx_tree")]
    | Annotated[MinEnergyTree, Tag("min_energy_tree")]
    | Annotated[GivenTree, Tag("tree")],
    kind_or("min_hop_tree"),
]
"""A choice of routes; where the kind is left out, the fewest hops."""
