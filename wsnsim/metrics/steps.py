"""The `steps` table: what was true, what was believed, and what it was made from.

One row for each target and tracking step. Everything that tells how good a
tracker was is computed from this table.
"""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.metrics.figures import SMOOTHED
from wsnsim.types import BoolArray, FloatArray, IntArray, NodeId

_SAME_INSTANT_S = 1e-6
"""Two times closer than this are the same sampling instant."""

_POSITION = ("x_m", "y_m", "z_m")
_ORIENTATION = ("qw", "qx", "qy", "qz")
_STATE = (*_POSITION, *_ORIENTATION)


def steps_table(
    truth: pd.DataFrame,
    estimates: pd.DataFrame,
    views: pd.DataFrame,
    cameras: Mapping[NodeId, PinholeCamera],
) -> pd.DataFrame:
    """Join truth, estimates and views at the sampling instants.

    A target's estimate is the last one made for that instant under a track of
    the target's name; estimates for other instants are left out. A smoother's
    second look at an instant is no such estimate and has an error of its own.
    The instant of the manual initialisation, the first, is no step.

    Parameters
    ----------
    truth, estimates, views : the record tables
    cameras : by the names that stand in `views`

    Returns
    -------
    one row for each step and target, steps counted from 1, with NaN where no
    estimate was made; `participating` is the number of cameras that really see
    the target, `pixel_share` the mean of its share of their images, and
    `reprojection_px` the mean over them of the distance in the image between
    the true and the estimated position (a camera that has the estimate behind
    it is left out, and none counts more than its image's diagonal),
    `orientation_error_deg` the angle of the turn between true and estimated
    orientation, `smoothed_error_m` the distance of a smoother's last revision
    """
    instants = np.unique(truth["time_s"].to_numpy(np.float64))
    frame = truth[["time_s", "target", *_STATE]].rename(columns=_prefixed("truth"))
    frame.insert(1, "step", _instant_index(instants, frame["time_s"]))
    frame = frame[frame["step"] > 0]
    smoothed = estimates["kind"] == SMOOTHED
    frame = frame.merge(_last_estimates(estimates[~smoothed], instants), how="left", on=["step", "target"])
    revised = _last_estimates(estimates[smoothed], instants, "smoothed")
    revised = revised[["step", "target", *_named("smoothed", _POSITION)]]
    frame = frame.merge(revised, how="left", on=["step", "target"])
    seen = _view_figures(views, instants, frame, cameras)
    frame = frame.merge(seen, how="left", on=["step", "target"])
    true_m, believed_m = _positions(frame, "truth"), _positions(frame, "estimate")
    revised_m = _positions(frame, "smoothed")
    return pd.DataFrame(
        {
            "time_s": frame["time_s"],
            "step": frame["step"].astype("int64"),
            "target": frame["target"],
            "track": frame["track"],
            **{column: frame[column] for column in _named("truth", _POSITION)},
            **{column: frame[column] for column in _named("estimate", _POSITION)},
            "error_m": np.linalg.norm(believed_m - true_m, axis=1),
            "reprojection_px": frame["reprojection_px"],
            "participating": frame["participating"].fillna(0).astype("int64"),
            "asked": frame["asked"],
            "heard": frame["heard"],
            "pixel_share": frame["pixel_share"],
            "latency_s": frame["made_at_s"] - frame["time_s"],
            "kind": frame["kind"],
            "orientation_error_deg": np.degrees(
                turn_between(_orientations(frame, "truth"), _orientations(frame, "estimate"))
            ),
            "smoothed_error_m": np.linalg.norm(revised_m - true_m, axis=1),
            **{column: frame[column] for column in _named("truth", _ORIENTATION)},
            **{column: frame[column] for column in _named("estimate", _ORIENTATION)},
        }
    )


def passed_over(steps: pd.DataFrame, events: pd.DataFrame) -> pd.DataFrame:
    """Return the steps, `skipped` where the tracker left the frame out since it was still busy.

    A base station that tracks says so itself. Where a mote does, the base station knows only that it heard
    nothing of the frame: its estimate, if it made one, says `timed_out`.

    Parameters
    ----------
    steps : the table of `steps_table`
    events : the record table
    """
    left_out = steps["step"].isin(events.loc[events["kind"] == "frame_left_out", "step"])
    unheard = steps["kind"].isna() | (steps["kind"] == "timed_out")
    return steps.assign(kind=steps["kind"].mask(left_out & unheard, "skipped"))


