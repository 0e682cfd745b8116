"""What a base station holds of one target: a track that is followed, or a quest for it."""

from dataclasses import dataclass, field

from wsnsim.estimation.kalman import Gaussian
from wsnsim.messages.search import SightingPayload
from wsnsim.messages.state import StatePayload
from wsnsim.systems.base import TrackEstimate
from wsnsim.systems.multiview.history import History
from wsnsim.systems.multiview.orientation import Attitude
from wsnsim.systems.multiview.proposal import Proposal
from wsnsim.systems.multiview.variants import Report
from wsnsim.types import FloatArray, NodeId, Seconds


@dataclass
class Track:
    """A target that is followed, between two fusions; `reports` fills as cameras answer.

    Parameters
    ----------
    state : belief (6,) at step - 1
    attitude : predicted for `step`
    step : the step that is being measured
    sent, heard_state : the state that the cameras predict from, before and after its encoding
    proposal, asked : the particles they draw, and who takes part
    bad_s : for how long the images have not borne the track out [s]
    history : beliefs that are not smoothed yet
    reports : in the order in which they came; no camera is in two of them
    """

    state: Gaussian
    attitude: Attitude
    step: int
    sent: StatePayload
    heard_state: StatePayload
    proposal: Proposal
    asked: tuple[NodeId, ...]
    bad_s: Seconds
    history: History
    reports: list[Report] = field(default_factory=list)

    @property
    def number(self) -> int:
        """The target's."""
        return self.sent.target

    @property
    def heard(self) -> frozenset[NodeId]:
        """Cameras whose images are in what came."""
        return frozenset(node for report in self.reports for node in report.cameras)


@dataclass
class Quest:
    """A target that is looked for; `sightings` fills as cameras report.

    Parameters
    ----------
    number : the target's
    step : whose sightings are being collected, and those of slower cameras, of some steps before
    asked_at : step at which the cameras were last told to look
    last : where a track ended; None where there was none
    sightings : the last of each camera that has one
    met : step and place (3,) [m] where sightings met before; a second meeting tells the velocity
    """

    number: int
    step: int
    asked_at: int
    last: TrackEstimate | None
    sightings: dict[NodeId, SightingPayload] = field(default_factory=dict)
    met: tuple[int, FloatArray] | None = None
