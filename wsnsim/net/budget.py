"""Bandwidth budgets: how many bytes a mote may put on the air, as a token bucket.

Tokens come in at the budget's rate and are spent on every byte that the MAC
sends, as its counters have it: headers, repeats, preambles of its own and
acknowledgements included. A frame is given to the MAC only where the bucket
holds enough for all its attempts and one acknowledgement, so that repeats do
not overdraw it. Acknowledgements of what others send, and what the routing
protocol says, are never withheld: what they take beyond the tokens is a debt
that is paid before the next frame.

Levels are integers, in billionths of a bit: on a clock of nanoseconds no token
is ever lost to rounding.

References
----------
The token bucket with its depth of `burst` and its rate: IETF RFC 2697 (1999),
sec. 3, colour-blind and without the excess bucket.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, TypeAlias

from wsnsim.net.clock import Clock
from wsnsim.net.fragmentation import data_within
from wsnsim.net.interface import LinkCounters
from wsnsim.types import Nanoseconds
from wsnsim.units import NS_PER_S

AtLimit: TypeAlias = Literal["drop", "delay", "degrade"]

_BYTE = 8 * NS_PER_S
"""A byte in billionths of a bit."""


def _once(frame_bytes: int) -> int:
    """Send a frame once, and nothing else."""
    return frame_bytes


@dataclass(frozen=True)
class BudgetConfig:
    """A mote's budget.

    Raises
    ------
    ValueError : a number outside its range
    """

    bandwidth_bps: int
    """Rate at which it may send in the long run [bit/s]."""
    burst_bytes: int
    """What it may send at once after a long silence [B]."""
    at_limit: AtLimit = "delay"
    """`drop`: a message whose turn comes too early is lost. `delay`: it waits. `degrade`: it waits, and
    the program is told how much it may say."""
    most_sent_bytes: Callable[[int], int] = _once
    """What the MAC sends at most for a frame of a length, repeats and an acknowledgement included [B]."""

    def __post_init__(self) -> None:
        for name in ("bandwidth_bps", "burst_bytes"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name}: must be at least 1, got {getattr(self, name)}")


class TokenBucket:
    """Tokens for bytes, full at first.

    Parameters
    ----------
    rate_bps : tokens that come in [bit/s]
    burst_bytes : tokens that it holds [B]
    """

    def __init__(self, rate_bps: int, burst_bytes: int) -> None:
        self._rate_bps, self._full = rate_bps, burst_bytes * _BYTE
        self._level, self._since_ns = self._full, 0

    def spend(self, spent_bytes: int, now_ns: Nanoseconds) -> None:
        """Take tokens for what was sent since the last look, as if all of it had been sent just now.

        That is the strictest reading: what came in meanwhile is cut at the brim first.
        """
        came = self._rate_bps * (now_ns - self._since_ns)
        self._level = min(self._full, self._level + came) - spent_bytes * _BYTE
        self._since_ns = now_ns

    @property
    def level_bytes(self) -> int:
        """Whole bytes that may be sent at the last look; negative in debt."""
        return self._level // _BYTE

    def wait_ns(self, wanted_bytes: int) -> Nanoseconds:
        """Return how long after the last look the bucket holds so much; a full one is always enough."""
        lacking = min(wanted_bytes * _BYTE, self._full) - self._level
        return max(0, -(-lacking // self._rate_bps))


class Budget:
    """What one mote's link layer asks before it gives a frame to the MAC.

    Parameters
    ----------
    clock : the event clock
    config : rate, burst, and what happens at the limit
    counters : of the mote's MAC, by which bytes are charged
    overhead_bytes : what the MAC adds to a packet [B]
    reached : called when the limit holds a frame up for the first time
    """

    def __init__(
        self,
        clock: Clock,
        config: BudgetConfig,
        counters: LinkCounters,
        overhead_bytes: int,
        reached: Callable[[], None],
    ) -> None:
        self._clock, self._config, self._counters = clock, config, counters
        self._overhead_bytes = overhead_bytes
        self._reached, self._was_reached = reached, False
        self._bucket = TokenBucket(config.bandwidth_bps, config.burst_bytes)
        self._charged_bytes = 0
        self.waited_ns: Nanoseconds = 0
        """How long frames at the head of the queue have waited for tokens."""

    @property
    def drops(self) -> bool:
        """Whether what exceeds the budget is lost."""
        return self._config.at_limit == "drop"

    @property
    def limits_programs(self) -> bool:
        """Whether the program is to be told how much it may say."""
        return self._config.at_limit == "degrade"

    def data_bytes(self, room_bytes: int, max_payload_bytes: int) -> int:
        """Return how long a message may be that need not wait, unless its frames have to be repeated [B].

        Parameters
        ----------
        room_bytes : what a packet has left for a fragment of it [B]
        max_payload_bytes : longest packet [B]
        """
        frame_bytes = self._overhead_bytes + max_payload_bytes
        kept_bytes = self._config.most_sent_bytes(frame_bytes) - frame_bytes
        self._charge()
        usable_bytes = self._bucket.level_bytes - kept_bytes
        return data_within(max(0, usable_bytes), room_bytes, frame_bytes - room_bytes)

    def wait_ns(self, packet_bytes: int) -> Nanoseconds:
        """Return how long a packet has to wait before it may be given to the MAC; 0 where it may go now."""
        self._charge()
        wait = self._bucket.wait_ns(self._config.most_sent_bytes(packet_bytes + self._overhead_bytes))
        if wait and not self._was_reached:
            self._was_reached = True
            self._reached()
        return wait

    def _charge(self) -> None:
        sent_bytes = self._counters.mac_tx_bytes
        self._bucket.spend(sent_bytes - self._charged_bytes, self._clock.now)
        self._charged_bytes = sent_bytes
