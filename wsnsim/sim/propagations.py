"""What lies between a run's antennas, from the scenario."""

from collections.abc import Mapping, Sequence

from wsnsim.net.channel.propagation import LogDistance, Propagation
from wsnsim.net.channel.shadowing import Shadowed, shadowing_db
from wsnsim.rng import RandomStreams
from wsnsim.scenario.schema_network import NetworkParams
from wsnsim.types import NodeId

Positions = Mapping[NodeId, Sequence[float]]


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
