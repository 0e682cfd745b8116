"""Trees on whose ways a frame costs the least energy.

All nodes send with the same power, so that a link costs more only where frames
are repeated, or where radios draw more. A frame over a link takes ETX attempts;
each costs the sender its transmitting and the receiver its receiving for the
time of the frame, and each frame that arrives the same, the other way round,
for its acknowledgement:

    E = ETX · [(P_tx,i + P_rx,j) · T_frame + p_f · (P_tx,j + P_rx,i) · T_ack],

with p_f the success of the frame forward, so that ETX · p_f = 1 / p_r. What a
node on mains draws counts nothing. Listening between frames is left out: it
costs the same on every way.

References
----------
Singh, Woo, Raghavendra, Power-Aware Routing in Mobile Ad Hoc Networks (MobiCom 1998), sec. 3: energy
consumed per packet. Banerjee, Misra, Minimum Energy Paths for Reliable Communication in Multi-Hop Wireless
Networks (MobiHoc 2002), sec. 3: transmissions repeated until they arrive.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from wsnsim.net.channel.links import Links
from wsnsim.net.config import Draw, RadioConfig
from wsnsim.net.mac.base import MacFamily
from wsnsim.net.routing.linkquality import expected_transmissions, frame_successes
from wsnsim.types import FloatArray, NodeId
from wsnsim.units import to_s


def frame_energies_j(
    links: Links,
    draws: Mapping[NodeId, Draw],
    names: Sequence[NodeId],
    family: MacFamily,
    radio: RadioConfig,
    frame_bytes: int,
) -> FloatArray:
    """Return the energy (m,) that a frame over each link costs until it is acknowledged [J].

    Parameters
    ----------
    links : who arrives where
    draws : of every node
    names : the nodes, in the order of the links
    family : times on the air, and the length of an acknowledgement
    radio : noise and sensitivity
    frame_bytes : length of the frame [B]
    """
    phy, ack_bytes = family.phy, family.ack_bytes
    etx = expected_transmissions(links, phy, radio, frame_bytes, ack_bytes)
    forward = frame_successes(links, phy, radio, frame_bytes)
    transmit_w = np.array([draws[node].transmit_w for node in names])
    receive_w = np.array([draws[node].receive_w for node in names])
    sender, receiver = links.senders, links.receivers
    frame_s = to_s(phy.air_time_ns(frame_bytes))
    ack_s = to_s(phy.air_time_ns(ack_bytes, phy.control_mode))
    frame_j = (transmit_w[sender] + receive_w[receiver]) * frame_s
    ack_j = (transmit_w[receiver] + receive_w[sender]) * ack_s
    return np.where(np.isfinite(etx), etx * (frame_j + forward * ack_j), np.inf)
