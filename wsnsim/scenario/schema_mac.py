"""Schema of `network.mac:`: who may send when.

Defaults of unslotted CSMA/CA are those of IEEE 802.15.4-2006, table 86, but for
`max_channel_retries`: the bare standard gives a frame up that never found a free
channel. The threshold of carrier sensing is the CC2420's.
"""

from typing import Annotated, Any, Literal, Self, TypeAlias

from pydantic import AfterValidator, Field, Tag, model_validator

from wsnsim.scenario.schema_base import Part, kind_or, wrong

QueueFrames: TypeAlias = Annotated[
    int, Field(ge=1, le=100_000, description="frames that a node's link layer can hold [-]")
]
OutboxDatagrams: TypeAlias = Annotated[
    int, Field(ge=1, le=100_000, description="messages of its own that wait above the link layer [-]")
]
CcaThreshold: TypeAlias = Annotated[
    float, Field(ge=-150, le=0, description="energy that makes the channel busy [dBm]")
]
_OF_OTHERS = {"kind", "cca_threshold_dbm", "queue_frames", "outbox_datagrams"}
"""Keys that the transceiver and the link layer read, not the MAC."""


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
    cca_threshold_dbm: CcaThreshold = -77.0
    cca: Literal["whole_window", "end_of_window"] = Field(
        "whole_window",
        description="whole_window: busy if there was energy at any time of the 8 symbols, as the standard "
        "has it; end_of_window: only what is there at the end or begins inside counts, as in ns-3 and INET",
    )
    queue_frames: QueueFrames = 30
    outbox_datagrams: OutboxDatagrams = 8

    @model_validator(mode="after")
    def _exponents_in_order(self) -> Self:
        if self.min_be > self.max_be:
            raise wrong(f"min_be must be at most max_be, got {self.min_be} and {self.max_be}")
        return self


class Tdma(Part):
    """Slots for every node of the routing tree; radios sleep in those of others."""

    kind: Literal["tdma"] = Field(
        "tdma", description="tdma: slots on the routing tree by its conflicts; radios sleep in between"
    )
    slot_s: float | None = Field(
        None, gt=0, le=10, description="length of a slot; null: as short as guards and a frame let it be [s]"
    )
    guard_s: float = Field(0.001, gt=0, le=1, description="how far the clocks of two nodes may be apart [s]")
    drift_ppm: float = Field(
        20.0, ge=0, le=1000, description="largest deviation of a node's clock [parts per million]"
    )
    resync_s: float = Field(
        2.0, gt=0, le=3600, description="time after which a silent parent sends its children a beacon [s]"
    )
    interference_dbm: float | None = Field(
        None,
        ge=-200,
        le=0,
        description="power from which on a node disturbs another; null: 10 dB below the sensitivity [dBm]",
    )
    proportional: bool = Field(
        True,
        description="true: a slot up the tree for each node that sends through a node, itself included; "
        "false: one",
    )
    max_frame_retries: int = Field(3, ge=0, le=20, description="retries without an ACK [-]")
    queue_frames: QueueFrames = 30
    outbox_datagrams: OutboxDatagrams = 8

    def values(self) -> dict[str, Any]:
        """Return what `wsnsim.net.mac.tdma_config.TdmaConfig` takes."""
        return self.model_dump(exclude=_OF_OTHERS)

    @model_validator(mode="after")
    def _slots_hold_frames_and_guards_drift(self) -> Self:
        from wsnsim.net.mac.tdma_config import TdmaConfig

        try:
            TdmaConfig(**self.values())
        except ValueError as error:
            raise wrong(str(error)) from error
        return self


