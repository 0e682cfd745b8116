"""What holds for every motion: velocity is the derivative of place, and a pose depends on the time only."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from wsnsim.geometry.rotations import normalise
from wsnsim.world.motion import ConstantVelocity, Spinning, TimedPath, Waypoints
from wsnsim.world.random_motion import Area, gauss_markov, random_waypoint

UNTIL = 40.0
AREA = Area(np.array([-2.0, 1.0, 0.9]), np.array([3.0, 4.0, 2.1]))
FLAT = Area(np.array([-2.0, 1.0, 0.9]), np.array([3.0, 4.0, 0.9]))


def waypoint(seed, area=AREA, until=UNTIL, pause=0.5):
    generator = np.random.default_rng(seed)
    return random_waypoint(generator, area, generator.uniform(area.low, area.high), (0.3, 2.0), pause, until)


def drifting(seed, area=AREA, until=UNTIL, memory=0.7):
    generator = np.random.default_rng(seed)
    start, mean, sd = generator.uniform(area.low, area.high), np.array([0.8, -0.6, 0.1]), np.full(3, 0.5)
    return gauss_markov(generator, area, start, mean, sd, memory, 0.7, until)


def on_points(seed):
    return Waypoints(np.random.default_rng(seed).uniform(-3.0, 3.0, (6, 3)), 0.7)


def straight(seed):
    return ConstantVelocity(*np.random.default_rng(seed).uniform(-3.0, 3.0, (2, 3)))


def recorded(seed):
    generator = np.random.default_rng(seed)
    times, points = np.sort(generator.uniform(0.0, UNTIL, 9)), generator.uniform(-3.0, 3.0, (9, 3))
    turns = np.array([normalise(turn) for turn in generator.normal(size=(9, 4))])
    return TimedPath(times, points, turns)


def spinning(seed):
    return Spinning(recorded(seed), np.array([1.0, -2.0, 0.5]), 1.3)


MOTIONS = (waypoint, drifting, on_points, straight, recorded, spinning)
seeds = st.integers(0, 2**32 - 1)


@pytest.mark.parametrize("make", MOTIONS)
@settings(max_examples=40, deadline=None)
@given(seeds, st.floats(-1.0, UNTIL - 1.0))
def test_velocity_is_the_derivative_of_place(make, seed, time):
    motion, step = make(seed), 1e-4
    before, here, after = (motion.at(time + shift) for shift in (-step, 0.0, step))
    # not at an instant at which the velocity jumps
    assume(np.array_equal(before.velocity, here.velocity) and np.array_equal(here.velocity, after.velocity))
    slope = (after.position - before.position) / (2 * step)
    np.testing.assert_allclose(here.velocity, slope, atol=1e-9)
    assert np.linalg.norm(here.orientation) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("make", MOTIONS)
@settings(max_examples=20, deadline=None)
@given(seeds, st.lists(st.floats(-1.0, UNTIL), min_size=2, max_size=12))
def test_poses_do_not_depend_on_what_was_asked_before(make, seed, times):
    used = make(seed)
    for time in times:
        used.at(time)
    for time in times:
        for part in ("position", "velocity", "orientation"):
            found, expected = getattr(used.at(time), part), getattr(make(seed).at(time), part)
            np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("make", MOTIONS)
@settings(max_examples=40, deadline=None)
@given(seeds, st.floats(-1.0, UNTIL))
def test_nobody_jumps(make, seed, time):
    motion, step = make(seed), 1e-6
    first, second = motion.at(time), motion.at(time + step)
    fastest = max(np.linalg.norm(first.velocity), np.linalg.norm(second.velocity))
    assert np.linalg.norm(second.position - first.position) <= (1 + 1e-6) * fastest * step + 1e-12


@pytest.mark.parametrize("make", [waypoint, drifting])
@pytest.mark.parametrize("area", [AREA, FLAT])
@settings(max_examples=20, deadline=None)
@given(seeds)
def test_drawn_motions_stay_in_their_area(make, area, seed):
    motion = make(seed, area)
    places = np.array([motion.at(time).position for time in np.arange(-1.0, UNTIL + 5.0, 0.1)])
    assert (places >= area.low).all()
    assert (places <= area.high).all()
    assert np.ptp(places[:, 0]) > 0.0


@pytest.mark.parametrize("make", [waypoint, drifting])
@settings(max_examples=20, deadline=None)
@given(seeds, st.floats(0.1, UNTIL))
def test_a_longer_run_goes_on_where_a_shorter_one_ends(make, seed, until):
    short, long = make(seed, until=until), make(seed, until=10 * UNTIL)
    for time in np.linspace(0.0, until, 7):
        np.testing.assert_array_equal(short.at(time).position, long.at(time).position)
