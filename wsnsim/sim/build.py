"""Puts a simulation together from a scenario: the only place that knows every room."""

from collections.abc import Callable

import simpy

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.hardware.profiles import BATTERIES, IMAGERS, PLATFORMS, RADIOS
from wsnsim.net.clock import Clock
from wsnsim.net.interface import Network
from wsnsim.records import Sink
from wsnsim.rng import RandomStreams
from wsnsim.scenario.load import LoadedScenario
from wsnsim.scenario.nodes import PlacedNode, placed_nodes
from wsnsim.scenario.schema import Scenario
from wsnsim.scenario.schema_motes import Capacity
from wsnsim.sim.cameras import MoteCamera
from wsnsim.sim.engine import Schedule, Simulation
from wsnsim.sim.mail import MailRoom
from wsnsim.sim.networks import build_network, build_tree
from wsnsim.sim.node import Node
from wsnsim.sim.power import NodePower
from wsnsim.sim.worlds import build_world
from wsnsim.systems.base import Belief, Role, Send, Site, TrackedTarget
from wsnsim.types import NodeId
from wsnsim.vision.photos import load_background
from wsnsim.vision.portrait import Studio
from wsnsim.vision.renderer import Renderer
from wsnsim.world.world import World

_PORTRAIT_DISTANCE_M = 4.0


def build(loaded: LoadedScenario, sink: Sink) -> Simulation:
    """Return a simulation of a scenario, ready to run.

    Raises
    ------
    ScenarioError : something cannot be built: a track, a picture, a transmitter's power, the routing tree
    """
    scenario = loaded.scenario
    streams = RandomStreams(scenario.seed)
    placed = placed_nodes(scenario)
    positions = {node.id: node.position_m for node in placed}
    base = scenario.motes.base.id
    tree = build_tree(loaded, positions)
    world = build_world(scenario.world, streams)
    rate_hz = scenario.cameras[0].rate_hz
    # a duration that is a whole number of periods keeps its last frame despite rounding
    schedule = Schedule(rate_hz, int(scenario.duration_s * rate_hz * (1 + 1e-12)))
    cameras = {
        camera.id: PinholeCamera.look_at(
            camera.position_m, camera.look_at_m, camera.focal_px, camera.resolution_px
        )
        for camera in scenario.cameras
    }
    targets = _tracked_targets(scenario, world, streams)
    site = Site(cameras, targets, schedule.rate_hz, schedule.steps, streams)

    env = simpy.Environment()
    clock = Clock(env)
    powers = {node.id: _power(clock, node, loaded) for node in placed}
    nodes: dict[NodeId, Node] = {}
    mail = MailRoom(
        clock,
        sink,
        loaded.system.payloads,
        base,
        tuple(node.id for node in placed if node.id != base),
        lambda receiver, message: nodes[receiver].take_message(message),
    )
    network = build_network(scenario, env, positions, tree, streams, mail, powers)
    for node in placed:
        role = Role(node.role)
        nodes[node.id] = Node(
            clock,
            node.id,
            role,
            loaded.system.program(loaded.system_params, site, node.id, role),
            PLATFORMS[node.platform],
            powers[node.id],
            sink,
            _sender(mail, network, node.id),
            network.stop_node,
        )
    return Simulation(
        env=env,
        clock=clock,
        world=world,
        schedule=schedule,
        nodes=nodes,
        positions=positions,
        cameras=_mote_cameras(clock, loaded, nodes, cameras, world, streams),
        network=network,
        tree=tree,
        mail=mail,
        sink=sink,
    )


def _tracked_targets(scenario: Scenario, world: World, streams: RandomStreams) -> tuple[TrackedTarget, ...]:
    """Tell the system where targets start, and let it take pictures as its first camera would."""
    first = scenario.cameras[0]
    tracked = []
    for target, pose in zip(world.targets, world.at(0.0), strict=True):
        studio = Studio(
            target.body,
            pose.orientation,
            world.light,
            world.ambient,
            first.focal_px,
            first.resolution_px,
            _PORTRAIT_DISTANCE_M,
            first.noise_sd,
            streams,
            target.id,
        )
        start = Belief(pose.position, pose.velocity, pose.orientation)
        tracked.append(TrackedTarget(target.id, target.body.semi_axes_m, start, studio.portrait))
    return tuple(tracked)


def _power(clock: Clock, node: PlacedNode, loaded: LoadedScenario) -> NodePower:
    tx_power_dbm = loaded.scenario.network.tx_power_dbm
    battery = node.battery
    capacity = battery.capacity_j if isinstance(battery, Capacity) else BATTERIES[battery.kind].capacity_j
    imager = None if node.camera is None else IMAGERS["cmos"]
    try:
        return NodePower(clock, capacity, PLATFORMS[node.platform], RADIOS[node.radio], tx_power_dbm, imager)
    except ValueError as error:
        raise loaded.error(("network", "tx_power_dbm"), f"{error} (node {node.id})") from error


def _sender(mail: MailRoom, network: Network, node: NodeId) -> Callable[[Send], None]:
    return lambda send: mail.post(network, node, send)


def _mote_cameras(
    clock: Clock,
    loaded: LoadedScenario,
    nodes: dict[NodeId, Node],
    cameras: dict[NodeId, PinholeCamera],
    world: World,
    streams: RandomStreams,
) -> tuple[MoteCamera, ...]:
    result = []
    for number, camera in enumerate(loaded.scenario.cameras):
        try:
            background = load_background(camera.background, camera.resolution_px)
        except ValueError as error:
            raise loaded.error(("cameras", number, "background"), str(error)) from error
        renderer = Renderer(
            cameras[camera.id],
            camera.id,
            background,
            camera.noise_sd,
            camera.gain_jitter,
            world.light,
            world.ambient,
            streams,
        )
        result.append(MoteCamera(clock, nodes[camera.id], renderer, IMAGERS["cmos"], world))
    return tuple(result)
