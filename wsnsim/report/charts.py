"""What the figures have in common: colours, a bare layout, and numbers short enough to ship.

Colours are those of Okabe and Ito (2008), told apart by the colour-blind, in
shades that stand out on light and on dark ground. Text, grid and background
come from the page, which knows which of the two it is.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import ArrayLike

BLUE = "#2f86c8"
VERMILLION = "#d9601a"
GREEN = "#0c9f78"
PURPLE = "#b8689c"
ORANGE = "#e0a020"
SKY = "#5ab0e0"
GREY = "#8a9099"


@dataclass(frozen=True)
class TargetStyle:
    """How one target looks in every figure: a hue, dark for the truth, and a shape for its points.

    Parameters
    ----------
    truth : colour of what really is
    estimate : colour of what the tracker made of it
    symbol : of the estimate's points
    """

    truth: str
    estimate: str
    symbol: str = "circle"


_ALONE = TargetStyle(BLUE, VERMILLION)

_PAIRS = (
    ("#304fbf", "#7885fe"),
    ("#8a7b00", "#cab523"),
    ("#aa004b", "#ee5580"),
    ("#1a857e", "#00c6bb"),
    ("#bd5e43", "#ff9879"),
    ("#604c8d", "#9982c8"),
)
"""Truth and estimate of each target, chosen to stay apart with any of the three kinds of colour blindness."""

_SYMBOLS = ("circle", "square", "triangle-up", "cross", "triangle-down", "star", "triangle-left")
"""One more than there are pairs, so that a hue that comes again has another shape."""


def target_style(number: int, targets: int) -> TargetStyle:
    """Return the look of a target, the same in every figure."""
    if targets == 1:
        return _ALONE
    truth, estimate = _PAIRS[number % len(_PAIRS)]
    return TargetStyle(truth, estimate, _SYMBOLS[number % len(_SYMBOLS)])


def translucent(colour: str, opacity: float) -> str:
    """Return a colour such as ``#d9601a`` as one that lets others shine through."""
    red, green, blue = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    return f"rgba({red},{green},{blue},{opacity})"


def explain(chart: go.Figure, name: str, **look: Any) -> None:
    """Add an entry to the legend that stands for traces of several colours, those of its legendgroup."""
    chart.add_scatter(x=[None], y=[None], name=name, hoverinfo="skip", **look)


def figure(**layout: Any) -> go.Figure:
    """Return an empty figure without plotly's own template."""
    chart = go.Figure()
    chart.update_layout(
        template=go.layout.Template(),
        margin={"l": 10, "r": 10, "t": 10, "b": 10},
        hovermode="closest",
        legend={"orientation": "h", "x": 0, "y": 1.02, "yanchor": "bottom", "xanchor": "left"},
        **layout,
    )
    return chart


def axis(title: str, **more: Any) -> dict[str, Any]:
    """Return an axis with a title."""
    return {"title": {"text": title}, "automargin": True, "zeroline": False, **more}


def short(values: ArrayLike, decimals: int = 4) -> list[float | None]:
    """Return plain numbers rounded to `decimals`, None for missing ones."""
    numbers = np.asarray(values, dtype=np.float64).round(decimals)
    return [None if np.isnan(value) else float(value) for value in numbers]
