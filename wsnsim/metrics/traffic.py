"""Quality of service of the network: bytes offered, sent and delivered."""

import numpy as np
import pandas as pd

from wsnsim.metrics.accuracy import Figures
from wsnsim.types import NodeId, Seconds

_ARRIVED = ("delivered", "fused")


def traffic(
    messages: pd.DataFrame,
    nodes: pd.DataFrame,
    base: NodeId,
    steps: int,
    step_s: Seconds,
    channel_bps: float | None,
    simulated_s: Seconds,
) -> Figures:
    """Return the load and what became of it.

    - `offered_bps`: application bits handed to the network, over the simulated
      time; a message to many receivers counts once.
    - `delivery_ratio`: of all (message, receiver) pairs, the share that arrived
      (or was fused into one that went on) before the run ended.
    - `bandwidth_mean_bps`: bits of all MAC frames sent by all nodes, relayed
      and repeated ones and acknowledgements included, over the simulated time.
    - `bandwidth_peak_bps`: the same in the busiest window of one step. Frames
      carry no record of their own by default, so each message is charged, at
      its creation, with its share by bytes of all MAC bytes of the run. Where
      that is more than the channel carries (queues drain later than they fill),
      the channel's rate is the peak, or the mean if nodes far apart made it higher.
    - `base_ingress_bytes_per_step`: application bytes that arrived at the base.

    Parameters
    ----------
    messages, nodes : the record tables
    base : name of the base station
    steps : tracking steps in the run
    step_s : time from one step to the next [s]
    channel_bps : what the radio channel carries [bit/s]; None for a network without limit
    simulated_s : time from the beginning to the end of the run [s]
    """
    arrived = messages["outcome"].isin(_ARRIVED)
    offered = messages.drop_duplicates("message")
    app_bytes = int(nodes["app_tx_bytes"].sum())
    mac_bytes = int(nodes["mac_tx_bytes"].sum())
    ingress = int(messages.loc[arrived & (messages["destination"] == base), "bytes"].sum())
    mean_bps = 8 * mac_bytes / simulated_s if simulated_s > 0 else None
    peak_bps = _peak_bps(offered, mac_bytes, step_s)
    if peak_bps is not None and channel_bps is not None:
        peak_bps = min(peak_bps, max(channel_bps, mean_bps or 0.0))
    return {
        "offered_bps": 8 * int(offered["bytes"].sum()) / simulated_s if simulated_s > 0 else None,
        "delivery_ratio": float(arrived.mean()) if len(messages) else None,
        "app_bytes_per_step": app_bytes / steps if steps else None,
        "mac_bytes_per_step": mac_bytes / steps if steps else None,
        "bandwidth_mean_bps": mean_bps,
        "bandwidth_peak_bps": peak_bps,
        "base_ingress_bytes_per_step": ingress / steps if steps else None,
    }


def _peak_bps(offered: pd.DataFrame, mac_bytes: int, step_s: Seconds) -> float | None:
    total = int(offered["bytes"].sum())
    if total == 0 or not step_s > 0:
        return None
    # A message of the next step is created at its instant, not a rounding error before it.
    window = np.floor(offered["created_s"].to_numpy(np.float64) / step_s + 1e-6)
    busiest = int(offered["bytes"].groupby(window).sum().max())
    return 8 * mac_bytes * (busiest / total) / step_s
