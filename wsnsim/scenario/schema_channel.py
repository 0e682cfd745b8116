"""Schema of `network.noise:` and `network.fading:`: what changes on the air while a run lasts."""

from typing import Annotated, Literal, TypeAlias

from pydantic import Field

from wsnsim.scenario.schema_base import InputFile, Part


class NoiseTrace(Part):
    """Noise that behaves like a recorded one, each node's for itself."""

    kind: Literal["trace"] = Field(
        "trace", description="trace: closest-pattern matching on a trace (Lee, Cerpa, Levis 2007)"
    )
    file: InputFile = Field(description="noise in dBm every millisecond, one number a line")


class TableNoise(Part):
    """Noise by the lines of the link table."""

    kind: Literal["link_table"] = Field(
        "link_table", description="link_table: each node's floor and standard deviation in the link table"
    )


Noise: TypeAlias = Annotated[NoiseTrace | TableNoise, Field(discriminator="kind")]


class Fading(Part):
    """Block fading: a link's power stays for a while, then is another."""

    kind: Literal["rayleigh", "rician"] = Field(
        description="rayleigh: many ways and none in sight; rician: one way stronger than the others together"
    )
    coherence_s: float = Field(0.1, ge=1e-6, le=1e6, description="how long a link's power stays as it is [s]")
    k_db: float = Field(
        6.0, ge=-30, le=60, description="rician: power in sight over that of all other ways [dB]"
    )
