"""The recorded walk: on the track that ships, and on real pedestrians of the UCY Zara01 recording.

Real data: A. Lerner, Y. Chrysanthou, D. Lischinski, Crowds by Example, Computer Graphics Forum 26, 2007.
"""

from pathlib import Path

import numpy as np
import pytest

import wsnsim

FRAMES_A_SECOND = 25.0
PEDESTRIANS = (9, 34, 77, 90)
"""Four of the longest walks, straight across the square and round a corner."""


def test_the_walk_that_ships_is_tracked(scenarios: Path) -> None:
    run = wsnsim.run(scenarios / "recorded_walk.yaml")
    assert run.met, run.expectations
    assert run.summary["lost_fraction"] == 0
    track = np.loadtxt(scenarios / "tracks" / "walk.csv", delimiter=",", comments="#", skiprows=2)
    truth = run.tables["truth"]
    at_rows = np.interp(truth["time_s"], track[:, 0], track[:, 1])
    np.testing.assert_allclose(truth["x_m"], at_rows, atol=1e-12)
    assert (truth["z_m"] == 0.9).all()


@pytest.mark.parametrize("pedestrian", PEDESTRIANS)
def test_real_pedestrians_are_tracked(scenarios: Path, shared: Path, pedestrian: int) -> None:
    file = shared / "data" / "ucy" / "zara01" / "obsmat.txt"
    rows = np.loadtxt(file)
    frames = rows[rows[:, 1] == pedestrian, 0]
    duration = min(14.0, float(frames[-1] - frames[0]) / FRAMES_A_SECOND)
    motion = "world.targets[walker].motion"
    run = wsnsim.run(
        scenarios / "recorded_walk.yaml",
        overrides=(
            f"{motion}.file={file}",
            f"{motion}.track_id={pedestrian}",
            f"{motion}.frame_rate_hz={FRAMES_A_SECOND}",
            f"{motion}.start_s=null",
            f"{motion}.offset_m=[8, -3, 0]",
            f"duration_s={duration}",
        ),
    )
    # half of the estimates lie inside the walker's own body, of radius 0.28 m
    assert run.summary["position_error_median_m"] < 0.28
    assert run.summary["lost_fraction"] == 0
    assert run.summary["delivery_ratio"] > 0.95
