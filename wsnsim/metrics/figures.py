"""What the figures of a run are: numbers by name, and nothing where there is nothing to measure."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pandas as pd

Figures = dict[str, float | int | None]
"""Figures by their key, the unit in the key; None where there is nothing to measure."""

SUMMARY_KEYS = frozenset(
    {
        "position_error_mean_m",
        "position_error_median_m",
        "position_rmse_m",
        "reprojection_error_mean_px",
        "lost_fraction",
        "orientation_error_mean_deg",
        "smoothed_error_mean_m",
        "latency_p50_s",
        "latency_p95_s",
        "latency_p99_s",
        "heard_ratio",
        "missed_deadlines",
        "unmeasured_steps",
        "skipped_steps",
        "offered_bps",
        "channel_bps",
        "delivery_ratio",
        "delivery_ratio_down",
        "app_bytes_per_step",
        "mac_bytes_per_step",
        "bandwidth_mean_bps",
        "bandwidth_peak_bps",
        "base_ingress_bytes_per_step",
        "energy_total_j",
        "energy_per_step_j",
        "energy_max_node_j",
        "cpu_cycles_per_step",
        "frame_work_max_s",
        "work_longest_s",
        "busy_share_max",
        "images_skipped",
        "lifetime_first_death_s",
        "lifetime_first_death_extrapolated_s",
        "steps",
        "simulated_s",
        "wall_s",
    }
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
