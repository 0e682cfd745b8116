"""Schema of `motes:`: what computes and sends, and what feeds it."""

from typing import Annotated, Literal, TypeAlias

from pydantic import Field

from wsnsim.scenario.schema_base import Name, Part, PlatformName, Position, RadioName
from wsnsim.scenario.schema_layout import Layout


class TwoAa(Part):
    """Two AA alkaline cells."""

    kind: Literal["two_aa"] = Field("two_aa", description="two_aa: two AA alkaline cells")


class Mains(Part):
    """Power without end."""

    kind: Literal["mains"] = Field("mains", description="mains: never empty")


class Capacity(Part):
    """A battery of a given capacity."""

    kind: Literal["capacity"] = Field("capacity", description="capacity: a battery with capacity_j joules")
    capacity_j: float = Field(gt=0, le=1e12, description="energy when full [J]")


Battery: TypeAlias = Annotated[TwoAa | Mains | Capacity, Field(discriminator="kind")]


class Budget(Part):
    """What a mote may put on the air: a token bucket over all bytes that its MAC sends."""

    bandwidth_bps: int = Field(
        gt=0, le=10**12, description="rate in the long run, headers, repeats and ACKs included [bit/s]"
    )
    burst_bytes: int | None = Field(
        None,
        gt=0,
        le=10**12,
        description="what may be sent at once after a silence; null: what the rate gives in a second, but at "
        "least one frame with all its repeats [bytes]",
    )
    at_limit: Literal["drop", "delay", "degrade"] = Field(
        "delay",
        description="drop: a message that would exceed it is lost; delay: it waits; degrade: it waits, and "
        "the program is told how much it may say",
    )


class MoteDefaults(Part):
    """What a mote is made of where it does not say otherwise."""

    platform: PlatformName = Field("imote2_416", description="processor and board")
    radio: RadioName = Field("cc2420", description="radio chip")
    battery: Battery = Field(TwoAa(), description="where the energy comes from")
    budget: Budget | None = Field(None, description="what it may put on the air; null: as much as it can")


class MoteEntry(Part):
    """A relay of its own, or changes to the mote of the camera with this id."""

    id: Name = Field(description="a camera's id, or the name of a relay")
    position_m: Position | None = Field(
        None, description="where a relay stands [m]; a camera's mote is at the camera"
    )
    platform: PlatformName | None = Field(None, description="processor and board; null: the default's")
    radio: RadioName | None = Field(None, description="radio chip; null: the default's")
    battery: Battery | None = Field(None, description="where the energy comes from; null: the default's")
    budget: Budget | None = Field(None, description="what it may put on the air; null: the default's")


class BaseStation(Part):
    """Where the estimates are wanted."""

    id: Name = Field("base", description="name of the base station")
    position_m: Position = Field(description="where it stands [m]")
    platform: PlatformName = Field("workstation", description="processor and board")
    radio: RadioName | None = Field(None, description="radio chip; null: the default's")
    battery: Battery = Field(Mains(), description="where the energy comes from")


class Sink(Part):
    """A gateway that is joined to the base station by a wire, which takes no time and no energy."""

    id: Name = Field(description="name of the sink")
    position_m: Position = Field(description="where it stands [m]")
    platform: PlatformName = Field("workstation", description="processor and board")
    radio: RadioName | None = Field(None, description="radio chip; null: the default's")
    battery: Battery = Field(Mains(), description="where the energy comes from")


class Motes(Part):
    """All nodes of the network; a camera without an entry has a mote by the default."""

    default: MoteDefaults = Field(MoteDefaults(), description="for every mote that does not say otherwise")
    layout: Layout | None = Field(
        None,
        description="many nodes at once: a JSON file with their places, or a rule; what else is given comes "
        "first; null: all stand under nodes and base",
    )
    nodes: tuple[MoteEntry, ...] = Field(
        (), description="relays, and motes of cameras that differ from the default"
    )
    base: BaseStation = Field(description="the base station; may be left out where a layout has it")
    sinks: tuple[Sink, ...] = Field(
        (), description="further ends of ways; what reaches one has reached the base station"
    )
