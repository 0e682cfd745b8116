"""Low-power listening: what all nodes have alike."""

from collections.abc import Sequence

import numpy as np

from wsnsim.net.clock import Clock
from wsnsim.net.mac.frames import ACK_BYTES, DATA_OVERHEAD_BYTES, MAX_PAYLOAD_BYTES
from wsnsim.net.mac.lpl import Lpl
from wsnsim.net.mac.lpl_config import LplConfig, quiet_ns
from wsnsim.net.mac.napping import START_UP_NS
from wsnsim.net.phy.base import Phy
from wsnsim.net.phy.ieee802154 import O_QPSK, TURNAROUND_NS, UNIT_BACKOFF_NS, air_time_ns
from wsnsim.net.phy.medium import Medium
from wsnsim.types import Nanoseconds
from wsnsim.units import to_ns


class LplFamily:
    """The medium access of all nodes, as `wsnsim.net.mac.base.MacFamily` asks for it."""

    phy: Phy = O_QPSK
    max_payload_bytes = MAX_PAYLOAD_BYTES
    overhead_bytes = DATA_OVERHEAD_BYTES
    ack_bytes = ACK_BYTES

    def __init__(self, config: LplConfig | None = None) -> None:
        self._config = LplConfig() if config is None else config

    def mac(self, clock: Clock, medium: Medium, address: int, rng: np.random.Generator) -> Lpl:
        """Return the MAC of the node with that address."""
        return Lpl(clock, medium, self._config, address, rng)

    def service_ns(self, payload_bytes: Sequence[int], contenders: int) -> Nanoseconds:
        """Return the time in which a datagram crosses one hop, as a rule [ns].

        The first frame waits for its receiver to look, one interval at most; those that follow find
        it awake. Each other contender's train lasts half an interval in the mean.
        """
        config = self._config
        backoff_ns = ((1 << config.min_be) - 1) * UNIT_BACKOFF_NS // 2
        interval_ns = to_ns(config.wake_interval_s)
        exchanges_ns = sum(
            backoff_ns + quiet_ns() + TURNAROUND_NS + air_time_ns(DATA_OVERHEAD_BYTES + size)
            + TURNAROUND_NS + air_time_ns(ACK_BYTES)
            for size in payload_bytes
        )  # fmt: skip
        return START_UP_NS + (contenders + 1) * interval_ns // 2 + contenders * exchanges_ns
