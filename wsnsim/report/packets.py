"""The figures of a network without cameras: where its nodes are, what arrived, what was lost."""

from html import escape

import numpy as np
import pandas as pd
import plotly.graph_objects as go

from wsnsim.report.charts import BLUE, GREEN, GREY, ORANGE, VERMILLION, axis, figure, short
from wsnsim.report.context import ReportContext
from wsnsim.report.glossary import OUTCOMES, ROLES, explained
from wsnsim.report.paths import add_scenery, add_tree, add_world
from wsnsim.report.view import nodes_view
from wsnsim.report.wording import count, duration, percent, plural

_MOST_NAMES = 40
"""Nodes whose names stand on the map or below bars."""


def by_source(context: ReportContext) -> pd.DataFrame:
    """Return for each node that made packets `made`, `delivery` (share that arrived) and `delay_s` (mean)."""
    messages = context.tables["messages"]
    rows = messages.assign(
        arrived=messages["outcome"] == "delivered",
        took_s=(messages["delivered_s"] - messages["created_s"]).astype("float64"),
    )
    grouped = rows.groupby("source", sort=False)
    return grouped.agg(made=("arrived", "size"), delivery=("arrived", "mean"), delay_s=("took_s", "mean"))


def network_map(context: ReportContext) -> go.Figure:
    """Return all nodes from above with the routing tree, sources by what arrived of their packets."""
    view = nodes_view(context)
    chart = figure(
        xaxis=axis("x [m]", range=short(view.x)),
        yaxis=axis("y [m]", range=short(view.y), scaleanchor="x", scaleratio=1),
    )
    add_world(chart, context)
    add_scenery(chart, context)
    nodes = context.tables["nodes"].set_index("node")
    add_tree(chart, context.tables["nodes"])
    sources = by_source(context).join(nodes, how="inner")
    named = len(nodes) <= _MOST_NAMES
    others = nodes[~nodes.index.isin(sources.index)]
    for role, symbol, colour in (("base", "square", ORANGE), ("mote", "triangle-up", GREY)):
        rows = others[(others["role"] == "base") == (role == "base")]
        if len(rows):
            label = ROLES[role] if role == "base" else "node that made no packet"
            _add_nodes(chart, rows, label, named, {"color": colour, "size": 11, "symbol": symbol})
    if len(sources):
        look = {
            "size": 10,
            "color": short(100 * sources["delivery"]),
            "cmin": 0,
            "cmax": 100,
            "colorscale": [[0.0, VERMILLION], [0.5, ORANGE], [1.0, BLUE]],
            "colorbar": {"title": {"text": "arrived [%]"}, "thickness": 12},
            "line": {"color": GREY, "width": 0.5},
        }
        words = [
            f"{escape(str(node))}: {percent(row['delivery'])} of {count(row['made'])} arrived, "
            f"{plural(int(row['depth']), 'hop')}, mean delay {duration(or_none(row['delay_s']))}"
            for node, row in zip(sources.index, sources.to_dict("records"), strict=True)
        ]
        _add_nodes(chart, sources, "source, by what arrived", named, look, words)
    return chart


def delivery_figure(context: ReportContext) -> go.Figure:
    """Return the share of each node's packets that arrived, the worst first."""
    sources = by_source(context).sort_values("delivery", kind="stable")
    names = [escape(str(node)) for node in sources.index]
    named = len(names) <= _MOST_NAMES
    chart = figure(
        height=260,
        xaxis=axis(
            "" if named else f"{len(names)} sources, the worst first",
            type="category",
            categoryorder="array",
            categoryarray=names,
            showticklabels=named,
        ),
        yaxis=axis("arrived [%]", range=[0, 104], tickvals=[0, 25, 50, 75, 100]),
    )
    chart.add_bar(
        x=names,
        y=short(100 * sources["delivery"]),
        marker={"color": BLUE},
        hovertemplate="%{x}: %{y:.4g} % arrived<extra></extra>",
    )
    return chart


def losses_figure(context: ReportContext) -> go.Figure:
    """Return how many packets met each fate, those that arrived among them."""
    fates = context.tables["messages"]["outcome"].value_counts().sort_values(kind="stable")
    names = [explained(OUTCOMES, str(fate)) for fate in fates.index]
    chart = figure(
        height=80 + 34 * max(1, len(fates)), xaxis=axis("packets", rangemode="tozero"), yaxis=axis("")
    )
    chart.add_bar(
        y=names,
        x=[int(number) for number in fates],
        orientation="h",
        text=[count(int(number)) for number in fates],
        textposition="auto",
        marker={"color": [_colour(str(fate)) for fate in fates.index]},
        hovertemplate="%{y}: %{x} packets<extra></extra>",
    )
    return chart


def or_none(number: float | None) -> float | None:
    """Return a number of a table, None where it is missing."""
    return None if number is None or np.isnan(number) else float(number)


def _colour(fate: str) -> str:
    return {"delivered": GREEN, "in_flight": GREY}.get(fate, VERMILLION)


def _add_nodes(
    chart: go.Figure,
    rows: pd.DataFrame,
    label: str,
    named: bool,
    marker: dict[str, object],
    words: list[str] | None = None,
) -> None:
    names = [escape(str(node)) for node in rows.index]
    chart.add_scatter(
        x=short(rows["x_m"]),
        y=short(rows["y_m"]),
        mode="markers+text" if named else "markers",
        name=label,
        text=names,
        textposition="top center",
        customdata=words or [f"{name}, {label}" for name in names],
        hovertemplate="%{customdata}<extra></extra>",
        marker=marker,
    )
