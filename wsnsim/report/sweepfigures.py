"""The chart of a study: what each cell costs against what it gets for it."""

from html import escape
from math import ceil, floor, isnan, log10
from typing import TYPE_CHECKING, Any

import plotly.graph_objects as go

from wsnsim.report.charts import BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILLION, axis, figure
from wsnsim.report.wording import number

if TYPE_CHECKING:
    import pandas as pd

_COLOURS = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY)
_SYMBOLS = ("circle", "square", "diamond", "triangle-up", "cross", "star", "triangle-down")
_LABELLED = 12
"""With more cells than this, names would cover each other and are shown on pointing only."""
_HEIGHT = 380
_CUT = 0.1
"""On a logarithmic scale a bar is cut at this share of its mean."""
_NARROW = 1.6
"""Ends less than this ratio apart stand on a linear scale."""
_ROOM = 1.25
"""So much farther than its data goes a logarithmic axis."""
_TICKS = ((1,), (1, 2, 5), (1, 1.5, 2, 3, 4, 5, 6, 8))
_FEW_TICKS = 3
_BESIDE = ("top right", "bottom right", "top left", "bottom left")
"""Names stand off the bars, and those of cells in one place apart."""


def cost_figure(cells: "pd.DataFrame", x: str, y: str, titles: tuple[str, str], by_factor: bool) -> go.Figure:
    """Return one marker for each cell, with its intervals.

    Parameters
    ----------
    cells : the table of cells
    x, y : its figures across and up
    titles : of the axes
    by_factor : colours tell factors, not cells, and a legend names them
    """
    drawn = [cell for cell in cells.to_dict("records") if not (isnan(cell[x]) or isnan(cell[y]))]
    across, up = _ends(drawn, x), _ends(drawn, y)
    chart = figure(
        xaxis=axis(titles[0], **_scale(across)),
        yaxis=axis(titles[1], **_scale(up)),
        height=_HEIGHT,
        showlegend=by_factor,
    )
    labelled = len(drawn) <= _LABELLED and not by_factor
    groups = list(dict.fromkeys(str(cell["factor"]) for cell in drawn))
    for at, group in enumerate(groups):
        own = [cell for cell in drawn if cell["factor"] == group]
        colour = _COLOURS[(at - ("" in groups)) % len(_COLOURS)] if group else GREY
        chart.add_scatter(
            x=[_plain(cell[x]) for cell in own],
            y=[_plain(cell[y]) for cell in own],
            error_x=_bars([across[drawn.index(cell)] for cell in own], colour),
            error_y=_bars([up[drawn.index(cell)] for cell in own], colour),
            mode="markers+text" if labelled else "markers",
            text=[escape(str(cell["level"])) for cell in own],
            textposition=[_BESIDE[(at + nth) % len(_BESIDE)] for nth in range(len(own))],
            cliponaxis=False,
            name=escape(group) or "default",
            customdata=[escape(str(cell["name"])) for cell in own],
            marker={"size": 10, "color": colour, "symbol": _SYMBOLS[at % len(_SYMBOLS)]},
            hovertemplate="%{customdata}<br>%{x:.4g}, %{y:.4g}<extra></extra>",
        )
    return chart


def _ends(cells: list[dict[Any, Any]], key: str) -> list[tuple[float, float, float]]:
    """Return low end, mean and high end of each cell's bar; the low end is cut for a logarithmic scale."""
    positive = all(cell[key] > 0 for cell in cells)
    ends = []
    for cell in cells:
        mean, low, high = (float(cell[each]) for each in (key, f"{key}_low", f"{key}_high"))
        if isnan(low):
            low = high = mean
        ends.append((max(low, _CUT * mean) if positive else low, mean, high))
    return ends


def _scale(ends: list[tuple[float, float, float]]) -> dict[str, Any]:
    """Return kind, range and ticks of an axis: logarithmic, if all means are positive and far apart."""
    low, high = min((end[0] for end in ends), default=0.0), max((end[2] for end in ends), default=1.0)
    if low <= 0 or high < _NARROW * low:
        return {"rangemode": "tozero"}
    decades = range(floor(log10(low)) - 1, ceil(log10(high)) + 1)
    ticks: list[float] = []
    for steps in _TICKS:
        ticks = [step * 10.0**decade for decade in decades for step in steps]
        ticks = [tick for tick in ticks if low / _ROOM <= tick <= high * _ROOM]
        if len(ticks) >= _FEW_TICKS:
            break
    return {
        "type": "log",
        "range": [_plain(log10(low / _ROOM)), _plain(log10(high * _ROOM))],
        "tickvals": [_plain(tick) for tick in ticks],
        "ticktext": [number(tick, 1 + (tick * 10 ** -floor(log10(tick)) % 1 > 0.01)) for tick in ticks],
    }


def _bars(ends: list[tuple[float, float, float]], colour: str) -> dict[str, Any]:
    return {
        "type": "data",
        "symmetric": False,
        "array": [_plain(high - mean) for _, mean, high in ends],
        "arrayminus": [_plain(mean - low) for low, mean, _ in ends],
        "color": colour,
        "thickness": 1.4,
        "width": 3,
    }


def _plain(value: float) -> float:
    """Return a number with as many digits as a screen can show."""
    return float(f"{value:.6g}")
