"""How good the links between nodes are while nobody else sends: margins and expected transmissions.

References
----------
De Couto, Aguayo, Bicket, Morris, A High-Throughput Path Metric for Multi-Hop
Wireless Routing (MobiCom 2003), sec. 3: ETX.
"""

from math import inf, log10

import numpy as np

from wsnsim.net.config import Ieee802154Config
from wsnsim.net.frames import ACK_BYTES
from wsnsim.net.phy import MAX_MPDU_BYTES, frame_success, weakest_sinr
from wsnsim.types import FloatArray


def weakest_usable_dbm(config: Ieee802154Config) -> float:
    """Return the power at which `link_success_min` of the longest frames arrive, undisturbed [dBm]."""
    needed_db = 10.0 * log10(weakest_sinr(MAX_MPDU_BYTES, config.link_success_min))
    return max(config.sensitivity_dbm, config.noise_dbm + needed_db)


def frame_successes(power_dbm: FloatArray, config: Ieee802154Config, mpdu_bytes: int) -> FloatArray:
    """Return the probability that a frame arrives over each link, undisturbed.

    Parameters
    ----------
    power_dbm : (n, n) - power of node i at node j [dBm]
    config : noise, sensitivity and the SINR at which a receiver synchronises
    mpdu_bytes : length of the MPDU [B]

    Returns
    -------
    (n, n) - from node i to node j [-]
    """
    weakest_dbm = max(config.sensitivity_dbm, config.noise_dbm + config.lock_sinr_db)
    success = np.zeros_like(power_dbm)
    for link in np.argwhere(power_dbm >= weakest_dbm):
        sinr = 10.0 ** ((float(power_dbm[tuple(link)]) - config.noise_dbm) / 10.0)
        success[tuple(link)] = frame_success(sinr, mpdu_bytes)
    return success


def expected_transmissions(power_dbm: FloatArray, config: Ieee802154Config, frame_bytes: int) -> FloatArray:
    """Return ETX = 1 / (p_f p_r): how often a frame is sent until its acknowledgement is heard.

    p_f is the success of the frame forward, p_r that of the acknowledgement on its
    way back. As in the paper a frame is repeated for ever; a MAC that gives up
    loses what the ETX does not show.

    Parameters
    ----------
    power_dbm : (n, n) - power of node i at node j [dBm], minus infinity on the diagonal
    config : noise, sensitivity and the SINR at which a receiver synchronises
    frame_bytes : length of the frame's MPDU [B]

    Returns
    -------
    (n, n) - from node i to node j [-], infinite where nothing arrives

    References
    ----------
    De Couto et al. (2003), sec. 3.
    """
    both = frame_successes(power_dbm, config, frame_bytes) * frame_successes(power_dbm, config, ACK_BYTES).T
    return np.divide(1.0, both, out=np.full_like(both, inf), where=both > 0.0)
