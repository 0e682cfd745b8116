"""The figure of paths from above: truth and estimate, joined step by step by patches.

After Fig. 9 of Kushwaha & Koutsoukos (2013): the narrower a patch, the better
the estimate at that time.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

import numpy as np
import pandas as pd
import plotly.graph_objects as go

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.report.charts import (
    GREEN,
    GREY,
    ORANGE,
    TargetStyle,
    axis,
    explain,
    figure,
    short,
    target_style,
    translucent,
)
from wsnsim.report.context import ReportContext
from wsnsim.report.floorplan import footprint
from wsnsim.report.view import View, outside, whole_view, world_view
from wsnsim.types import FloatArray

_SIGHT_OF_VIEW = 0.07
"""Length of a drawn viewing direction, in parts of the first view's longer side."""

_ABOVE_TITLE_PX = 6
"""Keeps the title of the x axis near it where buttons widen the margin below."""

_WALK_OPACITY, _FAINTEST = 0.8, 0.12
_MANY_PLACES = 3000
"""Of people's ways together, more of which are drawn fainter."""
_PLACES_OF_A_WALK = 400

_PATCHES = "error, a patch a step"


def paths_figure(context: ReportContext) -> go.Figure:
    """Return the paths from above, with cameras, base station and routing tree."""
    view = world_view(context)
    chart = figure(
        xaxis=axis("x [m]", range=short(view.x)),
        yaxis=axis("y [m]", range=short(view.y), scaleanchor="x", scaleratio=1),
    )
    if outside(context):
        chart.update_layout(
            updatemenus=[_buttons(view, whole_view(context))], xaxis_title_standoff=_ABOVE_TITLE_PX
        )
    add_world(chart, context)
    add_scenery(chart, context)
    add_tree(chart, context.tables["nodes"])
    _add_cameras(chart, context, _SIGHT_OF_VIEW * view.longer_m)
    steps, truth = context.tables["steps"], context.tables["truth"]
    targets = list(dict.fromkeys(steps["target"]))
    if len(targets) > 1:
        _explain_several(chart)
    for number, target in enumerate(targets):
        rows = steps[steps["target"] == target]
        start = truth[truth["target"] == target].head(1)
        style = target_style(number, len(targets))
        _add_target(chart, start, rows, style, _Naming(str(target), number, len(targets) == 1))
    _add_stations(chart, context.tables["nodes"])
    return chart


@dataclass(frozen=True)
class _Naming:
    """How the traces of one target are called and grouped in the legend."""

    target: str
    number: int
    alone: bool

    def of(self, what: str) -> str:
        return what if self.alone else f"{escape(self.target)}: {what}"

    def group(self, alone: str) -> str:
        return alone if self.alone else f"target {self.number}"


def _buttons(world: View, whole: View) -> dict[str, Any]:
    """Return two buttons below the map; their colours fit light and dark ground, as plotly's own do not."""
    views = {"world": world, "whole network": whole}
    return {
        "type": "buttons",
        "direction": "right",
        "x": 1,
        "xanchor": "right",
        "y": 0,
        "yanchor": "top",
        "pad": {"t": 28},
        "bgcolor": "#cdd4de",
        "bordercolor": GREY,
        "font": {"color": "#1c2430"},
        "buttons": [
            {
                "label": label,
                "method": "relayout",
                "args": [{"xaxis.range": short(view.x), "yaxis.range": short(view.y)}],
            }
            for label, view in views.items()
        ],
    }


def add_world(chart: go.Figure, context: ReportContext) -> None:
    """Add the edge of the world, where there is one."""
    if context.size_m is None:
        return
    width, depth, _ = context.size_m
    chart.add_scatter(
        x=short([0, width, width, 0, 0]),
        y=short([0, 0, depth, depth, 0]),
        mode="lines",
        line={"color": GREY, "width": 1.5},
        name="edge of the world",
        legendrank=7,
        hoverinfo="skip",
    )


