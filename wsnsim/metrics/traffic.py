"""Quality of service of the network: bytes offered, sent and delivered."""

import numpy as np
import pandas as pd

from wsnsim.metrics.figures import Figures
from wsnsim.types import NodeId, Seconds


def traffic(
    messages: pd.DataFrame,
    nodes: pd.DataFrame,
    load: pd.DataFrame,
    base: NodeId,
    steps: int,
    step_s: Seconds,
    simulated_s: Seconds,
    active_s: Seconds | None = None,
) -> Figures:
    """Return the load and what became of it.

    - `offered_bps`: application bits handed to the network, over the time in
      which frames are taken, or messages made; a message to many receivers counts once, and one
      that climbs hop by hop, as messages that are fused on their way do, at each.
    - `delivery_ratio`: of the messages on the way up (to the base station, or
      to the sender's parent), the share whose content arrived before the run
      ended: by itself, or fused into one whose content did.
    - `delivery_ratio_down`: the same of all other (message, receiver) pairs.
    - `bandwidth_mean_bps`: bits of all MAC frames sent by all nodes, relayed
      and repeated ones and acknowledgements included, over the simulated time.
    - `bandwidth_peak_bps`: the same between the two consecutive rows of `load`
      where it is highest.
    - `base_ingress_bytes_per_step`: application bytes that arrived at the base.
    - `control_share`: of the bytes of all MAC frames sent, those of the routing
      protocol.

    Parameters
    ----------
    messages, nodes, load : the record tables
    base : name of the base station
    steps : tracking steps in the run
    step_s : time from one step to the next [s]
    simulated_s : time from the beginning to the end of the run [s]
    active_s : time in which messages are made [s]; None: `steps` times `step_s`
    """
    arrived = content_arrived(messages)
    to_base = messages["destination"] == base
    up = on_the_way_up(messages, nodes, base)
    offered_bytes = int(messages.drop_duplicates("message")["bytes"].sum())
    app_bytes = int(nodes["app_tx_bytes"].sum())
    mac_bytes = int(nodes["mac_tx_bytes"].sum())
    ingress = int(messages.loc[arrived & to_base, "bytes"].sum())
    active_s = steps * step_s if active_s is None else active_s
    return {
        "offered_bps": 8 * offered_bytes / active_s if active_s > 0 else None,
        "delivery_ratio": float(arrived[up].mean()) if up.any() else None,
        "delivery_ratio_down": float(arrived[~up].mean()) if not up.all() else None,
        "app_bytes_per_step": app_bytes / steps if steps else None,
        "mac_bytes_per_step": mac_bytes / steps if steps else None,
        "bandwidth_mean_bps": 8 * mac_bytes / simulated_s if simulated_s > 0 else None,
        "bandwidth_peak_bps": _peak_bps(load),
        "base_ingress_bytes_per_step": ingress / steps if steps else None,
        "control_share": _control_share(nodes, mac_bytes),
    }


def on_the_way_up(messages: pd.DataFrame, nodes: pd.DataFrame, base: NodeId) -> "pd.Series[bool]":
    """Tell for each row of `messages` whether it is for the base station, or for its sender's parent.

    A sender may have had other parents before: what nodes say of a kind that was fused climbs hop by hop.
    """
    parents = messages["source"].map(nodes.set_index("node")["parent"])
    fused = messages["kind"].isin(messages.loc[messages["outcome"] == "fused", "kind"].unique())
    climbs = fused & (messages["source"] != base)
    return (messages["destination"] == base) | (messages["destination"] == parents) | climbs


def content_arrived(messages: pd.DataFrame) -> "pd.Series[bool]":
    """Tell for each row of `messages` whether what it said came to whom it was for.

    A message that was fused into another shares the fate of that one.
    """
    return fates(messages) == "delivered"


def fates(messages: pd.DataFrame) -> "pd.Series[str]":
    """Return for each row of `messages` the outcome of the last message that its content was in."""
    fused = messages["outcome"] == "fused"
    outcomes = messages.loc[~fused].drop_duplicates("message").set_index("message")["outcome"]
    return messages["outcome"].where(~fused, last_messages(messages).map(outcomes)).fillna("fused")


def last_messages(messages: pd.DataFrame) -> "pd.Series[int]":
    """Return for each row of `messages` the number of the last message that its content was in."""
    fused = messages.loc[messages["outcome"] == "fused", ["message", "fused_into"]]
    last: dict[int, int] = {}
    # what a message is fused into was made later, so it has the higher number and is settled first
    for message, into in fused.sort_values("message", ascending=False).itertuples(index=False):
        last[message] = last.get(int(into), int(into))
    return messages["message"].map(lambda message: last.get(message, message))


def _control_share(nodes: pd.DataFrame, mac_bytes: int) -> float | None:
    # runs that were recorded before routes could change do not have the column
    if "control_tx_bytes" not in nodes or not mac_bytes:
        return None
    return int(nodes["control_tx_bytes"].sum()) / mac_bytes


def _peak_bps(load: pd.DataFrame) -> float | None:
    if len(load) < 2:
        return None
    sent_bits = 8.0 * np.diff(load["mac_tx_bytes"].to_numpy(np.float64))
    return float((sent_bits / np.diff(load["time_s"].to_numpy(np.float64))).max())
