"""Puts a simulation together from a scenario: the only place that knows every room."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial

import numpy as np

from wsnsim.errors import Problem, ScenarioError
from wsnsim.hardware.profiles import BATTERIES, IMAGERS, PLATFORMS, RADIOS
from wsnsim.net.channel.places import numbered_by_place
from wsnsim.net.clock import Clock
from wsnsim.net.interface import Network
from wsnsim.records import Outlet
from wsnsim.rng import RandomStreams
from wsnsim.scenario.cameras import focal_length_px, pinhole
from wsnsim.scenario.load import LoadedScenario
from wsnsim.scenario.nodes import PlacedNode, placed_nodes
from wsnsim.scenario.schema import Scenario
from wsnsim.scenario.schema_motes import Capacity
from wsnsim.scenario.schema_world import Target
from wsnsim.sim.agenda import Agenda
from wsnsim.sim.budgets import budget_configs
from wsnsim.sim.collecting import Way, ways
from wsnsim.sim.engine import Schedule, Simulation
from wsnsim.sim.eyes import IMAGER, camera_renderers, mote_cameras, open_background
from wsnsim.sim.mail import MailRoom
from wsnsim.sim.networks import build_network, build_tree
from wsnsim.sim.node import Node
from wsnsim.sim.power import NodePower
from wsnsim.sim.recording import ImageRecorder
from wsnsim.sim.worlds import build_world
from wsnsim.systems.base import Belief, Floor, Program, Role, Send, Site, TrackedTarget
from wsnsim.systems.silent import SilentProgram
from wsnsim.types import NodeId
from wsnsim.units import to_s
from wsnsim.vision.album import View, read_album
from wsnsim.vision.portrait import Studio
from wsnsim.world.bodies import Body
from wsnsim.world.world import World

_PORTRAIT_AREA_PX = 100.0
"""A histogram of 110 bins from fewer pixels is mostly empty."""
_PORTRAIT_PX = 640
"""Longest side of the pictures a reference model is learned from; those of larger cameras are scaled down."""


def build(loaded: LoadedScenario) -> Simulation:
    """Return a simulation of a scenario, ready to run.

    Raises
    ------
    ScenarioError : something cannot be built: a track, a picture, a transmitter's power, the routing tree
    """
    scenario = loaded.scenario
    streams = RandomStreams(scenario.seed)
    placed = placed_nodes(scenario)
    positions = numbered_by_place({node.id: node.position_m for node in placed})
    base = scenario.motes.base.id
    env, outlet = Agenda(), Outlet()
    clock = Clock(env)
    schedule = _schedule(loaded)
    faults = _Faults()
    with faults.gathered():
        tree = build_tree(loaded, positions)
    with faults.gathered():
        world = build_world(loaded, streams) if scenario.world is not None else _open_space(positions)
    albums: dict[str, tuple[View, ...]] = {}
    for target in () if scenario.world is None else scenario.world.targets:
        with faults.gathered():
            albums[target.id] = _album(target)
    backgrounds = {}
    for number, camera in enumerate(scenario.cameras):
        with faults.gathered():
            backgrounds[camera.id] = open_background(loaded, number, schedule.steps)
    powers = {}
    for node in placed:
        with faults.gathered():
            powers[node.id] = _power(clock, node, loaded)
    with faults.gathered():
        budgets = budget_configs(loaded)
    faults.raise_all()

    cameras = {camera.id: pinhole(camera) for camera in scenario.cameras}
    targets = _tracked_targets(scenario, world, albums, streams) if cameras else ()
    ends = (base, *(sink.id for sink in scenario.motes.sinks))
    motes = {node.id: number for number, node in enumerate(node for node in placed if node.id not in ends)}
    renderers = camera_renderers(scenario, cameras, backgrounds, world, streams)
    site = Site(
        cameras=cameras,
        targets=targets,
        rate_hz=schedule.rate_hz,
        steps=schedule.steps,
        streams=streams,
        motes=motes,
        duration_s=scenario.duration_s,
        floor=_floor(world),
        empty_views={name: partial(renderer.render, 0, (), ()) for name, renderer in renderers.items()},
    )

    recorder = ImageRecorder(scenario.record, outlet)
    nodes: dict[NodeId, Node] = {}
    upward: dict[NodeId, Way] = {}
    mail = MailRoom(
        clock,
        outlet,
        loaded.system.payloads,
        base,
        tuple(motes),
        lambda receiver, message: nodes[receiver].take_message(message),
        lambda receiver, number, letter: upward[receiver].arrived(number, letter),
        lambda node, key: nodes[node].take_key(key),
    )
    network = build_network(
        scenario,
        env,
        positions,
        tree,
        streams,
        mail,
        powers,
        budgets,
        lambda node: nodes[node].tell("budget_reached", "the bandwidth budget held a frame up"),
    )
    programs = {}
    for node in placed:
        role = Role(node.role)
        with _placed_problems(loaded):
            program = _program(loaded, site, node.id, role)
        programs[node.id] = program
        nodes[node.id] = Node(
            clock,
            node.id,
            role,
            program,
            PLATFORMS[node.platform],
            powers[node.id],
            outlet,
            _sender(mail, network, upward, node.id),
            _stopper(network, upward),
            lambda name: upward[name].settled(),
            network.allowance_bytes,
            network.neighbours,
        )
    with _placed_problems(loaded):
        sensors = loaded.system.sensors(loaded.system_params, site, world)
    upward |= ways(clock, tree, network, mail, nodes, programs, lambda epoch: to_s(schedule.at_ns(epoch)))
    return Simulation(
        env=env,
        clock=clock,
        world=world,
        schedule=schedule,
        nodes=nodes,
        positions=positions,
        cameras=mote_cameras(clock, scenario, nodes, renderers, world, recorder, sensors),
        counts_pixels=loaded.system.needs_pixels(loaded.system_params),
        network=network,
        tree=tree,
        mail=mail,
        outlet=outlet,
        site=site,
    )


def _program(loaded: LoadedScenario, site: Site, node: NodeId, role: Role) -> Program:
    """Return what runs on a node; a sink only passes on what it gets."""
    if role is Role.SINK:
        return SilentProgram()
    return loaded.system.program(loaded.system_params, site, node, role)


def _schedule(loaded: LoadedScenario) -> Schedule:
    scenario, settle_s = loaded.scenario, loaded.system.settle_s
    if scenario.cameras:
        rate_hz = scenario.cameras[0].rate_hz
        return Schedule(rate_hz, scenario.steps, settle_s(loaded.system_params, rate_hz))
    return Schedule.without_cameras(scenario.duration_s, settle_s(loaded.system_params, 0.0))


def _open_space(positions: Mapping[NodeId, tuple[float, float, float]]) -> World:
    """Return a world with nothing in it, as large as the nodes need."""
    size_m = np.max(list(positions.values()), axis=0).clip(min=0.0)
    return World(size_m=size_m, targets=(), light=np.array([0.0, 0.0, 1.0]), ambient=1.0)


def _floor(world: World) -> Floor:
    """Return what the plans of a room show."""
    widths = [float(person.body.semi_axes_m[:2].max()) for person in world.people]
    return Floor(world.size_m, world.scenery, len(widths), max(widths, default=0.0))


@contextmanager
def _placed_problems(loaded: LoadedScenario) -> Iterator[None]:
    """Tell the place in the file of what a system finds wrong with its own keys."""
    try:
        yield
    except ScenarioError as error:
        raise ScenarioError([loaded.marks.found(problem) for problem in error.problems]) from error


def _album(target: Target) -> tuple[View, ...]:
    """Return the pictures that the user took of a target."""
    if target.learn_from is None:
        return ()
    return read_album(target.learn_from, np.array(target.shape.semi_axes_m))


def _tracked_targets(
    scenario: Scenario, world: World, albums: Mapping[str, tuple[View, ...]], streams: RandomStreams
) -> tuple[TrackedTarget, ...]:
    """Tell the system where targets start, and let it take pictures as the cameras will.

    Of cameras that differ, the one of middling focal length lends its lens and
    sensor to the portraits, whatever its place in the list.
    """
    typical = sorted(scenario.cameras, key=focal_length_px)[(len(scenario.cameras) - 1) // 2]
    shrink = min(1.0, _PORTRAIT_PX / max(typical.resolution_px))
    width, height = (round(shrink * side) for side in typical.resolution_px)
    noise_sd = float(np.median([camera.noise_sd for camera in scenario.cameras]))
    tracked = []
    for target, pose in zip(world.targets, world.at(0.0), strict=True):
        distances = [float(np.linalg.norm(pose.position - camera.position_m)) for camera in scenario.cameras]
        studio = Studio(
            body=target.body,
            orientation=pose.orientation,
            light=world.light,
            ambient=world.ambient,
            focal_px=shrink * focal_length_px(typical),
            resolution_px=(width, height),
            distance_m=_portrait_distance_m(target.body, distances, shrink * focal_length_px(typical)),
            noise_sd=noise_sd,
            streams=streams,
            name=target.id,
        )
        start = Belief(pose.position, pose.velocity, pose.orientation)
        tracked.append(
            TrackedTarget(target.id, target.body.semi_axes_m, start, studio.portrait, albums[target.id])
        )
    return tuple(tracked)


def _portrait_distance_m(body: Body, distances_m: list[float], focal_px: float) -> float:
    """Return the middling distance of the cameras, or less where the target would be too small there."""
    radius_m = float(np.cbrt(np.prod(body.semi_axes_m)))
    farthest_m = focal_px * radius_m / float(np.sqrt(_PORTRAIT_AREA_PX / np.pi))
    nearest_m = 3.0 * float(body.semi_axes_m.max())
    return max(min(float(np.median(distances_m)), farthest_m), nearest_m)


def _power(clock: Clock, node: PlacedNode, loaded: LoadedScenario) -> NodePower:
    tx_power_dbm = loaded.scenario.network.tx_power_dbm
    battery = node.battery
    capacity = battery.capacity_j if isinstance(battery, Capacity) else BATTERIES[battery.kind].capacity_j
    imager = None if node.camera is None else IMAGERS[IMAGER]
    try:
        return NodePower(clock, capacity, PLATFORMS[node.platform], RADIOS[node.radio], tx_power_dbm, imager)
    except ValueError as error:
        raise loaded.error(("network", "tx_power_dbm"), str(error)) from error


def _sender(
    mail: MailRoom, network: Network, upward: Mapping[NodeId, Way], node: NodeId
) -> Callable[[Send], None]:
    def send(message: Send) -> None:
        if message.group is None:
            mail.post(network, node, message)
        else:
            upward[node].own(message)

    return send


def _stopper(network: Network, upward: Mapping[NodeId, Way]) -> Callable[[NodeId], None]:
    def stop(node: NodeId) -> None:
        network.stop_node(node)
        upward[node].stop()

    return stop


class _Faults:
    """Gathers what is wrong with the parts of a scenario, to be told all at once."""

    def __init__(self) -> None:
        self._problems: list[Problem] = []

    @contextmanager
    def gathered(self) -> Iterator[None]:
        """Go on after a part that cannot be built."""
        try:
            yield
        except ScenarioError as error:
            # what every node says alike is said once
            self._problems += [problem for problem in error.problems if problem not in self._problems]

    def raise_all(self) -> None:
        """Raise everything that was gathered."""
        if self._problems:
            raise ScenarioError(self._problems)
