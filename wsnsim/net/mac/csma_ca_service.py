"""How long unslotted CSMA/CA takes to bring a datagram over one hop, as a rule."""

from collections.abc import Sequence

from wsnsim.net.mac.frames import ACK_BYTES
from wsnsim.net.phy.ieee802154 import (
    ACK_WAIT_NS,
    CCA_NS,
    TURNAROUND_NS,
    UNIT_BACKOFF_NS,
    air_time_ns,
    interframe_space_ns,
)
from wsnsim.types import Nanoseconds


def csma_ca_service_ns(mpdu_bytes: Sequence[int], contenders: int, min_be: int) -> Nanoseconds:
    """Return the time in which unslotted CSMA/CA brings a datagram over one hop, as a rule [ns].

    A frame of L octets that nobody disturbs takes

        T(L) = (2^BE - 1)/2 · backoff + CCA + turnaround + air(L) + turnaround + air(ACK) + space(L),

    the mean of its first backoff, and all that follows up to the instant at
    which the next frame may contend. Where c nodes begin together with one
    datagram each, the channel carries one frame at a time, so the last datagram is
    through when all are, after about c · Σ T(L) over its frames. (Backoffs
    overlap, which saves time, and frames collide, which costs it. For 2 and 3
    nodes the two cancel; from 5 nodes on the mean of the last arrival is less,
    because CSMA/CA gives frames up.) One attempt in vain at the longest frame is allowed for:

        R(L) = (2^BE - 1)/2 · backoff + CCA + turnaround + air(L) + macAckWaitDuration.

    Parameters
    ----------
    mpdu_bytes : lengths of the datagram's frames, frame check sequence included [B]
    contenders : nodes that have such a datagram to send at the same time, the node itself among them
    min_be : macMinBE

    References
    ----------
    IEEE Std 802.15.4-2006, sec. 7.5.1.3 (spacing), 7.5.1.4 (CSMA-CA), 7.5.6.4 (acknowledgement, retries).
    """
    begin_ns = ((1 << min_be) - 1) * UNIT_BACKOFF_NS // 2 + CCA_NS + TURNAROUND_NS
    exchanges_ns = sum(
        begin_ns + air_time_ns(size) + TURNAROUND_NS + air_time_ns(ACK_BYTES) + interframe_space_ns(size)
        for size in mpdu_bytes
    )
    retry_ns = begin_ns + air_time_ns(max(mpdu_bytes)) + ACK_WAIT_NS
    return contenders * exchanges_ns + retry_ns
