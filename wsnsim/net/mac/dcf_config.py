"""Parameters of the distributed coordination function of IEEE 802.11b."""

from dataclasses import dataclass

from wsnsim.net.phy.ieee80211b import Preamble


@dataclass(frozen=True)
class DcfConfig:
    """Rates, backoffs and retries; defaults of IEEE Std 802.11-2007, table 18-5 and annex D.

    Raises
    ------
    ValueError : a number outside its range
    """

    rate_mbps: float = 11
    """Bit rate of data frames, 1, 2, 5.5 or 11 [Mbit/s]."""
    basic_rate_mbps: float = 1
    """Bit rate of acknowledgements and broadcasts [Mbit/s]."""
    preamble: Preamble = "long"
    """Of all frames faster than 1 Mbit/s."""
    cw_min: int = 31
    """aCWmin: the first backoff is 0 to cw_min slots of 20 µs."""
    cw_max: int = 1023
    """aCWmax."""
    retry_limit: int = 7
    """dot11ShortRetryLimit: how often a frame is sent at most, the first attempt included."""

    def __post_init__(self) -> None:
        for name, least in {"cw_min": 0, "cw_max": self.cw_min, "retry_limit": 1}.items():
            if getattr(self, name) < least:
                raise ValueError(f"{name}: must be at least {least}, got {getattr(self, name)}")
