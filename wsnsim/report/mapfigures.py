"""The figures of the maps: coloured floor plans in classes that a legend names.

plotly's basic bundle has no heat map: the floor is a small picture, one pixel a
cell, and invisible points over it say the numbers where the pointer is.
"""

import io
from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape

import numpy as np
import plotly.graph_objects as go
from PIL import Image

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.report.charts import GREEN, GREY, ORANGE, axis, explain, figure, short, translucent
from wsnsim.report.floorplan import footprint
from wsnsim.report.wording import number, percent
from wsnsim.sim.maps import Coverage, Grid, Links, Reach
from wsnsim.types import FloatArray, IntArray
from wsnsim.world.world import World

_OPACITY = 0.62
"""Of the floor's colours, so that they suit light and dark ground."""
_EVERY = 3
"""Cells, along each side, that share one point for the pointer."""
_MARGIN = 0.06
"""Free space round the cells, in parts of the longer side: enough for a camera's name."""
_SIGHT = 0.06
"""Length of a drawn viewing direction, in parts of the longer side of the floor plan."""


@dataclass(frozen=True)
class Scale:
    """Classes of a quantity, each with a colour and words.

    Parameters
    ----------
    bounds : ascending; a value at a bound belongs to the class above it
    colours : one more than bounds; None where the ground stays bare
    words : of each class
    """

    bounds: tuple[float, ...]
    colours: tuple[str | None, ...]
    words: tuple[str, ...]

    def classes(self, values: FloatArray | IntArray) -> IntArray:
        """Return the number of the class of each value."""
        return np.asarray(np.digitize(values, self.bounds), dtype=np.int64)


COUNTS = Scale(
    (1, 2, 3, 4),
    (None, "#6a5fc4", "#2f86c8", "#1fb08a", "#d3cf3a"),
    ("no camera", "1 camera", "2 cameras", "3 cameras", "4 or more"),
)
SHARES = Scale(
    (1e-12, 1e-3, 3e-3, 1e-2, 3e-2),
    (None, "#7a4fa8", "#b8568f", "#e0705e", "#f0a23c", "#f2dc4a"),
    ("not seen", "below 0.1 %", "0.1 to 0.3 %", "0.3 to 1 %", "1 to 3 %", "3 % and more"),
)
MARGINS = Scale(
    (0.0, 3.0, 6.0, 10.0, 20.0),
    (None, "#d9601a", "#e0a020", "#3fa98c", "#2f86c8", "#6a6fd6"),
    ("not usable", "0 to 3 dB", "3 to 6 dB", "6 to 10 dB", "10 to 20 dB", "20 dB and more"),
)


def seen_by_figure(coverage: Coverage, cameras: Mapping[str, PinholeCamera], world: World) -> go.Figure:
    """Return how many cameras see each point of the floor plan."""
    chart = _plan(coverage.grid, coverage.seen_by, COUNTS)
    _add_room(chart, world)
    _add_cameras(chart, cameras, world)
    _add_numbers(chart, coverage)
    return chart


def share_figure(coverage: Coverage, cameras: Mapping[str, PinholeCamera], world: World) -> go.Figure:
    """Return how large the target would be in the image that shows it largest."""
    chart = _plan(coverage.grid, coverage.largest_share, SHARES)
    _add_room(chart, world)
    _add_cameras(chart, cameras, world)
    _add_numbers(chart, coverage)
    return chart


def links_figure(links: Links, reach: Reach, world: World) -> go.Figure:
    """Return the links between nodes over the margin that one more node would have."""
    chart = _plan(reach.grid, reach.margin_db, MARGINS)
    _add_room(chart, world)
    _add_links(chart, links)
    _add_nodes(chart, links)
    rows, columns = _pointed(reach.grid)
    margins, best = reach.margin_db[rows, columns], reach.best[rows, columns]
    told = [
        f"{_decibels(margin)} to {escape(links.nodes[node])}" if np.isfinite(margin) else "not known"
        for margin, node in zip(margins.tolist(), best.tolist(), strict=True)
    ]
    _add_pointer(chart, reach.grid, [f"another mote here: {words}" for words in told])
    return chart


