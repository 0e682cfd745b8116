"""The physical layer of IEEE 802.11b (DSSS and CCK at 2.4 GHz): times and errors.

Data frames have one of four bit rates and the long or the short preamble;
acknowledgements, control frames and broadcasts have the basic rate. Preamble and
header are sent at their own rate: the long ones at 1 Mbit/s, of the short ones
the preamble at 1 and the header at 2 Mbit/s. A frame at 1 Mbit/s has the long
ones always. Times are exact integers of nanoseconds (of microseconds, even: a
frame is a whole number of them). All bits of a frame are equal: an error in the
preamble is as fatal as one in the data, and what the last microsecond has left
counts as bits. Left out: propagation delay (0.33 µs at 100 m), scrambler and
PBCC, and a receiver's fall-back to a slower rate.

References
----------
IEEE Std 802.11-2007: PPDU formats, sec. 18.2.2; TXTIME, sec. 18.3.4; PHY characteristics, table 18-5;
MSDU length, sec. 7.1.2 and 6.2.1.1.2.
"""

from functools import lru_cache
from math import exp, log1p
from typing import Literal, TypeAlias

from wsnsim.net.phy.dsss import (
    cck_11_symbol_errors,
    cck_55_symbol_errors,
    dbpsk_bit_errors,
    dqpsk_bit_errors,
)
from wsnsim.types import Nanoseconds

Preamble: TypeAlias = Literal["long", "short"]

RATES_MBPS = (1, 2, 5.5, 11)
"""Bit rates (table 18-2) [Mbit/s]."""
SLOT_NS: Nanoseconds = 20_000
"""aSlotTime (table 18-5)."""
SIFS_NS: Nanoseconds = 10_000
"""aSIFSTime (table 18-5)."""
DIFS_NS: Nanoseconds = SIFS_NS + 2 * SLOT_NS
"""Sec. 9.2.10."""
TURNAROUND_NS: Nanoseconds = 5_000
"""aRxTxTurnaroundTime is less (table 18-5)."""
CCA_NS: Nanoseconds = 15_000
"""aCCATime (table 18-5)."""
MAX_MSDU_BYTES = 2304
"""What a data frame carries, LLC header included (sec. 6.2.1.1.2)."""
MAX_MPDU_BYTES = 24 + MAX_MSDU_BYTES + 4
"""With the MAC header of a frame between stations and its check sequence (sec. 7.1.2)."""

_LONG_HEAD: tuple[tuple[float, Nanoseconds], ...] = ((1, 192_000),)
_SHORT_HEAD: tuple[tuple[float, Nanoseconds], ...] = ((1, 72_000), (2, 96_000))
"""Rate of each part of preamble and header [Mbit/s], and when it ends (sec. 18.2.2.1 and 18.2.2.2)."""

PREAMBLE_NS: Nanoseconds = 72_000
"""Of a short preamble (sec. 18.2.2.2); a receiver of a long one is taken to be committed as early."""

_NOISE_BANDWIDTH_MHZ = 22.0
_CCK_SYMBOLS_PER_US = 1.375
"""11 Mchip/s, eight chips a symbol (sec. 18.4.6.6)."""
_CCK_LOSS = 2.0
"""By how much (3 dB) a receiver of CCK falls behind the ideal one; ns-3's model has the same. With it, and
noise of -89 dBm, all four rates come within 1.5 dB of the sensitivities that makers of cards give."""
_ERROR_FREE_SINR = 100.0
"""Above 20 dB no bit rate has as many as 1e-80 errors a bit."""


