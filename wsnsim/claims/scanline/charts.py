"""Counterparts of Figs. 9 to 13 and 15."""

from collections.abc import Callable, Sequence
from math import inf
from typing import TYPE_CHECKING, Any

import numpy as np

from wsnsim.claims.drawing import (
    INK,
    Drawing,
    drawn_heights,
    interval_bar,
    legend_above,
    log_scale,
    span,
)
from wsnsim.claims.scanline.evidence import Evidence, Place
from wsnsim.claims.scanline.measures import WANTED, curve, needed_for
from wsnsim.claims.scanline.studies import (
    BEYOND,
    CAMERAS,
    CROWDS,
    KALMAN,
    LAB_CAMERAS,
    NONE,
    PAPER_SD,
    PERFECT,
    PRIORS,
    PUBLISHED,
    SDS,
    TRADED,
)
from wsnsim.metrics.statistics import mean_interval
from wsnsim.report.charts import BLUE, GREEN, GREY, ORANGE, PURPLE, VERMILLION

if TYPE_CHECKING:
    from matplotlib.axes import Axes

STYLES = {
    NONE: (VERMILLION, "o"),
    KALMAN: (ORANGE, "s"),
    PERFECT: (BLUE, "D"),
    "stationary": (PURPLE, "^"),
    "scan_lines": (GREEN, "v"),
}
"""Colour and marker of each kind of priors, in every figure."""
WORDS = {
    NONE: "none",
    KALMAN: "Kalman",
    PERFECT: "perfect",
    "stationary": "the room alone",
    "scan_lines": "whole scan lines",
}
RMSE_LABEL = "RMSE over both axes [units]"
_APART = 0.015
"""By which share of the axis markers of one number of cameras stand beside each other."""


def by_cameras(evidence: Evidence) -> str:
    """Return Fig. 9: error by number of cameras, with the block."""
    with Drawing(7.0, 3.8) as drawing:
        axes = drawing.axes[0, 0]
        least = _lines(axes, PRIORS, CAMERAS, evidence.behind_block)
        nothing = evidence.rooms.block.target
        axes.axhline(nothing, color=INK, linewidth=0.9, linestyle=":", label="nothing measured")
        axes.set_xlabel("cameras")
        _finish(axes, least)
        legend_above(drawing)
    return drawing.svg


def by_priors(evidence: Evidence) -> str:
    """Return Fig. 10: error by that of the priors, four cameras."""
    with Drawing(8.0, 4.0) as drawing:
        axes = drawing.axes[0, 0]
        found = curve(evidence)
        assert found is not None
        at, errors = found
        intervals = [mean_interval(row) for row in errors]
        colours = [STYLES[PERFECT], *(STYLES[KALMAN] for _ in SDS), STYLES[NONE]]
        axes.plot(at, [each.value for each in intervals], color=GREY, linewidth=1.0)
        for x, interval, (colour, symbol) in zip(at, intervals, colours, strict=True):
            interval_bar(axes, x, interval, colour)
            axes.plot([x], [interval.value], symbol, color=colour, markersize=6)
        for name in (PERFECT, KALMAN, NONE):
            axes.plot([], [], STYLES[name][1], color=STYLES[name][0], label=WORDS[name])
        _published(axes, evidence)
        for name in BEYOND:
            place = evidence.known(name)
            assert place is not None
            value = mean_interval(place.rmse().to_numpy()).value
            axes.axhline(value, color=STYLES[name][0], linewidth=1.0, linestyle="--", label=WORDS[name])
        axes.axline((0, 0), slope=1, color=INK, linewidth=0.8, linestyle=":", label="both equal")
        axes.set_xlim(-0.03 * at[-1], 1.03 * at[-1])
        axes.set_xlabel("RMSE of the priors over both axes [units]")
        axes.set_ylim(0, 1.12 * max(each.high for each in intervals))
        axes.set_ylabel(RMSE_LABEL)
        legend_above(drawing, ncols=7)
    return drawing.svg


def _published(axes: "Axes", evidence: Evidence) -> None:
    """Draw the printed form beside the mended one, hollow."""
    seen, room = evidence.seen_as(PUBLISHED), evidence.rooms.open
    at = {PERFECT: 0.0, KALMAN: room.filters[f"{KALMAN}-{PAPER_SD}"], NONE: room.occluders}
    for name, x in at.items():
        place = seen.known(name)
        if place is not None:
            colour, symbol = STYLES[name]
            value = mean_interval(place.rmse().to_numpy()).value
            axes.plot([x], [value], symbol, color=colour, markerfacecolor="none", markersize=8)
    axes.plot([], [], "o", color=GREY, markerfacecolor="none", markersize=8, label=PUBLISHED)


