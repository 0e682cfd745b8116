"""Figures as SVG text: the same bytes each time, to be read on light and on dark ground.

Text and axes take the page's ink, the ground under them changes with the reader's
scheme; colours of the series are told apart by the colour-blind (Okabe & Ito 2008)
and stand out on both grounds.
"""

import re
from collections.abc import Iterable
from io import StringIO
from math import ceil, floor, isnan, log10, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np

from wsnsim.errors import OutputError
from wsnsim.report.charts import BLUE, GREEN, GREY, ORANGE, PURPLE, VERMILLION

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

    from wsnsim.metrics.statistics import Interval

COLOURS = {"P": GREY, "T0": BLUE, "T1": ORANGE, "T2": VERMILLION, "T3": GREEN, "T4": PURPLE}
"""One colour for each tracker, in every figure."""
SYMBOLS = {"P": "X", "T0": "o", "T1": "s", "T2": "D", "T3": "^", "T4": "v"}

_CUT = 0.1
"""On a logarithmic scale a bar that reaches below zero is cut at this share of its mean."""
_TICKS = ((1,), (1, 3), (1, 2, 5), (1, 1.5, 2, 3, 4, 5, 6, 8))
_FEWEST_TICKS = 4
_INK = "#1f2430"
"""Stands for the page's ink until the figure is written."""
_STYLE = """<style>
svg { color: #1f2430; background: #ffffff }
.ground { fill: #ffffff }
@media (prefers-color-scheme: dark) { svg { color: #dfe3ea; background: #14171c } .ground { fill: #14171c } }
</style>
<rect class="ground" width="100%" height="100%"/>
"""
_SETTINGS: dict[str, Any] = {
    "svg.hashsalt": "wsnsim",
    "svg.fonttype": "none",  # text stays text: small, and to be searched
    "font.family": ["DejaVu Sans"],
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.labelsize": 9.0,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": _INK,
    "axes.labelcolor": _INK,
    "axes.facecolor": "none",
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": GREY,
    "grid.alpha": 0.25,
    "grid.linewidth": 0.6,
    "text.color": _INK,
    "xtick.color": _INK,
    "ytick.color": _INK,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "lines.linewidth": 1.4,
    "figure.facecolor": "none",
    "savefig.facecolor": "none",
    "path.simplify": False,
}
INK = _INK


class Drawing:
    """A figure under way: `with Drawing(8, 4, 1, 2) as drawing: drawing.axes[0, 0].plot(...)`, then `svg`.

    Parameters
    ----------
    width_in, height_in : of the whole figure [inch]
    rows, columns : of its panels
    **grid : of `matplotlib.figure.Figure.subplots`

    Raises
    ------
    OutputError : matplotlib is not installed
    """

    def __init__(
        self, width_in: float, height_in: float, rows: int = 1, columns: int = 1, **grid: Any
    ) -> None:
        try:
            import matplotlib
        except ModuleNotFoundError as error:
            raise OutputError("figures need matplotlib; pip install 'wsnsim[reports]'") from error
        settings: Any = _SETTINGS
        self._context = matplotlib.rc_context(settings)
        self._size, self._shape, self._grid = (width_in, height_in), (rows, columns), grid
        self.svg = ""

    def __enter__(self) -> "Drawing":
        from matplotlib.figure import Figure

        self._context.__enter__()
        self.figure: Figure = Figure(figsize=self._size, layout="constrained")
        self.axes: Any = self.figure.subplots(*self._shape, squeeze=False, **self._grid)
        return self

    def __exit__(self, *error: Any) -> None:
        try:
            if error[0] is None:
                self.svg = _written(self.figure)
        finally:
            self._context.__exit__(*error)


def _written(figure: "Figure") -> str:
    text = StringIO()
    figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    svg = (
        text.getvalue()
        .replace(_INK, "currentColor")
        .replace("'DejaVu Sans'", "'DejaVu Sans', Verdana, sans-serif")
    )
    # fonts of the reader are wider or narrower; what is anchored stays in place
    head = re.search(r"<svg [^>]*>\n", svg)
    assert head is not None
    body = svg[head.end() :]
    lines = [line.rstrip() for line in (svg[: head.end()] + _STYLE + body).splitlines()]
    return "\n".join(lines) + "\n"


def legend_above(drawing: Drawing, ncols: int = 8) -> None:
    """Put one legend for all panels above them, each label once."""
    found: dict[str, Any] = {}
    for axes in drawing.axes.flat:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            found.setdefault(label, handle)
    columns = min(len(found), ncols)
    drawing.figure.legend(list(found.values()), list(found), loc="outside upper center", ncols=columns)


def drawn_heights(panels: Iterable["Axes"]) -> list[float]:
    """Return all heights that lines in some panels reach."""
    return [float(y) for axes in panels for line in axes.lines for y in np.atleast_1d(line.get_ydata())]


def interval_bar(axes: "Axes", at: float, interval: "Interval", colour: str, across: bool = False) -> None:
    """Draw an interval upwards, or across, for a logarithmic scale."""
    ends = interval_ends(interval)
    place = [at] * len(ends)
    x, y = (ends, place) if across else (place, ends)
    axes.plot(x, y, color=colour, linewidth=1.3, solid_capstyle="butt")


def log_scale(axis: "Axis", low: float, high: float) -> None:
    """Make an axis logarithmic from `low` to `high`, with ticks that read as plain numbers."""
    from matplotlib.ticker import FixedLocator, NullLocator

    letter = "x" if axis is axis.axes.xaxis else "y"
    axis.axes.set(**{f"{letter}scale": "log", f"{letter}lim": (low, high)})
    decades = range(floor(log10(low)) - 1, ceil(log10(high)) + 1)
    ticks: list[float] = []
    for steps in _TICKS:
        ticks = [step * 10.0**decade for decade in decades for step in steps]
        ticks = [tick for tick in ticks if low <= tick <= high]
        if len(ticks) >= _FEWEST_TICKS:
            break
    axis.set_major_locator(FixedLocator(ticks))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(lambda value, _: f"{value:,.6g}".replace(",", "\u202f"))


def span(values: Iterable[float], room: float = 1.25, least: float = 4.0) -> tuple[float, float]:
    """Return ends of a logarithmic axis for positive values, at least a ratio of `least` apart."""
    present = [value for value in values if value > 0]
    low, high = min(present, default=1.0) / room, max(present, default=1.0) * room
    wider = max(sqrt(least * low / high), 1.0)
    return low / wider, high * wider


def interval_ends(interval: "Interval") -> list[float]:
    """Return the ends of an interval's bar on a logarithmic axis, the mean alone where it has no bar."""
    if isnan(interval.low) or isnan(interval.high):
        return [interval.value]
    # the interval of a mean may reach below zero, where there is no logarithm
    return [interval.low if interval.low > 0 else _CUT * interval.value, interval.high]
