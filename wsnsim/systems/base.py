"""The seam between a tracking system and everything that runs it.

A system is a set of small programs, each a function of (context, input) that
returns a `Step`: what to send, what work it cost, what it now believes. A
program never waits, never sends and never reads a clock by itself, so that it
can be tested without a network and run over any.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar, runtime_checkable

import numpy as np
from pydantic import BaseModel

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.hardware.work import Work
from wsnsim.messages.base import Payload
from wsnsim.rng import RandomStreams
from wsnsim.types import ByteArray, FloatArray, NodeId, Seconds
from wsnsim.vision.frame import Frame

if TYPE_CHECKING:
    from wsnsim.vision.album import View
    from wsnsim.vision.portrait import Portrait
    from wsnsim.world.world import Placed, World


class Role(Enum):
    """What a node is in the network."""

    CAMERA = "camera"
    RELAY = "relay"
    MOTE = "mote"
    """A node of a network without cameras."""
    SINK = "sink"
    """A further end of ways: joined to the base station by wire, it has no program of the system's."""
    BASE = "base"


class Scope(Enum):
    """Whom a message is for, where it is not one named node."""

    BASE = "base"
    """The base station, up the tree."""
    TREE = "tree"
    """Every mote, down the tree."""
    NEIGHBOURS = "neighbours"
    """Everybody in radio reach, one hop and unacknowledged: those that `Context.neighbours` names."""


@dataclass(frozen=True)
class GroupKey:
    """Messages that may be aggregated on their way to the base station: those of one tracking step."""

    epoch: int
    """The step."""


@dataclass(frozen=True)
class Send:
    """A message to hand to the network."""

    to: NodeId | Scope
    payload: Payload
    expires: Seconds | None = None
    """Time after which nobody wants it: what is unsent then is dropped. Where its group is aggregated, that
    is when the group is due instead."""
    group: GroupKey | None = None
    """Where it is named, the message climbs to the base station hop by hop, `to` is `Scope.BASE`, and every
    node on its way whose program is an `Aggregator` fuses it with others of the group, its maker first."""
    when_left: str | None = None
    """Key of a call of `on_timer` when the node's own link layer has done with the message, sent or given up;
    for messages without a group."""


@dataclass(frozen=True)
class Timer:
    """A call of `on_timer` with `key` when the node's clock shows `at` [s]."""

    key: str
    at: Seconds


NOT_ORIENTED: FloatArray = np.full(4, np.nan)
"""Orientation of a target of which a tracker estimates none."""
NOT_ORIENTED.flags.writeable = False


@dataclass(frozen=True)
class Belief:
    """State of a target as a tracker holds it: two arrays (3,) and a unit quaternion (w, x, y, z).

    A tracker that does not estimate the orientation says so by `NOT_ORIENTED`.
    """

    position: FloatArray
    velocity: FloatArray
    orientation: FloatArray


class Basis(Enum):
    """What an estimate rests on."""

    UPDATE = "update"
    """Measurements of its instant."""
    TIMED_OUT = "timed_out"
    """Prediction: cameras were asked, none was heard in time."""
    UNASKED = "unasked"
    """Prediction: no camera has the target in view."""
    SKIPPED = "skipped"
    """Prediction: the tracker was still busy with an earlier instant."""
    LOST = "lost"
    """The track was given up: where it was last believed to be."""
    SMOOTHED = "smoothed"
    """A revision, with what was measured up to some steps later."""


@dataclass(frozen=True)
class TrackEstimate:
    """A statement about where a target was at `time`."""

    time: Seconds
    track: str
    belief: Belief
    cov: FloatArray
    """(3, 3) covariance of the position [m²]."""
    basis: Basis
    asked: int
    """Cameras that were expected to contribute."""
    heard: int
    """Cameras that did."""


@dataclass(frozen=True)
class Note:
    """Something worth an event record: `kind` and a sentence."""

    kind: str
    detail: str
    step: int | None = None
    """The tracking step that it is about, where figures are made of it."""


@dataclass(frozen=True)
class Step:
    """What a program does with one input.

    Sends, timers and estimates take effect when the work is done.
    """

    sends: tuple[Send, ...] = ()
    work: Work = field(default_factory=Work)
    timers: tuple[Timer, ...] = ()
    estimates: tuple[TrackEstimate, ...] = ()
    notes: tuple[Note, ...] = ()


@dataclass(frozen=True)
class Context:
    """What a node may know at this instant."""

    node: NodeId
    now: Seconds
    """By the node's own clock."""
    battery_j: float
    """Energy left; infinite on mains."""
    allowance_bytes: float = math.inf
    """What the program may say now within the mote's bandwidth budget, headers taken off; infinite without a
    budget that is the program's to keep."""
    neighbours: tuple[NodeId, ...] = ()
    """Nodes that this one can speak with directly, as far as it knows."""


@dataclass(frozen=True)
class Received:
    """A payload that arrived, and who made it."""

    source: NodeId
    payload: Payload


class Program(Protocol):
    """What runs on a mote, a relay or a base station alike."""

    def on_start(self, ctx: Context) -> Step:
        """React to the beginning of the run."""

    def on_frame(self, ctx: Context, frame: Frame) -> Step:
        """React to an image from the node's own camera."""

    def on_payload(self, ctx: Context, message: Received) -> Step:
        """React to a message."""

    def on_timer(self, ctx: Context, key: str) -> Step:
        """React to a timer set earlier."""


