"""The multi-view system as the simulator sees it."""

from functools import lru_cache
from typing import TYPE_CHECKING, Literal

from wsnsim.errors import Problem, ScenarioError
from wsnsim.messages.mixture import MixturePayload
from wsnsim.messages.ray import RayPayload
from wsnsim.messages.search import SearchPayload, SightingPayload
from wsnsim.messages.state import StatePayload
from wsnsim.messages.weights import WeightsPayload
from wsnsim.systems.base import Program, Role, Site, System
from wsnsim.systems.multiview.params import MultiviewParams
from wsnsim.systems.silent import SilentProgram
from wsnsim.types import NodeId

if TYPE_CHECKING:
    from wsnsim.systems.multiview.reference_model import ReferenceModel


@lru_cache(maxsize=1)
def _models(site: Site, colour_space: Literal["hsv", "hs"]) -> "tuple[ReferenceModel, ...]":
    from wsnsim.systems.multiview.reference_model import learn
    from wsnsim.vision.features import FeatureSpace

    features = FeatureSpace(colour_space)
    return tuple(learn(target, features) for target in site.targets)


def _check_start(params: MultiviewParams, site: Site) -> None:
    """Make sure that an automatic start can happen at all.

    Raises
    ------
    ScenarioError : more cameras have to agree than there are
    """
    needed, present = params.searching.cameras_min, len(site.cameras)
    if params.start == "automatic" and needed > present:
        message = f"must be at most the number of cameras, {present}, where start is automatic, got {needed}"
        raise ScenarioError([Problem("system.loss.cameras_min", message)])


def make_program(params: MultiviewParams, site: Site, node: NodeId, role: Role) -> Program:
    """Return what runs on `node`; all motes share one reference model, learned before the run."""
    # compiled kernels come in with the trackers: a scenario is checked without them
    from wsnsim.systems.multiview.base import BaseProgram
    from wsnsim.systems.multiview.camera import CameraProgram
    from wsnsim.systems.multiview.relay import RelayingCamera, RelayProgram
    from wsnsim.systems.multiview.variants import variant

    if role is Role.BASE:
        _check_start(params, site)
        return BaseProgram(params, site)
    fused = variant(params.variant).fused_on_the_way
    if role is Role.CAMERA:
        models = _models(site, params.colour_space)
        return (RelayingCamera if fused else CameraProgram)(params, site, node, models)
    return RelayProgram(params, site, node) if fused else SilentProgram()


SYSTEM = System(
    name="multiview",
    citation="M. Kushwaha, X. Koutsoukos: Collaborative 3D Target Tracking in Distributed Smart Camera "
    "Networks for Wide-Area Surveillance. Journal of Sensor and Actuator Networks 2(2), 316-353, 2013",
    params=MultiviewParams,
    payloads=(StatePayload, WeightsPayload, MixturePayload, RayPayload, SearchPayload, SightingPayload),
    program=make_program,
    settle_s=MultiviewParams.deadline,
)
