"""The committed tables of runs: of the studies that are there, and any row can be made again."""

import random
from pathlib import Path

import pandas as pd
import pytest

from wsnsim.claims.multiview.evidence import STUDIES
from wsnsim.claims.record import planned, read_record
from wsnsim.runs.run import run
from wsnsim.sweeps.study import load_study

ROOT = Path(__file__).parents[2]
RERUN = 3
"""Cells that are run again, one seed each."""
SAME = 0.05
"""Two processors add in different orders, and a particle filter makes more of that."""


@pytest.fixture(scope="module")
def rows() -> pd.DataFrame:
    if not (ROOT / "reports").is_dir():
        pytest.skip("the reports do not ship with the source distribution")
    return read_record(ROOT / "reports" / "multiview.csv")


@pytest.mark.parametrize("study", STUDIES, ids=lambda study: study.name)
def test_the_table_is_of_the_studies_as_they_are(study, rows: pd.DataFrame) -> None:
    """A study that has other cells or seeds makes the published figures stale: run `make reports`."""
    own = rows[rows["study"] == study.name]
    found = set(zip(own["cell"], own["seed"], strict=True))
    assert found == {(each.cell.name, each.seed) for each in load_study(ROOT / study.file).runs}


@pytest.mark.parametrize("nth", range(RERUN))
def test_a_row_can_be_made_again(nth: int, rows: pd.DataFrame, test_seed: int) -> None:
    """Of runs that keep their target: one that loses it goes anywhere after a rounding."""
    kept = rows[rows["lost_fraction"] == 0.0]
    chosen = random.Random(test_seed).sample(range(len(kept)), RERUN)[nth]
    row = kept.iloc[chosen].to_dict()
    summary = run(planned(row, STUDIES, ROOT).loaded).summary
    for key in ("position_error_mean_m", "app_bytes_per_step", "cpu_cycles_per_step", "energy_per_step_j"):
        assert summary[key] == pytest.approx(row[key], rel=SAME), f"{row['cell']}, seed {row['seed']}: {key}"
