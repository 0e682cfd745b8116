"""Tracker T0 in the conference room (LCR) of Kushwaha & Koutsoukos 2013, Sec. 6.2.1.

The world is pinned first: what the trackers are judged in must not drift.
"""

from itertools import product
from math import sqrt
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from wsnsim.geometry.rotations import quaternion_to_matrix
from wsnsim.runs.result import Run
from wsnsim.runs.run import run
from wsnsim.scenario.load import load_scenario
from wsnsim.sim.build import build

SEEDS = range(2)
STEPS = 96
RATE_HZ = 4.0


@pytest.fixture(scope="module")
def room(scenarios: Path) -> Path:
    return scenarios / "published" / "multiview_lcr.yaml"


@pytest.fixture(scope="module")
def runs(room: Path) -> list[Run]:
    return [run(room, seed=seed) for seed in SEEDS]


def test_the_world_is_that_of_the_conference_room(runs: list[Run]) -> None:
    """Four cameras that see the box at all of 96 steps, on 1.2 to 2.3 % of their pixels in the mean."""
    for result in runs:
        steps = result.steps
        assert len(steps) == STEPS
        assert (steps["participating"] == 4).all()
        assert steps["pixel_share"].between(0.012, 0.023).all()
        assert 0.016 < steps["pixel_share"].mean() < 0.018
        path = steps[["truth_x_m", "truth_y_m", "truth_z_m"]].to_numpy()
        assert 12.2 < np.linalg.norm(np.diff(path, axis=0), axis=1).sum() < 13.1
        assert np.ptp(path[:, 2]) > 0.5
    assert len({tuple(result.steps["truth_x_m"]) for result in runs}) == len(SEEDS)


def test_the_whole_box_is_in_every_image(room: Path) -> None:
    """All eight corners, at every step."""
    simulation = build(load_scenario(room))
    (box,) = simulation.world.targets
    corners = np.array(list(product((-1, 1), repeat=3))) * box.body.semi_axes_m
    for step in range(STEPS + 1):
        pose = box.motion.at(step / RATE_HZ)
        places = pose.position + corners @ quaternion_to_matrix(pose.orientation).T
        for mote in simulation.cameras:
            pixels, depths = mote.renderer.camera.project(places)
            assert (depths > 0).all()
            assert ((pixels > 0) & (pixels < (319, 239))).all()


def test_furniture_hides_a_part_of_the_box_and_never_all_of_it(room: Path, runs: list[Run]) -> None:
    """At worst half of it: more than a twentieth is hidden at a twentieth of the camera-steps or more."""
    bare = build(load_scenario(room, ("world.occluders=[]",)))
    views = runs[0].tables["views"].set_index(["camera", "time_s"])["visible_px"]
    shown = []
    for step in range(1, STEPS + 1):
        poses = bare.world.at(step / RATE_HZ)
        for mote in bare.cameras:
            (area,) = mote.renderer.visible_pixels(bare.world.moving_bodies, poses)
            shown.append(views[mote.node.id, step / RATE_HZ] / area)
    assert 0.3 < min(shown) < 0.7
    assert np.mean(np.array(shown) < 0.95) > 0.05


def test_t0_follows_the_box(runs: list[Run]) -> None:
    """Over 15 seeds the error is 0.083 m (sd 0.007); the bound: the mean plus five standard errors of two."""
    steps = pd.concat(result.steps for result in runs)
    assert (steps["kind"] == "update").all()
    assert (steps["asked"] == 4).all()
    assert (steps["heard"] == 4).all()
    errors = np.array([result.summary["position_error_mean_m"] for result in runs])
    assert errors.mean() < 0.083 + 5 * 0.007 / sqrt(len(SEEDS))
    assert all(result.summary["lost_fraction"] == 0 for result in runs)
    assert steps["error_m"].max() < 0.5


def test_the_scenario_meets_its_own_expectations(runs: list[Run]) -> None:
    for result in runs:
        assert result.expectations
        assert all(expectation.met for expectation in result.expectations)
