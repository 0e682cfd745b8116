"""Schema of `network.routing:`: which way frames go."""

from typing import Annotated, Literal, TypeAlias

from pydantic import Field

from wsnsim.scenario.schema_base import Name, Part


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
