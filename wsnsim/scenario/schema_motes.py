"""Schema of `motes:`: what computes and sends, and what feeds it."""

from typing import Annotated, Literal, TypeAlias

from pydantic import Field

from wsnsim.scenario.schema_base import Name, Part, PlatformName, Position, RadioName


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


class MoteDefaults(Part):
    """What a mote is made of where it does not say otherwise."""

    platform: PlatformName = Field("imote2_416", description="processor and board")
    radio: RadioName = Field("cc2420", description="radio chip")
    battery: Battery = Field(TwoAa(), description="where the energy comes from")


class MoteEntry(Part):
    """A relay of its own, or changes to the mote of the camera with this id."""

    id: Name = Field(description="a camera's id, or the name of a relay")
    position_m: Position | None = Field(
        None, description="where a relay stands [m]; a camera's mote is at the camera"
    )
    platform: PlatformName | None = Field(None, description="processor and board; null: the default's")
    radio: RadioName | None = Field(None, description="radio chip; null: the default's")
    battery: Battery | None = Field(None, description="where the energy comes from; null: the default's")


class BaseStation(Part):
    """Where the estimates are wanted."""

    id: Name = Field("base", description="name of the base station")
    position_m: Position = Field(description="where it stands [m]")
    platform: PlatformName = Field("workstation", description="processor and board")
    radio: RadioName | None = Field(None, description="radio chip; null: the default's")
    battery: Battery = Field(Mains(), description="where the energy comes from")


class Motes(Part):
    """All nodes of the network; a camera without an entry has a mote by the default."""

    default: MoteDefaults = Field(MoteDefaults(), description="for every mote that does not say otherwise")
    nodes: tuple[MoteEntry, ...] = Field(
        (), description="relays, and motes of cameras that differ from the default"
    )
    base: BaseStation = Field(description="the base station")
