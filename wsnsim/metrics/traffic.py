"""Quality of service of the network: bytes offered, sent and delivered."""

import numpy as np
import pandas as pd

from wsnsim.metrics.figures import ARRIVED, Figures
from wsnsim.types import NodeId, Seconds


def traffic(
    messages: pd.DataFrame,
    nodes: pd.DataFrame,
    load: pd.DataFrame,
    base: NodeId,
    steps: int,
    step_s: Seconds,
    simulated_s: Seconds,
) -> Figures:
    """Return the load and what became of it.

    - `offered_bps`: application bits handed to the network, over the time in
      which frames are taken; a message to many receivers counts once.
    - `delivery_ratio`: of the messages to the base station, the share that
      arrived (or was fused into one that went on) before the run ended.
    - `delivery_ratio_down`: the same of all other (message, receiver) pairs.
    - `bandwidth_mean_bps`: bits of all MAC frames sent by all nodes, relayed
      and repeated ones and acknowledgements included, over the simulated time.
    - `bandwidth_peak_bps`: the same between the two consecutive rows of `load`
      where it is highest.
    - `base_ingress_bytes_per_step`: application bytes that arrived at the base.

    Parameters
    ----------
    messages, nodes, load : the record tables
    base : name of the base station
    steps : tracking steps in the run
    step_s : time from one step to the next [s]
    simulated_s : time from the beginning to the end of the run [s]
    """
    arrived = messages["outcome"].isin(ARRIVED)
    up = messages["destination"] == base
    offered_bytes = int(messages.drop_duplicates("message")["bytes"].sum())
    app_bytes = int(nodes["app_tx_bytes"].sum())
    mac_bytes = int(nodes["mac_tx_bytes"].sum())
    ingress = int(messages.loc[arrived & up, "bytes"].sum())
    frames_s = steps * step_s
    return {
        "offered_bps": 8 * offered_bytes / frames_s if frames_s > 0 else None,
        "delivery_ratio": float(arrived[up].mean()) if up.any() else None,
        "delivery_ratio_down": float(arrived[~up].mean()) if not up.all() else None,
        "app_bytes_per_step": app_bytes / steps if steps else None,
        "mac_bytes_per_step": mac_bytes / steps if steps else None,
        "bandwidth_mean_bps": 8 * mac_bytes / simulated_s if simulated_s > 0 else None,
        "bandwidth_peak_bps": _peak_bps(load),
        "base_ingress_bytes_per_step": ingress / steps if steps else None,
    }


def _peak_bps(load: pd.DataFrame) -> float | None:
    if len(load) < 2:
        return None
    sent_bits = 8.0 * np.diff(load["mac_tx_bytes"].to_numpy(np.float64))
    return float((sent_bits / np.diff(load["time_s"].to_numpy(np.float64))).max())
