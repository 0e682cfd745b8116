"""The channel as the medium sees it: fixed links, and what changes on them while a run lasts."""

from dataclasses import dataclass
from typing import Protocol

from wsnsim.net.channel.links import Links
from wsnsim.types import FloatArray, IntArray, Nanoseconds


class Fading(Protocol):
    """What multipath makes of a link's power, constant while a frame lasts."""

    def gains(self, sender: int, receivers: IntArray, now_ns: Nanoseconds) -> FloatArray:
        """Return the factors (m,) by which the powers at `receivers` (m,) differ from their means [-]."""


class Noise(Protocol):
    """Noise that changes in time, constant between multiples of `step_ns`."""

    step_ns: Nanoseconds

    def level_mw(self, receiver: int, now_ns: Nanoseconds) -> float:
        """Return the noise in a receiver [mW]; for one receiver the time goes back by a frame at most."""


class Losses(Protocol):
    """Losses of links beyond what noise and interference do, such as recorded ones."""

    def log_success(self, sender: int, receiver: int, now_ns: Nanoseconds) -> float:
        """Return the logarithm of the probability that a frame that begins now gets through."""


@dataclass(frozen=True, eq=False)
class Channel:
    """Everything between the antennas."""

    links: Links
    fading: Fading | None = None
    noise: Noise | None = None
    """None: the constant noise of the radio's parameters."""
    losses: Losses | None = None