def turn_between(one: FloatArray, other: FloatArray) -> FloatArray:
    """Return the angle of the turn that takes one orientation to the other.

    Parameters
    ----------
    one, other : (n, 4) - unit quaternions; q and -q are the same orientation

    Returns
    -------
    (n,) - 0 to π, NaN where a quaternion is missing [rad]

    References
    ----------
    Huynh (2009), Metrics for 3D rotations, eq. 4: 2 acos|q₁ · q₂|; taken from
    sine and cosine, since the arc cosine keeps half of the digits near 1.
    """
    nearer = np.where((one * other).sum(axis=1, keepdims=True) < 0, -other, other)
    # the chord and its complement on the unit sphere: |q₁ - q₂| = 2 sin(θ/4), |q₁ + q₂| = 2 cos(θ/4)
    sine, cosine = np.linalg.norm(one - nearer, axis=1), np.linalg.norm(one + nearer, axis=1)
    return np.asarray(4.0 * np.arctan2(sine, cosine), dtype=np.float64)


def _named(prefix: str, columns: Sequence[str]) -> list[str]:
    return [f"{prefix}_{column}" for column in columns]


def _prefixed(prefix: str) -> dict[str, str]:
    return dict(zip(_STATE, _named(prefix, _STATE), strict=True))


def _positions(frame: pd.DataFrame, prefix: str) -> FloatArray:
    return frame[_named(prefix, _POSITION)].to_numpy(np.float64)


def _orientations(frame: pd.DataFrame, prefix: str) -> FloatArray:
    return frame[_named(prefix, _ORIENTATION)].to_numpy(np.float64)


def _instant_index(instants: FloatArray, times: "pd.Series[float]") -> IntArray:
    """Return for each time the number of the instant it is, -1 where it is none."""
    values = times.to_numpy(np.float64)
    if len(instants) == 0:
        return np.full(len(values), -1, dtype=np.int64)
    after = np.clip(np.searchsorted(instants, values), 0, len(instants) - 1)
    before = np.maximum(after - 1, 0)
    nearest = np.where(np.abs(instants[before] - values) < np.abs(instants[after] - values), before, after)
    return np.where(np.abs(instants[nearest] - values) <= _SAME_INSTANT_S, nearest, -1).astype(np.int64)


def _last_estimates(estimates: pd.DataFrame, instants: FloatArray, prefix: str = "estimate") -> pd.DataFrame:
    """Return the last estimate for each (step, target), its counts as whole numbers with gaps."""
    columns = ["made_at_s", "track", *_STATE, "asked", "heard", "kind"]
    frame = estimates[columns].rename(columns=_prefixed(prefix))
    frame = frame.assign(step=_instant_index(instants, estimates["time_s"]), target=estimates["track"])
    frame = frame.sort_values("made_at_s", kind="stable").drop_duplicates(["step", "target"], keep="last")
    return frame.astype({"asked": "Int64", "heard": "Int64"})


def _view_figures(
    views: pd.DataFrame, instants: FloatArray, frame: pd.DataFrame, cameras: Mapping[NodeId, PinholeCamera]
) -> pd.DataFrame:
    """Return participating cameras, pixel share and reprojection error for each (step, target) in view."""
    seen = views[["camera", "target", "pixel_share"]].assign(step=_instant_index(instants, views["time_s"]))
    seen = seen.merge(frame, how="inner", on=["step", "target"])
    seen = seen.assign(reprojection_px=_reprojection_px(seen, cameras))
    grouped = seen.groupby(["step", "target"], as_index=False, sort=False)
    return grouped.agg(
        participating=("camera", "nunique"),
        pixel_share=("pixel_share", "mean"),
        reprojection_px=("reprojection_px", "mean"),
    )


def _reprojection_px(seen: pd.DataFrame, cameras: Mapping[NodeId, PinholeCamera]) -> FloatArray:
    true_m, believed_m = _positions(seen, "truth"), _positions(seen, "estimate")
    distances = np.full(len(seen), np.nan)
    for name, camera in cameras.items():
        rows: BoolArray = (seen["camera"] == name).to_numpy(np.bool_)
        true_px, _ = camera.project(true_m[rows])
        believed_px, _ = camera.project(believed_m[rows])
        apart = np.linalg.norm(believed_px - true_px, axis=1)
        distances[rows] = np.minimum(apart, np.hypot(*camera.resolution_px))
    return distances
