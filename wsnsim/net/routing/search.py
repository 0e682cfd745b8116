"""Trees to the base station that links suggest: of fewest hops, or of fewest transmissions.

References
----------
De Couto, Aguayo, Bicket, Morris, A High-Throughput Path Metric for Multi-Hop Wireless Routing (MobiCom 2003),
sec. 3: ETX.
"""

from collections.abc import Mapping
from heapq import heappop, heappush

import numpy as np
from numpy.typing import ArrayLike

from wsnsim.net.channel.links import MARGIN_DB, Links, floor_of, links_between
from wsnsim.net.channel.propagation import Propagation, mean_of
from wsnsim.net.config import RadioConfig, RouteConfig
from wsnsim.net.mac.base import MacFamily
from wsnsim.net.routing.energy import frame_energies_j
from wsnsim.net.routing.linkquality import (
    expected_transmissions,
    weakest_heard_dbm,
    weakest_usable_dbm,
)
from wsnsim.net.routing.tree import RoutingError, Tree, tree_from_parents
from wsnsim.types import BoolArray, FloatArray, IntArray, NodeId

_ETX_UNITS = 1e9
"""Parts in which a transmission is counted, so that ways are equal or not whatever the order of adding."""
_JOULE_UNITS = 1e12
"""Parts in which a joule is counted."""
_NO_WAY = np.iinfo(np.int64).max
"""Length of a way where there is none."""
_SHOWN_NODES = 20
"""Nodes without a way that an error names."""


def radio_tree(
    positions: Mapping[NodeId, ArrayLike],
    base: NodeId,
    propagation: Propagation,
    family: MacFamily,
    radio: RadioConfig,
    routes: RouteConfig,
) -> Tree:
    """Return the tree of fewest hops, or of lowest ETX, over links that are good enough, undisturbed.

    Parameters
    ----------
    positions : where the nodes are, (x, y, z) [m]; their order breaks ties
    base : the node all routes lead to
    propagation : path loss between nodes
    family, radio, routes : as for `tree_over`

    Raises
    ------
    RoutingError : nodes that cannot reach the base
    """
    links = radio_links(positions, propagation, radio)
    weakest_dbm = weakest_usable_dbm(family.phy, radio, routes.link_success_min)
    reach_m = mean_of(propagation).reach_m(_places(positions), radio.tx_power_dbm - weakest_dbm)
    return tree_over(links, positions, base, family, radio, routes, f"of up to {reach_m:.1f} m")


def tree_over(
    links: Links,
    positions: Mapping[NodeId, ArrayLike],
    base: NodeId,
    family: MacFamily,
    radio: RadioConfig,
    routes: RouteConfig,
    good: str,
) -> Tree:
    """Return the tree of fewest hops, or of lowest ETX, over links that are good enough, undisturbed.

    Good enough for fewest hops: `link_success_min` of the longest frames arrive, in
    both directions. For the ETX: so much of the frames and their acknowledgements do.

    Parameters
    ----------
    links : who arrives where
    positions : where the nodes are, (x, y, z) [m], in the order of the links, which breaks ties
    base : the node all routes lead to
    family : the physical layer and the length of an acknowledgement
    radio : powers and thresholds
    routes : what a link must carry, and `etx_frame_bytes` where the ETX is wanted
    good : what links for fewest hops are like, for the error message

    Raises
    ------
    RoutingError : nodes that cannot reach the base
    """
    if routes.etx_frame_bytes is not None:
        if routes.etx_frame_bytes > family.phy.max_mpdu_bytes:
            longest = family.phy.max_mpdu_bytes
            raise ValueError(f"etx_frame_bytes: must be 1 to {longest}, got {routes.etx_frame_bytes}")
        links = links.above(weakest_heard_dbm(radio))
        etx = expected_transmissions(links, family.phy, radio, routes.etx_frame_bytes, family.ack_bytes)
        most_etx = 1.0 / routes.link_success_min
        if routes.draws is not None:
            names, frame_bytes = list(positions), routes.etx_frame_bytes
            joules = frame_energies_j(links, routes.draws, names, family, radio, frame_bytes)
            return energy_tree(positions, base, links, etx, joules, most_etx, routes.sinks)
        return etx_tree(positions, base, links, etx, most_etx, routes.sinks)
    weakest_dbm = weakest_usable_dbm(family.phy, radio, routes.link_success_min)
    usable = links.above(weakest_dbm)
    least = routes.link_success_min
    return min_hop_tree(positions, base, usable, weakest_dbm, good, least, routes.sinks)


