"""The nodes that a scenario's cameras, relays and base station make."""

from dataclasses import dataclass

from wsnsim.scenario.schema import Scenario
from wsnsim.scenario.schema_base import Position
from wsnsim.scenario.schema_cameras import Camera
from wsnsim.scenario.schema_motes import Battery
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


def placed_nodes(scenario: Scenario) -> tuple[PlacedNode, ...]:
    """Return all nodes: motes of cameras, then relays, in the scenario's order, the base station last."""
    motes = scenario.motes
    default = motes.default
    cameras = {camera.id: camera for camera in scenario.cameras}
    entries = {entry.id: entry for entry in motes.nodes}
    nodes = []
    for name in cameras | entries:
        camera, entry = cameras.get(name), entries.get(name)
        position = camera.position_m if camera else entry.position_m if entry else None
        if position is None:
            raise ValueError(f"relay {name!r} must have a position_m")
        nodes.append(
            PlacedNode(
                name,
                Role.CAMERA if camera else Role.RELAY,
                position,
                (entry and entry.platform) or default.platform,
                (entry and entry.radio) or default.radio,
                (entry and entry.battery) or default.battery,
                camera,
            )
        )
    base = motes.base
    radio = base.radio or default.radio
    nodes.append(PlacedNode(base.id, Role.BASE, base.position_m, base.platform, radio, base.battery))
    return tuple(nodes)
