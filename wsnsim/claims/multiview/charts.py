"""Counterparts of the paper's charts over many runs, and those of what the radio and the factors come to."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from wsnsim.claims.drawing import (
    COLOURS,
    INK,
    SYMBOLS,
    Drawing,
    drawn_heights,
    interval_bar,
    interval_ends,
    legend_above,
    log_scale,
    span,
)
from wsnsim.claims.multiview.evidence import (
    ERROR_M,
    ERROR_PX,
    FIXED_SPREAD,
    FORMS,
    JOULES,
    PUBLISHED,
    SETUPS,
    TRACKERS,
    WITH_RELAYS,
    Evidence,
    turning,
)
from wsnsim.metrics.cells import compare
from wsnsim.metrics.statistics import Interval, mean_interval
from wsnsim.report.charts import GREY

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_AXIS = {ERROR_M: "error [m]", ERROR_PX: "error [px]"}
FIXED, TURNING = "fixed", "turning"
_HOLLOW = (PUBLISHED, TURNING)
_BESIDE = (-0.14, 0.14)
"""Where the two markers of a tracker stand."""
_CLASSES = 8
"""Classes of pixel share, with as many steps each."""
_FEWEST = 12
"""Steps that a number of cameras must have to be shown."""


def means(evidence: Evidence) -> str:
    """Return Figs. 11 and 13: mean errors of all trackers in A and B, in both forms."""
    cells = (*TRACKERS, *FIXED_SPREAD)
    with Drawing(9.0, 5.0, 2, 2, sharex=True, sharey="row") as drawing:
        for row, key in enumerate((ERROR_M, ERROR_PX)):
            for column, setup in enumerate(SETUPS):
                axes = drawing.axes[row, column]
                for at, cell in enumerate(cells):
                    for form, shift in zip(FORMS, _BESIDE, strict=True):
                        name = f"{setup}/{cell}" + ("-published" if form == PUBLISHED else "")
                        if name in evidence.variants:
                            values = evidence.variants.figure(name, key)
                            _dot(axes, at + shift, mean_interval(values.to_numpy()), cell, form)
                axes.set_xticks(range(len(cells)), [cell.replace("-", "\n") for cell in cells])
                if row == 0:
                    axes.set_title(f"setup {setup}")
        _finish_means(drawing, FORMS)
    return drawing.svg


def turning_or_fixed(evidence: Evidence) -> str:
    """Return Fig. 12: mean errors in B of targets that turn beside those that do not."""
    turns = turning(evidence)
    with Drawing(9.0, 5.0, 2, 2, sharex=True, sharey="row") as drawing:
        for row, key in enumerate((ERROR_M, ERROR_PX)):
            for column, form in enumerate(FORMS):
                axes = drawing.axes[row, column]
                for at, tracker in enumerate(TRACKERS):
                    values = evidence.seen_as(form).figure("B", tracker, key)
                    assert values is not None
                    rotates = np.array([turns[int(seed)] for seed in values.index])
                    for kind, shift, group in zip(
                        (FIXED, TURNING), _BESIDE, (~rotates, rotates), strict=True
                    ):
                        _dot(axes, at + shift, mean_interval(values.to_numpy()[group]), tracker, kind)
                axes.set_xticks(range(len(TRACKERS)), TRACKERS)
                if row == 0:
                    axes.set_title(form)
        _finish_means(drawing, (FIXED, TURNING))
    return drawing.svg


def _dot(axes: "Axes", x: float, interval: Interval, cell: str, kind: str) -> None:
    """Draw a mean with its interval; the hollow marker is the printed form, or the target that turns."""
    tracker = cell.partition("-")[0]
    interval_bar(axes, x, interval, COLOURS[tracker])
    axes.plot(
        [x], [interval.value], SYMBOLS[tracker], markersize=6, **_paint(COLOURS[tracker], kind in _HOLLOW)
    )


def _paint(colour: str, hollow: bool) -> dict[str, Any]:
    return {"color": colour, "markerfacecolor": "none" if hollow else colour}


def _finish_means(drawing: Drawing, kinds: Sequence[str]) -> None:
    """Set scales, labels and the legend of hollow and filled markers."""
    for axes_row, key in zip(drawing.axes, (ERROR_M, ERROR_PX), strict=True):
        low, high = span(drawn_heights(axes_row))
        for axes in axes_row:
            log_scale(axes.yaxis, low, high)
            axes.grid(axis="x", visible=False)
        axes_row[0].set_ylabel(_AXIS[key])
    for kind in kinds:
        axes_row[0].plot([], [], "o", markersize=6, label=kind, **_paint(GREY, kind in _HOLLOW))
    legend_above(drawing)


def errors_by_sight(evidence: Evidence) -> str:
    """Return the median error of each tracker in B by pixel share and by number of cameras, over all runs."""
    with Drawing(9.0, 5.4, 2, 2, sharey="col", sharex="row") as drawing:
        for column, form in enumerate(FORMS):
            for tracker in TRACKERS:
                steps = evidence.seen_as(form).steps("B", tracker)
                assert steps is not None
                style: dict[str, Any] = {
                    "color": COLOURS[tracker],
                    "marker": SYMBOLS[tracker],
                    "markersize": 4.5,
                    "label": tracker,
                }
                seen = steps[["error_m", "pixel_share", "participating"]].dropna()
                shares = pd.qcut(seen["pixel_share"], _CLASSES, duplicates="drop")
                classes = seen.groupby(shares, observed=True)[["pixel_share", "error_m"]].median()
                drawing.axes[0, column].plot(100 * classes["pixel_share"], classes["error_m"], **style)
                cameras = seen.groupby("participating")["error_m"].agg(["median", "size"])
                cameras = cameras[cameras["size"] >= _FEWEST]
                drawing.axes[1, column].plot(cameras.index, cameras["median"], **style)
            drawing.axes[0, column].set_title(form)
            for axes, label in zip(
                drawing.axes[:, column], ("pixels [%]", "cameras that see the target"), strict=True
            ):
                axes.set_xlabel(label)
        low, high = span(drawn_heights(drawing.axes.flat))
        for axes in drawing.axes.flat:
            log_scale(axes.yaxis, low, high)
        for axes in drawing.axes[1]:
            axes.xaxis.get_major_locator().set_params(integer=True)
        for axes in drawing.axes[:, 0]:
            axes.set_ylabel("median error [m]")
        legend_above(drawing)
    return drawing.svg


def radio_costs(evidence: Evidence) -> str:
    """Return error against bytes on the air and against joules, a step, over IEEE 802.15.4."""
    results = evidence.radio
    with Drawing(9.0, 4.0, 1, 2, sharey=True) as drawing:
        for axes, key, label in zip(
            drawing.axes[0],
            (WITH_RELAYS, JOULES),
            ("bytes of all frames, a step", "joules of all motes, a step"),
            strict=True,
        ):
            across: list[float] = []
            for name in (str(name) for name in results.cells["name"]):
                error, cost = (
                    mean_interval(results.figure(name, each).to_numpy()) for each in (ERROR_M, key)
                )
                tracker, _, detail = name.partition("-")
                interval_bar(axes, cost.value, error, COLOURS[tracker])
                interval_bar(axes, error.value, cost, COLOURS[tracker], across=True)
                paint = _paint(COLOURS[tracker], bool(detail))
                shown = f"{tracker}, {detail}" if detail else tracker
                axes.plot([cost.value], [error.value], SYMBOLS[tracker], markersize=7, label=shown, **paint)
                if detail and detail != "float64":
                    place = (cost.value, error.value)
                    axes.annotate(detail, place, (7, 4), textcoords="offset points", fontsize=8)
                across += interval_ends(cost)
            axes.set_xlabel(label)
            log_scale(axes.xaxis, *span(across, least=1.5))
        low, high = span(drawn_heights(drawing.axes[0]))
        for axes in drawing.axes[0]:
            log_scale(axes.yaxis, low, high)
        drawing.axes[0, 0].set_ylabel("error [m]")
        legend_above(drawing, ncols=5)
    return drawing.svg


def factor_ratios(evidence: Evidence) -> str:
    """Return the error of T2 in B over that of the default, for each level of each factor."""
    results = evidence.factors
    base = results.number_of("default")
    cells = results.cells[results.cells["name"] != "default"].to_dict("records")
    with Drawing(9.0, 0.9 + 0.27 * len(cells)) as drawing:
        axes = drawing.axes[0, 0]
        ends = [1.0]
        for at, cell in enumerate(cells):
            interval = compare(results.runs, int(cell["cell"]), base, ERROR_M).ratio
            interval_bar(axes, at, interval, COLOURS["T2"], across=True)
            axes.plot([interval.value], [at], SYMBOLS["T2"], color=COLOURS["T2"], markersize=6)
            ends += interval_ends(interval)
        axes.axvline(1.0, color=INK, linewidth=0.8)
        axes.set_yticks(range(len(cells)), [str(cell["name"]).replace("=", ": ") for cell in cells])
        axes.invert_yaxis()
        axes.grid(axis="y", visible=False)
        log_scale(axes.xaxis, *span(ends))
        axes.set_xlabel("error over that of the default, same seeds")
    return drawing.svg
