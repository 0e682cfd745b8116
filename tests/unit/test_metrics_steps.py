"""The steps table, computed by hand for a camera that looks along the x axis."""

import math

import numpy as np
import pandas as pd
import pytest

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.geometry.rotations import quaternion_to_matrix
from wsnsim.metrics.steps import passed_over, steps_table, turn_between

# f = 100 px, looking along +x from the origin: y metres to the left at depth x is 100 y / x pixels.
CAMERA = PinholeCamera.look_at((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 100.0, (200, 200))
BEHIND = PinholeCamera.look_at((20.0, 0.0, 0.0), (10.0, 0.0, 0.0), 100.0, (200, 200))


QUATERNION = ["qw", "qx", "qy", "qz"]


def turned(frame, quaternion):
    """Give all rows one orientation."""
    return frame.assign(**dict(zip(QUATERNION, quaternion, strict=True))).astype(
        dict.fromkeys(QUATERNION, "float64")
    )


def truth(rows, quaternion=(1, 0, 0, 0)):
    return turned(pd.DataFrame(rows, columns=["time_s", "target", "x_m", "y_m", "z_m"]), quaternion)


def estimates(rows, quaternion=(1, 0, 0, 0)):
    columns = ["time_s", "made_at_s", "track", "x_m", "y_m", "z_m", "asked", "heard", "kind"]
    return turned(pd.DataFrame(rows, columns=columns), quaternion)


def views(rows):
    return pd.DataFrame(rows, columns=["time_s", "camera", "target", "pixel_share"])


TRUTH = truth(
    [(0.0, "box", 9, 0, 0), (1 / 3, "box", 10, 0, 0), (2 / 3, "box", 10, 1, 0), (1.0, "box", 10, 2, 0)]
)


def table(estimate_rows, view_rows=(), cameras=None):
    views_frame = views(list(view_rows))
    return steps_table(TRUTH, estimates(estimate_rows), views_frame, cameras or {"a": CAMERA, "b": BEHIND})


def test_frames_that_a_busy_tracker_left_out_are_told_from_those_of_which_nothing_came():
    """Of the first nothing was believed; of the second a mote tells, as it was no longer the only tracker."""
    frame = table(
        [(2 / 3, 0.8, "box", 10, 1, 0, 2, 1, "update"), (1.0, 1.2, "box", 10, 1, 0, 2, 0, "timed_out")]
    )
    columns = ["time_s", "node", "kind", "detail", "step"]
    left_out = [(1.5, "m", "frame_left_out", "busy", step) for step in (1, 2)]
    other = (1.5, "m", "frame_skipped", "busy", 3)
    said = passed_over(frame, pd.DataFrame([*left_out, other], columns=columns))
    assert said["kind"].tolist() == ["skipped", "update", "timed_out"]
    assert said.drop(columns="kind").equals(frame.drop(columns="kind"))
    assert passed_over(frame, pd.DataFrame([], columns=columns)).equals(frame)


def test_without_an_orientation_there_is_no_error_of_it():
    rows = [(1 / 3, 0.5, "box", 10, 0, 0, 2, 1, "update")]
    frame = steps_table(TRUTH, estimates(rows, (math.nan,) * 4), views([]), {})
    assert frame["error_m"].iloc[0] == 0.0
    assert frame["orientation_error_deg"].isna().all()


def test_one_row_for_each_step_after_the_first_instant_whatever_was_estimated():
    frame = table([])
    assert frame["step"].tolist() == [1, 2, 3]
    assert frame["time_s"].tolist() == [1 / 3, 2 / 3, 1.0]
    assert frame["error_m"].isna().all()
    assert frame["track"].isna().all()
    assert frame["heard"].isna().all()
    assert frame["participating"].tolist() == [0, 0, 0]


def test_error_latency_and_counts():
    frame = table([(0.333333333, 0.5, "box", 10, 0.3, 0.4, 4, 2, "update")])
    first = frame.iloc[0]
    assert first["error_m"] == pytest.approx(0.5)
    assert first["latency_s"] == pytest.approx(1 / 6)
    assert (first["asked"], first["heard"], first["kind"]) == (4, 2, "update")
    assert frame["error_m"].isna().tolist() == [False, True, True]


def test_reprojection_is_the_mean_over_the_cameras_that_see_the_target():
    seen = [(1 / 3, "a", "box", 0.02), (1 / 3, "b", "box", 0.04), (2 / 3, "b", "box", 0.01)]
    frame = table(
        [(1 / 3, 0.4, "box", 10, 1, 0, 2, 2, "update"), (2 / 3, 0.7, "box", 5, 1, 0, 2, 2, "update")], seen
    )
    assert frame["reprojection_px"][0] == pytest.approx((100 / 10 + 100 / 10) / 2)
    assert frame["reprojection_px"][1] == pytest.approx(100 / 10 - 100 / 15)
    assert math.isnan(frame["reprojection_px"][2])
    assert frame["participating"].tolist() == [2, 1, 0]
    assert frame["pixel_share"][0] == pytest.approx(0.03)


def test_a_camera_with_the_estimate_behind_it_does_not_count():
    seen = [(1 / 3, "a", "box", 0.02), (1 / 3, "b", "box", 0.02)]
    frame = table([(1 / 3, 0.4, "box", -5, 0, 0, 2, 2, "update")], seen)
    assert frame["reprojection_px"][0] == 0.0
    frame = table([(1 / 3, 0.4, "box", 30, 1, 0, 2, 2, "update")], seen[1:])
    assert math.isnan(frame["reprojection_px"][0])


def test_a_revision_replaces_what_was_said_before_even_if_it_stands_first():
    late = (1 / 3, 0.9, "box", 10, 0.0, 0, 2, 2, "update")
    early = (1 / 3, 0.4, "box", 10, 3.0, 0, 2, 0, "timed_out")
    for rows in ([late, early], [early, late]):
        frame = table(rows)
        assert len(frame) == 3
        assert frame["error_m"][0] == 0.0


def test_estimates_of_other_instants_and_other_tracks_are_left_out():
    frame = table(
        [
            (0.4, 0.5, "box", 10, 0, 0, 1, 1, "update"),
            (1 / 3, 0.5, "ghost", 10, 0, 0, 1, 1, "update"),
            (0.0, 0.1, "box", 9, 0, 0, 1, 1, "update"),
        ]
    )
    assert frame["error_m"].isna().all()
    assert len(frame) == 3


def quaternion_about_z(angle_rad):
    return (math.cos(angle_rad / 2), 0.0, 0.0, math.sin(angle_rad / 2))


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("angle_deg", [0.0, 1e-6, 30.0, 179.0, 180.0])
def test_the_orientation_error_is_the_angle_of_the_turn_between_the_two(angle_deg, sign):
    believed = estimates(
        [(1 / 3, 0.4, "box", 10, 0, 0, 1, 1, "update")],
        np.multiply(sign, quaternion_about_z(math.radians(40.0 + angle_deg))),
    )
    true = truth(TRUTH[["time_s", "target", "x_m", "y_m", "z_m"]], quaternion_about_z(math.radians(40.0)))
    frame = steps_table(true, believed, views([]), {})
    assert frame["orientation_error_deg"][0] == pytest.approx(angle_deg, rel=1e-9, abs=1e-13)
    assert frame["orientation_error_deg"].isna().tolist() == [False, True, True]


def test_the_turn_between_orientations_is_that_of_the_rotation_matrix(test_seed):
    """Trace of the relative rotation matrix: 1 + 2 cos θ (Rodrigues)."""
    generator = np.random.default_rng(test_seed)
    one, other = generator.standard_normal((2, 200, 4))
    one /= np.linalg.norm(one, axis=1, keepdims=True)
    other /= np.linalg.norm(other, axis=1, keepdims=True)
    for q, p, angle in zip(one, other, turn_between(one, other), strict=True):
        relative = quaternion_to_matrix(q).T @ quaternion_to_matrix(p)
        assert math.cos(angle) == pytest.approx((np.trace(relative) - 1) / 2, abs=1e-12)


def test_a_smoothers_second_look_has_an_error_of_its_own_and_replaces_nothing():
    now = (1 / 3, 0.4, "box", 10, 1.0, 0, 2, 2, "update")
    first = (1 / 3, 0.9, "box", 10, 0.5, 0, 2, 0, "smoothed")
    last = (1 / 3, 1.2, "box", 10, 0.25, 0, 2, 0, "smoothed")
    plain = table([now])
    assert plain["smoothed_error_m"].isna().all()
    for rows in ([now, first, last], [last, first, now]):
        frame = table(rows)
        assert frame["smoothed_error_m"][0] == 0.25
        assert frame["smoothed_error_m"].isna().tolist() == [False, True, True]
        pd.testing.assert_frame_equal(
            frame.drop(columns="smoothed_error_m"), plain.drop(columns="smoothed_error_m")
        )


def test_targets_keep_to_themselves():
    two = truth([(t, name, 10, offset, 0) for t in (0.0, 0.5) for name, offset in (("p", 0), ("q", 5))])
    rows = [(0.5, 0.6, "q", 10, 5, 0, 1, 1, "update"), (0.5, 0.6, "p", 10, 1, 0, 1, 1, "update")]
    frame = steps_table(two, estimates(rows), views([(0.5, "a", "q", 0.1)]), {"a": CAMERA})
    assert frame["target"].tolist() == ["p", "q"]
    assert frame["error_m"].tolist() == [1.0, 0.0]
    assert frame["participating"].tolist() == [0, 1]


def test_arguments_stay_as_they_were(synthetic_run):
    run = synthetic_run()
    before = {name: frame.copy() for name, frame in run.tables.items()}
    again = steps_table(run.tables["truth"], run.tables["estimates"], run.tables["views"], run.cameras)
    for name, frame in before.items():
        pd.testing.assert_frame_equal(run.tables[name], frame)
    pd.testing.assert_frame_equal(again, before["steps"])
    assert np.isfinite(again["reprojection_px"]).all()


def test_a_world_without_targets_gives_an_empty_table():
    frame = steps_table(truth([]), estimates([]), views([]), {})
    assert len(frame) == 0
    assert "error_m" in frame.columns
