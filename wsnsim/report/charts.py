"""What the figures have in common: colours, a bare layout, and numbers short enough to ship.

Colours are those of Okabe and Ito (2008), told apart by the colour-blind, in
shades that stand out on light and on dark ground. Text, grid and background
come from the page, which knows which of the two it is.
"""

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

TARGET_COLOURS = (VERMILLION, BLUE, GREEN, PURPLE, ORANGE, SKY)


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
