"""The figure over time: error above, cameras that saw the target and were heard below."""

from html import escape
from typing import Any

import plotly.graph_objects as go

from wsnsim.report.charts import GREY, TARGET_COLOURS, axis, figure, short
from wsnsim.report.context import ReportContext


def timeline_figure(context: ReportContext) -> go.Figure:
    """Return error, participating and heard cameras over a shared time axis."""
    steps = context.tables["steps"]
    targets = list(dict.fromkeys(steps["target"]))
    chart = figure(
        xaxis=axis("time [s]", anchor="y2"),
        yaxis=axis("error [m]", domain=[0.46, 1], rangemode="tozero"),
        yaxis2=axis(
            "cameras", domain=[0, 0.36], rangemode="tozero", tickformat="d", dtick=_camera_tick(context)
        ),
    )
    for number, target in enumerate(targets):
        rows = steps[steps["target"] == target]
        colour = TARGET_COLOURS[number % len(TARGET_COLOURS)]
        of = f" ({escape(str(target))})" if len(targets) > 1 else ""
        times = short(rows["time_s"])
        chart.add_scatter(
            x=times,
            y=short(rows["error_m"]),
            mode="lines+markers",
            name=f"error{of}",
            line={"color": colour, "width": 2},
            marker={"size": 4},
            hovertemplate="%{x:.2f} s: %{y:.3f} m<extra></extra>",
        )
        guessed = rows[rows["kind"] != "update"]
        if len(guessed):
            chart.add_scatter(
                x=short(guessed["time_s"]),
                y=short(guessed["error_m"]),
                mode="markers",
                name="no measurement",
                marker={
                    "color": colour,
                    "size": 10,
                    "symbol": "x-thin",
                    "line": {"color": colour, "width": 2},
                },
                legendgroup="guessed",
                showlegend=not any(t.name == "no measurement" for t in chart.data),
                hovertemplate="%{x:.2f} s: no measurement<extra></extra>",
            )
        chart.add_scatter(
            x=times,
            y=[int(n) for n in rows["participating"]],
            yaxis="y2",
            mode="lines",
            name=f"see the target{of}",
            **_seen_style(colour, alone=len(targets) == 1),
            hovertemplate="%{x:.2f} s: seen by %{y} cameras<extra></extra>",
        )
        chart.add_scatter(
            x=times,
            y=short(rows["heard"].astype("float64")),
            yaxis="y2",
            mode="lines",
            name=f"heard in time{of}",
            line={"color": colour, "width": 2, "shape": "hvh"},
            hovertemplate="%{x:.2f} s: %{y} cameras heard<extra></extra>",
        )
    return chart


def _seen_style(colour: str, alone: bool) -> dict[str, Any]:
    """Return a grey area under the count, or a dotted line where several targets would hide each other."""
    if alone:
        line = {"color": GREY, "width": 1, "shape": "hvh"}
        return {"line": line, "fill": "tozeroy", "fillcolor": "rgba(138,144,153,0.25)"}
    return {"line": {"color": colour, "width": 2, "shape": "hvh", "dash": "dot"}}


def _camera_tick(context: ReportContext) -> int:
    return max(1, len(context.cameras) // 5)
