"""What a frame costs over IEEE 802.15.4, drawn: energy by component, and error against bytes and joules."""

from typing import TYPE_CHECKING

from wsnsim.claims.drawing import (
    INK,
    Drawing,
    drawn_heights,
    interval_bar,
    interval_ends,
    legend_above,
    log_scale,
    span,
)
from wsnsim.claims.scanline.charts import RMSE_LABEL, STYLES, WORDS
from wsnsim.claims.scanline.evidence import HEARD, ON_AIR, Evidence
from wsnsim.claims.scanline.measures import COMPONENTS, energy_a_frame
from wsnsim.claims.scanline.studies import ALONE, KALMAN, NONE, PERFECT
from wsnsim.metrics.statistics import mean_interval
from wsnsim.report.charts import BLUE, GREEN, PURPLE, VERMILLION
from wsnsim.report.wording import number, percent

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_MESSAGES = {
    "bearing": ("bearings", BLUE, "o"),
    "scan_line": ("whole scan lines", GREEN, "s"),
    "jpeg": ("JPEG images", VERMILLION, "D"),
    ALONE: ("one JPEG image, alone", PURPLE, "X"),
}
"""Name, colour and marker of what cameras send."""
PARTS = {
    "radio_tx": "radio, sending",
    "radio_rx": "radio, receiving",
    "radio_listen": "radio, listening",
    "cpu": "processor",
    "camera": "camera",
    "board": "board",
}
_ALL = "together"
_KINDS = {"bearing": NONE, "stationary": "stationary", "kalman": KALMAN, "perfect": PERFECT,
          "scan_line": "scan_lines"}  # fmt: skip
"""Cells over the radio by what they know; nobody follows anything by images that do not arrive."""


def energy(evidence: Evidence) -> str:
    """Return the joules of a camera's node a frame by component, and the share heard, for each message."""
    with Drawing(9.0, 5.2, 1, 2, width_ratios=(2.4, 1.0)) as drawing:
        left, right = drawing.axes[0]
        rows, seen = [*COMPONENTS, _ALL], list[float]()
        for place, (cell, (name, colour, symbol)) in enumerate(_MESSAGES.items()):
            parts = {
                part: 1e3 * float(values.mean()) for part, values in energy_a_frame(evidence, cell).items()
            }
            parts[_ALL] = sum(parts.values())
            # a frame of the camera alone lasts ten seconds: but for its sending it does not compare
            shown = rows[:1] if cell == ALONE else rows
            heights = [rows.index(row) + 0.23 * (place - 1.5) for row in shown]
            values = [parts[row] for row in shown]
            seen += values
            left.plot(values, heights, symbol, color=colour, markersize=5, label=name)
            for row, value, height in zip(shown, values, heights, strict=True):
                if row in (rows[0], _ALL):
                    _beside(left, value, height, f"{number(value)} mJ")
            found = evidence.on_air(cell)
            assert found is not None
            heard = float(found.figure(HEARD).mean())
            right.barh(place, 100 * heard, height=0.5, color=colour)
            _beside(right, 100 * heard, place, percent(heard))
        for line in range(1, len(rows)):
            left.axhline(line - 0.5, color=INK, linewidth=0.4, alpha=0.4)
        left.set_yticks(range(len(rows)), [PARTS.get(row, row) for row in rows])
        right.set_yticks(range(len(_MESSAGES)), [name for name, _, _ in _MESSAGES.values()])
        for axes in (left, right):
            axes.invert_yaxis()
            axes.grid(axis="y", visible=False)
        low, high = span(seen)
        log_scale(left.xaxis, low, 3 * high)
        right.set_xlim(0, 150)
        right.set_xticks([0, 50, 100])
        left.set_xlabel("energy of a camera's node, a frame [mJ]")
        right.set_xlabel("reports heard in time [%]")
        legend_above(drawing)
    return drawing.svg


def _beside(axes: "Axes", x: float, y: float, text: str) -> None:
    axes.annotate(text, (x, y), (5, 0), textcoords="offset points", va="center", fontsize=7.5)


def bargain(evidence: Evidence) -> str:
    """Return error against bytes on the air and against joules of sending, over IEEE 802.15.4."""
    with Drawing(9.0, 3.6, 1, 2, sharey=True) as drawing:
        left, right = drawing.axes[0]
        across: dict[str, list[float]] = {"left": [], "right": []}
        for cell, prior in _KINDS.items():
            place = evidence.on_air(cell)
            assert place is not None
            colour, symbol = STYLES[prior]
            error = mean_interval(place.rmse().to_numpy())
            costs = (
                mean_interval(place.figure(ON_AIR).to_numpy()),
                mean_interval(1e3 * energy_a_frame(evidence, cell)["radio_tx"]),
            )
            for axes, cost, reached in zip((left, right), costs, across.values(), strict=True):
                interval_bar(axes, cost.value, error, colour)
                axes.plot([cost.value], [error.value], symbol, color=colour, markersize=6, label=WORDS[prior])
                reached += interval_ends(cost)
        left.set_xlabel("bytes of all frames on the air, a step")
        right.set_xlabel("sending, a camera's node, a frame [mJ]")
        for axes, reached in zip((left, right), across.values(), strict=True):
            log_scale(axes.xaxis, *span(reached, least=1.5))
        log_scale(left.yaxis, *span(drawn_heights(drawing.axes[0])))
        left.set_ylabel(RMSE_LABEL)
        legend_above(drawing, ncols=6)
    return drawing.svg
