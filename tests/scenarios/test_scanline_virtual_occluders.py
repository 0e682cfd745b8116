"""Virtual occluders on a recorded path (Ercan et al. 2007, Sec. 6): they delete measurements."""

import numpy as np
import pytest

from wsnsim.runs.run import run

SHORT = ("duration_s=8", "cameras={only: [c1, c5, c9, c13]}")
NOBODY = ("system.virtual_occluders.count=0", "system.virtual_occluders.blocks_m=[]")


@pytest.fixture(scope="module")
def lab(scenarios):
    return scenarios / "published" / "scanline_lab.yaml"


def seen(finished):
    """Return how often each camera saw the object."""
    return finished.tables["views"].groupby("camera").size()


def test_they_hide_the_object_from_some_cameras_at_some_times(lab):
    free, crowded = (run(lab, overrides=(*SHORT, *more)) for more in (NOBODY, ()))
    assert (seen(crowded) < seen(free)).all()
    assert seen(crowded).sum() > 0.2 * seen(free).sum()
    # the path is the recorded one in both
    truth = ["truth_x_m", "truth_y_m"]
    np.testing.assert_array_equal(free.steps[truth], crowded.steps[truth])
    assert free.steps["error_m"].iloc[10:].mean() < crowded.steps["error_m"].iloc[10:].mean()


def test_knowing_them_helps(lab):
    errors = {
        kind: [
            run(lab, seed=seed, overrides=(*SHORT, f"system.priors.kind={kind}")).summary["position_rmse_m"]
            for seed in range(4)
        ]
        for kind in ("none", "perfect")
    }
    assert np.mean(errors["perfect"]) < np.mean(errors["none"])


def test_what_real_pixels_show_is_thrown_away_too(lab):
    pixels = (
        *SHORT[1:],
        "duration_s=3",
        "cameras[*].resolution_px=[200, 150]",
        "cameras[*].focal_px=230",
        "system.front_end={kind: pixels}",
    )
    free, crowded = (run(lab, overrides=(*pixels, *more)) for more in (NOBODY, ()))
    # nobody else is in the images: pixels of the object are there either way
    np.testing.assert_array_equal(free.tables["views"]["visible_px"], crowded.tables["views"]["visible_px"])
    errors = [float(each.steps["error_m"].iloc[5:].mean()) for each in (free, crowded)]
    assert errors[0] < errors[1]
