"""The figure of paths from above: truth and estimate, joined step by step by patches.

After Fig. 9 of Kushwaha & Koutsoukos (2013): the narrower a patch, the better
the estimate at that time.
"""

from html import escape

import numpy as np
import pandas as pd
import plotly.graph_objects as go

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.report.charts import BLUE, GREEN, GREY, ORANGE, VERMILLION, axis, figure, short
from wsnsim.report.context import ReportContext

_SIGHT_OF_WORLD = 0.07
"""Length of a drawn viewing direction, in parts of the world's longer side."""


def paths_figure(context: ReportContext) -> go.Figure:
    """Return the paths from above, with cameras, base station and routing tree."""
    width, depth, _ = context.size_m
    chart = figure(xaxis=axis("x [m]"), yaxis=axis("y [m]", scaleanchor="x", scaleratio=1))
    chart.add_shape(
        type="rect", x0=0, y0=0, x1=width, y1=depth, line={"color": GREY, "width": 1}, layer="below"
    )
    _add_tree(chart, context.tables["nodes"])
    _add_cameras(chart, context)
    steps = context.tables["steps"]
    targets = list(dict.fromkeys(steps["target"]))
    for number, target in enumerate(targets):
        start = context.tables["truth"]
        start = start[start["target"] == target].head(1)
        _add_target(
            chart, start, steps[steps["target"] == target], str(target), number == 0, len(targets) > 1
        )
    _add_stations(chart, context.tables["nodes"])
    return chart


def _add_target(
    chart: go.Figure, start: pd.DataFrame, steps: pd.DataFrame, target: str, legend: bool, label: bool
) -> None:
    true = np.vstack(
        [start[["x_m", "y_m"]].to_numpy(float), steps[["truth_x_m", "truth_y_m"]].to_numpy(float)]
    )
    believed = np.vstack([true[:1], steps[["estimate_x_m", "estimate_y_m"]].to_numpy(float)])
    name = escape(target)
    xs, ys = _patches(true, believed)
    chart.add_scatter(
        x=xs,
        y=ys,
        mode="lines",
        fill="toself",
        fillcolor="rgba(217,96,26,0.22)",
        line={"color": VERMILLION, "width": 0.5},
        name="error, a patch a step",
        legendrank=3,
        legendgroup="patches",
        showlegend=legend,
        hoverinfo="skip",
    )
    times = [0.0, *steps["time_s"].tolist()]
    hover = [f"{name}<br>{time:.2f} s" for time in times]
    chart.add_scatter(
        x=short(true[:, 0]),
        y=short(true[:, 1]),
        mode="lines",
        line={"color": BLUE, "width": 2.5},
        name="true path",
        legendrank=1,
        legendgroup="truth",
        showlegend=legend,
        text=hover,
        hovertemplate="%{text}, true position<extra></extra>",
    )
    errors = ["start", *(f"error {value:.3f} m" for value in steps["error_m"])]
    chart.add_scatter(
        x=short(believed[1:, 0]),
        y=short(believed[1:, 1]),
        mode="lines+markers",
        connectgaps=False,
        line={"color": VERMILLION, "width": 1.5},
        name="estimate",
        legendrank=2,
        legendgroup="estimate",
        showlegend=legend,
        marker={"size": 5, "symbol": ["circle" if k == "update" else "circle-open" for k in steps["kind"]]},
        text=[f"{place}<br>{error}" for place, error in zip(hover[1:], errors[1:], strict=True)],
        hovertemplate="%{text}<extra></extra>",
    )
    chart.add_scatter(
        x=short(true[:1, 0]),
        y=short(true[:1, 1]),
        mode="markers+text" if label else "markers",
        text=[name],
        textposition="top center",
        marker={"color": BLUE, "size": 9, "symbol": "diamond"},
        name="start",
        legendrank=4,
        legendgroup="start",
        showlegend=legend,
        hoverinfo="skip",
    )


def _patches(
    true: "np.ndarray[tuple[int, int], np.dtype[np.float64]]",
    believed: "np.ndarray[tuple[int, int], np.dtype[np.float64]]",
) -> tuple[list[float | None], list[float | None]]:
    """Return the corners of one four-sided patch for each pair of steps, set apart by None."""
    xs: list[float | None] = []
    ys: list[float | None] = []
    for k in range(len(true) - 1):
        corners = np.array([true[k], true[k + 1], believed[k + 1], believed[k], true[k]])
        if np.isfinite(corners).all():
            xs += [*short(corners[:, 0]), None]
            ys += [*short(corners[:, 1]), None]
    return xs, ys


def _add_tree(chart: go.Figure, nodes: pd.DataFrame) -> None:
    places = {row["node"]: (row["x_m"], row["y_m"]) for row in nodes.to_dict("records")}
    xs: list[float | None] = []
    ys: list[float | None] = []
    for row in nodes.to_dict("records"):
        if row["parent"] in places:
            ends = np.array([places[row["node"]], places[row["parent"]]])
            xs += [*short(ends[:, 0]), None]
            ys += [*short(ends[:, 1]), None]
    chart.add_scatter(
        x=xs,
        y=ys,
        mode="lines",
        line={"color": GREY, "width": 1, "dash": "dot"},
        opacity=0.7,
        name="routing tree",
        legendrank=8,
        hoverinfo="skip",
    )


def _add_cameras(chart: go.Figure, context: ReportContext) -> None:
    sight_m = _SIGHT_OF_WORLD * max(context.size_m[:2])
    xs: list[float | None] = []
    ys: list[float | None] = []
    for camera in context.cameras.values():
        corners = _wedge(camera, sight_m)
        xs += [*short(corners[:, 0]), None]
        ys += [*short(corners[:, 1]), None]
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
        textposition="bottom center",
        marker={"color": GREEN, "size": 7},
        name="camera",
        legendgroup="cameras",
        showlegend=False,
        hovertemplate="camera %{text}<extra></extra>",
    )


def _wedge(camera: PinholeCamera, sight_m: float) -> "np.ndarray[tuple[int, int], np.dtype[np.float64]]":
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
