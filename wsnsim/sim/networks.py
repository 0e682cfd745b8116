"""The network of a run from its section of a scenario."""

from collections.abc import Callable, Mapping
from math import dist

import simpy

from wsnsim.errors import ScenarioError
from wsnsim.hardware.profiles import RADIOS
from wsnsim.net.budget import BudgetConfig
from wsnsim.net.channel.links import Links, LinksError
from wsnsim.net.config import Draw, RouteConfig
from wsnsim.net.ideal import IdealNetwork
from wsnsim.net.interface import Network, NetworkObserver
from wsnsim.net.mac.tdma_family import TdmaFamily
from wsnsim.net.meshes import RoutingConfig
from wsnsim.net.radio import RadioNetwork, Stack
from wsnsim.net.routing.config import DisseminationConfig, RepairConfig
from wsnsim.net.routing.linkquality import weakest_usable_dbm
from wsnsim.net.routing.probing import ProbingConfig
from wsnsim.net.routing.reach import Reach
from wsnsim.net.routing.search import tree_over
from wsnsim.net.routing.tree import RoutingError, Tree, tree_from_parents
from wsnsim.rng import RandomStreams
from wsnsim.scenario.faults import Fault, shown
from wsnsim.scenario.load import LoadedScenario
from wsnsim.scenario.nodes import placed_nodes
from wsnsim.scenario.routes import PARENTS, route_faults
from wsnsim.scenario.schema import Scenario
from wsnsim.scenario.schema_mac import Lpl, Mac
from wsnsim.scenario.schema_network import NetworkParams
from wsnsim.scenario.schema_propagation import LinkTable, RecordedLinks
from wsnsim.scenario.schema_routing import EtxTree, GivenTree, MinEnergyTree, MinHopTree, Repair
from wsnsim.sim.channels import good_links, run_channel, run_links
from wsnsim.sim.macs import link_config, mac_family, radio_config
from wsnsim.sim.power import NodePower
from wsnsim.sim.propagations import Positions, by_seed
from wsnsim.types import NodeId

_SOMETHING = 0.01
"""Share of the longest frames that a link of a tree by hand must carry in both directions."""
_WAKES_A_BEACON = 20
"""Wake intervals between a node's beacons at least: each holds the channel for one of them."""
_USUAL: float = MinHopTree.model_fields["link_success_min"].default
"""What counts as a good link where the routing does not say."""


def build_tree(loaded: LoadedScenario, positions: Positions) -> Tree:
    """Return the routing tree; over an ideal network too, so that a comparison has the same hops.

    Raises
    ------
    ScenarioError : nodes that cannot reach the base station, a tree by hand that is none, or guards of a
        TDMA that are too short on this tree
    """
    tree = _found_tree(loaded, positions)
    _check_slots(loaded, tree, positions)
    return tree


def _check_slots(loaded: LoadedScenario, tree: Tree, positions: Positions) -> None:
    """Make sure that a TDMA's guards are enough on the tree."""
    network = loaded.scenario.network
    family = mac_family(network)
    if network.standard == "ideal" or not isinstance(family, TdmaFamily):
        return
    radio = radio_config(network)
    links = _links(loaded, positions)
    try:
        family.on_tree(tree, tuple(positions), links, radio)
    except ValueError as error:
        raise loaded.error(("network", "mac"), str(error)) from error


def _found_tree(loaded: LoadedScenario, positions: Positions) -> Tree:
    """Return a tree over links that work, or the one by hand."""
    scenario = loaded.scenario
    network = scenario.network
    if isinstance(network.routing, GivenTree):
        return _given_tree(loaded, network.routing, positions)
    family, radio = mac_family(network), radio_config(network)
    try:
        routes = route_config(scenario)
    except ValueError as error:
        raise loaded.error(("network", "tx_power_dbm"), str(error)) from error
    links = _links(loaded, positions)
    spare_db = radio.tx_power_dbm - weakest_usable_dbm(family.phy, radio, routes.link_success_min)
    good = good_links(scenario, positions, spare_db, routes.link_success_min)
    try:
        return tree_over(links, positions, scenario.motes.base.id, family, radio, routes, good)
    except RoutingError as error:
        why = str(error)
        if isinstance(network.propagation, LinkTable | RecordedLinks):
            why += "\nlinks are those of the file, wherever nodes stand: leave nodes out, ask less of a link "
            why += "(routing.link_success_min), or name another base"
        if by_seed(network):
            why += "\nshadowing makes links better or worse than their distance, "
            why += f"by the run's seed; this seed is {scenario.seed}"
        raise loaded.error(("network",), why) from error


def _given_tree(loaded: LoadedScenario, routing: GivenTree, positions: Positions) -> Tree:
    """Return a tree by hand over links that carry something."""
    scenario = loaded.scenario
    faults = route_faults(scenario, routing)
    if not faults:
        faults = _dead_links(loaded, routing, positions)
    if faults:
        raise ScenarioError([loaded.marks.problem(fault) for fault in faults])
    base, sinks = scenario.motes.base.id, frozenset(sink.id for sink in scenario.motes.sinks)
    parents: dict[NodeId, NodeId | None] = {base: None, **dict.fromkeys(sinks, base), **routing.parents}
    return tree_from_parents({node: parents[node] for node in positions}, sinks)


