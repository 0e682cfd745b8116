"""How good the links between nodes are while nobody else sends: margins and expected transmissions.

References
----------
De Couto, Aguayo, Bicket, Morris, A High-Throughput Path Metric for Multi-Hop
Wireless Routing (MobiCom 2003), sec. 3: ETX.
"""

from math import inf, log10

import numpy as np

from wsnsim.net.channel.links import Links
from wsnsim.net.config import RadioConfig
from wsnsim.net.phy.base import Phy
from wsnsim.types import FloatArray

_STRONGEST_SINR = 1e4
"""At 40 dB no physical layer makes errors worth mentioning."""


def weakest_sinr(phy: Phy, mpdu_bytes: int, success: float) -> float:
    """Return the smallest SINR (a ratio) at which a frame succeeds often enough.

    Parameters
    ----------
    phy : what noise does to bits
    mpdu_bytes : length of the MPDU [B]
    success : wanted probability of success, between 0 and 1 (excluded)

    Raises
    ------
    ValueError : `success` is not between 0 and 1
    """
    if not 0.0 < success < 1.0:
        raise ValueError(f"success: must be between 0 and 1, got {success}")
    low, high = 0.0, _STRONGEST_SINR
    for _ in range(80):
        middle = (low + high) / 2.0
        if phy.frame_success(middle, mpdu_bytes) < success:
            low = middle
        else:
            high = middle
    return high


def weakest_usable_dbm(phy: Phy, radio: RadioConfig, success: float) -> float:
    """Return the power at which that share of the longest frames arrive, undisturbed [dBm]."""
    needed_db = 10.0 * log10(weakest_sinr(phy, phy.max_mpdu_bytes, success))
    return max(radio.sensitivity_dbm, radio.noise_dbm + needed_db)


def weakest_heard_dbm(radio: RadioConfig) -> float:
    """Return the power below which a receiver notices nothing, undisturbed [dBm]."""
    return max(radio.sensitivity_dbm, radio.noise_dbm + radio.lock_sinr_db)


def frame_successes(links: Links, phy: Phy, radio: RadioConfig, mpdu_bytes: int, mode: int = 0) -> FloatArray:
    """Return the probability that a frame arrives over each link, undisturbed.

    Parameters
    ----------
    links : who arrives where
    phy : what noise does to bits
    radio : noise, sensitivity and the SINR at which a receiver synchronises
    mpdu_bytes : length of the MPDU [B]
    mode : the frame's bit rate

    Returns
    -------
    (m,) - for each link [-]
    """
    heard = links.power_dbm >= weakest_heard_dbm(radio)
    # both directions of a link are often equal
    power_dbm, places = np.unique(links.power_dbm[heard], return_inverse=True)
    success = np.zeros_like(links.power_dbm)
    sinrs = (10.0 ** ((dbm - radio.noise_dbm) / 10.0) for dbm in map(float, power_dbm))
    each = (phy.frame_success(sinr, mpdu_bytes, mode) for sinr in sinrs)
    success[heard] = np.fromiter(each, np.float64, len(power_dbm))[places]
    return success if links.delivery is None else success * links.delivery


def expected_transmissions(
    links: Links, phy: Phy, radio: RadioConfig, frame_bytes: int, ack_bytes: int
) -> FloatArray:
    """Return ETX = 1 / (p_f p_r): how often a frame is sent until its acknowledgement is heard.

    p_f is the success of the frame forward, p_r that of the acknowledgement on its
    way back. As in the paper a frame is repeated for ever; a MAC that gives up
    loses what the ETX does not show.

    Parameters
    ----------
    links : who arrives where
    phy : what noise does to bits
    radio : noise, sensitivity and the SINR at which a receiver synchronises
    frame_bytes : length of the frame's MPDU [B]
    ack_bytes : length of an acknowledgement [B]

    Returns
    -------
    (m,) - for each link [-], infinite where nothing arrives

    References
    ----------
    De Couto et al. (2003), sec. 3.
    """
    back = frame_successes(links, phy, radio, ack_bytes, phy.control_mode)[links.reverse]
    both = frame_successes(links, phy, radio, frame_bytes) * np.where(links.reverse >= 0, back, 0.0)
    return np.divide(1.0, both, out=np.full_like(both, inf), where=both > 0.0)