class Lpl(Part):
    """Low-power listening: radios wake up now and then, senders repeat until they do."""

    kind: Literal["lpl"] = Field("lpl", description="lpl: low-power listening, as in B-MAC and BoX-MAC-2")
    wake_interval_s: float = Field(
        0.1, gt=0, le=60, description="time from one look at the channel to the next [s]"
    )
    check_s: float = Field(0.0055, gt=0, le=1, description="how long a node listens each time [s]")
    after_receive_s: float = Field(
        0.02, gt=0, le=10, description="how long a node stays awake after it noticed or sent something [s]"
    )
    min_be: int = Field(4, ge=0, le=8, description="first backoff exponent [-]")
    max_be: int = Field(6, ge=0, le=8, description="largest backoff exponent [-]")
    patience_intervals: int = Field(
        5, ge=1, le=1000, description="wake-up intervals that a sender waits for a free channel [-]"
    )
    max_frame_retries: int = Field(
        3, ge=0, le=20, description="how often a whole train of copies without an ACK is repeated [-]"
    )
    cca_threshold_dbm: CcaThreshold = -77.0
    queue_frames: QueueFrames = 30
    outbox_datagrams: OutboxDatagrams = 8

    def values(self) -> dict[str, Any]:
        """Return what `wsnsim.net.mac.lpl_config.LplConfig` takes."""
        return self.model_dump(exclude=_OF_OTHERS)

    @model_validator(mode="after")
    def _intervals_hold_what_happens_in_them(self) -> Self:
        from wsnsim.net.mac.lpl_config import LplConfig

        try:
            LplConfig(**self.values())
        except ValueError as error:
            raise wrong(str(error)) from error
        return self


def _known_rate(rate_mbps: float) -> float:
    if rate_mbps not in (1, 2, 5.5, 11):
        raise wrong(f"must be 1, 2, 5.5 or 11, got {rate_mbps:g}")
    return rate_mbps


RateMbps: TypeAlias = Annotated[float, AfterValidator(_known_rate)]


class Dcf(Part):
    """The distributed coordination function: CSMA/CA with acknowledgements of IEEE 802.11."""

    kind: Literal["dcf"] = Field(
        "dcf", description="dcf: the distributed coordination function of IEEE 802.11"
    )
    rate_mbps: RateMbps = Field(11.0, description="bit rate of data frames: 1, 2, 5.5 or 11 [Mbit/s]")
    basic_rate_mbps: RateMbps = Field(1.0, description="bit rate of ACKs and of frames to all [Mbit/s]")
    preamble: Literal["long", "short"] = Field(
        "long", description="long: 192 µs before each frame; short: 96 µs, but not at 1 Mbit/s"
    )
    cw_min: int = Field(31, ge=0, le=65_535, description="aCWmin: first backoff at most [slots of 20 µs]")
    cw_max: int = Field(1023, ge=0, le=65_535, description="aCWmax: backoff at most [slots of 20 µs]")
    retry_limit: int = Field(
        7, ge=1, le=255, description="dot11ShortRetryLimit: how often a frame is sent at most [-]"
    )
    cca_threshold_dbm: float = Field(
        -80.0, ge=-150, le=0, description="energy that makes the channel busy, beside any frame heard [dBm]"
    )
    queue_frames: QueueFrames = 30
    outbox_datagrams: OutboxDatagrams = 8

    def values(self) -> dict[str, Any]:
        """Return what `wsnsim.net.mac.dcf_config.DcfConfig` takes."""
        return self.model_dump(exclude=_OF_OTHERS)

    @model_validator(mode="after")
    def _windows_and_rates_in_order(self) -> Self:
        if self.cw_min > self.cw_max:
            raise wrong(f"cw_min must be at most cw_max, got {self.cw_min} and {self.cw_max}")
        if self.basic_rate_mbps > self.rate_mbps:
            rates = f"{self.basic_rate_mbps:g} and {self.rate_mbps:g}"
            raise wrong(f"basic_rate_mbps must be at most rate_mbps, got {rates} Mbit/s")
        return self


Mac: TypeAlias = Annotated[
    Annotated[CsmaCa, Tag("csma_ca")]
    | Annotated[Tdma, Tag("tdma")]
    | Annotated[Lpl, Tag("lpl")]
    | Annotated[Dcf, Tag("dcf")],
    kind_or("csma_ca"),
]
"""A medium access; where the kind is left out, unslotted CSMA/CA, or DCF in a network by IEEE 802.11b."""