def add_scenery(chart: go.Figure, context: ReportContext) -> None:
    """Add what may hide a target: things by their footprints, people by their ways."""
    outlines = [footprint(placed.body, placed.pose) for placed in context.scenery]
    walks = [_thinned(walk) for walk in context.walks.values()]
    # where many walk for long, ink would cover everything
    opacity = min(_WALK_OPACITY, max(_FAINTEST, _WALK_OPACITY * _MANY_PLACES / max(1, sum(map(len, walks)))))
    for ways, name, look in (
        (outlines, "walls and things", {"fill": "toself", "fillcolor": translucent(GREY, 0.45)}),
        (walks, "people in the way", {"opacity": opacity}),
    ):
        if ways:
            xs, ys = _strung(ways)
            chart.add_scatter(
                x=xs,
                y=ys,
                mode="lines",
                line={"color": GREY, "width": 1},
                name=name,
                legendrank=7,
                hoverinfo="skip",
                **look,
            )


def _thinned(walk: FloatArray) -> FloatArray:
    """Return every so many-th place of a way (n, 2), at most 400 of a long one."""
    return walk[:: max(1, -(-len(walk) // _PLACES_OF_A_WALK))]


def _strung(ways: Sequence[FloatArray]) -> tuple[list[float | None], list[float | None]]:
    """Return lines (n, 2) as one, set apart by None."""
    xs: list[float | None] = []
    ys: list[float | None] = []
    for way in ways:
        xs += [*short(way[:, 0]), None]
        ys += [*short(way[:, 1]), None]
    return xs, ys


def _explain_several(chart: go.Figure) -> None:
    """Explain patches and starting points in grey, since every target has them in a colour of its own."""
    explain(
        chart,
        _PATCHES,
        mode="lines",
        fill="toself",
        fillcolor=translucent(GREY, 0.22),
        line={"color": GREY, "width": 0.5},
        legendrank=3,
        legendgroup="patches",
    )
    explain(
        chart,
        "start",
        mode="markers",
        marker={"color": GREY, "size": 9, "symbol": "diamond"},
        legendrank=4,
        legendgroup="start",
    )


def _add_target(
    chart: go.Figure, start: pd.DataFrame, steps: pd.DataFrame, style: TargetStyle, naming: _Naming
) -> None:
    true = np.vstack(
        [start[["x_m", "y_m"]].to_numpy(float), steps[["truth_x_m", "truth_y_m"]].to_numpy(float)]
    )
    believed = np.vstack([true[:1], steps[["estimate_x_m", "estimate_y_m"]].to_numpy(float)])
    name = escape(naming.target)
    xs, ys = _patches(true, believed)
    chart.add_scatter(
        x=xs,
        y=ys,
        mode="lines",
        fill="toself",
        fillcolor=translucent(style.estimate, 0.22),
        line={"color": style.estimate, "width": 0.5},
        name=_PATCHES,
        legendrank=3,
        legendgroup="patches",
        showlegend=naming.alone,
        hoverinfo="skip",
    )
    times = [0.0, *steps["time_s"].tolist()]
    hover = [f"{name}<br>{time:.2f} s" for time in times]
    chart.add_scatter(
        x=short(true[:, 0]),
        y=short(true[:, 1]),
        mode="lines",
        line={"color": style.truth, "width": 2.5},
        name=naming.of("true path"),
        legendrank=1,
        legendgroup=naming.group("truth"),
        text=hover,
        hovertemplate="%{text}, true position<extra></extra>",
    )
    errors = ["start", *(f"error {value:.3f} m" for value in steps["error_m"])]
    chart.add_scatter(
        x=short(believed[1:, 0]),
        y=short(believed[1:, 1]),
        mode="lines+markers",
        connectgaps=False,
        line={"color": style.estimate, "width": 1.5},
        name=naming.of("estimate"),
        legendrank=2,
        legendgroup=naming.group("estimate"),
        marker={
            "size": 5 if naming.alone else 6,
            "symbol": [style.symbol if k == "update" else f"{style.symbol}-open" for k in steps["kind"]],
        },
        text=[f"{place}<br>{error}" for place, error in zip(hover[1:], errors[1:], strict=True)],
        hovertemplate="%{text}<extra></extra>",
    )
    chart.add_scatter(
        x=short(true[:1, 0]),
        y=short(true[:1, 1]),
        mode="markers" if naming.alone else "markers+text",
        text=[name],
        textposition="top center",
        marker={"color": style.truth, "size": 9, "symbol": "diamond"},
        name="start",
        legendrank=4,
        legendgroup="start",
        showlegend=naming.alone,
        hoverinfo="skip",
    )


def _patches(true: FloatArray, believed: FloatArray) -> tuple[list[float | None], list[float | None]]:
    """Return the corners of one four-sided patch for each pair of steps, set apart by None."""
    patches = (
        np.array([true[k], true[k + 1], believed[k + 1], believed[k], true[k]]) for k in range(len(true) - 1)
    )
    return _strung([corners for corners in patches if np.isfinite(corners).all()])


def add_tree(chart: go.Figure, nodes: pd.DataFrame) -> None:
    """Add the way of messages from each node to the next."""
    places = {row["node"]: (row["x_m"], row["y_m"]) for row in nodes.to_dict("records")}
    links = [
        np.array([places[row["node"]], places[row["parent"]]])
        for row in nodes.to_dict("records")
        if row["parent"] in places
    ]
    xs, ys = _strung(links)
    chart.add_scatter(
        x=xs,
        y=ys,
        mode="lines",
        line={"color": ORANGE, "width": 1.5, "dash": "dot"},
        name="routing tree",
        legendrank=8,
        hoverinfo="skip",
    )


def _add_cameras(chart: go.Figure, context: ReportContext, sight_m: float) -> None:
    xs, ys = _strung([_wedge(camera, sight_m) for camera in context.cameras.values()])
    chart.add_scatter(
        x=xs,
        y=ys,
        mode="lines",
        fill="toself",
        fillcolor="rgba(12,159,120,0.25)",
        line={"color": GREEN, "width": 1},
        name="camera and where it looks",
        legendrank=5,
        legendgroup="cameras",
        hoverinfo="skip",
    )
    names = list(context.cameras)
    chart.add_scatter(
        x=short([camera.position[0] for camera in context.cameras.values()]),
        y=short([camera.position[1] for camera in context.cameras.values()]),
        mode="markers+text",
        text=[escape(name) for name in names],
        textposition=[
            "top center" if camera.rotation[2, 1] < 0 else "bottom center"
            for camera in context.cameras.values()
        ],
        marker={"color": GREEN, "size": 7},
        name="camera",
        legendgroup="cameras",
        showlegend=False,
        hovertemplate="camera %{text}<extra></extra>",
    )


def _wedge(camera: PinholeCamera, sight_m: float) -> FloatArray:
    """Return the corners of a camera's horizontal field of view from above, (4, 2)."""
    half = camera.resolution_px[0] / 2 / camera.focal_px
    right, forward = camera.rotation[0], camera.rotation[2]
    sides = [forward - half * right, forward + half * right]
    place = camera.position[:2]
    ends = [place + sight_m * side[:2] / max(float(np.linalg.norm(side[:2])), 1e-9) for side in sides]
    return np.array([place, *ends, place])


def _add_stations(chart: go.Figure, nodes: pd.DataFrame) -> None:
    for role, label, symbol, colour in (
        ("base", "base station", "square", ORANGE),
        ("relay", "relay", "triangle-up", GREY),
    ):
        rows = nodes[nodes["role"] == role]
        if len(rows):
            chart.add_scatter(
                x=short(rows["x_m"]),
                y=short(rows["y_m"]),
                mode="markers+text",
                name=label,
                legendrank=6,
                text=[escape(str(node)) for node in rows["node"]],
                textposition="bottom center",
                marker={"color": colour, "size": 11, "symbol": symbol},
                hovertemplate=f"{label} %{{text}}<extra></extra>",
            )
