"""The network of a run from its section of a scenario."""

from collections.abc import Mapping
from math import dist

import simpy

from wsnsim.errors import ScenarioError
from wsnsim.net.channel.channel import Channel
from wsnsim.net.channel.links import Links
from wsnsim.net.channel.shadowing import Shadowed
from wsnsim.net.config import RouteConfig
from wsnsim.net.ideal import IdealNetwork
from wsnsim.net.interface import Network, NetworkObserver
from wsnsim.net.radio import RadioNetwork, Stack
from wsnsim.net.routing.linkquality import weakest_usable_dbm
from wsnsim.net.routing.search import link_powers, radio_tree
from wsnsim.net.routing.tree import RoutingError, Tree, tree_from_parents
from wsnsim.rng import RandomStreams
from wsnsim.scenario.faults import Fault, shown
from wsnsim.scenario.load import LoadedScenario
from wsnsim.scenario.routes import PARENTS, route_faults
from wsnsim.scenario.schema import Scenario
from wsnsim.scenario.schema_network import NetworkParams
from wsnsim.scenario.schema_routing import EtxTree, GivenTree, MinHopTree
from wsnsim.sim.macs import link_config, mac_family, radio_config
from wsnsim.sim.power import NodePower, RadioMeter
from wsnsim.sim.propagations import Positions, node_propagation
from wsnsim.types import NodeId

_SOMETHING = 0.01
"""Share of the longest frames that a link of a tree by hand must carry in both directions."""
_USUAL: float = MinHopTree.model_fields["link_success_min"].default
"""What counts as a good link where the routing does not say."""


def build_tree(loaded: LoadedScenario, positions: Positions) -> Tree:
    """Return the routing tree; over an ideal network too, so that a comparison has the same hops.

    Raises
    ------
    ScenarioError : nodes that cannot reach the base station, or a tree by hand that is none
    """
    scenario = loaded.scenario
    network = scenario.network
    if isinstance(network.routing, GivenTree):
        return _given_tree(loaded, network.routing, positions)
    propagation = node_propagation(network, positions, RandomStreams(scenario.seed))
    try:
        return radio_tree(
            positions,
            scenario.motes.base.id,
            propagation,
            mac_family(network),
            radio_config(network),
            route_config(network),
        )
    except RoutingError as error:
        why = str(error)
        if isinstance(propagation, Shadowed):
            why += "\nshadowing makes links better or worse than their distance, "
            why += f"by the run's seed; this seed is {scenario.seed}"
        raise loaded.error(("network",), why) from error


def _given_tree(loaded: LoadedScenario, routing: GivenTree, positions: Positions) -> Tree:
    """Return a tree by hand over links that carry something."""
    scenario = loaded.scenario
    faults = route_faults(scenario, routing)
    if not faults:
        faults = _dead_links(scenario, routing, positions)
    if faults:
        raise ScenarioError([loaded.marks.problem(fault) for fault in faults])
    base = scenario.motes.base.id
    return tree_from_parents({node: None if node == base else routing.parents[node] for node in positions})


def _dead_links(scenario: Scenario, routing: GivenTree, positions: Positions) -> list[Fault]:
    """Find links of a tree by hand over which next to nothing gets through in one of the directions."""
    radio = radio_config(scenario.network)
    propagation = node_propagation(scenario.network, positions, RandomStreams(scenario.seed))
    power_dbm = link_powers(positions, propagation, radio)
    weakest_dbm = weakest_usable_dbm(mac_family(scenario.network).phy, radio, _SOMETHING)
    at = {node: number for number, node in enumerate(positions)}
    faults = []
    for node, parent in routing.parents.items():
        one, other = at[node], at[parent]
        arriving_dbm = min(power_dbm[one, other], power_dbm[other, one])
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
) -> Network:
    """Return the network that carries a run's messages."""
    network = scenario.network
    if network.standard == "ideal":
        return IdealNetwork(env, tree, observer)
    radio = radio_config(network)
    propagation = node_propagation(network, positions, streams)
    return RadioNetwork(
        env,
        tuple(positions),
        tree,
        Channel(Links.from_matrix(link_powers(positions, propagation, radio))),
        Stack(mac_family(network), radio, link_config(network)),
        streams,
        observer,
        {node: RadioMeter(power) for node, power in powers.items()},
        scenario.record.frames,
    )


def route_config(network: NetworkParams) -> RouteConfig:
    """Return how the routing tree is found."""
    routing = network.routing
    return RouteConfig(
        link_success_min=_USUAL if isinstance(routing, GivenTree) else routing.link_success_min,
        etx_frame_bytes=routing.frame_bytes if isinstance(routing, EtxTree) else None,
    )
