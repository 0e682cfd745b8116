"""The traffic tool as the simulator sees it: a system without cameras."""

from wsnsim.errors import Problem, ScenarioError
from wsnsim.messages.packet import PacketPayload
from wsnsim.systems.base import Program, Role, Site, System
from wsnsim.systems.silent import SilentProgram
from wsnsim.systems.traffic.params import TrafficParams
from wsnsim.systems.traffic.program import SourceProgram
from wsnsim.types import NodeId, Seconds


def _check_sources(params: TrafficParams, site: Site) -> None:
    """Make sure that those who are to send exist.

    Raises
    ------
    ScenarioError : a name that is no mote's, or nobody to send
    """
    if params.sources == "all":
        return
    problems = []
    if not params.sources:
        problems.append(Problem("system.sources", 'must be "all" or the names of motes, got an empty list'))
    for at, name in enumerate(params.sources):
        if name not in site.motes:
            problems.append(Problem(f"system.sources[{at}]", f"must be the name of a mote, got {name!r}"))
        elif name in params.sources[:at]:
            problems.append(Problem(f"system.sources[{at}]", f"must be named once, got {name!r} again"))
    if problems:
        raise ScenarioError(problems)


def make_program(params: TrafficParams, site: Site, node: NodeId, role: Role) -> Program:
    """Return what runs on `node`: a source, or nothing that says anything."""
    if role is Role.BASE:
        _check_sources(params, site)
        return SilentProgram()
    if params.sources != "all" and node not in params.sources:
        return SilentProgram()
    rng = site.streams.stream("traffic.departures", node)
    return SourceProgram(params, site.motes[node], site.duration_s, rng)


def _drain_s(params: TrafficParams, rate_hz: float) -> Seconds:
    return params.drain_s


SYSTEM = System(
    name="traffic",
    citation="Packets of a fixed length, for studies of the network alone.",
    params=TrafficParams,
    payloads=(PacketPayload,),
    program=make_program,
    settle_s=_drain_s,
    needs_cameras=False,
)
