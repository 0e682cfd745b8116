"""What tells the trackers apart: what a camera sends, and what the base station makes of it.

Everything else is common: who is asked, the Kalman filter, loss and search, orientation.
Each tracker is one short file beside this one.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Protocol, TypeAlias, cast

from wsnsim.estimation.kalman import Gaussian
from wsnsim.hardware.work import Work
from wsnsim.messages.mixture import MixturePayload
from wsnsim.messages.ray import RayPayload
from wsnsim.messages.state import StatePayload
from wsnsim.messages.weights import WeightsPayload
from wsnsim.systems.base import Site
from wsnsim.systems.multiview.eye import Eye
from wsnsim.systems.multiview.params import MultiviewParams
from wsnsim.systems.multiview.proposal import Proposal
from wsnsim.types import FloatArray, NodeId
from wsnsim.vision.frame import Frame

Said: TypeAlias = WeightsPayload | MixturePayload | RayPayload
"""What cameras send of a target whose state they know."""


@dataclass(frozen=True, eq=False)
class Report:
    """What came to the base station, and whose images are in it."""

    cameras: tuple[NodeId, ...]
    said: Said


@dataclass(frozen=True, eq=False)
class Question:
    """What the cameras were asked at a step.

    Parameters
    ----------
    state : as they heard it
    proposal : where the target may be
    predicted : (6,) the filter's belief
    """

    state: StatePayload
    proposal: Proposal
    predicted: Gaussian


@dataclass(frozen=True, eq=False)
class Posterior:
    """Where a target is, after the images of a step.

    Parameters
    ----------
    position : (3,) the estimate [m]
    mean, cov : (3,) [m], (3, 3) [m²] of the density that the estimate is taken from
    prior : (3,) that is in it, once
    unresolved : variance that particles so far apart cannot tell [m²]
    work : what it cost
    """

    position: FloatArray
    mean: FloatArray
    cov: FloatArray
    prior: Gaussian
    unresolved: float
    work: Work


class CameraPart(Protocol):
    """A tracker on a camera mote; may remember what it saw."""

    def answer(self, frame: Frame, state: StatePayload, proposal: Proposal) -> tuple[Said | None, Work]:
        """Return what the camera sends of a target, None where it has nothing to say."""


@dataclass(frozen=True)
class Variant:
    """One of the trackers.

    Parameters
    ----------
    said : the type of what its cameras send
    dimension : of the mixtures they send; 0 where they send none
    camera : makes the camera's part
    posterior : the base station's part, of a step of which at least one report came
    fused_on_the_way : whether relays fuse messages
    """

    said: type[Said]
    camera: Callable[[Eye], CameraPart]
    posterior: Callable[[MultiviewParams, Site, Question, Sequence[Report]], Posterior]
    dimension: int = 0
    fused_on_the_way: bool = False


def variant(name: str) -> Variant:
    """Return the tracker `name`: P, T0, T1, T2, T3 or T4."""
    return cast(Variant, import_module(f"wsnsim.systems.multiview.{name.lower()}").VARIANT)
