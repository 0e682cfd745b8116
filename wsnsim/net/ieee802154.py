"""An IEEE 802.15.4 network of fixed nodes on a routing tree, put together.

Datagrams climb the tree to the base station (or to any node), go down it to a
named node, or are disseminated to all nodes below their source. Relays do not
look inside them.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike
from simpy import Environment

from wsnsim.net.clock import Clock
from wsnsim.net.collection import csma_ca_service_ns
from wsnsim.net.config import Ieee802154Config
from wsnsim.net.csma_ca import CsmaCa
from wsnsim.net.flights import Flights
from wsnsim.net.fragmentation import fragment, fragment_count
from wsnsim.net.frames import DATA_OVERHEAD_BYTES, MAX_NODES, MAX_PAYLOAD_BYTES
from wsnsim.net.interface import Datagram, LinkCounters, NetworkObserver, Outcome
from wsnsim.net.link import Directory, Link, fragment_room_bytes
from wsnsim.net.linkquality import expected_transmissions, weakest_usable_dbm
from wsnsim.net.medium import Medium, RadioMeter, Transmission
from wsnsim.net.mesh import MAX_HOPS
from wsnsim.net.propagation import Propagation, range_m, received_dbm
from wsnsim.net.routing import RoutingError, Tree, check_datagram, etx_tree, min_hop_tree
from wsnsim.net.shadowing import mean_of
from wsnsim.records import FrameRow
from wsnsim.rng import RandomStreams
from wsnsim.types import FloatArray, Nanoseconds, NodeId, Seconds
from wsnsim.units import to_s


def radio_tree(
    positions: Mapping[NodeId, ArrayLike],
    base: NodeId,
    propagation: Propagation,
    config: Ieee802154Config,
) -> Tree:
    """Return the tree of fewest hops, or of lowest ETX, over links that are good enough, undisturbed.

    Good enough for fewest hops: `link_success_min` of the longest frames arrive, in
    both directions. For the ETX: so much of the frames and their acknowledgements do.

    Parameters
    ----------
    positions : where the nodes are, (x, y, z) [m]; their order breaks ties
    base : the node all routes lead to
    propagation : path loss between nodes
    config : powers, `link_success_min`, and `etx_frame_bytes` where the ETX is wanted

    Raises
    ------
    RoutingError : nodes that cannot reach the base
    """
    power_dbm = link_powers(positions, propagation, config)
    if config.etx_frame_bytes is not None:
        etx = expected_transmissions(power_dbm, config, config.etx_frame_bytes)
        return etx_tree(positions, base, etx, power_dbm, 1.0 / config.link_success_min)
    weakest_dbm = weakest_usable_dbm(config)
    reach_m = range_m(mean_of(propagation), config.tx_power_dbm - weakest_dbm)
    return min_hop_tree(positions, base, power_dbm, weakest_dbm, reach_m)


def link_powers(
    positions: Mapping[NodeId, ArrayLike], propagation: Propagation, config: Ieee802154Config
) -> FloatArray:
    """Return the power (n, n) of each node at each other [dBm], in the order of `positions`."""
    return received_dbm(propagation, _array(positions), config.tx_power_dbm)


class Ieee802154Network:
    """The network, as `wsnsim.net.interface.Network` asks for it.

    Parameters
    ----------
    env : SimPy environment whose time counts integer nanoseconds
    positions : where the nodes are, (x, y, z) [m]; their order gives short addresses and breaks ties
    routes : the routing tree, or the base station to which a tree shall be found
    propagation : path loss between nodes
    config : all parameters
    streams : the run's random streams; `net.mac` and `net.reception` of each node are used
    observer : hears what became of each datagram
    meters : what keeps account of each node's radio, for the nodes that have one

    Raises
    ------
    RoutingError : a tree over other nodes than these, too many nodes or hops, or nodes that cannot
        reach the base
    """

    def __init__(
        self,
        env: Environment,
        positions: Mapping[NodeId, ArrayLike],
        routes: Tree | NodeId,
        propagation: Propagation,
        config: Ieee802154Config,
        streams: RandomStreams,
        observer: NetworkObserver,
        meters: Mapping[NodeId, RadioMeter],
    ) -> None:
        self.tree = routes if isinstance(routes, Tree) else radio_tree(positions, routes, propagation, config)
        _check(self.tree, positions)
        names = tuple(positions)
        self._clock = Clock(env)
        self._config, self._observer = config, observer
        self._flights = Flights(observer)
        self._stopped: set[NodeId] = set()
        addresses = {node: at for at, node in enumerate(names)}
        directory = Directory(self.tree, names, addresses, self._stopped, self._flights)
        self._directory = directory
        self._power_dbm = link_powers(positions, propagation, config)
        report = self._record if config.record_frames else None
        medium = Medium(self._clock, config, 10.0 ** (self._power_dbm / 10.0), report)
        self._macs: dict[NodeId, CsmaCa] = {}
        self._links: dict[NodeId, Link] = {}
        for address, node in enumerate(names):
            mac = CsmaCa(self._clock, medium, config, address, streams.stream("net.mac", node))
            link = Link(node, self._clock, config, mac, directory)
            meter = meters.get(node)
            enter = _unmetered if meter is None else meter.enter
            mac.connect(medium.add(enter, streams.stream("net.reception", node), mac), link)
            self._macs[node], self._links[node] = mac, link

    def fragments(self, data_bytes: int) -> int:
        """Return the number of radio frames a datagram of that size takes on one hop."""
        return fragment_count(data_bytes, fragment_room_bytes(self._config, self.tree.height))

    def hop_service_s(self, data_bytes: int, node: NodeId) -> Seconds:
        """Return the time in which a datagram of that size goes from a node to its parent, as a rule [s].

        The nodes of the same depth that the node or its parent hears above the CCA threshold
        are taken to send one too.
        """
        room_bytes = fragment_room_bytes(self._config, 1)
        overhead_bytes = DATA_OVERHEAD_BYTES + MAX_PAYLOAD_BYTES - room_bytes
        mpdu_bytes = [overhead_bytes + len(body) for body in fragment(bytes(data_bytes), 0, room_bytes)]
        return to_s(csma_ca_service_ns(mpdu_bytes, self._contenders(node), self._config.min_be))

    def send(self, datagram: Datagram) -> None:
        """Take a datagram at its source.

        Raises
        ------
        RoutingError : an unknown node, several receivers without dissemination, or a receiver of a
            dissemination that is not below its source
        """
        check_datagram(self.tree, datagram)
        flight = self._flights.begin(datagram)
        source = datagram.source
        if source in self._stopped:
            self._flights.lose(flight, datagram.destinations, Outcome.DEAD)
        elif datagram.destinations == (source,):
            self._clock.call(0, lambda: self._flights.deliver(flight, source, datagram.data, 0))
        elif datagram.destinations:
            self._links[source].send(flight)

    def stop_node(self, node: NodeId) -> None:
        """Silence a node for good: its radio is dead, its queue is lost.

        What it was sending is cut off; fragments it had collected are gone. Other nodes learn
        nothing: what they send to it or through it fails for want of an acknowledgement.
        """
        if node not in self._stopped:
            self._stopped.add(node)
            self._links[node].stop()

    def counters(self, node: NodeId) -> LinkCounters:
        """Return what the node's link layer has done so far."""
        return self._macs[node].counters

    def _contenders(self, node: NodeId) -> int:
        """Return how many nodes of one depth share the channel on the way from `node` to its parent."""
        parent = self.tree.parent[node]
        assert parent is not None
        addresses, depth = self._directory.addresses, self.tree.depth
        peers = [addresses[other] for other in depth if other != node and depth[other] == depth[node]]
        loudest_dbm = self._power_dbm[peers][:, [addresses[node], addresses[parent]]].max(axis=1)
        return 1 + int((loudest_dbm >= self._config.cca_threshold_dbm).sum())

    def _record(self, frame: Transmission, receiver: int, sinr_db: float, outcome: str) -> None:
        names = self._directory.names
        self._observer.frame(
            FrameRow(
                time_s=to_s(frame.start_ns),
                sender=names[frame.sender],
                receiver=names[receiver],
                kind=frame.kind,
                bytes=len(frame.mpdu),
                attempt=frame.attempt,
                rssi_dbm=float(self._power_dbm[frame.sender, receiver]),
                sinr_db=sinr_db,
                outcome=outcome,
            )
        )


def _array(positions: Mapping[NodeId, ArrayLike]) -> FloatArray:
    return np.array(list(positions.values()), dtype=np.float64).reshape(-1, 3)


def _unmetered(now_ns: Nanoseconds, cause: str) -> None:
    """Keep no account of a radio."""


def _check(tree: Tree, positions: Mapping[NodeId, ArrayLike]) -> None:
    if set(tree.parent) != set(positions):
        odd = sorted(set(tree.parent) ^ set(positions))
        raise RoutingError(f"tree: must hold the nodes that have a position and no others, differs in {odd}")
    if len(positions) > MAX_NODES:
        raise RoutingError(f"nodes: short addresses are enough for {MAX_NODES}, got {len(positions)}")
    if 2 * tree.height > MAX_HOPS:
        raise RoutingError(
            f"tree: a way of at most {MAX_HOPS} hops fits the mesh header, got a tree {tree.height} hops high"
        )