def radio_links(
    positions: Mapping[NodeId, ArrayLike],
    propagation: Propagation,
    radio: RadioConfig,
    margin_db: float = MARGIN_DB,
) -> Links:
    """Return who arrives where, in the order of `positions`.

    In a large network links are left out that arrive farther below the noise than a margin [dB].
    """
    floor_dbm = floor_of(len(positions), radio.noise_dbm, margin_db)
    return links_between(_places(positions), propagation, radio.tx_power_dbm, floor_dbm)


def _places(positions: Mapping[NodeId, ArrayLike]) -> FloatArray:
    return np.array(list(positions.values()), dtype=np.float64).reshape(-1, 3)


def min_hop_tree(
    positions: Mapping[NodeId, ArrayLike],
    base: NodeId,
    links: Links,
    weakest_dbm: float,
    good: str,
    delivery_min: float = 0.0,
    sinks: tuple[NodeId, ...] = (),
) -> Tree:
    """Find the tree of fewest hops over links that are good in both directions.

    Among parents of equal depth the one with the stronger link wins (the weaker
    of its two directions counts), then the one that stands first.

    Parameters
    ----------
    positions : where the nodes are, (x, y, z) [m]; their order breaks ties
    base : the node all routes lead to
    links : who arrives where, nodes in the order of `positions`
    weakest_dbm : power below which a link is not used [dBm]
    good : what such links are like, for the error message
    delivery_min : share of frames that a link that loses some by itself must deliver [-]
    sinks : nodes beside the base at which ways may end, wired to it

    Raises
    ------
    RoutingError : the base is not a node, or nodes cannot reach it
    """
    usable = links.strength_dbm >= weakest_dbm
    if links.delivery is not None:
        delivers = links.delivery >= delivery_min
        usable &= delivers & delivers[links.reverse]
    return _cheapest_tree(positions, base, links, usable, usable.astype(np.int64), good, sinks)


def etx_tree(
    positions: Mapping[NodeId, ArrayLike],
    base: NodeId,
    links: Links,
    etx: FloatArray,
    most_etx: float,
    sinks: tuple[NodeId, ...] = (),
) -> Tree:
    """Find the tree on whose ways to the base a frame is sent least often.

    The cost of a way is the sum of its links' ETX. Of ways that cost the same (to
    1e-9 transmissions) the one with fewer hops wins, then the stronger link (the
    weaker of its two directions counts), then the parent that stands first.

    Parameters
    ----------
    positions : where the nodes are, (x, y, z) [m]; their order breaks ties
    base : the node all routes lead to
    links : who arrives where, nodes in the order of `positions`
    etx : (m,) - expected transmissions of a frame over each link until its acknowledgement is heard,
        infinite where none is [-]
    most_etx : ETX above which a link is not used [-]
    sinks : nodes beside the base at which ways may end, wired to it

    Raises
    ------
    RoutingError : the base is not a node, or nodes cannot reach it

    References
    ----------
    De Couto et al. (2003), sec. 3.
    """
    usable = etx <= most_etx
    # whole numbers, so that sums do not depend on their order
    costs = np.where(usable, np.round(np.where(usable, etx, 1.0) * _ETX_UNITS), 0.0).astype(np.int64)
    return _cheapest_tree(
        positions, base, links, usable, costs, f"with an ETX of at most {most_etx:g}", sinks
    )


def energy_tree(
    positions: Mapping[NodeId, ArrayLike],
    base: NodeId,
    links: Links,
    etx: FloatArray,
    joules: FloatArray,
    most_etx: float,
    sinks: tuple[NodeId, ...] = (),
) -> Tree:
    """Find the tree on whose ways to the base a frame costs the least energy.

    Ties (to 1e-12 J) are broken as in `etx_tree`.

    Parameters
    ----------
    positions, base, links, etx, most_etx, sinks : as for `etx_tree`
    joules : (m,) - what a frame over each link costs until it is acknowledged [J]

    Raises
    ------
    RoutingError : the base is not a node, or nodes cannot reach it
    """
    usable = etx <= most_etx
    costs = np.round(np.where(usable, joules, 0.0) * _JOULE_UNITS).astype(np.int64)
    return _cheapest_tree(
        positions, base, links, usable, costs, f"with an ETX of at most {most_etx:g}", sinks
    )


