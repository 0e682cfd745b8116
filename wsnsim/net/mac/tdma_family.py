"""TDMA on the routing tree: what all nodes have alike, and the slots that a tree gives them."""

from collections.abc import Sequence

import numpy as np

from wsnsim.net.channel.links import Links
from wsnsim.net.clock import Clock
from wsnsim.net.config import RadioConfig
from wsnsim.net.mac.frames import ACK_BYTES, DATA_OVERHEAD_BYTES, MAX_PAYLOAD_BYTES
from wsnsim.net.mac.slots import Timetable, timetable
from wsnsim.net.mac.tdma import Tdma
from wsnsim.net.mac.tdma_config import TdmaConfig
from wsnsim.net.phy.base import Phy
from wsnsim.net.phy.ieee802154 import O_QPSK
from wsnsim.net.phy.medium import Medium
from wsnsim.net.routing.tree import Tree
from wsnsim.types import Nanoseconds, NodeId

_MARGIN_DB = 10.0
"""How far below the sensitivity a node disturbs another no more."""


class TdmaFamily:
    """The medium access of all nodes, as `wsnsim.net.mac.base.MacFamily` asks for it.

    Parameters
    ----------
    config : slots, guards and clocks
    table : who sends when; None as long as there is no tree, when nobody can have a MAC yet
    """

    phy: Phy = O_QPSK
    max_payload_bytes = MAX_PAYLOAD_BYTES
    overhead_bytes = DATA_OVERHEAD_BYTES
    ack_bytes = ACK_BYTES

    def __init__(self, config: TdmaConfig | None = None, table: Timetable | None = None) -> None:
        self._config = TdmaConfig() if config is None else config
        self._table = table

    def on_tree(self, tree: Tree, names: Sequence[NodeId], links: Links, radio: RadioConfig) -> "TdmaFamily":
        """Return the same with slots for all nodes of a tree.

        Parameters
        ----------
        tree : the routing tree
        names : the nodes by address, in the order of the links
        links : who arrives where
        radio : whose sensitivity gives the threshold of interference, unless there is another

        Raises
        ------
        ValueError : the guard does not cover the drift of the clocks of this tree
        """
        config = self._config
        threshold_dbm = config.interference_dbm
        if threshold_dbm is None:
            threshold_dbm = radio.sensitivity_dbm - _MARGIN_DB
        table = timetable(tree, names, links, threshold_dbm, config.proportional)
        config.check_guard(tree.height, table.length * config.slot_ns)
        return TdmaFamily(config, table)

    @property
    def table(self) -> Timetable:
        """Who sends when.

        Raises
        ------
        ValueError : there is no tree yet
        """
        if self._table is None:
            raise ValueError("TDMA: slots come from a tree; call on_tree first")
        return self._table

    @property
    def superframe_ns(self) -> Nanoseconds:
        """Length of the superframe [ns]."""
        return self.table.length * self._config.slot_ns

    def mac(self, clock: Clock, medium: Medium, address: int, rng: np.random.Generator) -> Tdma:
        """Return the MAC of the node with that address."""
        return Tdma(clock, medium, self._config, self.table, address, rng)

    def service_ns(self, payload_bytes: Sequence[int], contenders: int) -> Nanoseconds:
        """Return the time in which a datagram crosses one hop [ns]: a superframe for each frame, and a slot.

        That is the longest for a node with one turn a superframe whose frames all arrive; contenders
        change nothing.
        """
        return len(payload_bytes) * self.superframe_ns + self._config.slot_ns
