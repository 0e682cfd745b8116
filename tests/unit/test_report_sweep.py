"""The chart of a study: one marker for each cell, its bars, and scales that fit."""

import numpy as np
import pandas as pd
import pytest

from wsnsim.report.sweepfigures import cost_figure


def cells(x: list[float], y: list[float]) -> pd.DataFrame:
    factor, level = ["", "f", "f"][: len(x)], ["default", "<a>", "b"][: len(x)]
    frame = pd.DataFrame({"name": level, "factor": factor, "level": level, "x": x, "y": y})
    return frame.assign(x_low=frame["x"] - 1, x_high=frame["x"] + 1, y_low=-0.5, y_high=frame["y"] + 0.5)


def test_each_cell_is_a_marker_with_its_interval() -> None:
    chart = cost_figure(cells([10.0, 100.0, 5000.0], [0.1, 0.2, 0.4]), "x", "y", ("cost", "error"), False)
    default, others = chart.data
    assert (list(default.x), list(default.y)) == ([10.0], [0.1])
    assert list(others.x) == [100.0, 5000.0]
    assert list(others.text) == ["&lt;a&gt;", "b"]
    assert list(others.error_x.array) == [1.0, 1.0]
    # cut at a tenth of the mean: below zero there is no logarithm
    assert list(others.error_y.arrayminus) == pytest.approx([0.18, 0.36])
    assert chart.layout.xaxis.type == chart.layout.yaxis.type == "log"
    low, high = chart.layout.xaxis.range
    assert low < np.log10(9) < np.log10(5001) < high
    assert list(chart.layout.xaxis.ticktext) == ["10", "100", "1\u202f000"]


def test_what_hardly_differs_stands_on_a_scale_from_zero() -> None:
    chart = cost_figure(cells([300.0, 310.0], [0.1, 0.2]), "x", "y", ("cost", "error"), False)
    assert chart.layout.xaxis.type is None
    assert chart.layout.xaxis.rangemode == "tozero"


def test_cells_without_a_figure_are_left_out() -> None:
    nothing = cells([float("nan")], [0.1])
    assert len(cost_figure(nothing, "x", "y", ("cost", "error"), True).data) == 0
