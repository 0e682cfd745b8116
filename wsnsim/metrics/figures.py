"""What the figures of a run are: numbers by name, and nothing where there is nothing to measure."""

from typing import TYPE_CHECKING

from wsnsim.net.interface import Outcome

if TYPE_CHECKING:
    import pandas as pd

Figures = dict[str, float | int | None]
"""Figures by their key, the unit in the key; None where there is nothing to measure."""

DROPPED = (*(outcome.value for outcome in Outcome), "dropped_undecodable", "dropped_refused")
"""Outcomes of a message that did not arrive: the network's, and those of programs."""

TRACKING_KEYS = frozenset(
    {
        "position_error_mean_m",
        "position_error_median_m",
        "position_rmse_m",
        "reprojection_error_mean_px",
        "lost_fraction",
        "orientation_error_mean_deg",
        "smoothed_error_mean_m",
        "heard_ratio",
        "missed_deadlines",
        "unmeasured_steps",
        "skipped_steps",
        "app_bytes_per_step",
        "mac_bytes_per_step",
        "base_ingress_bytes_per_step",
        "energy_per_step_j",
        "cpu_cycles_per_step",
        "frame_work_max_s",
        "images_skipped",
        "steps",
    }
)
"""Figures that a run without cameras does not have."""

SUMMARY_KEYS = TRACKING_KEYS.union(
    DROPPED,
    {
        "generated",
        "delivered",
        "fused",
        "in_flight",
        "throughput_bps",
        "mac_frames_tx",
        "mac_frames_retried",
        "mac_attempts_per_frame",
        "attempt_failure_ratio",
        "cca_busy_ratio",
        "control_share",
        "budget_waited_s",
        "latency_mean_s",
        "latency_max_s",
        "latency_p50_s",
        "latency_p95_s",
        "latency_p99_s",
        "offered_bps",
        "channel_bps",
        "delivery_ratio",
        "delivery_ratio_down",
        "bandwidth_mean_bps",
        "bandwidth_peak_bps",
        "energy_total_j",
        "energy_max_node_j",
        "work_longest_s",
        "busy_share_max",
        "lifetime_first_death_s",
        "lifetime_first_death_extrapolated_s",
        "simulated_s",
        "wall_s",
    },
)
"""Every key of summary.json."""

ESTIMATE_KINDS = ("update", "timed_out", "unasked", "skipped", "lost", "smoothed")
"""What an estimate can rest on, as it stands in the records; only an `update` holds new measurements."""

SMOOTHED = "smoothed"
"""The kind of a second look at an older instant, which is no estimate of its own."""

ARRIVED = ("delivered", "fused")
"""Outcomes of a message that was of use to its receiver, by itself or merged into another."""


def mean_or_none(values: "pd.Series[float]") -> float | None:
    """Return the mean of the values that are there, None if there are none."""
    present = values.dropna()
    return float(present.mean()) if len(present) else None
