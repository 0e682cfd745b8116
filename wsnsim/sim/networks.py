"""The network of a run from its section of a scenario."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import dist

import simpy

from wsnsim.errors import ScenarioError
from wsnsim.net.config import Ieee802154Config
from wsnsim.net.ideal import IdealNetwork
from wsnsim.net.ieee802154 import Ieee802154Network, link_powers, radio_tree
from wsnsim.net.interface import Network, NetworkObserver
from wsnsim.net.linkquality import weakest_usable_dbm
from wsnsim.net.phy import BIT_RATE_BPS
from wsnsim.net.propagation import LogDistance, Propagation
from wsnsim.net.routing import RoutingError, Tree, tree_from_parents
from wsnsim.net.shadowing import Shadowed, shadowing_db
from wsnsim.rng import RandomStreams
from wsnsim.scenario.faults import Fault, shown
from wsnsim.scenario.load import LoadedScenario
from wsnsim.scenario.routes import PARENTS, route_faults
from wsnsim.scenario.schema import Scenario
from wsnsim.scenario.schema_network import EtxTree, GivenTree, MinHopTree, NetworkParams
from wsnsim.sim.power import NodePower, RadioMeter
from wsnsim.types import NodeId

Positions = Mapping[NodeId, Sequence[float]]

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
        return radio_tree(positions, scenario.motes.base.id, propagation, radio_config(network))
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
    config = replace(radio_config(scenario.network), link_success_min=_SOMETHING)
    propagation = node_propagation(scenario.network, positions, RandomStreams(scenario.seed))
    power_dbm = link_powers(positions, propagation, config)
    weakest_dbm = weakest_usable_dbm(config)
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
    return Ieee802154Network(
        env,
        positions,
        tree,
        node_propagation(network, positions, streams),
        radio_config(network, scenario.record.frames),
        streams,
        observer,
        {node: RadioMeter(power) for node, power in powers.items()},
    )


def node_propagation(network: NetworkParams, positions: Positions, streams: RandomStreams) -> Propagation:
    """Return the path loss between a run's nodes, the shadowing of each link included."""
    loss, mean = network.propagation, mean_propagation(network)
    if loss.shadowing_db == 0.0 and loss.asymmetry_db == 0.0:
        return mean
    return Shadowed(mean, shadowing_db(tuple(positions), loss.shadowing_db, loss.asymmetry_db, streams))


def mean_propagation(network: NetworkParams) -> LogDistance:
    """Return the path loss by distance alone, which holds at any place."""
    loss = network.propagation
    return LogDistance(loss.exponent, loss.reference_loss_db, loss.reference_distance_m)


def radio_config(network: NetworkParams, record_frames: bool = False) -> Ieee802154Config:
    """Return radio, MAC and link layer of all nodes."""
    routing = network.routing
    mac = network.mac
    return Ieee802154Config(
        tx_power_dbm=network.tx_power_dbm,
        sensitivity_dbm=network.sensitivity_dbm,
        noise_dbm=network.noise_dbm,
        cca_threshold_dbm=mac.cca_threshold_dbm,
        collision=network.collision,
        min_be=mac.min_be,
        max_be=mac.max_be,
        max_csma_backoffs=mac.max_csma_backoffs,
        max_frame_retries=mac.max_frame_retries,
        max_channel_retries=mac.max_channel_retries,
        mesh_header_bytes=network.mesh_header_bytes,
        queue_frames=mac.queue_frames,
        outbox_datagrams=mac.outbox_datagrams,
        reassembly_timeout_s=network.reassembly_timeout_s,
        link_success_min=_USUAL if isinstance(routing, GivenTree) else routing.link_success_min,
        etx_frame_bytes=routing.frame_bytes if isinstance(routing, EtxTree) else None,
        record_frames=record_frames,
    )


def channel_bps(network: NetworkParams) -> float | None:
    """Return what the radio channel carries when it is never idle [bit/s]; None for an ideal network."""
    return None if network.standard == "ideal" else BIT_RATE_BPS
