"""The figure over time: error on top, then how the targets are turned, seen and heard.

After Fig. 10 of Kushwaha & Koutsoukos (2013), which holds the error against
the number of cameras with the target in view and its share of their images.
"""

from dataclasses import dataclass
from html import escape
from typing import Any

import pandas as pd
import plotly.graph_objects as go

from wsnsim.report.charts import (
    GREEN,
    GREY,
    PURPLE,
    TargetStyle,
    axis,
    explain,
    figure,
    short,
    target_style,
    translucent,
)
from wsnsim.report.context import ReportContext
from wsnsim.report.glossary import ESTIMATES, explained

MOST_ROWS = 6
"""More targets than this share one row of sums for their cameras."""

_ERROR_PX, _PANEL_PX, _ROW_PX, _GAP_PX, _AROUND_PX = 190, 84, 56, 28, 70
"""Heights: errors, another panel, a row of counts, the gap above each, titles and ticks."""

_SEEN, _HEARD, _GUESSED, _SMOOTHED = (
    "see the target",
    "heard in time",
    "no measurement",
    "smoothed afterwards",
)

_STILL_DEG = 1e-3
"""Orientations that are off by less at every step were neither turned nor estimated."""

_TRACK_EVENTS = {
    "track_lost": ("track lost", "x", PURPLE),
    "track_started": ("track started", "star", GREEN),
    "reinitialised": ("particles drawn anew", "diamond", PURPLE),
}


@dataclass(frozen=True)
class _Panel:
    """One of the axes that stand over each other and share the time.

    Parameters
    ----------
    title : above it; for the first, beside it
    height_px : of its ground
    options : of its y axis
    """

    title: str
    height_px: int
    options: dict[str, Any]


def timeline_figure(context: ReportContext) -> go.Figure:
    """Return error, orientation error, pixel share and counts of cameras over a shared time axis."""
    steps = context.tables["steps"]
    targets = list(dict.fromkeys(steps["target"]))
    several = len(targets) > 1
    styles = [target_style(number, len(targets)) for number in range(len(targets))]
    rows = [steps[steps["target"] == target] for target in targets]
    names = [escape(str(target)) for target in targets]
    panels = [_Panel("error [m]", _ERROR_PX, {"rangemode": "tozero"})]
    counts = _count_panels(context, names)
    shown = {"orientation_error_deg": turns(steps), "pixel_share": counts_pixels(steps)}
    others = [column for column in _OTHERS if shown[column]]
    panels += [_OTHERS[column] for column in others] + counts
    chart = _stacked(panels)
    first = 2 + len(others)
    for name, style, row in zip(names, styles, rows, strict=True):
        _add_error(chart, row, style, f"{name}: error" if several else "error", several)
        for place, column in enumerate(others):
            _add_other(chart, row, style, column, f"y{2 + place}", name if several else "")
    if len(counts) < len(targets):
        sums = steps.groupby("time_s", as_index=False)[["participating", "heard"]].sum(min_count=1)
        _add_counts(chart, sums, TargetStyle(GREY, GREY), f"y{first}", several)
    else:
        for number, (style, row) in enumerate(zip(styles, rows, strict=True)):
            _add_counts(chart, row, style, f"y{first + number}", several)
    _add_track_events(chart, context.tables["events"])
    if several:
        if (steps["kind"] != "update").any():
            explain(chart, _GUESSED, **_guessed_look(GREY))
        if steps["smoothed_error_m"].notna().any():
            explain(chart, _SMOOTHED, **_smoothed_look(GREY))
        explain(chart, _SEEN, **_seen_look(GREY))
        explain(chart, _HEARD, **_heard_look(GREY))
    return chart


_OTHERS = {
    "orientation_error_deg": _Panel("orientation error [°]", _PANEL_PX, {"rangemode": "tozero", "nticks": 4}),
    "pixel_share": _Panel(
        "share of the image that shows the target [%]",
        _PANEL_PX,
        {"rangemode": "tozero", "nticks": 4},
    ),
}


def turns(steps: pd.DataFrame) -> bool:
    """Return whether a target turns or its orientation is estimated, so that there is an error to show."""
    return bool(steps["orientation_error_deg"].max() > _STILL_DEG)


def counts_pixels(steps: pd.DataFrame) -> bool:
    """Return whether it is known how much of the images shows a target: not where nobody looks at pixels."""
    return bool(steps["pixel_share"].notna().any())