@lru_cache(maxsize=1 << 16)
def log_bit_success(rate_mbps: float, sinr: float) -> float:
    """Return the logarithm of the probability that a bit is right; of CCK, where symbols fail, a bit's share.

    Parameters
    ----------
    rate_mbps : bit rate, 1, 2, 5.5 or 11 [Mbit/s]
    sinr : signal over noise and interference in 22 MHz, as a ratio (not decibels)
    """
    if rate_mbps == 1:
        return log1p(-dbpsk_bit_errors(_NOISE_BANDWIDTH_MHZ * sinr))
    if rate_mbps == 2:
        return log1p(-dqpsk_bit_errors(_NOISE_BANDWIDTH_MHZ * sinr / 2.0))
    es_n0 = _NOISE_BANDWIDTH_MHZ / _CCK_SYMBOLS_PER_US * sinr / _CCK_LOSS
    errors = cck_55_symbol_errors(es_n0) if rate_mbps == 5.5 else cck_11_symbol_errors(es_n0)
    return log1p(-errors) * _CCK_SYMBOLS_PER_US / rate_mbps


class Ieee80211b:
    """The physical layer as `wsnsim.net.phy.base.Phy` asks for it; mode 0 is data, mode 1 the basic rate.

    Parameters
    ----------
    rate_mbps : bit rate of data frames, 1, 2, 5.5 or 11 [Mbit/s]
    preamble : of all frames faster than 1 Mbit/s
    basic_rate_mbps : bit rate of acknowledgements, control frames and broadcasts [Mbit/s]

    Raises
    ------
    ValueError : a rate that 802.11b does not have, or data slower than the basic rate
    """

    turnaround_ns = TURNAROUND_NS
    cca_ns = CCA_NS
    preamble_ns = PREAMBLE_NS
    max_mpdu_bytes = MAX_MPDU_BYTES
    control_mode = 1

    def __init__(
        self, rate_mbps: float = 11, preamble: Preamble = "long", basic_rate_mbps: float = 1
    ) -> None:
        for name, rate in (("rate_mbps", rate_mbps), ("basic_rate_mbps", basic_rate_mbps)):
            if rate not in RATES_MBPS:
                raise ValueError(f"{name}: must be 1, 2, 5.5 or 11, got {rate} [Mbit/s]")
        if basic_rate_mbps > rate_mbps:
            raise ValueError(
                f"basic_rate_mbps: must be at most rate_mbps, got {basic_rate_mbps} and {rate_mbps} [Mbit/s]"
            )
        self.bit_rate_bps = rate_mbps * 1e6
        self._rates_mbps = (rate_mbps, basic_rate_mbps)
        self._heads = tuple(
            _SHORT_HEAD if preamble == "short" and rate > 1 else _LONG_HEAD for rate in self._rates_mbps
        )

    def head_ns(self, mode: int = 0) -> Nanoseconds:
        """Return how long preamble and PLCP header take [ns]."""
        return self._heads[mode][-1][1]

    def air_time_ns(self, mpdu_bytes: int, mode: int = 0) -> Nanoseconds:
        """Return how long a frame is on the air [ns]; its bits take a whole number of microseconds."""
        signal = round(10 * self._rates_mbps[mode])
        return self.head_ns(mode) - 80 * mpdu_bytes // -signal * 1000

    def log_success(self, sinr: float, since_ns: Nanoseconds, until_ns: Nanoseconds, mode: int = 0) -> float:
        """Return the logarithm of the probability that a stretch of a frame is received without error."""
        if sinr > _ERROR_FREE_SINR:
            return 0.0
        total, begin_ns = 0.0, 0
        for rate_mbps, end_ns in (*self._heads[mode], (self._rates_mbps[mode], until_ns)):
            spent_ns = min(until_ns, end_ns) - max(since_ns, begin_ns)
            if spent_ns > 0:
                total += spent_ns * 1e-3 * rate_mbps * log_bit_success(rate_mbps, sinr)
            begin_ns = end_ns
        return total

    def frame_success(self, sinr: float, mpdu_bytes: int, mode: int = 0) -> float:
        """Return the probability that a whole frame is received without error at one SINR (a ratio)."""
        return exp(self.log_success(sinr, 0, self.air_time_ns(mpdu_bytes, mode), mode))
