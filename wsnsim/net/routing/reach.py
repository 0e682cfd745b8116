"""Whom a node can speak with: those to and from whom most of the longest frames get through, undisturbed."""

import numpy as np

from wsnsim.net.channel.links import Links
from wsnsim.net.config import RadioConfig
from wsnsim.net.phy.base import Phy
from wsnsim.net.routing.linkquality import weakest_usable_dbm

GOOD = 0.9
"""Share of the longest frames that a good link carries, in both directions."""


class Reach:
    """The good links of a network, by the addresses of its nodes.

    Parameters
    ----------
    links : who arrives where
    phy, radio : what noise does to frames
    """

    def __init__(self, links: Links, phy: Phy, radio: RadioConfig) -> None:
        self._links, self._phy, self._radio = links, phy, radio
        self._weakest_dbm: float | None = None
        self._found: dict[int, tuple[int, ...]] = {}

    def of(self, node: int) -> tuple[int, ...]:
        """Return whom a node reaches and is reached by, in the order of the nodes."""
        if node not in self._found:
            if self._weakest_dbm is None:
                self._weakest_dbm = weakest_usable_dbm(self._phy, self._radio, GOOD)
            row = self._links.row(node)
            good = self._links.strength_dbm[row] >= self._weakest_dbm
            if self._links.delivery is not None:
                back = self._links.delivery[self._links.reverse[row]]
                good &= np.minimum(self._links.delivery[row], back) >= GOOD
            self._found[node] = tuple(self._links.receivers[row][good].tolist())
        return self._found[node]
