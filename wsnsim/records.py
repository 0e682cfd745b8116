"""The rows a run leaves behind, and the sink they go to.

Everything that happens is one record; every metric and every figure is a pure
function of the records. A field's unit stands in its name; the tables of
``results.sqlite`` have these fields as columns.
"""

from dataclasses import dataclass
from typing import ClassVar, Protocol, TypeAlias


@dataclass(frozen=True, slots=True)
class TruthRow:
    """Where a target really is at a sampling instant; orientation as unit quaternion (w, x, y, z)."""

    table: ClassVar[str] = "truth"
    time_s: float
    target: str
    x_m: float
    y_m: float
    z_m: float
    vx_mps: float
    vy_mps: float
    vz_mps: float
    qw: float
    qx: float
    qy: float
    qz: float


@dataclass(frozen=True, slots=True)
class ViewRow:
    """How much of a target one camera really sees at a sampling instant; no row where it sees nothing."""

    table: ClassVar[str] = "views"
    time_s: float
    camera: str
    target: str
    visible_px: float | None
    """Pixels of the image that show the target, in parts at its edge; None where the system needs none."""
    pixel_share: float | None
    """`visible_px` over the pixels of the image."""


@dataclass(frozen=True, slots=True)
class EstimateRow:
    """What a node believes of a target; covariance of the position [m²], orientation (w, x, y, z).

    The orientation is NaN, and missing in results.sqlite, where the system estimates none.
    """

    table: ClassVar[str] = "estimates"
    time_s: float
    made_at_s: float
    node: str
    track: str
    x_m: float
    y_m: float
    z_m: float
    vx_mps: float
    vy_mps: float
    vz_mps: float
    cov_xx_m2: float
    cov_xy_m2: float
    cov_xz_m2: float
    cov_yy_m2: float
    cov_yz_m2: float
    cov_zz_m2: float
    qw: float
    qx: float
    qy: float
    qz: float
    asked: int
    """Cameras that were expected to contribute."""
    heard: int
    """Cameras whose contribution is in the estimate."""
    kind: str
    """`update` from measurements; without any: `timed_out` (asked, none arrived in time), `unasked` (no
    camera has the target in view), `skipped` (the tracker was still busy with an earlier step), `lost` (the
    track was declared lost: its last prediction is held). `smoothed`: a second look at an older instant,
    made later from what came after it; it takes no other estimate's place."""


@dataclass(frozen=True, slots=True)
class NodeRow:
    """What a node did and used up over the whole run."""

    table: ClassVar[str] = "nodes"
    node: str
    role: str
    parent: str | None
    depth: int
    x_m: float
    y_m: float
    z_m: float
    app_tx_bytes: int
    mac_tx_bytes: int
    mac_rx_bytes: int
    frames_tx: int
    frames_retried: int
    frames_dropped: int
    images_taken: int
    images_skipped: int
    cpu_cycles: float
    cpu_busy_s: float
    frame_work_mean_s: float | None
    """`cpu_busy_s` for each image taken; None for a node that took none."""
    work_longest_s: float
    """Time that the longest work on one input (an image, a message, a timer) takes on this processor."""
    energy_radio_tx_j: float
    energy_radio_rx_j: float
    energy_radio_listen_j: float
    energy_radio_sleep_j: float
    energy_cpu_j: float
    energy_camera_j: float
    energy_board_j: float
    harvested_j: float
    battery_capacity_j: float | None
    battery_left_j: float | None
    died_at_s: float | None
    attempts: int = 0
    """Data frames sent that ask for an acknowledgement, repeats included."""
    attempts_failed: int = 0
    """Those of them that were not acknowledged."""
    cca_total: int = 0
    """Looks at the channel before sending."""
    cca_busy: int = 0
    """Those of them that found it busy."""
    budget_waited_s: float = 0.0
    """How long frames at the head of the queue waited for the bandwidth budget."""
    control_frames_tx: int = 0
    """Of `frames_tx`, those of the routing protocol: beacons, joins and probes."""
    control_tx_bytes: int = 0
    """Of `mac_tx_bytes`, those of such frames."""
    duplicates: int = 0
    """Packets that came again and were thrown away above the MAC."""


@dataclass(frozen=True, slots=True)
class EnergyRow:
    """The joules of one node, component and cause over the whole run."""

    table: ClassVar[str] = "energy"
    node: str
    component: str
    cause: str
    seconds: float
    energy_j: float


@dataclass(frozen=True, slots=True)
class MessageRow:
    """One application message and one receiver it was meant for."""

    table: ClassVar[str] = "messages"
    message: int
    kind: str
    source: str
    destination: str
    created_s: float
    delivered_s: float | None
    bytes: int
    fragments: int
    hops: int | None
    outcome: str
    """`delivered`, `fused`, `in_flight`, or `dropped_<reason>`."""
    fused_into: int | None = None
    """The message that went on in place of this one, which had arrived at `delivered_s`."""


@dataclass(frozen=True, slots=True)
class LoadRow:
    """What all nodes together have sent by a sampling instant, and at the end of the run."""

    table: ClassVar[str] = "load"
    time_s: float
    app_tx_bytes: int
    mac_tx_bytes: int


@dataclass(frozen=True, slots=True)
class EventRow:
    """A death, a skipped frame, a stale message: what is worth telling."""

    table: ClassVar[str] = "events"
    time_s: float
    node: str
    kind: str
    detail: str
    step: int | None = None
    """The tracking step that it is about, where figures are made of it."""


@dataclass(frozen=True, slots=True)
class FrameRow:
    """One radio frame at one receiver it was meant for (where `record.frames` asks for it)."""

    table: ClassVar[str] = "frames"
    time_s: float
    sender: str
    receiver: str
    kind: str
    bytes: int
    attempt: int
    rssi_dbm: float
    sinr_db: float
    outcome: str


@dataclass(frozen=True, slots=True)
class ImageRow:
    """One image as the program of a camera's mote got it (where `record.images` asks for it)."""

    table: ClassVar[str] = "images"
    time_s: float
    """When it was taken; the program has it when it is read out."""
    step: int
    camera: str
    png: bytes


Row: TypeAlias = (
    TruthRow
    | ViewRow
    | EstimateRow
    | NodeRow
    | EnergyRow
    | MessageRow
    | LoadRow
    | EventRow
    | FrameRow
    | ImageRow
)

ROW_TYPES: tuple[type[Row], ...] = (
    TruthRow,
    ViewRow,
    EstimateRow,
    NodeRow,
    EnergyRow,
    MessageRow,
    LoadRow,
    EventRow,
    FrameRow,
    ImageRow,
)


class Sink(Protocol):
    """Takes the rows of a run as they happen."""

    def write(self, row: Row) -> None:
        """Take one row."""


class MemorySink:
    """A sink that keeps rows in a list, for tests and short studies."""

    def __init__(self) -> None:
        self.rows: list[Row] = []

    def write(self, row: Row) -> None:
        """Append the row."""
        self.rows.append(row)


class Outlet:
    """A sink that passes rows on to another, which it is connected to when the run begins."""

    def __init__(self) -> None:
        self._sink: Sink | None = None

    def connect(self, sink: Sink) -> None:
        """Pass rows on to `sink` from now on."""
        self._sink = sink

    def write(self, row: Row) -> None:
        """Pass on one row.

        Raises
        ------
        RuntimeError : nothing is connected
        """
        if self._sink is None:
            raise RuntimeError("a record was written before the run began")
        self._sink.write(row)
