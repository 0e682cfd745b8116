"""Tracker T0 in the atrium (FGH) of Kushwaha & Koutsoukos 2013, Sec. 6.2.2.

The world is pinned first: what the trackers are judged in must not drift.
"""

from pathlib import Path

import numpy as np
import pytest

from wsnsim.runs.result import Run
from wsnsim.runs.run import run
from wsnsim.scenario.load import load_scenario
from wsnsim.sim.build import build
from wsnsim.sim.engine import Simulation
from wsnsim.types import FloatArray

STEPS = 160
RATE_HZ = 4.0
IMAGE_PX = 320 * 240
USABLE_PX = 130.0


@pytest.fixture(scope="module")
def atrium(scenarios: Path) -> Path:
    return scenarios / "published" / "multiview_fgh.yaml"


@pytest.fixture(scope="module")
def result(atrium: Path) -> Run:
    return run(atrium)


@pytest.fixture(scope="module")
def shown_px(result: Run) -> FloatArray:
    """Pixels of the walker (steps, cameras) as the images show them."""
    views = result.tables["views"].pivot(index="time_s", columns="camera", values="visible_px")
    return views.fillna(0.0).sort_index().to_numpy()[1:]


@pytest.fixture(scope="module")
def without_people_px(atrium: Path) -> FloatArray:
    return walker_px(build(load_scenario(atrium, ("world.people=[]",))))


@pytest.fixture(scope="module")
def alone_px(atrium: Path) -> FloatArray:
    return walker_px(build(load_scenario(atrium, ("world.people=[]", "world.occluders=[]"))))


def walker_px(simulation: Simulation) -> FloatArray:
    """Return the pixels of the walker (steps, cameras) in a world, by the names of the cameras."""
    world = simulation.world
    motes = sorted(simulation.cameras, key=lambda mote: mote.node.id)
    return np.array(
        [
            [mote.renderer.visible_pixels(world.moving_bodies, poses)[0] for mote in motes]
            for poses in (world.moving_at(step / RATE_HZ) for step in range(1, STEPS + 1))
        ]
    )


def test_the_world_is_that_of_the_atrium(result: Run) -> None:
    """160 steps on 45 to 49 m; below 1 % of the pixels at every step."""
    steps = result.steps
    assert len(steps) == STEPS
    assert steps["pixel_share"].between(0.001, 0.0075).all()
    assert 0.0039 < steps["pixel_share"].mean() < 0.0047
    path = steps[["truth_x_m", "truth_y_m", "truth_z_m"]].to_numpy()
    assert 45.0 < np.linalg.norm(np.diff(path, axis=0), axis=1).sum() < 49.0


def test_three_cameras_take_part_at_first_and_five_at_last(result: Run) -> None:
    """As the tracker chooses them: who has the walker in view, and large enough."""
    asked = result.steps["asked"]
    assert asked.iloc[0] == 3
    assert asked.iloc[-1] == 5
    assert asked.between(2, 6).all()
    assert asked.nunique() >= 4


def test_cameras_in_which_the_walker_is_too_small_take_no_part(result: Run, alone_px: FloatArray) -> None:
    """Two of a hundred views are clearly below the threshold; fewer cameras are asked than see it."""
    seen = alone_px >= 1.0
    small = seen & (alone_px < 0.9 * USABLE_PX)
    assert 0.02 < small.sum() / seen.sum() < 0.05
    assert (result.steps["asked"].to_numpy() < seen.sum(axis=1)).sum() > 15


def test_the_walker_changes_its_scale_and_comes_and_goes(alone_px: FloatArray) -> None:
    """In every camera its area grows more than fourfold; three lose it, five catch it on its way."""
    for column in alone_px.T:
        usable = column[column >= USABLE_PX]
        assert usable.max() > 4.0 * usable.min()
    assert 0.012 < alone_px.max() / IMAGE_PX < 0.015
    seen = alone_px >= 1.0
    leaves = (seen[:-1] & ~seen[1:]).any(axis=0)
    enters = (~seen[:-1] & seen[1:]).any(axis=0)
    assert leaves.sum() >= 3
    assert enters.sum() >= 5


def test_people_and_columns_really_hide_the_walker(
    shown_px: FloatArray, without_people_px: FloatArray, alone_px: FloatArray
) -> None:
    """Of the views of usable size one in nine is hidden by more than half; one in 40 by people alone."""
    usable = alone_px >= USABLE_PX
    hidden = usable & (shown_px < 0.5 * alone_px)
    assert 0.08 < hidden.sum() / usable.sum() < 0.16
    by_people = (without_people_px >= USABLE_PX) & (shown_px < 0.5 * without_people_px)
    assert 0.015 < by_people.sum() / usable.sum() < 0.05
    assert (usable & (shown_px < 0.05 * alone_px)).sum() > 20


def test_nobody_walks_through_the_walker(atrium: Path) -> None:
    """They stay 0.7 m away and more, centre to centre, of which half a metre is their own widths."""
    world = build(load_scenario(atrium)).world
    for step in range(STEPS + 1):
        walker, *people = (pose.position[:2] for pose in world.moving_at(step / RATE_HZ))
        assert min(np.linalg.norm(person - walker) for person in people) > 0.7


def test_t0_follows_the_walker(result: Run) -> None:
    """Over 15 seeds the error is 0.069 m (sd 0.011); the bound is the mean plus five standard deviations."""
    assert result.met
    assert result.summary["lost_fraction"] == 0
    assert (result.steps["kind"] == "update").all()
    assert result.summary["position_error_mean_m"] < 0.069 + 5 * 0.011
    assert result.steps["error_m"].max() < 1.0
