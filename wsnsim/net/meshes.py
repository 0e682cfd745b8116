"""Links with routers, for networks whose routes change, that repeat broadcasts, or have several sinks."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

from wsnsim.net.backbone import Backbone
from wsnsim.net.budget import Budget
from wsnsim.net.clock import Clock
from wsnsim.net.config import LinkConfig
from wsnsim.net.mac.base import Mac, MacFamily
from wsnsim.net.manners import Manners
from wsnsim.net.mesh import MAX_HOPS, MAX_SHALLOW_HOPS
from wsnsim.net.meshlink import MeshLink
from wsnsim.net.parcel import Directory
from wsnsim.net.routing.base import Router
from wsnsim.net.routing.config import DisseminationConfig, RepairConfig
from wsnsim.net.routing.fixed import FixedRouter
from wsnsim.net.routing.livetree import LiveTree, Moved
from wsnsim.net.routing.probing import ProbingConfig, ProbingRouter, measured_tree
from wsnsim.net.routing.router import CollectionRouter
from wsnsim.net.routing.tree import Tree
from wsnsim.rng import RandomStreams
from wsnsim.types import NodeId
from wsnsim.units import to_ns

MEASURED = "links were measured"


@dataclass(frozen=True)
class RoutingConfig:
    """What happens to routes while a network runs."""

    repair: RepairConfig | None = None
    """None: the tree stays as it was planned."""
    probing: ProbingConfig | None = None
    """Measures links first; the tree is then the measured one, in place of the planned."""
    spread: DisseminationConfig = field(default_factory=DisseminationConfig)

    @property
    def spreads_everywhere(self) -> bool:
        """Whether what one node spreads goes to all others, and not only down the tree."""
        return self.repair is not None or self.spread.accept == "anyone"

    def changes_nothing(self, tree: Tree) -> bool:
        """Return whether plain links on the planned tree do all that is asked."""
        stays = self.repair is None and self.probing is None
        return stays and self.spread == DisseminationConfig() and not tree.wired

    def __post_init__(self) -> None:
        if self.repair is not None and self.probing is not None:
            raise ValueError("probing: must be left out with repair, whose beacons measure the links")


class Mesh:
    """The links of a network, each with its router.

    Parameters
    ----------
    clock : the event clock
    family, link, routing : what all nodes have alike
    directory : the planned tree, the addresses and the account of datagrams
    streams : the run's random streams; `net.routing` and `net.trickle` of each node are used
    reach : who is in reach of a node over good links, by addresses
    moved : told of each change of the tree
    """

    def __init__(
        self,
        clock: Clock,
        family: MacFamily,
        link: LinkConfig,
        routing: RoutingConfig,
        directory: Directory,
        streams: RandomStreams,
        reach: Callable[[int], tuple[int, ...]],
        moved: Moved,
    ) -> None:
        self._clock, self._family, self._link, self._routing = clock, family, link, routing
        self._directory, self._streams, self._reach = directory, streams, reach
        repair, planned = routing.repair, directory.tree
        overhead_bytes = family.overhead_bytes
        if repair is None:
            hop_limit = min(MAX_HOPS, max(MAX_SHALLOW_HOPS, 2 * planned.height))
            self._manners = Manners(routing.spread, hop_limit, overhead_bytes)
        else:
            hold = repair.no_route == "hold"
            self._manners = Manners(routing.spread, repair.hop_limit, overhead_bytes, repair.tries, hold)
        if routing.probing is not None:
            self._knows = False
            clock.call(to_ns(routing.probing.ready_s), self._measured)
        else:
            self._knows = repair is None or repair.initial == "tree"
        self._live = LiveTree(planned, self._knows, moved)
        self._backbone: Backbone[MeshLink] = Backbone(directory.base, {}, self._reached_at_first())
        self._links: dict[NodeId, MeshLink] = {}

    @property
    def tree(self) -> Tree:
        """Who sends to whom now."""
        return self._live.tree

    @property
    def hop_limit(self) -> int:
        """Hops that a packet may take."""
        return self._manners.hop_limit

    def router(self, node: NodeId) -> Router:
        """Return what knows a node's ways."""
        return self._links[node].router

    def neighbours(self, node: NodeId) -> tuple[NodeId, ...]:
        """Return who is in reach of a node, as far as it knows."""
        return tuple(self._directory.names[at] for at in sorted(self._links[node].router.neighbours()))

    def link(self, node: NodeId, mac: Mac, budget: Budget | None) -> MeshLink:
        """Return the link layer of the next node."""
        link = MeshLink(
            node,
            self._clock,
            self._link,
            self._manners,
            mac,
            self._family.max_payload_bytes,
            self._directory,
            self._backbone,
            self._streams.stream("net.routing", node),
            budget,
        )
        planned, address = self._directory.tree, self._directory.addresses[node]
        if node in planned.sinks:
            self._backbone.links[address] = link
        link.router = self._router(node, address, link)
        link.router.start()
        self._links[node] = link
        return link

    def entrance(self, source: NodeId, destination: NodeId) -> NodeId:
        """Return where a datagram joins the network: what a sink says may begin at another one."""
        addresses = self._directory.addresses
        if addresses[source] not in self._backbone.links:
            return source
        sink = self._backbone.reached.get(addresses[destination], addresses[source])
        return self._directory.names[sink]

    def _router(self, node: NodeId, address: int, link: MeshLink) -> Router:
        directory, repair = self._directory, self._routing.repair
        planned, addresses = directory.tree, directory.addresses
        if repair is None:
            from_anyone = self._routing.spread.accept == "anyone"
            reach = self._reach(address)
            probing = self._routing.probing
            if probing is not None:
                rng = self._streams.stream("net.probes", node)
                empty = self._live.tree
                return ProbingRouter(
                    node, empty, directory.names, addresses, reach, from_anyone,
                    self._clock, probing, rng, link.control,
                )  # fmt: skip
            return FixedRouter(node, planned, directory.names, addresses, reach, from_anyone)
        router = CollectionRouter(
            address,
            node in planned.sinks,
            self._clock,
            repair,
            self._streams.stream("net.trickle", node),
            self._family.max_payload_bytes,
            self._backbone.reached,
            link.control,
            partial(self._moved, node),
            link.opened,
        )
        if self._knows:
            parent = planned.parent[node]
            below = {
                addresses[far]: addresses[child]
                for child in planned.children[node]
                if child not in planned.wired
                for far in (child, *planned.descendants(child))
            }
            up = None if parent is None or node in planned.wired else addresses[parent]
            router.know(up, float(planned.depth[node]), below)
        return router

    def _measured(self) -> None:
        """Give everybody the tree that the probes have found."""
        probing = self._routing.probing
        assert probing is not None
        directory = self._directory
        routers = [link.router for link in self._links.values()]
        heard = [router.heard_probes for router in routers if isinstance(router, ProbingRouter)]
        tree = measured_tree(directory.tree, directory.names, heard, probing)
        for router in routers:
            if isinstance(router, ProbingRouter):
                router.adopt(tree)
        addresses = directory.addresses
        for sink in tree.sinks:
            self._backbone.reached.update(
                {addresses[node]: addresses[sink] for node in tree.descendants(sink)}
            )
        for node, parent in tree.parent.items():
            if parent is not None and node not in tree.wired:
                self._live.move(node, parent, MEASURED)
        for link in self._links.values():
            link.opened()

    def _moved(self, node: NodeId, parent: int | None, why: str) -> None:
        self._live.move(node, None if parent is None else self._directory.names[parent], why)

    def _reached_at_first(self) -> dict[int, int]:
        if not self._knows:
            return {}
        planned, addresses = self._directory.tree, self._directory.addresses
        found: dict[int, int] = {}
        # nodes behind further sinks come last, and stay
        for sink in planned.sinks:
            found |= {addresses[node]: addresses[sink] for node in planned.descendants(sink)}
        return found