def trade(evidence: Evidence) -> str:
    """Return Fig. 11: error by number of cameras without the block, and how good priors must be for 3."""
    with Drawing(9.0, 3.8, 1, 2) as drawing:
        left, right = drawing.axes[0]
        least = _lines(left, (NONE, PERFECT), TRADED, evidence.open_room)
        left.axhline(WANTED, color=INK, linewidth=0.8, linestyle=":")
        left.set_xlabel("cameras")
        _finish(left, least)
        worst = evidence.rooms.open.occluders
        at = [needed_for(evidence, n) for n in TRADED]
        for n, value in zip(TRADED, at, strict=True):
            if np.isnan(value):
                _note(right, n, 0, "never")
                right.plot([n], [0], "X", color=GREY, markersize=7)
            else:
                right.plot([n], [value], "D", color=BLUE, markersize=6)
        right.axhline(worst, color=INK, linewidth=0.8, linestyle="--")
        _note(right, TRADED[0], worst, "nothing known", "left")
        right.set_ylim(-0.05 * worst, 1.15 * worst)
        right.set_xlim(TRADED[0] - 0.4, TRADED[-1] + 0.4)
        right.set_xticks(TRADED)
        right.set_xlabel("cameras")
        right.set_ylabel(f"RMSE of priors that do for {WANTED:g} units [units]")
        legend_above(drawing)
    return drawing.svg


def by_crowd(evidence: Evidence) -> str:
    """Return Fig. 12: error by number of occluders, and what perfect priors bring."""
    with Drawing(9.0, 3.8, 1, 2) as drawing:
        left, right = drawing.axes[0]
        _lines(left, (NONE, PERFECT), CROWDS, evidence.crowd)
        left.set_xlabel("occluders")
        left.set_ylim(bottom=0)
        left.set_ylabel(RMSE_LABEL)
        for m in CROWDS:
            none, perfect = evidence.crowd(m, NONE), evidence.crowd(m, PERFECT)
            assert none is not None
            assert perfect is not None
            interval = mean_interval((none.rmse() - perfect.rmse()).to_numpy())
            right.plot([m, m], [interval.low, interval.high], color=GREEN, linewidth=1.3)
            right.plot([m], [interval.value], "D", color=GREEN, markersize=6)
        right.axhline(0.0, color=INK, linewidth=0.8)
        right.set_xlabel("occluders")
        right.set_ylabel("benefit of perfect priors [units]")
        legend_above(drawing)
    return drawing.svg


def times(evidence: Evidence) -> str:
    """Return Fig. 13: CPU time of a step by number of cameras, over that of two without priors."""
    speed = evidence.speed
    with Drawing(5.5, 3.6) as drawing:
        axes = drawing.axes[0, 0]
        cameras = sorted({n for _, n in speed.step_s}) if speed is not None else []
        if speed is not None:
            base = speed.step_s[NONE, cameras[0]]
            for prior in PRIORS:
                colour, symbol = STYLES[prior]
                heights = [speed.step_s[prior, n] / base for n in cameras]
                axes.plot(cameras, heights, color=colour, marker=symbol, markersize=5, label=WORDS[prior])
            axes.plot(
                cameras,
                [n / cameras[0] for n in cameras],
                color=INK,
                linestyle=":",
                linewidth=0.8,
                label="in proportion",
            )
            axes.set_xticks(cameras)
        axes.set_xlabel("cameras")
        axes.set_ylabel("time of a step, over that of 2 without priors")
        axes.set_ylim(bottom=0)
        legend_above(drawing)
    return drawing.svg


def in_lab(evidence: Evidence) -> str:
    """Return Fig. 15: error by number of cameras in the lab."""
    with Drawing(7.0, 3.8) as drawing:
        axes = drawing.axes[0, 0]
        least = _lines(axes, PRIORS, LAB_CAMERAS, evidence.in_lab)
        axes.set_xlabel("cameras")
        _finish(axes, least, "RMSE over both axes [inches]")
        legend_above(drawing)
    return drawing.svg


def _lines(
    axes: "Axes", priors: Sequence[str], at: Sequence[int], place: Callable[[int, str], Place | None]
) -> float:
    """Draw a line of mean errors for each kind of priors, side by side; return the least of them."""
    least = inf
    for number, prior in enumerate(priors):
        colour, symbol = STYLES[prior]
        places = [place(x, prior) for x in at]
        intervals = [mean_interval(each.rmse().to_numpy()) for each in places if each is not None]
        beside = _APART * (at[-1] - at[0]) * (number - 0.5 * (len(priors) - 1))
        across = [x + beside for x in at]
        for x, interval in zip(across, intervals, strict=True):
            interval_bar(axes, x, interval, colour)
        style: dict[str, Any] = {"color": colour, "marker": symbol, "markersize": 5}
        axes.plot(across, [each.value for each in intervals], label=WORDS[prior], **style)
        least = min(least, *(each.value for each in intervals))
    axes.set_xticks(at)
    return least


def _finish(axes: "Axes", least: float, label: str = RMSE_LABEL) -> None:
    """Make the heights logarithmic, from a little below the least mean: of few runs, intervals reach to 0."""
    log_scale(axes.yaxis, 0.5 * least, span(drawn_heights([axes]))[1])
    axes.set_ylabel(label)


def _note(axes: "Axes", x: float, y: float, text: str, side: str = "center") -> None:
    axes.annotate(text, (x, y), (0, 6), textcoords="offset points", ha=side, fontsize=8)
