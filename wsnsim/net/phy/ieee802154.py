"""The physical layer of IEEE 802.15.4-2006 in the 2.4 GHz band (O-QPSK): times and bit errors.

Times are exact integers of nanoseconds. All bits of a frame are equal: an
error in the preamble is as fatal as one in the data (as in ns-3). Left out:
clock offset, and propagation delay (0.17 µs at 50 m).

References
----------
IEEE Std 802.15.4-2006: symbol and chip rates, sec. 6.5.1 and table 1; PPDU
format, sec. 6.3; PHY constants, table 22; MAC constants, table 85; MAC PIB,
table 86; CCA, sec. 6.9.9; bit error rate, annex E, sec. E.4.1.8.
"""

from functools import lru_cache
from math import exp, log1p

from wsnsim.kernels import oqpsk
from wsnsim.types import Nanoseconds

SYMBOL_NS: Nanoseconds = 16_000
"""62.5 ksymbol/s (table 1)."""
BIT_NS: Nanoseconds = SYMBOL_NS // 4
"""Four bits a symbol, 250 kbit/s (table 1)."""
BIT_RATE_BPS = 1e9 / BIT_NS
"""What the channel carries while a frame is on the air."""
OCTET_NS: Nanoseconds = 8 * BIT_NS
MAX_MPDU_BYTES = 127
"""aMaxPHYPacketSize (table 22)."""
SYNC_NS: Nanoseconds = 12 * SYMBOL_NS
"""Preamble (8 symbols), start-of-frame delimiter (2) and PHY header (2), sec. 6.3."""
PREAMBLE_NS: Nanoseconds = 10 * SYMBOL_NS
"""Preamble and start-of-frame delimiter: until then a receiver is not committed to a frame (sec. 6.3)."""
TURNAROUND_NS: Nanoseconds = 12 * SYMBOL_NS
"""aTurnaroundTime (table 22), both ways."""
CCA_NS: Nanoseconds = 8 * SYMBOL_NS
"""The window of clear channel assessment (sec. 6.9.9)."""
UNIT_BACKOFF_NS: Nanoseconds = 20 * SYMBOL_NS
"""aUnitBackoffPeriod (table 85)."""
ACK_WAIT_NS: Nanoseconds = 54 * SYMBOL_NS
"""macAckWaitDuration (table 86): unit backoff + turnaround + 10 symbols of header + 6 octets."""
SIFS_NS: Nanoseconds = 12 * SYMBOL_NS
"""macMinSIFSPeriod, after a short MPDU (sec. 7.5.1.3)."""
LIFS_NS: Nanoseconds = 40 * SYMBOL_NS
"""macMinLIFSPeriod, after a longer one (sec. 7.5.1.3)."""
MAX_SIFS_MPDU_BYTES = 18
"""aMaxSIFSFrameSize (table 85)."""

_ERROR_FREE_SINR = 100.0
"""Above 20 dB the formula gives fewer than 1e-400 errors a bit: nothing a float can hold."""


def air_time_ns(mpdu_bytes: int) -> Nanoseconds:
    """Return how long a frame is on the air [ns].

    Parameters
    ----------
    mpdu_bytes : length of the MPDU, frame check sequence included [B]
    """
    return SYNC_NS + mpdu_bytes * OCTET_NS


def interframe_space_ns(mpdu_bytes: int) -> Nanoseconds:
    """Return the pause that must follow a frame of that size [ns] (sec. 7.5.1.3)."""
    return SIFS_NS if mpdu_bytes <= MAX_SIFS_MPDU_BYTES else LIFS_NS


def bit_error_rate(sinr: float) -> float:
    """Return the probability that a bit is wrong.

    Parameters
    ----------
    sinr : signal over noise and interference, as a ratio (not decibels)

    References
    ----------
    IEEE Std 802.15.4-2006, sec. E.4.1.8.
    """
    if sinr > _ERROR_FREE_SINR:
        return 0.0
    rate = 0.0
    for factor, exponent in zip(oqpsk.FACTORS, oqpsk.EXPONENTS, strict=True):
        rate += factor * exp(exponent * sinr)
    return rate


@lru_cache(maxsize=1 << 16)
def _log_bit_success(sinr: float) -> float:
    # Links are fixed, and the same few of them meet again and again. Compiled, for a run's channel needs
    # many; what only looks at links does not wait for a compiler.
    return log1p(-oqpsk.bit_error_rate.compiled(sinr))


def frame_success(sinr: float, mpdu_bytes: int) -> float:
    """Return the probability that all of a frame is right, its synchronisation header included.

    Parameters
    ----------
    sinr : signal over noise and interference, as a ratio (not decibels)
    mpdu_bytes : length of the MPDU, frame check sequence included [B]
    """
    return exp(air_time_ns(mpdu_bytes) / BIT_NS * log1p(-bit_error_rate(sinr)))


class OQpsk:
    """The physical layer as `wsnsim.net.phy.base.Phy` asks for it; it has one bit rate, mode 0."""

    turnaround_ns = TURNAROUND_NS
    cca_ns = CCA_NS
    preamble_ns = PREAMBLE_NS
    max_mpdu_bytes = MAX_MPDU_BYTES
    control_mode = 0
    bit_rate_bps = BIT_RATE_BPS

    def air_time_ns(self, mpdu_bytes: int, mode: int = 0) -> Nanoseconds:
        """Return how long a frame is on the air [ns]."""
        return air_time_ns(mpdu_bytes)

    def log_success(self, sinr: float, since_ns: Nanoseconds, until_ns: Nanoseconds, mode: int = 0) -> float:
        """Return the logarithm of the probability that a stretch of a frame is received without error."""
        return (until_ns - since_ns) / BIT_NS * _log_bit_success(sinr) if sinr <= _ERROR_FREE_SINR else 0.0

    def frame_success(self, sinr: float, mpdu_bytes: int, mode: int = 0) -> float:
        """Return the probability that a whole frame is received without error at one SINR (a ratio)."""
        return frame_success(sinr, mpdu_bytes)


O_QPSK = OQpsk()
