"""What the runs of a study come to, cell by cell, and cell against cell on the same seeds."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from wsnsim.metrics.statistics import Interval, mean_interval, ratio_interval, share_interval, sign_test
from wsnsim.types import FloatArray

LOST = "lost_fraction"


@dataclass(frozen=True)
class Comparison:
    """A cell beside another one, over the seeds that both have.

    Parameters
    ----------
    ratio : geometric mean of the paired ratios
    difference : mean of the paired differences, in the figure's unit
    seeds : how many both have
    """

    ratio: Interval
    difference: Interval
    seeds: int


@dataclass(frozen=True)
class Losses:
    """Runs that lost a target in one cell only, and how likely so uneven a split is by chance.

    Parameters
    ----------
    here, there : runs lost in this cell only, in the other only
    probability : McNemar's exact test, two-sided
    """

    here: int
    there: int
    probability: float


def cells_table(cells: pd.DataFrame, runs: pd.DataFrame, figures: Sequence[str]) -> pd.DataFrame:
    """Return one row for each cell: runs, lost runs, and mean and 95 % interval of each figure.

    Parameters
    ----------
    cells, runs : of a sweep's file
    figures : columns of `runs`, in the order in which they are to stand

    Returns
    -------
    `cell, name, scenario, factor, level, runs, failed, pending, lost_runs, lost_share, lost_share_low,
    lost_share_high`, and for each figure its `_n` (runs that have it), itself (the mean), `_low` and `_high`
    """
    rows = []
    for cell in cells.to_dict("records"):
        own = runs[runs["cell"] == cell["cell"]]
        done = own[own["status"] == "complete"]
        lost = share_interval(int(_lost(done).sum()), int(done[LOST].notna().sum()))
        row = {key: cell[key] for key in ("cell", "name", "scenario", "factor", "level")}
        row |= {
            "runs": len(done),
            "failed": int((own["status"] == "failed").sum()),
            "pending": int((own["status"] == "pending").sum()),
            "lost_runs": int(_lost(done).sum()),
            "lost_share": lost.value,
            "lost_share_low": lost.low,
            "lost_share_high": lost.high,
        }
        for key in figures:
            interval = mean_interval(done[key].to_numpy(np.float64))
            row |= {
                f"{key}_n": interval.n,
                key: interval.value,
                f"{key}_low": interval.low,
                f"{key}_high": interval.high,
            }
        rows.append(row)
    return pd.DataFrame(rows)


def compare(runs: pd.DataFrame, cell: int, other: int, figure: str) -> Comparison:
    """Return a figure of a cell beside that of another one, seed by seed."""
    ours, theirs = _paired(runs, cell, other, figure)
    present = ~(np.isnan(ours) | np.isnan(theirs))
    return Comparison(ratio_interval(ours, theirs), mean_interval(ours - theirs), int(present.sum()))


def compare_losses(runs: pd.DataFrame, cell: int, other: int) -> Losses:
    """Return in how many pairs of runs only one cell's lost a target."""
    ours, theirs = (values > 0 for values in _paired(runs, cell, other, LOST))
    here, there = int((ours & ~theirs).sum()), int((theirs & ~ours).sum())
    return Losses(here, there, sign_test(here, there))


def _paired(runs: pd.DataFrame, cell: int, other: int, figure: str) -> tuple[FloatArray, FloatArray]:
    """Return a figure of two cells at the seeds that are complete in both, in their order."""
    done = runs[runs["status"] == "complete"]
    ours = done[done["cell"] == cell].set_index("seed")[figure]
    theirs = done[done["cell"] == other].set_index("seed")[figure]
    seeds = sorted(set(ours.index) & set(theirs.index))
    return ours.loc[seeds].to_numpy(np.float64), theirs.loc[seeds].to_numpy(np.float64)


def _lost(done: pd.DataFrame) -> "pd.Series[bool]":
    """Tell the runs that lost a target."""
    return done[LOST] > 0
