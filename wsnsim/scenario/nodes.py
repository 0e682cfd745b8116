"""The nodes that a scenario's cameras, relays and base station make."""

from dataclasses import dataclass

from wsnsim.scenario.schema import Scenario
from wsnsim.scenario.schema_base import Position
from wsnsim.scenario.schema_cameras import Camera
from wsnsim.scenario.schema_motes import Battery, Budget
from wsnsim.systems.base import Role
from wsnsim.types import NodeId


@dataclass(frozen=True)
class PlacedNode:
    """A node with everything that its entry, its camera and the defaults say of it."""

    id: NodeId
    role: Role
    position_m: Position
    platform: str
    radio: str
    battery: Battery
    camera: Camera | None = None
    budget: Budget | None = None


def placed_nodes(scenario: Scenario) -> tuple[PlacedNode, ...]:
    """Return all nodes: motes of cameras, relays, sinks, in the scenario's order, the base station last."""
    motes = scenario.motes
    default = motes.default
    cameras = {camera.id: camera for camera in scenario.cameras}
    entries = {entry.id: entry for entry in motes.nodes}
    unseeing = Role.RELAY if cameras else Role.MOTE
    nodes = []
    for name in cameras | entries:
        camera, entry = cameras.get(name), entries.get(name)
        position = camera.position_m if camera else entry.position_m if entry else None
        if position is None:
            raise ValueError(f"relay {name!r} must have a position_m")
        nodes.append(
            PlacedNode(
                name,
                Role.CAMERA if camera else unseeing,
                position,
                (entry and entry.platform) or default.platform,
                (entry and entry.radio) or default.radio,
                (entry and entry.battery) or default.battery,
                camera,
                (entry and entry.budget) or default.budget,
            )
        )
    for sink in motes.sinks:
        radio = sink.radio or default.radio
        nodes.append(PlacedNode(sink.id, Role.SINK, sink.position_m, sink.platform, radio, sink.battery))
    base = motes.base
    radio = base.radio or default.radio
    nodes.append(PlacedNode(base.id, Role.BASE, base.position_m, base.platform, radio, base.battery))
    return tuple(nodes)