@dataclass(frozen=True)
class Aggregate:
    """What a relay makes of the messages of a group: one payload, or none, and the work it took."""

    payload: Payload | None
    work: Work = field(default_factory=Work)


@runtime_checkable
class Aggregator(Protocol):
    """A program that fuses what passes its node; at a camera that relays its own message is a part too.

    `due`, `usual` and `awaits` are asked for free and must change nothing.
    """

    def due(self, group: GroupKey) -> Seconds:
        """Return by when the base station wants the messages of a group; what comes later is dropped."""

    def usual(self) -> tuple[int, Work]:
        """Return the size [bytes] of an aggregate and the work of making one, as a rule.

        Asked once, before the run: how long each node may wait for others follows from it.
        """

    def awaits(self, group: GroupKey, parts: Sequence[Received], below: frozenset[NodeId]) -> bool:
        """Tell whether more may come; asked whenever a part has come or the program has taken an input.

        Not asked any more once the node has sent something of the group: what comes then goes on at once.

        Parameters
        ----------
        parts : what is here, its own unencoded
        below : the node itself and all whose messages pass it
        """

    def aggregate(self, ctx: Context, group: GroupKey, parts: Sequence[Received]) -> Aggregate:
        """Fuse messages of one group; `parts` is not empty, and no message is in it that was given before."""


@dataclass(frozen=True, eq=False)
class TrackedTarget:
    """What a system is told of a target before the run.

    Parameters
    ----------
    id : its name in the scenario
    semi_axes_m : (3,) of the ellipsoid that stands for it [m]
    start : where it is at the beginning, the manual initialisation of the published experiments
    portrait : takes a picture of it from a direction (3,) in its own axes
    album : pictures of it that the user took, to learn from in place of portraits; empty where there are none
    """

    id: str
    semi_axes_m: FloatArray
    start: Belief
    portrait: "Callable[[FloatArray], Portrait]"
    album: "tuple[View, ...]" = ()


@dataclass(frozen=True, eq=False)
class Floor:
    """The room as its plans show it, and who is to be expected in it.

    Parameters
    ----------
    size_m : (3,) - its extent from the origin [m]
    scenery : what stands about and never moves
    people : how many there are beside the targets
    person_radius_m : of the widest of them, seen from above; 0 without people [m]
    """

    size_m: FloatArray
    scenery: "tuple[Placed, ...]" = ()
    people: int = 0
    person_radius_m: float = 0.0


def _nowhere() -> Floor:
    return Floor(np.zeros(3))


@dataclass(frozen=True, eq=False)
class Site:
    """What was measured and configured at deployment; the same object at every node."""

    cameras: Mapping[NodeId, PinholeCamera]
    """Calibrated cameras by the node that carries each."""
    targets: tuple[TrackedTarget, ...]
    rate_hz: float
    """Frame rate that all cameras share [Hz]."""
    steps: int
    """Number of the last tracking step; frame k is taken at k / rate_hz, k = 1 … steps."""
    streams: RandomStreams
    """The seed that all motes share."""
    motes: Mapping[NodeId, int] = field(default_factory=dict)
    """Numbers of all nodes but the base station, from 0 on."""
    duration_s: Seconds = math.inf
    """For how long there is something to do [s]."""
    floor: Floor = field(default_factory=_nowhere)
    """The room."""
    empty_views: "Mapping[NodeId, Callable[[], ByteArray]]" = field(default_factory=dict)
    """Takes the picture (h, w, 3) that a camera had of the room before anybody was in it, by its node."""


class Sensor(Protocol):
    """What one camera's mote measures without pixels: it knows the truth, which no program does."""

    def measured(self, step: int, time: Seconds) -> Any:
        """Return what a program finds in its frame (`Frame.measured`) at an instant [s]."""

    def in_view(self, time: Seconds) -> tuple[str, ...]:
        """Return the names of the targets that the camera really sees at an instant [s]."""


class SystemParams(BaseModel, extra="forbid", frozen=True, allow_inf_nan=False):
    """Base of the parameters that stand under `system:` in a scenario."""

    kind: str

    def told(self, site: Site) -> tuple[str, ...]:
        """Return what decides a run's result besides the kinds of its parts, each in a few words."""
        return ()


P = TypeVar("P", bound=SystemParams)


def _one_period(params: SystemParams, rate_hz: float) -> Seconds:
    return 1.0 / rate_hz


def _no_sensors(params: SystemParams, site: Site, world: "World") -> Mapping[NodeId, Sensor]:
    return {}


def _always(params: SystemParams) -> bool:
    return True


@dataclass(frozen=True)
class System(Generic[P]):
    """A tracking system as the simulator sees it."""

    name: str
    citation: str
    params: type[P]
    payloads: tuple[type[Payload], ...]
    program: Callable[[P, Site, NodeId, Role], Program]
    settle_s: Callable[[P, float], Seconds] = _one_period
    """How long after a frame its estimate may still come [s], from the parameters and the frame rate [Hz];
    of a system without cameras how long a run goes on when everything has been said."""
    needs_cameras: bool = True
    """Whether it is of no use without cameras and targets."""
    sensors: "Callable[[P, Site, World], Mapping[NodeId, Sensor]]" = _no_sensors
    """Makes the measurement-level sensors of the cameras' motes; none: the programs look at pixels alone."""
    needs_pixels: Callable[[P], bool] = _always
    """Whether programs look at images; where they do not, what a camera sees of a target is not counted in
    pixels."""
