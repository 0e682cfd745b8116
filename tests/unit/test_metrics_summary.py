"""Every figure of the summary against a sum done by hand."""

import json
import math

import pandas as pd
import pytest

from wsnsim.metrics.accuracy import accuracy
from wsnsim.metrics.energy import ENERGY_COLUMNS, energy
from wsnsim.metrics.latency import latency
from wsnsim.metrics.summary import summary
from wsnsim.metrics.traffic import traffic

CONTRACT = {
    "position_error_mean_m", "position_error_median_m", "position_rmse_m", "reprojection_error_mean_px",
    "lost_fraction", "delivery_ratio", "app_bytes_per_step", "mac_bytes_per_step", "bandwidth_mean_bps",
    "bandwidth_peak_bps", "base_ingress_bytes_per_step", "latency_p50_s", "latency_p95_s", "missed_deadlines",
    "energy_total_j", "energy_per_step_j", "energy_max_node_j", "cpu_cycles_per_step",
    "lifetime_first_death_s", "lifetime_first_death_extrapolated_s", "steps", "simulated_s", "wall_s",
    "offered_bps", "channel_bps", "images_skipped",
}  # fmt: skip


def steps(rows):
    columns = ["step", "target", "error_m", "reprojection_px", "latency_s", "kind"]
    return pd.DataFrame(rows, columns=columns)


STEPS = steps(
    [
        (1, "p", 1.0, 2.0, 0.1, "update"),
        (1, "q", 2.0, math.nan, 0.2, "prediction"),
        (2, "p", 1.5, 4.0, 0.3, "update"),
        (2, "q", math.nan, math.nan, math.nan, None),
    ]
)


def test_errors_and_lost_targets():
    figures = accuracy(STEPS, lost_above_m=1.5)
    assert figures["position_error_mean_m"] == pytest.approx(1.5)
    assert figures["position_error_median_m"] == pytest.approx(1.5)
    assert figures["position_rmse_m"] == pytest.approx(math.sqrt((1 + 4 + 2.25) / 3))
    assert figures["reprojection_error_mean_px"] == 3.0
    assert figures["lost_fraction"] == 0.5
    assert accuracy(STEPS, lost_above_m=1.49)["lost_fraction"] == 1.0


def test_latency_and_steps_without_a_measurement():
    figures = latency(STEPS)
    assert figures["latency_p50_s"] == pytest.approx(0.2)
    assert figures["latency_p95_s"] == pytest.approx(0.29)
    assert figures["missed_deadlines"] == 2


def messages():
    columns = ["message", "source", "destination", "created_s", "bytes", "outcome"]
    rows = [
        (0, "base", "a", 0.0, 10, "delivered"),
        (0, "base", "b", 0.0, 10, "dropped_not_heard"),
        (1, "a", "base", 0.5 - 1e-9, 100, "delivered"),
        (2, "b", "base", 0.6, 50, "dropped_queue"),
        (3, "b", "base", 0.9, 40, "in_flight"),
    ]
    return pd.DataFrame(rows, columns=columns)


def nodes():
    base = {"node": "base", "role": "base", "app_tx_bytes": 10, "mac_tx_bytes": 30, "cpu_cycles": 1e9}
    base |= dict.fromkeys(ENERGY_COLUMNS, 1e6)
    base |= {"images_skipped": 0, "battery_capacity_j": math.nan, "died_at_s": math.nan}
    motes = []
    for i, name in enumerate(("a", "b")):
        mote = {"node": name, "role": "camera", "app_tx_bytes": 95, "mac_tx_bytes": 200, "cpu_cycles": 500.0}
        mote |= dict.fromkeys(ENERGY_COLUMNS, 1.0 + i)
        mote |= {"images_skipped": 3, "battery_capacity_j": 100.0, "died_at_s": math.nan}
        motes.append(mote)
    return pd.DataFrame([base, *motes])


def measure_traffic(channel_bps):
    return traffic(
        messages(), nodes(), base="base", steps=2, step_s=0.5, channel_bps=channel_bps, simulated_s=1.0
    )


def test_the_peak_is_never_above_what_the_channel_carries():
    assert measure_traffic(channel_bps=1e6)["bandwidth_peak_bps"] == pytest.approx(8 * 430 * 190 / 200 / 0.5)
    assert measure_traffic(channel_bps=5e3)["bandwidth_peak_bps"] == 5e3
    assert measure_traffic(channel_bps=1e3)["bandwidth_peak_bps"] == 8 * 430


def test_traffic():
    figures = measure_traffic(channel_bps=None)
    assert figures["offered_bps"] == 8 * 200
    assert figures["delivery_ratio"] == 0.4
    assert figures["app_bytes_per_step"] == 100
    assert figures["mac_bytes_per_step"] == 215
    assert figures["bandwidth_mean_bps"] == 8 * 430
    assert figures["base_ingress_bytes_per_step"] == 50
    # 190 of the 200 bytes are created in the second window of 0.5 s, the one a nanosecond early included.
    assert figures["bandwidth_peak_bps"] == pytest.approx(8 * 430 * 190 / 200 / 0.5)


def test_the_peak_is_never_below_the_mean(synthetic_run):
    for load in ("fine", "overloaded"):
        figures = synthetic_run(load).summary
        assert figures["bandwidth_peak_bps"] >= figures["bandwidth_mean_bps"]


def test_energy_counts_motes_and_not_the_base():
    figures = energy(nodes(), steps=2, simulated_s=1.0)
    assert figures["energy_total_j"] == 21.0
    assert figures["energy_per_step_j"] == 10.5
    assert figures["energy_max_node_j"] == 14.0
    assert figures["cpu_cycles_per_step"] == 500.0
    assert figures["images_skipped"] == 6
    assert figures["lifetime_first_death_s"] is None
    assert figures["lifetime_first_death_extrapolated_s"] == pytest.approx(100 / 14)


def test_a_mote_that_died_is_the_first_death():
    died = nodes()
    died.loc[1, "died_at_s"] = 0.25
    figures = energy(died, steps=2, simulated_s=1.0)
    assert figures["lifetime_first_death_s"] == 0.25
    assert figures["lifetime_first_death_extrapolated_s"] == pytest.approx(100 * 0.25 / 7)


def test_the_contract_keys_and_no_nan(synthetic_run):
    figures = synthetic_run().summary
    assert set(figures) == CONTRACT
    assert "NaN" not in json.dumps(figures, allow_nan=False)
    assert figures["steps"] == 36
    assert figures["lost_fraction"] == 0.0
    assert figures["position_error_mean_m"] == pytest.approx(0.035 * math.sqrt(8 / math.pi), rel=0.25)


def test_float64_weights_of_four_cameras_offer_a_megabit(synthetic_run):
    run = synthetic_run("overloaded")
    weights = run.tables["messages"]["kind"] == "weights"
    expected = 8 * (run.tables["messages"]["bytes"][weights].sum() + 36 * 80) / 9.0
    assert run.summary["offered_bps"] == pytest.approx(expected)
    assert run.summary["offered_bps"] > 3 * run.summary["channel_bps"]


def test_an_empty_run_has_no_figures_and_no_nan():
    empty = summary(
        steps=STEPS.head(0), nodes=nodes().head(1), messages=messages().head(0), base="base", step_s=0.25,
        lost_above_m=1.6, channel_bps=None, simulated_s=1.0, wall_s=0.1,
    )  # fmt: skip
    json.dumps(empty, allow_nan=False)
    for key in (
        "position_error_mean_m",
        "lost_fraction",
        "delivery_ratio",
        "energy_per_step_j",
        "latency_p50_s",
    ):
        assert empty[key] is None