def _plan(grid: Grid, values: FloatArray | IntArray, scale: Scale) -> go.Figure:
    """Return a floor plan whose ground has the colours of the classes of `values`, (ny, nx)."""
    (left, right), (bottom, top) = _ends(grid.x), _ends(grid.y)
    shown_x, shown_y = plan_ends(grid)
    chart = figure(
        xaxis=axis("x [m]", range=short(shown_x), showgrid=False),
        yaxis=axis("y [m]", range=short(shown_y), showgrid=False, scaleanchor="x", scaleratio=1),
    )
    chart.add_layout_image(
        source=_picture(scale.classes(values), scale),
        x=left,
        y=top,
        sizex=right - left,
        sizey=top - bottom,
        xref="x",
        yref="y",
        sizing="stretch",
        layer="below",
    )
    for colour, words in zip(scale.colours, scale.words, strict=True):
        look = {"symbol": "square", "size": 12, "line": {"color": GREY, "width": 1}}
        look["color"] = "rgba(0,0,0,0)" if colour is None else translucent(colour, _OPACITY)
        explain(chart, words, mode="markers", marker=look, legendrank=1)
    return chart


def plan_ends(grid: Grid) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return what a plan shows along x and y [m]: the cells, and room for names round them."""
    ends = _ends(grid.x), _ends(grid.y)
    margin = _MARGIN * max(high - low for low, high in ends)
    (left, right), (bottom, top) = ends
    return (left - margin, right + margin), (bottom - margin, top + margin)


def _ends(centres: FloatArray) -> tuple[float, float]:
    """Return where the cells with these centres begin and end."""
    first, last = float(centres[0]), float(centres[-1])
    half = 0.5 * (last - first) / max(len(centres) - 1, 1)
    return first - half, last + half


def _picture(classes: IntArray, scale: Scale) -> str:
    """Return the classes as a PNG in a data address, one pixel each, the largest y on top."""
    palette = np.zeros((len(scale.colours), 4), dtype=np.uint8)
    for at, colour in enumerate(scale.colours):
        if colour is not None:
            palette[at] = (*(int(colour[i : i + 2], 16) for i in (1, 3, 5)), round(255 * _OPACITY))
    buffer = io.BytesIO()
    Image.fromarray(palette[classes[::-1]]).save(buffer, "PNG", optimize=True)
    return f"data:image/png;base64,{b64encode(buffer.getvalue()).decode()}"


def _pointed(grid: Grid) -> tuple[IntArray, IntArray]:
    """Return the rows and columns of the cells that have a point for the pointer."""
    rows, columns = (np.arange(min(_EVERY // 2, n - 1), n, _EVERY) for n in grid.shape)
    at_row, at_column = np.meshgrid(rows, columns, indexing="ij")
    return at_row.ravel(), at_column.ravel()


def _add_pointer(chart: go.Figure, grid: Grid, told: Sequence[str]) -> None:
    rows, columns = _pointed(grid)
    chart.add_scatter(
        x=short(grid.x[columns], 2),
        y=short(grid.y[rows], 2),
        mode="markers",
        marker={"size": 9, "color": "rgba(0,0,0,0)"},
        text=told,
        hovertemplate="%{text}<br>x %{x} m, y %{y} m<extra></extra>",
        showlegend=False,
    )


def _add_numbers(chart: go.Figure, coverage: Coverage) -> None:
    rows, columns = _pointed(coverage.grid)
    told = []
    for row, column in zip(rows.tolist(), columns.tolist(), strict=True):
        seeing = [
            name for name, seen in zip(coverage.cameras, coverage.seen[:, row, column], strict=True) if seen
        ]
        if coverage.solid[row, column]:
            told.append("inside something that stands here")
        elif not seeing:
            told.append("seen by no camera")
        else:
            largest, mean = coverage.largest_share[row, column], coverage.mean_share[row, column]
            told.append(
                f"seen by {escape(', '.join(seeing))}<br>{escape(coverage.target)} would take "
                f"{percent(float(largest))} of an image at most, {percent(float(mean))} on average"
            )
    _add_pointer(chart, coverage.grid, told)


def _add_room(chart: go.Figure, world: World) -> None:
    width, depth, _ = world.size_m.tolist()
    chart.add_scatter(
        x=[0, width, width, 0, 0],
        y=[0, 0, depth, depth, 0],
        mode="lines",
        line={"color": GREY, "width": 1.5},
        showlegend=False,
        hoverinfo="skip",
    )
    for number_, placed in enumerate(world.scenery):
        outline = footprint(placed.body, placed.pose)
        chart.add_scatter(
            x=short(outline[:, 0]),
            y=short(outline[:, 1]),
            mode="lines",
            fill="toself",
            fillcolor=translucent(GREY, 0.6),
            line={"color": GREY, "width": 1},
            name="walls and things",
            legendgroup="scenery",
            legendrank=3,
            showlegend=number_ == 0,
            hoverinfo="skip",
        )


def _add_cameras(chart: go.Figure, cameras: Mapping[str, PinholeCamera], world: World) -> None:
    places = np.array([camera.position[:2] for camera in cameras.values()])
    ahead = np.array([camera.rotation[2, :2] for camera in cameras.values()])
    ends = places + _SIGHT * float(world.size_m[:2].max()) * ahead
    xs: list[float | None] = []
    ys: list[float | None] = []
    for place, end in zip(places, ends, strict=True):
        xs += [*short([place[0], end[0]]), None]
        ys += [*short([place[1], end[1]]), None]
    chart.add_scatter(
        x=xs, y=ys, mode="lines", line={"color": GREEN, "width": 3}, showlegend=False, hoverinfo="skip"
    )
    chart.add_scatter(
        x=short(places[:, 0]),
        y=short(places[:, 1]),
        mode="markers+text",
        text=[escape(name) for name in cameras],
        textposition=["bottom center" if y > 0 else "top center" for y in ahead[:, 1]],
        marker={"color": GREEN, "size": 9, "line": {"color": "#ffffff", "width": 1}},
        name="camera and where it looks",
        legendrank=2,
        cliponaxis=False,
        hoverinfo="skip",
    )


def _add_links(chart: go.Figure, links: Links) -> None:
    """Add a line for each usable link, by class, those of the tree thick, and what the pointer is told."""
    classes = MARGINS.classes(links.margin_db)
    middles, told = [], []
    for tree in (False, True):
        for number_, colour in enumerate(MARGINS.colours):
            xs: list[float | None] = []
            ys: list[float | None] = []
            for one, other in zip(*np.triu_indices(len(links.nodes), 1), strict=True):
                used = links.in_tree(links.nodes[one], links.nodes[other])
                if used is not tree or classes[one, other] != number_ or (colour is None and not tree):
                    continue
                ends = links.positions[[one, other], :2]
                xs += [*short(ends[:, 0]), None]
                ys += [*short(ends[:, 1]), None]
                middles.append(ends.mean(axis=0))
                told.append(_link_words(links, int(one), int(other)))
            if xs:
                chart.add_scatter(
                    x=xs,
                    y=ys,
                    mode="lines",
                    line={"color": colour or "#c0392b", "width": 6 if tree else 1.5},
                    opacity=1.0 if tree else 0.9,
                    showlegend=False,
                    hoverinfo="skip",
                )
    explain(chart, "link of the routing tree", mode="lines", line={"color": GREY, "width": 6}, legendrank=2)
    explain(chart, "other usable link", mode="lines", line={"color": GREY, "width": 1.5}, legendrank=2)
    if middles:
        spots = np.array(middles)
        chart.add_scatter(
            x=short(spots[:, 0]),
            y=short(spots[:, 1]),
            mode="markers",
            marker={"size": 10, "color": "rgba(0,0,0,0)"},
            text=told,
            hovertemplate="%{text}<extra></extra>",
            showlegend=False,
        )


def _link_words(links: Links, one: int, other: int) -> str:
    names = [escape(links.nodes[at]) for at in (one, other)]
    powers = links.power_dbm[one, other], links.power_dbm[other, one]
    return (
        f"{names[0]} – {names[1]}, {number(float(links.distance_m[one, other]))} m: "
        f"{_decibels(float(links.margin_db[one, other]))}<br>{powers[0]:.1f} dBm of {names[0]} arrive, "
        f"{powers[1]:.1f} dBm of {names[1]}"
    )


def _add_nodes(chart: go.Figure, links: Links) -> None:
    parents = links.tree.parent
    for base in (False, True):
        at = [i for i, node in enumerate(links.nodes) if (parents[node] is None) is base]
        chart.add_scatter(
            x=short(links.positions[at, 0]),
            y=short(links.positions[at, 1]),
            mode="markers+text",
            text=[escape(links.nodes[i]) for i in at],
            textposition="top center",
            marker={
                "color": ORANGE if base else GREEN,
                "size": 13 if base else 10,
                "symbol": "square" if base else "circle",
                "line": {"color": "#ffffff", "width": 1},
            },
            name="base station" if base else "mote",
            legendrank=3,
            cliponaxis=False,
            hoverinfo="skip",
        )


def _decibels(margin_db: float) -> str:
    return f"{margin_db:+.1f} dB"
