"""Runs of a study, cell by cell and cell against cell."""

import numpy as np
import pandas as pd
import pytest

from wsnsim.metrics.cells import cells_table, compare, compare_losses
from wsnsim.metrics.statistics import mean_interval

NAN = float("nan")
CELLS = pd.DataFrame(
    {"cell": [0, 1], "name": ["a", "b"], "scenario": "", "factor": ["", "f"], "level": ["default", "b"]}
)
RUNS = pd.DataFrame(
    [
        (0, 0, "complete", 1.0, 0.0),
        (0, 1, "complete", 2.0, 1.0),
        (0, 2, "complete", 4.0, 0.0),
        (0, 3, "failed", NAN, NAN),
        (1, 0, "complete", 2.0, 1.0),
        (1, 1, "complete", 4.0, 0.5),
        (1, 2, "pending", NAN, NAN),
        (1, 3, "complete", 7.0, 0.0),
    ],
    columns=["cell", "seed", "status", "error_m", "lost_fraction"],
)


def test_a_cell_is_the_mean_of_its_complete_runs() -> None:
    table = cells_table(CELLS, RUNS, ["error_m"]).set_index("name")
    a = table.loc["a"]
    interval = mean_interval([1.0, 2.0, 4.0])
    assert (a["error_m"], a["error_m_low"], a["error_m_high"], a["error_m_n"]) == pytest.approx(
        (interval.value, interval.low, interval.high, 3)
    )
    assert list(table["runs"]) == [3, 3]
    assert list(table["failed"]) == [1, 0]
    assert list(table["pending"]) == [0, 1]
    assert list(table["lost_runs"]) == [1, 2]
    assert a["lost_share"] == pytest.approx(1 / 3)
    assert a["lost_share_low"] < 1 / 3 < a["lost_share_high"]


def test_cells_are_compared_on_the_seeds_that_both_have() -> None:
    """Seeds 0 and 1, twice as far off each."""
    result = compare(RUNS, 1, 0, "error_m")
    assert result.seeds == 2
    assert result.ratio.value == pytest.approx(2.0)
    assert result.ratio.high - result.ratio.low == pytest.approx(0.0, abs=1e-12)
    assert result.difference.value == pytest.approx(1.5)


def test_losses_are_compared_pair_by_pair() -> None:
    losses = compare_losses(RUNS, 1, 0)
    assert (losses.here, losses.there) == (1, 0)
    assert losses.probability == 1.0


def test_cells_without_a_common_seed_have_nothing_to_compare() -> None:
    result = compare(RUNS[RUNS["seed"] != 0].query("seed != 1"), 1, 0, "error_m")
    assert result.seeds == 0
    assert np.isnan(result.ratio.value)
