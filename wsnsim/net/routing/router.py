"""Collection routes of one node that keep up with the network: the Collection Tree Protocol, with repair.

Each node tells its neighbours by beacons what its way to the base station
costs, in expected transmissions (ETX), and takes as its parent the neighbour
by which its own way is cheapest; another one only where that saves
`switch_etx`. A parent that does not acknowledge any more, is not heard any
more, or has lost its own way is left at once.

Loops. A node never takes a parent whose cost is not less than what the node
has last told others of its own, nor one that calls the node its parent; where
no other is left, it first tells that it has no way, so that all who go by it
look for another, and waits for two shortest beacon intervals. What slips
through, because a beacon was not heard, costs its own cure: costs in a circle
rise with every beacon until they exceed `path_etx_max`; and a packet from a
node that thinks itself nearer to the base makes its receiver say soon what it
really costs (datapath validation).

Downwards. A node that has found a parent tells it, and the parent tells its
own as far up as that is news, which nodes are reached by it (joins); packets on
their way up tell the same.

References
----------
Gnawali, Fonseca, Jamieson, Moss, Levis, Collection Tree Protocol (SenSys 2009), sec. 3-4. Fonseca, Gnawali,
Jamieson, Levis, TEP 123. Perkins, Bhagwat, DSDV (SIGCOMM 1994): telling of lost ways at once. RFC 6550,
sec. 9.8 (destination advertisement, storing mode).
"""

from collections.abc import Callable
from math import inf, isfinite

import numpy as np

from wsnsim.net.clock import Clock
from wsnsim.net.interface import Outcome
from wsnsim.net.phy.base import BROADCAST
from wsnsim.net.routing.config import RepairConfig
from wsnsim.net.routing.control import (
    BEACON,
    JOIN,
    Beacon,
    decode_beacon,
    decode_join,
    encode_cost,
    encode_join,
)
from wsnsim.net.routing.neighbours import Neighbour, NeighbourTable
from wsnsim.net.routing.trickle import Trickle
from wsnsim.net.sendqueue import Control
from wsnsim.types import Nanoseconds
from wsnsim.units import to_ns

FOUND, CHEAPER = "a way was found", "another way is cheaper"
UNANSWERED, SILENT = "it does not acknowledge", "it was not heard for long"
WAYLESS, TOO_LONG, CIRCLE = "it has no way", "its way is too long", "its way goes by this node"


