"""The distributed coordination function: what all nodes have alike."""

from collections.abc import Sequence

import numpy as np

from wsnsim.net.clock import Clock
from wsnsim.net.mac.dcf import Dcf
from wsnsim.net.mac.dcf_config import DcfConfig
from wsnsim.net.mac.dcf_service import dcf_service_ns
from wsnsim.net.mac.frames80211 import ACK_BYTES, DATA_OVERHEAD_BYTES, MAX_PAYLOAD_BYTES
from wsnsim.net.phy.ieee80211b import Ieee80211b
from wsnsim.net.phy.medium import Medium
from wsnsim.types import Nanoseconds


class DcfFamily:
    """The medium access of all nodes, as `wsnsim.net.mac.base.MacFamily` asks for it."""

    max_payload_bytes = MAX_PAYLOAD_BYTES
    overhead_bytes = DATA_OVERHEAD_BYTES
    ack_bytes = ACK_BYTES

    def __init__(self, config: DcfConfig | None = None) -> None:
        self._config = DcfConfig() if config is None else config
        self.phy = Ieee80211b(self._config.rate_mbps, self._config.preamble, self._config.basic_rate_mbps)

    def mac(self, clock: Clock, medium: Medium, address: int, rng: np.random.Generator) -> Dcf:
        """Return the MAC of the node with that address."""
        return Dcf(clock, medium, self.phy, self._config, address, rng)

    def service_ns(self, payload_bytes: Sequence[int], contenders: int) -> Nanoseconds:
        """Return the time in which a datagram crosses one hop, as a rule [ns]."""
        mpdu_bytes = [DATA_OVERHEAD_BYTES + size for size in payload_bytes]
        return dcf_service_ns(self.phy, mpdu_bytes, contenders, self._config.cw_min)
