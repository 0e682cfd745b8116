"""What a link layer knows of the router of its node, whatever it is."""

from typing import Protocol


class Router(Protocol):
    """The ways that one node knows. Nodes are named by their short addresses."""

    cost: float
    """Of the node's way to the base station [transmissions]; infinite where it has none."""
    parent: int | None

    def start(self) -> None:
        """Begin."""

    def stop(self) -> None:
        """Be silent for good."""

    def next_hop(self, final: int) -> int | None:
        """Return to whom a packet for a node goes next; None without a way."""

    def takes(self, source: int) -> bool:
        """Return whether what a neighbour spreads is taken."""

    @property
    def spreads(self) -> bool:
        """Whether the node spreads what it has taken."""

    def neighbours(self) -> tuple[int, ...]:
        """Return who is in reach over links good enough to be used."""

    def heard(self, source: int) -> None:
        """Note that a neighbour is there."""

    def take(self, source: int, packet: bytes) -> None:
        """Take a frame of a neighbour's router."""

    def carries(self, source: int, origin: int, cost: float) -> None:
        """Note a packet on its way up that a neighbour, who told its cost, has sent here."""

    def forget(self, node: int) -> None:
        """Take back by whom a node is reached."""

    def sent(self, hop: int, attempts: int, acknowledged: bool) -> None:
        """Learn what became of a frame to a neighbour: how often it was sent, the last time well or not."""