class CollectionRouter:
    """Routes of one node.

    Parameters
    ----------
    address : its short address
    sink : whether packets for the base station end here
    clock : the event clock
    config : intervals and thresholds
    rng : draws the instants of beacons
    join_bytes : longest join [B]
    reached : by which sink each node is reached, as all sinks know it
    say : takes frames for the MAC
    moved : told of each new parent, and why
    opened : told when there is a way again
    """

    def __init__(
        self,
        address: int,
        sink: bool,
        clock: Clock,
        config: RepairConfig,
        rng: np.random.Generator,
        join_bytes: int,
        reached: dict[int, int],
        say: Callable[[Control], None],
        moved: Callable[[int | None, str], None],
        opened: Callable[[], None],
    ) -> None:
        self._address, self._sink, self._clock, self._config = address, sink, clock, config
        self._say, self._moved, self._opened = say, moved, opened
        self._reached = reached if sink else {}
        self._join_limit = min(255, (join_bytes - 2) // 2)
        self._lifetime_ns = to_ns(config.lifetime_s)
        self._hold_ns = 2 * to_ns(config.beacon_min_s)
        self.table = NeighbourTable()
        self.parent: int | None = None
        self.cost = 0.0 if sink else inf
        self.below: dict[int, int] = {}
        """By which child each node below is reached."""
        self.loops_seen = 0
        """Packets from nodes that thought themselves nearer to the base station, though they are not."""
        self._told = inf
        """What the node has last said of its cost."""
        self._sequence = 0
        self._beaconing = False
        self._joining: dict[int, None] = {}
        self._join_out: tuple[int, ...] = ()
        self._join_tries = 0
        self._wait_until_ns: Nanoseconds = 0
        self._trickle = Trickle(
            clock, config.beacon_min_s, config.beacon_doublings, config.redundancy, rng, self._talk
        )

    def know(self, parent: int | None, cost: float, below: dict[int, int]) -> None:
        """Begin with a known tree, each of whose links is taken to need one transmission.

        Parameters
        ----------
        parent : None at a sink
        cost : hops to the sink
        below : by which child each node below is reached
        """
        self.parent, self.cost, self._told = parent, cost, cost
        for node, child in below.items():
            self._reach(node, child)
        if parent is not None:
            self._know(parent, cost - 1.0, None)
        for child in dict.fromkeys(below.values()):
            self._know(child, cost + 1.0, self._address)

    def start(self) -> None:
        """Begin to send beacons."""
        self._trickle.start()

    def stop(self) -> None:
        """Be silent for good."""
        self._trickle.stop()

    def next_hop(self, final: int) -> int | None:
        """Return to whom a packet for a node goes next; None without a way."""
        return self.below.get(final, self.parent)

    def takes(self, source: int) -> bool:
        """Return True: whoever a broadcast comes from, it is known again by its number."""
        return True

    @property
    def spreads(self) -> bool:
        """Whether the node spreads what it has taken: always, as it may be the only way for somebody."""
        return True

    def neighbours(self) -> tuple[int, ...]:
        """Return who is in reach over links good enough to be used."""
        since = self._clock.now - self._lifetime_ns
        return tuple(
            entry.address
            for entry in self.table
            if not entry.lost and entry.heard_ns >= since and entry.link_etx <= self._config.link_etx_max
        )

    def heard(self, source: int) -> None:
        """Note that a neighbour is there."""
        entry = self.table.get(source)
        if entry is not None:
            entry.heard_ns = self._clock.now

    def take(self, source: int, packet: bytes) -> None:
        """Take a frame of a neighbour's router.

        Raises
        ------
        DecodeError : no beacon and no join
        """
        if packet[:1] == bytes((BEACON,)):
            self._take_beacon(source, decode_beacon(packet))
        elif packet[:1] == bytes((JOIN,)):
            self._take_join(source, decode_join(packet))

    def carries(self, source: int, origin: int, cost: float) -> None:
        """Note a packet on its way up that a neighbour, who told its cost, has sent here."""
        if origin != self._address:
            self._reach(origin, source)
        if encode_cost(cost) <= encode_cost(self.cost):
            self.loops_seen += isfinite(self.cost)
            self._trickle.reset()
            if source == self.parent:
                self.table.meet(source).parent = self._address
                self._choose()

    def forget(self, node: int) -> None:
        """Take back by whom a node is reached."""
        self.below.pop(node, None)

    def sent(self, hop: int, attempts: int, acknowledged: bool) -> None:
        """Learn what became of a frame to a neighbour: how often it was sent, the last time well or not."""
        entry = self.table.meet(hop)
        entry.sent(attempts, acknowledged, self._clock.now)
        if entry.failed_in_row >= self._config.lost_after:
            entry.give_up(2.0 * self._config.link_etx_max)
            self._leave_below(hop)
        self._choose()

    def _know(self, node: int, cost: float, parent: int | None) -> None:
        entry = self.table.meet(node)
        entry.cost, entry.parent, entry.etx = cost, parent, 1.0

    def _take_beacon(self, source: int, beacon: Beacon) -> None:
        entry = self.table.meet(source)
        news = entry.cost != beacon.cost or entry.parent != beacon.parent
        was_child = entry.parent == self._address
        entry.beacon(beacon.sequence, self._clock.now)
        entry.cost, entry.parent = beacon.cost, beacon.parent
        if beacon.parent == self._address:
            self._reach(source, source)
        elif was_child:
            self._leave_below(source)
        if beacon.pull and isfinite(self.cost):
            self._trickle.reset()
        elif not news:
            self._trickle.consistent()
        self._choose()

    def _take_join(self, source: int, addresses: tuple[int, ...]) -> None:
        entry = self.table.meet(source)
        entry.parent, entry.heard_ns = self._address, self._clock.now
        news = [node for node in addresses if node != self._address and self.below.get(node) != source]
        for node in news:
            self._reach(node, source)
        if news and not self._sink:
            self._join(news)
        if source == self.parent:
            self._choose()

    def _reach(self, node: int, child: int) -> None:
        """Remember by which child a node is reached."""
        self.below[node] = child
        self._reached[node] = self._address

    def _leave_below(self, child: int) -> None:
        """Forget what was reached by a node that is no child any more."""
        self.below = {node: by for node, by in self.below.items() if by != child}

    def _choose(self) -> None:
        """Look for the best parent."""
        if self._sink:
            return
        current = self.table.get(self.parent)
        trouble = self._trouble(current)
        best = self._best()
        if trouble is None and current is not None:
            if best is not None and best.path_etx + self._config.switch_etx < current.path_etx:
                self._take_parent(best, CHEAPER)
            else:
                self.cost = current.path_etx
                if abs(self.cost - self._told) >= self._config.switch_etx:
                    self._trickle.reset()
        elif best is not None or self.parent is not None:
            self._take_parent(best, trouble or FOUND)

    def _trouble(self, current: Neighbour | None) -> str | None:
        """Return why the parent is of no use, None where it is."""
        if current is None:
            return None if self.parent is None else SILENT
        if current.lost:
            return UNANSWERED
        if not isfinite(current.cost):
            return WAYLESS
        if current.parent == self._address:
            return CIRCLE
        return TOO_LONG if current.path_etx > self._config.path_etx_max else None

    def _best(self) -> Neighbour | None:
        """Return the best parent that makes no circle; over a bad link only where there is no other."""
        if self._clock.now < self._wait_until_ns:
            return None
        fit = [
            entry
            for entry in self.table
            if not entry.lost
            and entry.cost < self._told
            and entry.parent != self._address
            and entry.path_etx <= self._config.path_etx_max
        ]
        good = [entry for entry in fit if entry.link_etx <= self._config.link_etx_max]
        return min(good or fit, key=lambda entry: (entry.path_etx, entry.address), default=None)

    def _take_parent(self, new: Neighbour | None, why: str) -> None:
        had_none = self.parent is None
        self.parent = None if new is None else new.address
        self.cost = inf if new is None else new.path_etx
        self._moved(self.parent, why)
        self._trickle.reset()
        if new is not None:
            self._join([self._address, *self.below])
            if had_none:
                self._opened()

    def _talk(self) -> None:
        """Send a beacon; what has not been heard for long is forgotten first."""
        for gone in self.table.forget_before(self._clock.now - self._lifetime_ns):
            self._leave_below(gone)
        self._choose()
        if not self._beaconing:
            self._beaconing = True
            self._say(Control(self._write_beacon, self._beacon_sent))

    def _write_beacon(self) -> tuple[bytes, int]:
        self._sequence = (self._sequence + 1) % 256
        parent = self._address if self._sink else self.parent
        beacon = Beacon(self._sequence, parent, self.cost, pull=parent is None)
        if parent is None and isfinite(self._told):
            self._wait_until_ns = self._clock.now + self._hold_ns
            self._clock.call(self._hold_ns, self._choose)
        self._told = self.cost
        return beacon.encode(), BROADCAST

    def _beacon_sent(self, outcome: Outcome | None, destination: int) -> None:
        self._beaconing = False

    def _join(self, nodes: list[int]) -> None:
        waiting = bool(self._joining)
        self._joining.update(dict.fromkeys(nodes))
        if not waiting:
            self._say(Control(self._write_join, self._join_sent))

    def _write_join(self) -> tuple[bytes, int] | None:
        if self.parent is None:
            self._joining.clear()
            return None
        self._join_out = tuple(self._joining)[: self._join_limit]
        return encode_join(self._join_out), self.parent

    def _join_sent(self, outcome: Outcome | None, parent: int) -> None:
        if outcome is None:
            for node in self._join_out:
                self._joining.pop(node, None)
            self._join_tries = 0
        else:
            self._join_tries += 1
            if self._join_tries >= self._config.tries:
                # Packets on their way up will tell.
                self._joining.clear()
                self._join_tries = 0
        if self._joining:
            self._say(Control(self._write_join, self._join_sent))
