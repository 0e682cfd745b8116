"""The wire between the sinks of a network: it takes no time and loses nothing, so what one has, all have."""

from dataclasses import dataclass
from typing import Generic, TypeVar

Sink = TypeVar("Sink")


@dataclass(frozen=True)
class Backbone(Generic[Sink]):
    """The sinks of a network, all of which stand for the base station."""

    base: int
    """Address of the base station."""
    links: dict[int, Sink]
    """Link layers of the sinks, by address."""
    reached: dict[int, int]
    """By which sink each node is reached, as all sinks know it."""

    def is_end(self, address: int, final: int) -> bool:
        """Return whether a packet with that final address need go no further than a node."""
        return final == address or (final == self.base and address in self.links)

    def others(self, address: int) -> list[Sink]:
        """Return whoever else has what a node has: the other sinks, for a sink."""
        if address not in self.links:
            return []
        return [link for at, link in self.links.items() if at != address]

    def towards(self, address: int, final: int) -> Sink | None:
        """Return the other sink by which a node is reached from here, None where there is none."""
        if address not in self.links:
            return None
        at = final if final in self.links else self.reached.get(final, address)
        return self.links.get(at) if at != address else None
