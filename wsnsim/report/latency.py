"""The figure of latency: how many of the estimates are there after how long."""

from html import escape

import numpy as np
import plotly.graph_objects as go

from wsnsim.report.charts import BLUE, GREY, axis, figure, short, target_style
from wsnsim.report.context import ReportContext
from wsnsim.report.wording import duration
from wsnsim.types import FloatArray

_MOST_CURVES = 6
"""Numbers of hops that have a curve of their own."""

_MOST_POINTS = 500
"""Corners of a drawn curve; those of longer runs are thinned."""


def latency_figure(context: ReportContext) -> go.Figure | None:
    """Return the distribution function of the latency of estimates from measurements; None without any."""
    steps = context.tables["steps"]
    measured = steps[(steps["kind"] == "update") & steps["latency_s"].notna()]
    if measured.empty:
        return None
    waited_ms = 1e3 * measured["latency_s"].to_numpy(np.float64)
    chart = _empty("time from the images to the estimate [ms]", "estimates that are there [%]")
    _add_curve(chart, waited_ms, "all targets", BLUE)
    targets = list(dict.fromkeys(steps["target"]))
    if len(targets) > 1:
        for number, target in enumerate(targets):
            own_ms = waited_ms[(measured["target"] == target).to_numpy(np.bool_)]
            if len(own_ms):
                colour = target_style(number, len(targets)).estimate
                _add_curve(chart, own_ms, escape(str(target)), colour, width=1.2)
    chart.update_layout(showlegend=len(targets) > 1)
    _mark(chart, waited_ms)
    return chart


def delay_figure(context: ReportContext) -> go.Figure | None:
    """Return the distribution function of the delay of packets, by hops; None where none arrived."""
    messages = context.tables["messages"]
    arrived = messages[messages["outcome"] == "delivered"]
    if arrived.empty:
        return None
    took_ms = 1e3 * (arrived["delivered_s"] - arrived["created_s"]).to_numpy(np.float64)
    chart = _empty("time from a packet's making to its arrival [ms]", "packets that are there [%]")
    _add_curve(chart, took_ms, "all packets", BLUE)
    hops = arrived["hops"].to_numpy(np.int64)
    ways = np.unique(hops)
    for number, way in enumerate(ways[:_MOST_CURVES] if len(ways) > 1 else ()):
        name = f"{way} hop{'s' if way > 1 else ''}"
        colour = target_style(number, _MOST_CURVES).estimate
        _add_curve(chart, took_ms[hops == way], name, colour, width=1.2)
    chart.update_layout(showlegend=len(ways) > 1)
    _mark(chart, took_ms)
    return chart


def _empty(time: str, share: str) -> go.Figure:
    return figure(
        height=300,
        xaxis=axis(time, rangemode="tozero"),
        yaxis=axis(share, range=[0, 104], tickvals=[0, 25, 50, 75, 100]),
    )


def _mark(chart: go.Figure, waited_ms: FloatArray) -> None:
    """Mark the median and the 95th percentile."""
    for percent in (50, 95):
        value_ms = float(np.percentile(waited_ms, percent))
        chart.add_scatter(
            x=short([value_ms, value_ms]),
            y=[0, percent],
            mode="lines+text",
            line={"color": GREY, "width": 1.2, "dash": "dash"},
            text=["", f"{percent} %: {duration(value_ms / 1e3)}"],
            # a curve that only rises leaves free what is above it to the left and below it to the right
            textposition="top left" if value_ms > 0.25 * waited_ms.max() else "bottom right",
            showlegend=False,
            hoverinfo="skip",
        )


def _add_curve(chart: go.Figure, values_ms: FloatArray, name: str, colour: str, width: float = 2.2) -> None:
    ordered = np.sort(values_ms)
    shares = 100.0 * np.arange(1, len(ordered) + 1) / len(ordered)
    kept = np.unique(np.linspace(0, len(ordered) - 1, min(len(ordered), _MOST_POINTS)).astype(np.int64))
    chart.add_scatter(
        x=short([ordered[0], *ordered[kept]]),
        y=short([0.0, *shares[kept]], 3),
        mode="lines",
        line={"color": colour, "width": width, "shape": "hv"},
        name=name,
        hovertemplate="%{y:.3g} % within %{x:.4g} ms<extra></extra>",
    )
