"""The committed tables of runs: of scenarios that still are what they were, and any row can be made again."""

import random
from pathlib import Path

import pandas as pd
import pytest

from wsnsim.claims.multiview.evidence import STUDIES
from wsnsim.claims.record import FIGURES, planned, read_record
from wsnsim.runs.run import run
from wsnsim.sweeps.study import load_study

ROOT = Path(__file__).parents[2]
RERUN = 3
"""Cells that are run again, one seed each."""


@pytest.fixture(scope="module")
def rows() -> pd.DataFrame:
    if not (ROOT / "reports").is_dir():
        pytest.skip("the reports do not ship with the source distribution")
    return read_record(ROOT / "reports" / "multiview.csv")


@pytest.mark.parametrize("study", STUDIES, ids=lambda study: study.name)
def test_the_table_is_of_the_studies_as_they_are(study, rows: pd.DataFrame) -> None:
    """A scenario, study or schema that changes makes the published figures stale: run `make reports`."""
    own = rows[rows["study"] == study.name]
    found = set(zip(own["cell"], own["seed"], own["scenario_sha256"], strict=True))
    runs = load_study(ROOT / study.file).runs
    assert found == {(each.cell.name, each.seed, each.scenario_sha256) for each in runs}


@pytest.mark.parametrize("nth", range(RERUN))
def test_a_row_can_be_made_again(nth: int, rows: pd.DataFrame, test_seed: int) -> None:
    chosen = random.Random(test_seed).sample(range(len(rows)), RERUN)[nth]
    row = rows.iloc[chosen].to_dict()
    summary = run(planned(row, STUDIES, ROOT).loaded).summary
    made = {key: float("nan") if summary.get(key) is None else summary[key] for key in FIGURES}
    kept = {key: row[key] for key in FIGURES}
    assert made == pytest.approx(kept, rel=1e-6, abs=1e-9, nan_ok=True), f"{row['cell']}, seed {row['seed']}"
