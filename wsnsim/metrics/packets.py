"""What became of messages, one by one, and what the medium access did for them."""

import numpy as np
import pandas as pd

from wsnsim.metrics.figures import DROPPED, Figures
from wsnsim.types import NodeId, Seconds


def packet_fates(messages: pd.DataFrame, base: NodeId, active_s: Seconds) -> Figures:
    """Return how many messages were made and what became of them, each counted once a receiver.

    `generated` = `delivered` + `fused` + `in_flight` + all `dropped_...`, in every run.

    - `in_flight`: still in a queue, on the air or half reassembled when the run ended.
    - `throughput_bps`: application bits that arrived at the base station, over the time in which messages
      are made.

    Parameters
    ----------
    messages : the record table
    base : name of the base station
    active_s : time in which messages are made [s]
    """
    counts = messages["outcome"].value_counts()
    arrived = messages[(messages["destination"] == base) & (messages["outcome"] == "delivered")]
    bits = 8 * int(arrived["bytes"].sum())
    return {
        "generated": len(messages),
        "delivered": int(counts.get("delivered", 0)),
        "fused": int(counts.get("fused", 0)),
        "in_flight": int(counts.get("in_flight", 0)),
        **{outcome: int(counts.get(outcome, 0)) for outcome in DROPPED},
        "throughput_bps": bits / active_s if active_s > 0 else None,
    }


def access(nodes: pd.DataFrame) -> Figures:
    """Return what the medium access of all nodes did.

    - `mac_frames_tx`: frames of all kinds on the air; `mac_frames_retried`: those that repeat one
      that was not acknowledged.
    - `mac_attempts_per_frame`: how often a frame that asks for an acknowledgement was sent, on average;
      under low-power listening each copy of a train is an attempt.
    - `attempt_failure_ratio`: share of those attempts that were not acknowledged.
    - `cca_busy_ratio`: share of the looks at the channel that found it busy.
    - `budget_waited_s`: how long frames waited for bandwidth budgets, all nodes together.

    Parameters
    ----------
    nodes : the record table
    """
    total = nodes[
        ["frames_tx", "frames_retried", "attempts", "attempts_failed", "cca_total", "cca_busy"]
    ].sum()
    first = int(total["attempts"] - total["frames_retried"])
    return {
        "mac_frames_tx": int(total["frames_tx"]),
        "mac_frames_retried": int(total["frames_retried"]),
        "mac_attempts_per_frame": float(total["attempts"] / first) if first > 0 else None,
        "attempt_failure_ratio": _ratio(total["attempts_failed"], total["attempts"]),
        "cca_busy_ratio": _ratio(total["cca_busy"], total["cca_total"]),
        "budget_waited_s": float(nodes["budget_waited_s"].sum()),
    }


def message_latency(messages: pd.DataFrame) -> Figures:
    """Return how long messages that arrived took from their making, queues included.

    Parameters
    ----------
    messages : the record table
    """
    arrived = messages[messages["outcome"] == "delivered"]
    took_s = (arrived["delivered_s"] - arrived["created_s"]).to_numpy(np.float64)
    if not took_s.size:
        return dict.fromkeys(("latency_mean_s", *_PERCENTILES, "latency_max_s"))
    return {
        "latency_mean_s": float(took_s.mean()),
        **{key: float(np.percentile(took_s, percent)) for key, percent in _PERCENTILES.items()},
        "latency_max_s": float(took_s.max()),
    }


_PERCENTILES = {"latency_p50_s": 50, "latency_p95_s": 95, "latency_p99_s": 99}


def _ratio(part: float, whole: float) -> float | None:
    return float(part / whole) if whole else None
