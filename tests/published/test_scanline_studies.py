"""The committed table of the scan-line runs: of the studies that are there, and any row can be made again."""

import random
from pathlib import Path

import pandas as pd
import pytest

from wsnsim.claims.record import planned, read_record
from wsnsim.claims.scanline.studies import LAB_STUDY, STUDIES, units_m
from wsnsim.runs.run import run
from wsnsim.sweeps.study import load_study

ROOT = Path(__file__).parents[2]
RERUN = 3
"""Rows that are run again."""
SAME = 0.1
"""Two processors add in different orders, and a particle filter makes more of that."""
WELL, WELL_UNITS = {LAB_STUDY.name: 6.0}, 3.0
"""RMSE up to which an object was never lost for long: one that is lost goes anywhere after a rounding."""
LONG = (
    "scanline-cameras",
    "scanline-priors",
    "scanline-tradeoff",
    "scanline-occluders",
    "scanline-radio",
    "scanline-hull",
)
"""Studies whose runs take too long for a test."""


@pytest.fixture(scope="module")
def rows() -> pd.DataFrame:
    if not (ROOT / "reports").is_dir():
        pytest.skip("the reports do not ship with the source distribution")
    return read_record(ROOT / "reports" / "scanline.csv")


@pytest.mark.parametrize("study", STUDIES, ids=lambda study: study.name)
def test_the_table_is_of_the_studies_as_they_are(study, rows: pd.DataFrame) -> None:
    """A study that has other cells or seeds makes the published figures stale: run `make scanline-report`."""
    own = rows[rows["study"] == study.name]
    found = set(zip(own["cell"], own["seed"], strict=True))
    assert found == {(each.cell.name, each.seed) for each in load_study(ROOT / study.file).runs}


@pytest.mark.parametrize("nth", range(RERUN))
def test_a_row_can_be_made_again(nth: int, rows: pd.DataFrame, test_seed: int) -> None:
    well_m = rows["study"].map({name: WELL.get(name, WELL_UNITS) * unit for name, unit in units_m().items()})
    short = rows[~rows["study"].isin(LONG) & (rows["position_rmse_m"] < well_m)]
    chosen = random.Random(test_seed).sample(range(len(short)), RERUN)[nth]
    row = short.iloc[chosen].to_dict()
    summary = run(planned(row, STUDIES, ROOT).loaded).summary
    of = f"{row['study']}, {row['cell']}, seed {row['seed']}"
    assert summary["position_rmse_m"] == pytest.approx(row["position_rmse_m"], rel=SAME), of
    assert summary["app_bytes_per_step"] == pytest.approx(row["app_bytes_per_step"], rel=1e-6), of
    assert summary["heard_ratio"] == pytest.approx(row["heard_ratio"], abs=1e-9), of
