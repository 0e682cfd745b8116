"""The main figures of all runs behind a page, as a small CSV file that is committed beside it.

What stands in it can be made again: any row names its study, cell and seed, and a
run of these must come to the same figures.
"""

from collections.abc import Mapping, Sequence
from io import StringIO
from pathlib import Path

import pandas as pd

from wsnsim.claims.results import Results, StudyFile
from wsnsim.errors import OutputError
from wsnsim.sweeps.study import PlannedRun, load_study

FIGURES = (
    "position_error_mean_m",
    "reprojection_error_mean_px",
    "orientation_error_mean_deg",
    "lost_fraction",
    "unmeasured_steps",
    "app_bytes_per_step",
    "mac_bytes_per_step",
    "base_ingress_bytes_per_step",
    "cpu_cycles_per_step",
    "energy_per_step_j",
    "latency_p95_s",
    "latency_p99_s",
    "heard_ratio",
)
_DIGITS = 9
"""Significant digits: more than any comparison asks for, less than a machine's rounding shows."""


def record_text(studies: Sequence[Results], figures: Sequence[str] = FIGURES) -> str:
    """Return the file's text: one row for each study, cell and seed, with some figures of their summaries."""
    rows = []
    for results in studies:
        frame = results.runs[["name", "seed", "scenario_sha256", *figures]]
        frame = frame.rename(columns={"name": "cell"})
        frame.insert(0, "study", results.study.name)
        rows.append(frame)
    text = StringIO()
    pd.concat(rows).to_csv(text, index=False, float_format=f"%.{_DIGITS}g", lineterminator="\n")
    return text.getvalue()


def read_record(path: Path) -> pd.DataFrame:
    """Return the rows of a file of figures.

    Raises
    ------
    OutputError : no such file
    """
    if not path.is_file():
        raise OutputError(f"{path}: the table of figures must exist; run: make reports")
    return pd.read_csv(path)


def planned(row: Mapping[str, object], studies: Sequence[StudyFile], root: Path) -> PlannedRun:
    """Return the run that a row is of, as its study plans it now.

    Parameters
    ----------
    row : of `read_record`
    studies : those that the rows may be of
    root : folder of the project, from which studies are named

    Raises
    ------
    OutputError : the study has no such run any more
    """
    files = {study.name: root / study.file for study in studies}
    loaded = load_study(files[str(row["study"])])
    of = f"{row['study']}, cell {row['cell']}, seed {row['seed']}"
    for run in loaded.runs:
        if run.cell.name == row["cell"] and run.seed == row["seed"]:
            return run
    raise OutputError(f"{of}: the study has no such run any more; run: make reports")