def _count_panels(context: ReportContext, names: list[str]) -> list[_Panel]:
    """Return a panel of cameras for each target, or one for the sums over too many targets."""
    most = max(1, len(context.cameras))
    ticks = {"range": [0, 1.1 * most], "tickvals": [0, most]}
    if len(names) > MOST_ROWS:
        times = len(names)
        ticks = {"range": [0, 1.1 * most * times], "tickvals": [0, most * times]}
        return [_Panel(f"cameras: sum over {times} targets", _ROW_PX, ticks)]
    if len(names) > 1:
        return [_Panel(f"cameras: {name}", _ROW_PX, ticks) for name in names]
    tick = max(1, most // 5)
    return [_Panel("cameras", _PANEL_PX, {"range": [0, 1.1 * most], "tickformat": "d", "dtick": tick})]


def _stacked(panels: list[_Panel]) -> go.Figure:
    """Return the axes of panels from top to bottom."""
    height = sum(panel.height_px for panel in panels) + _GAP_PX * (len(panels) - 1)
    chart = figure(height=height + _AROUND_PX, xaxis=axis("time [s]", anchor=f"y{len(panels)}"))
    top = float(height)
    for number, panel in enumerate(panels):
        bottom = top - panel.height_px
        domain = [max(0.0, bottom / height), top / height]
        name = f"yaxis{number + 1}" if number else "yaxis"
        chart.update_layout({name: axis("" if number else panel.title, domain=domain, **panel.options)})
        if number:
            chart.add_annotation(
                text=panel.title,
                x=0,
                y=top / height,
                xref="paper",
                yref="paper",
                xanchor="left",
                yanchor="bottom",
                showarrow=False,
            )
        top = bottom - _GAP_PX
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
    smoothed = rows[rows["smoothed_error_m"].notna()]
    if len(smoothed):
        chart.add_scatter(
            x=short(smoothed["time_s"]),
            y=short(smoothed["smoothed_error_m"]),
            name=_SMOOTHED,
            showlegend=not several,
            hovertemplate="%{x:.2f} s: %{y:.3f} m, smoothed afterwards<extra></extra>",
            **_smoothed_look(style.truth),
        )
    guessed = rows[rows["kind"] != "update"]
    if len(guessed):
        why = [
            explained(ESTIMATES, kind) if isinstance(kind, str) else "no estimate" for kind in guessed["kind"]
        ]
        chart.add_scatter(
            x=short(guessed["time_s"]),
            y=short(guessed["error_m"]),
            name=_GUESSED,
            showlegend=not several,
            text=why,
            hovertemplate="%{x:.2f} s: no measurement: %{text}<extra></extra>",
            **_guessed_look(style.estimate),
        )


def _add_other(
    chart: go.Figure, rows: pd.DataFrame, style: TargetStyle, column: str, yaxis: str, target: str
) -> None:
    """Add a line without an entry in the legend: its panel's title says what it is."""
    share = column == "pixel_share"
    whose = f"{target}<br>" if target else ""
    chart.add_scatter(
        x=short(rows["time_s"]),
        y=short(100 * rows[column] if share else rows[column]),
        yaxis=yaxis,
        mode="lines+markers",
        connectgaps=False,
        line={"color": style.truth if share else style.estimate, "width": 1.5},
        marker={"size": 3},
        name="share of the image" if share else "orientation error",
        showlegend=False,
        hovertemplate=f"{whose}%{{x:.2f}} s: %{{y:.3g}}{' %' if share else '°'}<extra></extra>",
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


def _add_track_events(chart: go.Figure, events: pd.DataFrame) -> None:
    """Mark on the ground of the errors where a tracker gave a track up or began one."""
    for kind, (name, symbol, colour) in _TRACK_EVENTS.items():
        rows = events[events["kind"] == kind]
        if len(rows):
            chart.add_scatter(
                x=short(rows["time_s"]),
                y=[0.0] * len(rows),
                mode="markers",
                name=name,
                marker={"color": colour, "size": 11, "symbol": symbol},
                cliponaxis=False,
                text=[escape(f"{row['node']}: {row['detail']}") for row in rows.to_dict("records")],
                hovertemplate=f"%{{x:.2f}} s, {name}<br>%{{text}}<extra></extra>",
            )


def _guessed_look(colour: str) -> dict[str, Any]:
    marker = {"color": colour, "size": 10, "symbol": "x-thin", "line": {"color": colour, "width": 2}}
    return {"mode": "markers", "marker": marker, "legendgroup": "guessed"}


def _smoothed_look(colour: str) -> dict[str, Any]:
    return {
        "mode": "lines",
        "line": {"color": colour, "width": 1.5, "dash": "dot"},
        "legendgroup": "smoothed",
    }


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
