"""Counterparts of the paper's figures of single runs: paths, and what happened step by step."""

from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from wsnsim.claims.drawing import COLOURS, INK, Drawing, drawn_heights, legend_above, log_scale, span
from wsnsim.claims.multiview.evidence import FORMS, Evidence
from wsnsim.report.charts import BLUE, GREY, VERMILLION

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DRAWN = ("P", "T0", "T2", "T3")
"""Trackers of Figs. 9 and 10; the paper finds T1 like T2, and T4 like T3."""
_FLOOR_M = 2e-3
"""Lower end of logarithmic axes of errors [m]."""


def first_run(evidence: Evidence, world: str, tracker: str) -> pd.DataFrame:
    """Return the steps of a tracker's run with the study's first seed."""
    steps = evidence.steps(world, tracker)
    assert steps is not None
    first: pd.DataFrame = steps[steps["seed"] == steps["seed"].min()]
    return first


def patch_graphs(evidence: Evidence) -> str:
    """Return Fig. 9: true and estimated path from above, the error at each step between them."""
    with Drawing(9.0, 4.2, 2, 4, sharex=True, sharey=True) as drawing:
        for row, form in enumerate(FORMS):
            for column, tracker in enumerate(DRAWN):
                axes = drawing.axes[row, column]
                _patches(axes, first_run(evidence.seen_as(form), "B", tracker))
                axes.set_title(f"{tracker}, {form}")
                axes.set_aspect("equal")
                if row == 1:
                    axes.set_xlabel("x [m]")
                if column == 0:
                    axes.set_ylabel("y [m]")
        _frame(drawing.axes[0, 0], first_run(evidence, "B", "T2"), margin_m=3.0)
        legend_above(drawing)
    return drawing.svg


def _patches(axes: "Axes", steps: pd.DataFrame) -> None:
    true_m, believed_m = _plane(steps, "truth"), _plane(steps, "estimate")
    for at in range(len(steps) - 1):
        corners = np.vstack([true_m[at : at + 2], believed_m[at : at + 2][::-1]])
        if not np.isnan(corners).any():
            axes.fill(corners[:, 0], corners[:, 1], color=GREY, alpha=0.45, linewidth=0)
    axes.plot(*true_m.T, color=BLUE, linewidth=2.2, label="truth")
    axes.plot(*believed_m.T, color=VERMILLION, linewidth=1.1, label="estimate")


def _plane(steps: pd.DataFrame, prefix: str) -> "np.ndarray[Any, np.dtype[np.float64]]":
    return steps[[f"{prefix}_x_m", f"{prefix}_y_m"]].to_numpy(np.float64)


def _frame(axes: "Axes", steps: pd.DataFrame, margin_m: float) -> None:
    """Show the true path and some room around it; an estimate that runs off leaves the picture."""
    true_m = _plane(steps, "truth")
    (left, low), (right, high) = true_m.min(axis=0) - margin_m, true_m.max(axis=0) + margin_m
    axes.set_xlim(left, right)
    axes.set_ylim(low, high)


def errors_by_step(evidence: Evidence) -> str:
    """Return Fig. 10: errors step by step, with the cameras that see the target and its pixel share."""
    ratios = {"height_ratios": [2.2, 1, 1]}
    with Drawing(9.0, 5.4, 3, 2, sharex=True, sharey="row", gridspec_kw=ratios) as drawing:
        for column, form in enumerate(FORMS):
            for tracker in DRAWN:
                steps = first_run(evidence.seen_as(form), "B", tracker)
                errors = steps["error_m"].clip(lower=_FLOOR_M)
                drawing.axes[0, column].plot(steps["step"], errors, color=COLOURS[tracker], label=tracker)
            drawing.axes[0, column].set_title(form)
            steps = first_run(evidence, "B", "T2")
            _world_rows(drawing.axes[1:, column], steps)
            drawing.axes[2, column].set_xlabel("step")
        low, high = span(drawn_heights(drawing.axes[0]))
        for axes in drawing.axes[0]:
            log_scale(axes.yaxis, low, high)
        drawing.axes[0, 0].set_ylabel("error [m]")
        _world_labels(drawing.axes[1:, 0])
        legend_above(drawing)
    return drawing.svg


def _world_rows(axes: Any, steps: pd.DataFrame) -> None:
    """Draw the number of cameras that see the target, and its share of their pixels."""
    cameras, share = axes
    cameras.step(steps["step"], steps["participating"], where="mid", color=INK)
    single = (steps["participating"] == 1).to_numpy()
    cameras.fill_between(
        steps["step"], 0, steps["participating"], where=single, step="mid", color=VERMILLION, alpha=0.5, lw=0
    )
    cameras.set_ylim(bottom=0)
    cameras.yaxis.get_major_locator().set_params(integer=True)
    share.plot(steps["step"], 100 * steps["pixel_share"], color=INK)
    share.axhline(1.0, color=VERMILLION, linestyle="--", linewidth=1.0)
    share.set_ylim(bottom=0)


def _world_labels(axes: Any) -> None:
    axes[0].set_ylabel("cameras")
    axes[1].set_ylabel("pixels [%]")


def conference_room(evidence: Evidence) -> str:
    """Return Figs. 16 and 17: a path in LCR as T3 estimates it, and the target's pixel share."""
    return _deployment(evidence, "LCR", "T3", with_cameras=False)


def atrium(evidence: Evidence) -> str:
    """Return Figs. 20 and 21: a path in FGH as T2 estimates it, cameras that see the target, pixel share."""
    return _deployment(evidence, "FGH", "T2", with_cameras=True)


def _deployment(evidence: Evidence, world: str, tracker: str, with_cameras: bool) -> str:
    steps = first_run(evidence, world, tracker)
    mosaic_rows = 3 if with_cameras else 2
    with Drawing(9.0, 3.6, mosaic_rows, 2) as drawing:
        grid = drawing.axes[0, 0].get_gridspec()
        for axes in drawing.axes[:, 0]:
            axes.remove()
        for axes in drawing.axes[:-1, 1]:
            axes.tick_params(labelbottom=False)
        path = drawing.figure.add_subplot(grid[:, 0])
        _patches(path, steps)
        path.plot(*_plane(steps, "truth")[0], "o", color=BLUE, markersize=5)
        path.set_aspect("equal")
        path.set_xlabel("x [m]")
        path.set_ylabel("y [m]")
        path.set_title(f"{world} from above, {tracker}")
        series = list(drawing.axes[:, 1])
        series[0].plot(steps["step"], 100 * steps["error_m"], color=COLOURS[tracker])
        series[0].set_ylabel("error [cm]")
        series[0].set_ylim(bottom=0)
        if with_cameras:
            _world_rows(series[1:], steps)
            _world_labels(series[1:])
        else:
            series[1].plot(steps["step"], 100 * steps["pixel_share"], color=INK)
            series[1].axhline(1.0, color=VERMILLION, linestyle="--", linewidth=1.0)
            series[1].set_ylim(bottom=0)
            series[1].set_ylabel("pixels [%]")
        series[-1].set_xlabel("step")
        drawing.figure.legend(loc="outside upper left", ncols=2)
    return drawing.svg
