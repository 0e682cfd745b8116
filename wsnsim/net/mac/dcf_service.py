"""How long the distributed coordination function takes to bring a datagram over one hop, as a rule."""

from collections.abc import Sequence

from wsnsim.net.mac.frames80211 import ACK_BYTES
from wsnsim.net.phy.ieee80211b import DIFS_NS, SIFS_NS, SLOT_NS, Ieee80211b
from wsnsim.types import Nanoseconds


def dcf_service_ns(phy: Ieee80211b, mpdu_bytes: Sequence[int], contenders: int, cw_min: int) -> Nanoseconds:
    """Return the time in which the DCF brings a datagram over one hop, as a rule [ns].

    A frame of L octets that nobody disturbs takes

        T(L) = DIFS + CWmin/2 · slot + air(L) + SIFS + air(ACK),

    the mean of its backoff and all that follows. Where c nodes begin together with
    one datagram each, the channel carries one frame at a time, so the last
    datagram is through when all are, after about c · Σ T(L) over its frames: too
    long, for the backoffs pass together. One collision of the longest frame is
    allowed for, by the frame, the time until its end is known and a backoff twice as long:

        R(L) = DIFS + CWmin · slot + air(L) + SIFS + air(ACK).

    Parameters
    ----------
    phy : times on the air
    mpdu_bytes : lengths of the datagram's frames, frame check sequence included [B]
    contenders : nodes that have such a datagram to send at the same time, the node itself among them
    cw_min : aCWmin

    References
    ----------
    IEEE Std 802.11-2007, sec. 9.2.3 (spaces), 9.2.4 (backoff), 9.2.8 (acknowledgement).
    """
    rest_ns = DIFS_NS + SIFS_NS + phy.air_time_ns(ACK_BYTES, phy.control_mode)
    window_ns = cw_min * SLOT_NS
    exchanges_ns = sum(rest_ns + window_ns // 2 + phy.air_time_ns(size) for size in mpdu_bytes)
    return contenders * exchanges_ns + rest_ns + window_ns + phy.air_time_ns(max(mpdu_bytes))
