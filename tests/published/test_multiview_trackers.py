"""What the trackers of the published family reach, from the committed table of all runs.

Kushwaha & Koutsoukos 2013 in the worlds of setups A and B; 15 seeds a cell, paired. The
table is made by `make reports`; tests/published/test_reports.py runs some rows again.
"""

from math import sqrt
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from wsnsim.claims.record import read_record
from wsnsim.metrics.statistics import mean_interval, ratio_interval, sign_test

ROOT = Path(__file__).parents[2]
VARIANTS, FACTORS, RADIO = "multiview-variants", "multiview-factors", "multiview-radio"


@pytest.fixture(scope="module")
def rows() -> pd.DataFrame:
    if not (ROOT / "reports").is_dir():
        pytest.skip("the reports do not ship with the source distribution")
    return read_record(ROOT / "reports" / "multiview.csv")


def cell(rows: pd.DataFrame, study: str, name: str) -> pd.DataFrame:
    """Return the 15 runs of a cell, by seed."""
    own = rows[(rows["study"] == study) & (rows["cell"] == name)].sort_values("seed")
    assert own["seed"].tolist() == list(range(15))
    return own.reset_index(drop=True)


def errors(rows: pd.DataFrame, study: str, name: str) -> np.ndarray:
    return cell(rows, study, name)["position_error_mean_m"].to_numpy()


@pytest.mark.parametrize("variant", ["T1", "T2", "T3", "T4"])
def test_near_the_cameras_all_are_as_good_as_the_base_tracker(rows: pd.DataFrame, variant: str) -> None:
    ratio = ratio_interval(errors(rows, VARIANTS, f"A/{variant}"), errors(rows, VARIANTS, "A/T0"))
    assert ratio.high <= 1.3
    assert mean_interval(errors(rows, VARIANTS, "A/T2")).high <= 0.05


@pytest.mark.parametrize(
    ("variant", "metres", "pixels"),
    [("T0", 0.09, 1.5), ("T1", 0.09, 1.5), ("T2", 0.09, 1.5), ("T3", 0.10, np.inf), ("T4", 0.10, np.inf)],
)
def test_far_from_the_cameras(rows: pd.DataFrame, variant: str, metres: float, pixels: float) -> None:
    own = cell(rows, VARIANTS, f"B/{variant}")
    assert mean_interval(own["position_error_mean_m"]).high <= metres
    assert own["reprojection_error_mean_px"].mean() <= pixels
    assert (own["lost_fraction"] > 0).sum() <= 1


def test_fusing_on_the_way_costs_no_accuracy(rows: pd.DataFrame) -> None:
    ratio = ratio_interval(errors(rows, VARIANTS, "B/T1"), errors(rows, VARIANTS, "B/T2"))
    assert 0.85 <= ratio.low <= ratio.high <= 1.15


def test_log_ratios_are_sharper_still(rows: pd.DataFrame) -> None:
    ratios = cell(rows, FACTORS, next(name for name in rows["cell"].unique() if "log_ratio" in name))
    default = errors(rows, VARIANTS, "B/T2")
    assert ratio_interval(ratios["position_error_mean_m"], default).value <= 0.7
    assert (ratios["lost_fraction"] > 0).sum() == 0


def test_eight_bits_are_enough(rows: pd.DataFrame) -> None:
    own = cell(rows, FACTORS, next(name for name in rows["cell"].unique() if "uint8" in name))
    default = cell(rows, VARIANTS, "B/T2")
    assert ratio_interval(own["position_error_mean_m"], default["position_error_mean_m"]).value <= 1.15
    # state and answers together, every message with its header
    assert own["app_bytes_per_step"].sum() <= 0.25 * default["app_bytes_per_step"].sum()


def test_rays_of_independent_trackers_are_poor_in_the_printed_form(rows: pd.DataFrame) -> None:
    rays, fused = (cell(rows, VARIANTS, f"B/{name}-published") for name in ("P", "T2"))
    default = cell(rows, VARIANTS, "B/T2")
    assert (rays["lost_fraction"] > 0).sum() >= 12
    worse = int((rays["position_error_mean_m"] > default["position_error_mean_m"]).sum())
    assert sign_test(worse, 15 - worse) < 0.01
    assert np.isfinite(fused["position_error_mean_m"]).all()


def test_t2_in_8_bits_keeps_its_deadline_over_802_15_4(rows: pd.DataFrame) -> None:
    """At 4 Hz on Imote2 motes, over a tree of up to four hops: within 250 ms, nearly all cameras heard."""
    own = cell(rows, RADIO, "T2")
    assert (own["latency_p99_s"] <= 0.25).all()
    heard = own["heard_ratio"]
    assert heard.mean() - 2.145 * heard.std(ddof=1) / sqrt(15) >= 0.95
    assert (own["lost_fraction"] > 0).sum() == 0
