"""The scan-line system as the simulator sees it."""

from collections.abc import Mapping
from difflib import get_close_matches
from functools import lru_cache
from typing import TYPE_CHECKING

from wsnsim.errors import Problem, ScenarioError
from wsnsim.messages.image_part import ImagePartPayload
from wsnsim.messages.scanline import (
    EnergyPayload,
    HandoverPayload,
    HeadPayload,
    PlacesPayload,
    ScanLinePayload,
    TrackPayload,
)
from wsnsim.systems.base import Program, Role, Sensor, Site, System
from wsnsim.systems.scanline.choices import NodeHead
from wsnsim.systems.scanline.params import ScanlineParams
from wsnsim.types import NodeId, Seconds

if TYPE_CHECKING:
    from wsnsim.systems.scanline.stage import Stage
    from wsnsim.world.world import World

_MOST_FRAMES = 128
"""That a head waits for reports: they name their frame by one byte, and so do tracks, which come later."""


@lru_cache(maxsize=1)
def _stage(params: ScanlineParams, site: Site) -> "Stage":
    from wsnsim.systems.scanline.stage import stage_of

    return stage_of(params, site)


def _check_head(params: ScanlineParams, site: Site) -> None:
    """Make sure that the head exists, and that what it hears and says comes while frames can be told apart.

    Raises
    ------
    ScenarioError : a name that is no mote's, or a deadline of too many frames
    """
    head, problems = params.head, []
    if isinstance(head, NodeHead) and head.id not in site.motes:
        near = get_close_matches(head.id, site.motes, n=1)
        hint = f'did you mean "{near[0]}"?' if near else "for the base station write head: {kind: base}"
        problems.append(Problem("system.head.id", f"must be the name of a mote, got {head.id!r}; {hint}"))
    most_s = _MOST_FRAMES / site.rate_hz
    if params.deadline(site.rate_hz) > most_s:
        must = f"must be at most {_MOST_FRAMES} frame periods, {most_s:.4g} s, for frames to be told apart"
        problems.append(Problem("system.deadline_s", f"{must}, got {params.deadline_s} [s]"))
    if problems:
        raise ScenarioError(problems)


def make_program(params: ScanlineParams, site: Site, node: NodeId, role: Role) -> Program:
    """Return what runs on `node`.

    Raises
    ------
    ScenarioError : the deployment is none for this system, or the head is no mote or waits too long
    """
    _check_head(params, site)
    # compiled kernels come in with the tracker: a scenario is checked without them
    from wsnsim.systems.scanline.programs import NodeProgram

    return NodeProgram(params, site, _stage(params, site), node, role)


def _sensors(params: ScanlineParams, site: Site, world: "World") -> Mapping[NodeId, Sensor]:
    from wsnsim.systems.scanline.sensor import make_sensors

    return make_sensors(params, site, world)


def _settle_s(params: ScanlineParams, rate_hz: float) -> Seconds:
    return params.settle_s(rate_hz)


SYSTEM = System(
    name="scanline",
    citation="A. O. Ercan, A. El Gamal, L. J. Guibas: Object Tracking in the Presence of Occlusions via a "
    "Camera Network. IPSN 2007",
    params=ScanlineParams,
    payloads=(
        ScanLinePayload,
        PlacesPayload,
        TrackPayload,
        EnergyPayload,
        HeadPayload,
        HandoverPayload,
        ImagePartPayload,
    ),
    program=make_program,
    settle_s=_settle_s,
    sensors=_sensors,
    needs_pixels=lambda params: params.looks_at_pixels,
)
