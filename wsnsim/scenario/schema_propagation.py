"""Schema of `network.propagation:`: what lies between two antennas."""

from typing import Annotated, Literal, TypeAlias

from pydantic import Field, Tag

from wsnsim.scenario.schema_base import Extent, InputFile, Name, Part, kind_or


class Walls(Part):
    """What stands about weakens what passes through it."""

    loss_db: float = Field(
        5.0,
        ge=0,
        le=200,
        description="what each occluder on the straight line costs that gives no attenuation_db itself [dB]",
    )


class _PathLoss(Part):
    """What all path losses by distance may have beside it."""

    kind: str
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
    tx_offset_db: float = Field(
        0.0,
        ge=0,
        le=50,
        description="standard deviation of what a node sends beyond its nominal power, by seed [dB]",
    )
    rx_offset_db: float = Field(
        0.0,
        ge=0,
        le=50,
        description="standard deviation of what a node hears beyond a nominal one, by seed [dB]",
    )
    offset_correlation: float = Field(
        0.0, ge=-1, le=1, description="correlation of a node's two offsets; 0.7 on the MICA2 [-]"
    )
    walls: Walls | None = Field(
        None, description="the world's occluders weaken links that cross them; null: they do not"
    )


class LogDistance(_PathLoss):
    """Path loss that grows with the logarithm of the distance."""

    kind: Literal["log_distance"] = Field(
        "log_distance", description="log_distance: reference loss + 10 exponent log10(d / reference distance)"
    )
    exponent: float = Field(3.0, gt=0, le=10, description="path-loss exponent; 2 in free space [-]")
    reference_loss_db: float = Field(40.05, ge=0, le=200, description="loss at the reference distance [dB]")
    reference_distance_m: float = Field(
        1.0, gt=0, le=1e4, description="distance below which the loss stays what it is there [m]"
    )


class FreeSpace(_PathLoss):
    """Path loss of free space (Friis)."""

    kind: Literal["free_space"] = Field(
        "free_space", description="free_space: 20 log10(4 pi d / wavelength), antennas without gain"
    )
    frequency_hz: float = Field(2.4e9, ge=1e6, le=1e12, description="of the carrier [Hz]")
    reference_distance_m: float = Field(
        1.0, gt=0, le=1e4, description="distance below which the loss stays what it is there [m]"
    )


class TwoRay(_PathLoss):
    """Free space near by, and a ray off the ground beside the straight one farther away."""

    kind: Literal["two_ray"] = Field(
        "two_ray",
        description="two_ray: free space, from 4 pi h h / wavelength on 40 log10(d) - 20 log10(h h), h the "
        "nodes' heights",
    )
    frequency_hz: float = Field(2.4e9, ge=1e6, le=1e12, description="of the carrier [Hz]")
    reference_distance_m: float = Field(
        1.0, gt=0, le=1e4, description="distance below which the loss stays what it is there [m]"
    )


Labels: TypeAlias = dict[Name, int | Annotated[str, Field(min_length=1, max_length=64)]]


class LinkTable(Part):
    """Links by hand or by measurement: no path loss."""

    kind: Literal["link_table"] = Field(
        "link_table", description="link_table: gains or packet reception ratios from a file"
    )
    file: InputFile = Field(
        description="TOSSIM topology (lines `gain FROM TO DB`, `noise NODE FLOOR SD`) or, with the ending "
        ".csv, reception ratios (columns from, to, prr)"
    )
    nodes: Labels | None = Field(
        None,
        description="what the file calls each node; null: its name, or else its place among the nodes from 0",
    )
    power_dbm: float = Field(
        -60.0,
        ge=-150,
        le=40,
        description="what arrives over a link of which only the reception ratio is known [dBm]",
    )


class RecordedLinks(Part):
    """Links that deliver what was measured at the same time of a recording."""

    kind: Literal["recorded"] = Field(
        "recorded",
        description="recorded: links of a k7 connectivity trace, replayed; after its end it begins again",
    )
    file: InputFile = Field(description="trace (.k7, or .k7.gz)")
    channel: int = Field(26, ge=11, le=26, description="channel of IEEE 802.15.4 whose records count [-]")
    nodes: Labels | None = Field(
        None,
        description="what the file calls each node; null: its name, or else its place among the nodes from 0",
    )
    start_s: float = Field(0.0, ge=0, le=1e9, description="time of the recording at which the run begins [s]")
    gap_s: Extent | None = Field(
        None,
        description="time to the nearest record beyond which a link carries nothing; null: 0.55 of the "
        "median time between records of a link [s]",
    )


Propagation: TypeAlias = Annotated[
    Annotated[LogDistance, Tag("log_distance")]
    | Annotated[FreeSpace, Tag("free_space")]
    | Annotated[TwoRay, Tag("two_ray")]
    | Annotated[LinkTable, Tag("link_table")]
    | Annotated[RecordedLinks, Tag("recorded")],
    kind_or("log_distance"),
]
"""A propagation; where the kind is left out, log-distance path loss."""