def _links(loaded: LoadedScenario, positions: Positions) -> Links:
    """Return who arrives where, or say where in the scenario the links are impossible."""
    try:
        return run_links(loaded.scenario, positions, RandomStreams(loaded.scenario.seed))
    except ScenarioError as error:
        raise ScenarioError([loaded.marks.found(problem) for problem in error.problems]) from error
    except (LinksError, ValueError) as error:
        raise loaded.error(("network", "propagation"), str(error)) from error


def _dead_links(loaded: LoadedScenario, routing: GivenTree, positions: Positions) -> list[Fault]:
    """Find links of a tree by hand over which next to nothing gets through in one of the directions."""
    scenario = loaded.scenario
    radio, links = radio_config(scenario.network), _links(loaded, positions)
    weakest_dbm = weakest_usable_dbm(mac_family(scenario.network).phy, radio, _SOMETHING)
    at = {node: number for number, node in enumerate(positions)}
    faults = []
    for node, parent in routing.parents.items():
        one, other = at[node], at[parent]
        arriving_dbm = min(links.arriving_dbm(one, other), links.arriving_dbm(other, one))
        if arriving_dbm < weakest_dbm:
            message = (
                f"must be a node that hears {shown(node)} and is heard by it, got {shown(parent)}: "
                f"{dist(positions[node], positions[parent]):.1f} m away, {arriving_dbm:.1f} dBm arrive and "
                f"{weakest_dbm:.1f} dBm are needed; choose another, add relays, or raise the transmit power"
            )
            faults.append(Fault((*PARENTS, node), message))
    return faults


def build_network(
    scenario: Scenario,
    env: simpy.Environment,
    positions: Positions,
    tree: Tree,
    streams: RandomStreams,
    observer: NetworkObserver,
    powers: Mapping[NodeId, NodePower],
    budgets: Mapping[NodeId, BudgetConfig],
    budget_reached: Callable[[NodeId], None],
) -> Network:
    """Return the network that carries a run's messages."""
    network = scenario.network
    if network.standard == "ideal":
        return IdealNetwork(env, tree, observer, _by_radio(scenario, positions, streams))
    radio = radio_config(network)
    channel = run_channel(scenario, positions, streams)
    family = mac_family(network)
    if isinstance(family, TdmaFamily):
        family = family.on_tree(tree, tuple(positions), channel.links, radio)
    return RadioNetwork(
        env,
        tuple(positions),
        tree,
        channel,
        Stack(family, radio, link_config(network), routing_config(network)),
        streams,
        observer,
        powers,
        scenario.record.frames,
        budgets,
        budget_reached,
    )


def routing_config(network: NetworkParams) -> RoutingConfig:
    """Return what happens to routes while the network runs."""
    routing = network.routing
    repair = None if routing.repair is None else _repair_config(routing.repair, network.mac)
    probing = None
    if isinstance(routing, EtxTree) and routing.estimate == "probes":
        packet_bytes = routing.frame_bytes - mac_family(network).overhead_bytes
        most_etx = 1.0 / routing.link_success_min
        probing = ProbingConfig(routing.probes, routing.probe_interval_s, max(1, packet_bytes), most_etx)
    return RoutingConfig(repair, probing, DisseminationConfig(**dict(network.dissemination)))


def _repair_config(repair: Repair, mac: Mac) -> RepairConfig:
    """Return how routes are repaired; where a beacon takes a wake interval, they are farther apart."""
    given = {key: value for key, value in dict(repair).items() if value is not None}
    if isinstance(mac, Lpl):
        given.setdefault("beacon_min_s", _WAKES_A_BEACON * mac.wake_interval_s)
    return RepairConfig(**given)


def _by_radio(
    scenario: Scenario, positions: Positions, streams: RandomStreams
) -> Callable[[NodeId], tuple[NodeId, ...]]:
    """Return what names whom a node could speak with by radio; the links are made when somebody asks."""
    names = tuple(positions)
    addresses = {node: at for at, node in enumerate(names)}
    found: list[Reach] = []

    def reach(node: NodeId) -> tuple[NodeId, ...]:
        if not found:
            phy, radio = mac_family(scenario.network).phy, radio_config(scenario.network)
            found.append(Reach(run_links(scenario, positions, streams), phy, radio))
        return tuple(names[at] for at in found[0].of(addresses[node]))

    return reach


def route_config(scenario: Scenario) -> RouteConfig:
    """Return how the routing tree is found."""
    routing = scenario.network.routing
    return RouteConfig(
        link_success_min=_USUAL if isinstance(routing, GivenTree) else routing.link_success_min,
        etx_frame_bytes=routing.frame_bytes if isinstance(routing, EtxTree | MinEnergyTree) else None,
        draws=_draws(scenario) if isinstance(routing, MinEnergyTree) else None,
        sinks=tuple(sink.id for sink in scenario.motes.sinks),
    )


def _draws(scenario: Scenario) -> dict[NodeId, Draw]:
    """Return what all nodes' radios draw from batteries."""
    found = {}
    for node in placed_nodes(scenario):
        radio = RADIOS[node.radio]
        draw = Draw(radio.transmit_w(scenario.network.tx_power_dbm), radio.receive_w)
        found[node.id] = Draw(0.0, 0.0) if node.battery.kind == "mains" else draw
    return found
