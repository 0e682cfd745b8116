"""What lies between a run's antennas, from the scenario: path loss by distance, and what alters it."""

from collections.abc import Mapping, Sequence

import numpy as np

from wsnsim.net.channel.free_space import FreeSpace, TwoRayGround
from wsnsim.net.channel.obstacles import Crossing, Obstructed
from wsnsim.net.channel.offsets import Offset, node_offsets
from wsnsim.net.channel.propagation import LogDistance, Propagation
from wsnsim.net.channel.shadowing import Shadowed
from wsnsim.rng import RandomStreams
from wsnsim.scenario import schema_propagation
from wsnsim.scenario.schema import Scenario
from wsnsim.scenario.schema_network import NetworkParams
from wsnsim.sim.worlds import scenery_of
from wsnsim.types import FloatArray, NodeId
from wsnsim.world.solids import blocks

Positions = Mapping[NodeId, Sequence[float]]


def node_propagation(scenario: Scenario, positions: Positions, streams: RandomStreams) -> Propagation | None:
    """Return the path loss between a run's nodes: walls, shadowing and unequal hardware included.

    None where the links come from a file.
    """
    loss, propagation = scenario.network.propagation, place_propagation(scenario)
    if propagation is None or isinstance(
        loss, schema_propagation.LinkTable | schema_propagation.RecordedLinks
    ):
        return None
    nodes = tuple(positions)
    if loss.shadowing_db > 0.0 or loss.asymmetry_db > 0.0:
        propagation = Shadowed(propagation, nodes, loss.shadowing_db, loss.asymmetry_db, streams)
    if loss.tx_offset_db > 0.0 or loss.rx_offset_db > 0.0:
        spread = loss.tx_offset_db, loss.rx_offset_db, loss.offset_correlation
        propagation = Offset(propagation, *node_offsets(nodes, *spread, streams))
    return propagation


def by_seed(network: NetworkParams) -> bool:
    """Tell whether the run's seed decides how good links are."""
    loss = network.propagation
    if isinstance(loss, schema_propagation.LinkTable | schema_propagation.RecordedLinks):
        return False
    return max(loss.shadowing_db, loss.asymmetry_db, loss.tx_offset_db, loss.rx_offset_db) > 0.0


def place_propagation(scenario: Scenario) -> Propagation | None:
    """Return the path loss that holds between any two places, walls included; None where there is none."""
    loss = scenario.network.propagation
    propagation: Propagation
    if isinstance(loss, schema_propagation.LogDistance):
        propagation = LogDistance(loss.exponent, loss.reference_loss_db, loss.reference_distance_m)
    elif isinstance(loss, schema_propagation.FreeSpace):
        propagation = FreeSpace(loss.frequency_hz, loss.reference_distance_m)
    elif isinstance(loss, schema_propagation.TwoRay):
        propagation = TwoRayGround(FreeSpace(loss.frequency_hz, loss.reference_distance_m))
    else:
        return None
    return propagation if loss.walls is None else Obstructed(propagation, _walls(scenario, loss.walls))


def _walls(scenario: Scenario, walls: schema_propagation.Walls) -> Crossing:
    """Return what the occluders on straight lines cost: each that is met its own loss, or the usual one."""
    occluders = () if scenario.world is None else scenario.world.occluders
    scenery = () if scenario.world is None else scenery_of(scenario.world, RandomStreams(scenario.seed))
    losses_db = [
        walls.loss_db if occluder.attenuation_db is None else occluder.attenuation_db
        for occluder in occluders
    ]

    def crossing(begins: FloatArray, ends: FloatArray) -> FloatArray:
        total_db = np.zeros(len(begins))
        for placed, loss_db in zip(scenery, losses_db, strict=True):
            total_db += np.where(blocks(placed.body, placed.pose, begins, ends), loss_db, 0.0)
        return total_db

    return crossing
