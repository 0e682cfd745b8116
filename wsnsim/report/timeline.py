"""The figure over time: error above, cameras that saw the target and were heard below."""

from html import escape
from typing import Any

import pandas as pd
import plotly.graph_objects as go

from wsnsim.report.charts import GREY, TargetStyle, axis, explain, figure, short, target_style, translucent
from wsnsim.report.context import ReportContext

MOST_ROWS = 6
"""More targets than this share one row of sums below."""

_ERROR_PX, _ROW_PX, _GAP_PX, _AROUND_PX = 190, 56, 26, 70
"""Heights where there are several targets: errors, a row of counts, the gap above it, titles and ticks."""

_SEEN, _HEARD, _GUESSED = "see the target", "heard in time", "no measurement"


def timeline_figure(context: ReportContext) -> go.Figure:
    """Return error, participating and heard cameras over a shared time axis."""
    steps = context.tables["steps"]
    targets = list(dict.fromkeys(steps["target"]))
    styles = [target_style(number, len(targets)) for number in range(len(targets))]
    rows = [steps[steps["target"] == target] for target in targets]
    if len(targets) <= 1:
        chart = _alone(context)
        for style, row in zip(styles, rows, strict=True):
            _add_error(chart, row, style, "error", several=False)
            _add_counts(chart, row, style, "y2", several=False)
        return chart
    names = [escape(str(target)) for target in targets]
    if len(targets) <= MOST_ROWS:
        chart = _several(context, [f"cameras: {name}" for name in names], 1)
        for number, (style, row) in enumerate(zip(styles, rows, strict=True)):
            _add_counts(chart, row, style, f"y{number + 2}", several=True)
    else:
        chart = _several(context, [f"cameras: sum over {len(targets)} targets"], len(targets))
        sums = steps.groupby("time_s", as_index=False)[["participating", "heard"]].sum(min_count=1)
        _add_counts(chart, sums, TargetStyle(GREY, GREY), "y2", several=True)
    for name, style, row in zip(names, styles, rows, strict=True):
        _add_error(chart, row, style, f"{name}: error", several=True)
    if (steps["kind"] != "update").any():
        explain(chart, _GUESSED, **_guessed_look(GREY))
    explain(chart, _SEEN, **_seen_look(GREY))
    explain(chart, _HEARD, **_heard_look(GREY))
    return chart


def _alone(context: ReportContext) -> go.Figure:
    tick = max(1, len(context.cameras) // 5)
    return figure(
        xaxis=axis("time [s]", anchor="y2"),
        yaxis=axis("error [m]", domain=[0.46, 1], rangemode="tozero"),
        yaxis2=axis("cameras", domain=[0, 0.36], rangemode="tozero", tickformat="d", dtick=tick),
    )


def _several(context: ReportContext, titles: list[str], times: int) -> go.Figure:
    """Return the axes of the errors and, below them, of a row for each title, each up to the same count."""
    height = _ERROR_PX + len(titles) * (_GAP_PX + _ROW_PX)
    most = max(1, times * len(context.cameras))
    chart = figure(
        height=height + _AROUND_PX,
        xaxis=axis("time [s]", anchor=f"y{len(titles) + 1}"),
        yaxis=axis("error [m]", domain=[1 - _ERROR_PX / height, 1], rangemode="tozero"),
    )
    for number, title in enumerate(titles):
        top = 1 - (_ERROR_PX + _GAP_PX + number * (_GAP_PX + _ROW_PX)) / height
        row = axis(
            "", domain=[max(0.0, top - _ROW_PX / height), top], range=[0, 1.1 * most], tickvals=[0, most]
        )
        chart.update_layout({f"yaxis{number + 2}": row})
        chart.add_annotation(
            text=title,
            x=0,
            y=top,
            xref="paper",
            yref="paper",
            xanchor="left",
            yanchor="bottom",
            showarrow=False,
        )
    return chart


def _add_error(chart: go.Figure, rows: pd.DataFrame, style: TargetStyle, name: str, several: bool) -> None:
    chart.add_scatter(
        x=short(rows["time_s"]),
        y=short(rows["error_m"]),
        mode="lines+markers",
        name=name,
        line={"color": style.estimate, "width": 2},
        marker={"size": 6 if several else 4, "symbol": style.symbol},
        hovertemplate=f"{name}<br>%{{x:.2f}} s: %{{y:.3f}} m<extra></extra>"
        if several
        else "%{x:.2f} s: %{y:.3f} m<extra></extra>",
    )
    guessed = rows[rows["kind"] != "update"]
    if len(guessed):
        chart.add_scatter(
            x=short(guessed["time_s"]),
            y=short(guessed["error_m"]),
            name=_GUESSED,
            showlegend=not several,
            hovertemplate="%{x:.2f} s: no measurement<extra></extra>",
            **_guessed_look(style.estimate),
        )


def _add_counts(chart: go.Figure, rows: pd.DataFrame, style: TargetStyle, yaxis: str, several: bool) -> None:
    times = short(rows["time_s"])
    chart.add_scatter(
        x=times,
        y=[int(n) for n in rows["participating"]],
        yaxis=yaxis,
        name=_SEEN,
        showlegend=not several,
        hovertemplate="%{x:.2f} s: seen by %{y} cameras<extra></extra>",
        **_seen_look(style.truth if several else GREY),
    )
    chart.add_scatter(
        x=times,
        y=short(rows["heard"].astype("float64")),
        yaxis=yaxis,
        name=_HEARD,
        showlegend=not several,
        hovertemplate="%{x:.2f} s: %{y} cameras heard<extra></extra>",
        **_heard_look(style.estimate),
    )


def _guessed_look(colour: str) -> dict[str, Any]:
    marker = {"color": colour, "size": 10, "symbol": "x-thin", "line": {"color": colour, "width": 2}}
    return {"mode": "markers", "marker": marker, "legendgroup": "guessed"}


def _seen_look(colour: str) -> dict[str, Any]:
    return {
        "mode": "lines",
        "line": {"color": colour, "width": 1, "shape": "hvh"},
        "fill": "tozeroy",
        "fillcolor": translucent(colour, 0.25),
        "legendgroup": "seen",
    }


def _heard_look(colour: str) -> dict[str, Any]:
    return {"mode": "lines", "line": {"color": colour, "width": 2, "shape": "hvh"}, "legendgroup": "heard"}