def _cheapest_tree(
    positions: Mapping[NodeId, ArrayLike],
    base: NodeId,
    links: Links,
    usable: BoolArray,
    costs: IntArray,
    good: str,
    sinks: tuple[NodeId, ...] = (),
) -> Tree:
    """Find the tree of cheapest ways to the base, or to one of the sinks.

    Parameters
    ----------
    positions, base : as above
    links : who arrives where
    usable : (m,) - whether a link may be used
    costs : (m,) - of each link that may be used
    good : what links must be like, for the error message
    sinks : nodes beside the base at which ways may end, wired to it
    """
    nodes = list(positions)
    if base not in positions:
        raise RoutingError(f"base: must be one of the nodes {nodes}, got {base!r}")
    # one number for cost, then hops: no way has as many hops as there are nodes
    steps = costs * len(nodes) + 1
    lengths = _lengths(links, np.flatnonzero(usable), steps, [nodes.index(end) for end in (base, *sinks)])
    if (lengths == _NO_WAY).any():
        raise RoutingError(_unreached(positions, base, lengths < _NO_WAY, good))
    senders, receivers = links.senders, links.receivers
    best = np.flatnonzero(usable & (lengths[receivers] + steps == lengths[senders]))
    # of each sender's the strongest, then the first
    best = best[np.lexsort((receivers[best], -links.strength_dbm[best], senders[best]))]
    parents: dict[NodeId, NodeId | None] = dict.fromkeys(nodes)
    for sender, first in zip(*np.unique(senders[best], return_index=True), strict=True):
        parents[nodes[sender]] = nodes[receivers[best[first]]]
    parents |= dict.fromkeys(sinks, base)
    return tree_from_parents(parents, frozenset(sinks))


def _lengths(links: Links, usable: IntArray, steps: IntArray, ends: list[int]) -> IntArray:
    """Return the length (n,) of each node's cheapest way to an end (Dijkstra), `_NO_WAY` where none is.

    Parameters
    ----------
    usable : (k,) - which links may be used
    steps : (m,) - length of each link
    ends : where ways end
    """
    inward = usable[np.argsort(links.receivers[usable], kind="stable")]
    starts = np.searchsorted(links.receivers[inward], np.arange(links.nodes + 1))
    senders, steps = links.senders[inward], steps[inward]
    lengths = np.full(links.nodes, _NO_WAY)
    lengths[ends] = 0
    waiting = [(0, end) for end in ends]
    while waiting:
        length, at = heappop(waiting)
        if length == lengths[at]:
            into = slice(starts[at], starts[at + 1])
            longer, others = length + steps[into], senders[into]
            shorter = longer < lengths[others]
            lengths[others[shorter]] = longer[shorter]
            for way in zip(longer[shorter].tolist(), others[shorter].tolist(), strict=True):
                heappush(waiting, way)
    return lengths


def _unreached(positions: Mapping[NodeId, ArrayLike], base: NodeId, reached: BoolArray, good: str) -> str:
    nodes, places = list(positions), _places(positions)
    inside, lost = np.flatnonzero(reached), np.flatnonzero(~reached)
    lines = [f"routing: every node must reach the base {base!r} over links {good}"]
    for at in lost[:_SHOWN_NODES].tolist():
        apart_m = np.linalg.norm(places[inside] - places[at], axis=1)
        nearest = int(np.argmin(apart_m))
        lines.append(
            f"  node {nodes[at]!r} cannot: the nearest node that does is {nodes[inside[nearest]]!r}, "
            f"{apart_m[nearest]:.1f} m away"
        )
    if len(lost) > _SHOWN_NODES:
        lines.append(f"  nor can {len(lost) - _SHOWN_NODES} others")
    lines.append("move these nodes, add relays, or raise the transmit power")
    return "\n".join(lines)
