"""The crowd: nobody meets a wall or another, and everybody gets about."""

import numpy as np
import pytest

from wsnsim.world.crowd import Crowd
from wsnsim.world.motion import TimedPath

BLOCK = np.array([[30.0, 40.0], [70.0, 40.0], [70.0, 60.0], [30.0, 60.0]])
DIAMETER = 3.33


def crowd(count=41, walls=(BLOCK,), **changes):
    values = {"speed_mps": 1.0, "noise_sd_m": 0.33, "step_s": 1.0} | changes
    return Crowd(count, DIAMETER, np.zeros(2), np.full(2, 100.0), walls=walls, **values)


def from_block(places):
    """Return the distances of places (..., 2) from the block: 0 in it."""
    beyond = np.maximum(np.maximum(BLOCK[0] - places, places - BLOCK[2]), 0.0)
    return np.hypot(beyond[..., 0], beyond[..., 1])


def test_nobody_meets_anything(test_seed):
    paths = crowd().paths(np.random.default_rng(test_seed), 1000)
    assert paths.shape == (1001, 41, 2)
    assert paths.min() >= DIAMETER / 2
    assert paths.max() <= 100.0 - DIAMETER / 2
    assert from_block(paths).min() >= DIAMETER / 2
    apart = np.linalg.norm(paths[:, :, None] - paths[:, None], axis=3) + 1e9 * np.eye(41)
    assert apart.min() >= DIAMETER


def test_they_walk_at_their_speed_all_over_the_room(test_seed):
    paths = crowd(walls=()).paths(np.random.default_rng(test_seed + 1), 2000)
    steps = np.diff(paths, axis=0)
    lengths = np.linalg.norm(steps, axis=2)
    # speed 1 with noise .33 on each axis: about 1 + .33²/2; somebody who stands now and then takes from it
    assert lengths.mean() == pytest.approx(1.0 + 0.33**2 / 2, rel=0.03)
    assert (lengths == 0.0).mean() < 0.03
    # random waypoints dwell in the middle: rms distance on one axis of the paper's room 21.3
    spread = (paths - 50.0).std(axis=(0, 1))
    assert (np.abs(spread - 21.3) < 2.0).all()
    assert (paths.min(axis=(0, 1)) < 5.0).all()
    assert (paths.max(axis=(0, 1)) > 95.0).all()


def test_two_who_meet_go_round_each_other():
    """Without noise, in a corridor as wide as three: both arrive, and both have left the straight line."""
    hall = Crowd(2, 1.0, np.zeros(2), np.array([40.0, 3.5]), 1.0, 0.0, 1.0)
    paths = hall.paths(np.random.default_rng(2), 600)
    order = np.sign(paths[:, 0, 0] - paths[:, 1, 0])
    assert (np.diff(order) != 0).sum() > 5
    assert np.linalg.norm(paths[:, 0] - paths[:, 1], axis=1).min() >= 1.0


def test_a_longer_walk_goes_on_where_a_shorter_one_ends(test_seed):
    short, long = (crowd().paths(np.random.default_rng(test_seed), steps) for steps in (50, 300))
    np.testing.assert_array_equal(short, long[:51])


def test_motions(test_seed):
    motions = crowd(3, step_s=0.5).motions(np.random.default_rng(test_seed), 10.2, 0.9)
    paths = crowd(3, step_s=0.5).paths(np.random.default_rng(test_seed), 21)
    assert len(motions) == 3
    for body, motion in enumerate(motions):
        assert isinstance(motion, TimedPath)
        np.testing.assert_allclose(motion.at(2.0).position, [*paths[4, body], 0.9], atol=1e-12)
        assert np.isfinite(motion.at(10.2).position).all()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"count": 0}, "count: must be at least 1"),
        ({"speed_mps": 0.0}, "speed_mps, step_s: must be above 0"),
        ({"noise_sd_m": -1.0}, "must be at least 0"),
        ({"walls": (BLOCK[[0, 2, 1, 3]],)}, r"walls\[0\]: must be convex"),
    ],
)
def test_what_makes_no_sense_is_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        crowd(**changes)


def test_rooms_without_room():
    with pytest.raises(ValueError, match="must leave room for a body"):
        Crowd(1, 4.0, np.zeros(2), np.array([3.0, 9.0]), 1.0, 0.0, 1.0)
    with pytest.raises(ValueError, match="found no place for body"):
        Crowd(30, 4.0, np.zeros(2), np.array([12.0, 12.0]), 1.0, 0.0, 1.0).placed(np.random.default_rng(0))
    full = Crowd(
        1,
        1.0,
        np.zeros(2),
        np.full(2, 10.0),
        1.0,
        0.0,
        1.0,
        (np.array([[-1, -1], [11, -1], [11, 11], [-1, 11.0]]),),
    )
    with pytest.raises(ValueError, match="found no place for body 0"):
        full.paths(np.random.default_rng(0), 5)


def test_a_jam_stands_still_and_stays_whole(test_seed):
    packed = Crowd(60, 4.0, np.zeros(2), np.full(2, 44.0), 1.0, 0.3, 1.0)
    paths = packed.paths(np.random.default_rng(test_seed), 200)
    apart = np.linalg.norm(paths[:, :, None] - paths[:, None], axis=3) + 1e9 * np.eye(60)
    assert apart.min() >= 4.0
