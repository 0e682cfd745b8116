"""The network of a run from its section of a scenario."""

from collections.abc import Mapping, Sequence

import simpy

from wsnsim.net.config import Ieee802154Config
from wsnsim.net.ideal import IdealNetwork
from wsnsim.net.ieee802154 import Ieee802154Network, radio_tree
from wsnsim.net.interface import Network, NetworkObserver
from wsnsim.net.phy import BIT_RATE_BPS
from wsnsim.net.propagation import LogDistance
from wsnsim.net.routing import RoutingError, Tree
from wsnsim.rng import RandomStreams
from wsnsim.scenario.load import LoadedScenario
from wsnsim.scenario.schema import Scenario
from wsnsim.scenario.schema_network import NetworkParams
from wsnsim.sim.power import NodePower, RadioMeter
from wsnsim.types import NodeId

Positions = Mapping[NodeId, Sequence[float]]


def build_tree(loaded: LoadedScenario, positions: Positions) -> Tree:
    """Return the routing tree; over an ideal network too, so that a comparison has the same hops.

    Raises
    ------
    ScenarioError : nodes that cannot reach the base station
    """
    network, base = loaded.scenario.network, loaded.scenario.motes.base.id
    try:
        return radio_tree(positions, base, _propagation(network), _config(network, record_frames=False))
    except RoutingError as error:
        raise loaded.error(("network",), str(error)) from error


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
        _propagation(network),
        _config(network, scenario.record.frames),
        streams,
        observer,
        {node: RadioMeter(power) for node, power in powers.items()},
    )


def _propagation(network: NetworkParams) -> LogDistance:
    loss = network.propagation
    return LogDistance(loss.exponent, loss.reference_loss_db, loss.reference_distance_m)


def _config(network: NetworkParams, record_frames: bool) -> Ieee802154Config:
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
        link_success_min=network.routing.link_success_min,
        record_frames=record_frames,
    )


def channel_bps(network: NetworkParams) -> float | None:
    """Return what the radio channel carries when it is never idle [bit/s]; None for an ideal network."""
    return None if network.standard == "ideal" else BIT_RATE_BPS
