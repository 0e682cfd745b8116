"""Quality of information: how far the estimates are from the truth."""

import numpy as np
import pandas as pd

Figures = dict[str, float | int | None]
"""Figures by their key, the unit in the key; None where there is nothing to measure."""


def accuracy(steps: pd.DataFrame, lost_above_m: float) -> Figures:
    """Return position and reprojection errors and the share of targets lost.

    Errors are taken over all steps with an estimate. A target is lost if its
    error at the last step is above `lost_above_m`, or if it has no estimate
    there.

    Parameters
    ----------
    steps : the table of `steps_table`
    lost_above_m : two target lengths in the published experiments [m]
    """
    errors = steps["error_m"].dropna().to_numpy(np.float64)
    last = steps[steps["step"] == steps["step"].max()]
    return {
        "position_error_mean_m": float(errors.mean()) if errors.size else None,
        "position_error_median_m": float(np.median(errors)) if errors.size else None,
        "position_rmse_m": float(np.sqrt(np.mean(errors**2))) if errors.size else None,
        "reprojection_error_mean_px": mean_or_none(steps["reprojection_px"]),
        "lost_fraction": float((~(last["error_m"] <= lost_above_m)).mean()) if len(last) else None,
    }


def mean_or_none(values: "pd.Series[float]") -> float | None:
    """Return the mean of the values that are there, None if there are none."""
    present = values.dropna()
    return float(present.mean()) if len(present) else None
