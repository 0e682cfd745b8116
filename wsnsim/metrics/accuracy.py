"""Quality of information: how far the estimates are from the truth."""

from collections.abc import Mapping

import numpy as np
import pandas as pd

from wsnsim.metrics.figures import Figures, mean_or_none


def accuracy(steps: pd.DataFrame, lost_above_m: Mapping[str, float]) -> Figures:
    """Return position, orientation and reprojection errors and the share of targets lost.

    Errors are taken over all steps with an estimate, mere predictions included;
    `smoothed_error_mean_m` over those that a smoother looked at again. A target
    is lost if the error of its last estimate is above its limit, if the tracker
    itself has given it up at the end, or if no estimate of it ever rested on a
    measurement.

    Parameters
    ----------
    steps : the table of `steps_table`
    lost_above_m : limit of every target by its name, two of its lengths in the published experiments [m]

    Raises
    ------
    KeyError : a target without a limit
    """
    errors = steps["error_m"].dropna().to_numpy(np.float64)
    return {
        "position_error_mean_m": float(errors.mean()) if errors.size else None,
        "position_error_median_m": float(np.median(errors)) if errors.size else None,
        "position_rmse_m": float(np.sqrt(np.mean(errors**2))) if errors.size else None,
        "reprojection_error_mean_px": mean_or_none(steps["reprojection_px"]),
        "orientation_error_mean_deg": mean_or_none(steps["orientation_error_deg"]),
        "smoothed_error_mean_m": mean_or_none(steps["smoothed_error_m"]),
        "lost_fraction": _lost_fraction(steps, lost_above_m),
    }


def _lost_fraction(steps: pd.DataFrame, lost_above_m: Mapping[str, float]) -> float | None:
    targets = [str(target) for target in steps["target"].unique()]
    if not targets:
        return None
    limits_m = np.array([lost_above_m[target] for target in targets])
    made = steps.dropna(subset=["error_m"]).sort_values("step", kind="stable")
    last = made.drop_duplicates("target", keep="last").set_index("target")
    kept = last["error_m"].reindex(targets).to_numpy(np.float64) <= limits_m
    kept &= (last["kind"].reindex(targets) != "lost").to_numpy(np.bool_)
    measured = np.isin(targets, steps.loc[steps["kind"] == "update", "target"].unique().astype(str))
    return float(np.mean(~(kept & measured)))
