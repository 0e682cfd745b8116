"""The figure by node: bandwidth on the left, energy by cause on the right."""

from html import escape
from typing import TYPE_CHECKING

import plotly.graph_objects as go

from wsnsim.metrics.energy import ENERGY_COLUMNS
from wsnsim.report.charts import BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILLION, axis, figure, short
from wsnsim.report.context import ReportContext
from wsnsim.report.glossary import ENERGY_CAUSES

if TYPE_CHECKING:
    import pandas as pd

_CAUSE_COLOURS = dict(
    zip(ENERGY_COLUMNS, (VERMILLION, ORANGE, SKY, "#9fb4c4", PURPLE, GREEN, GREY), strict=True)
)


MOST_NODES = 60
"""Nodes that are shown at most."""


def _loudest(nodes: "pd.DataFrame") -> "pd.DataFrame":
    """Return all nodes in their order, or of many those that sent most."""
    if len(nodes) <= MOST_NODES:
        return nodes
    return nodes.loc[nodes["mac_tx_bytes"].nlargest(MOST_NODES).index.sort_values()]


def bandwidth_figure(context: ReportContext) -> go.Figure:
    """Return what each node's program offered and what its radio sent [kbit/s]."""
    nodes = _loudest(context.tables["nodes"])
    seconds = float(context.summary["simulated_s"] or 1.0)
    names = [escape(str(name)) for name in nodes["node"]]
    chart = _bars("kbit/s", len(names), names)
    for column, label, colour in (
        ("app_tx_bytes", "offered by its program", BLUE),
        ("mac_tx_bytes", "sent on the air, all frames", ORANGE),
    ):
        chart.add_bar(
            y=names,
            x=short(nodes[column] * (8e-3 / seconds)),
            orientation="h",
            name=label,
            marker={"color": colour},
            hovertemplate="%{y}: %{x:.3g} kbit/s<extra></extra>",
        )
    chart.update_layout(barmode="group", bargap=0.25)
    return chart


def energy_figure(context: ReportContext) -> go.Figure:
    """Return what each mote drew, stacked by cause [J]; the base station is left out."""
    nodes = _loudest(context.tables["nodes"])
    motes = nodes[nodes["role"] != "base"]
    names = [escape(str(name)) for name in motes["node"]]
    chart = _bars("J", len(names), names)
    for column in ENERGY_COLUMNS:
        if (motes[column] > 0).any():
            chart.add_bar(
                y=names,
                x=short(motes[column], 7),
                orientation="h",
                name=ENERGY_CAUSES[column],
                marker={"color": _CAUSE_COLOURS[column]},
                hovertemplate="%{y}: %{x:.4g} J<extra></extra>",
            )
    chart.update_layout(barmode="stack", bargap=0.35, legend_traceorder="normal")
    return chart


def _bars(unit: str, rows: int, names: list[str]) -> go.Figure:
    return figure(
        xaxis=axis(unit, rangemode="tozero"),
        yaxis=axis("", type="category", autorange="reversed", categoryorder="array", categoryarray=names),
        height=80 + 34 * rows,
    )
