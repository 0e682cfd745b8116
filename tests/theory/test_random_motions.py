"""Random waypoint and Gauss–Markov motion against their theory; bounds are five standard errors."""

import numpy as np
import pytest
from scipy.stats import kstest

from wsnsim.world import random_motion
from wsnsim.world.random_motion import Area, gauss_markov, random_waypoint

SQUARE = Area(np.zeros(3), np.array([1.0, 1.0, 0.0]))
LINE = Area(np.zeros(3), np.array([1.0, 0.0, 0.0]))


def batched(values, batches=40):
    """Return mean and standard error of a correlated series, from the means of long batches."""
    means = np.array([batch.mean() for batch in np.array_split(values, batches)])
    return means.mean(), means.std(ddof=1) / np.sqrt(batches)


def test_length_of_a_leg_in_the_unit_square(test_seed):
    generator = np.random.default_rng(test_seed)
    path = random_waypoint(generator, SQUARE, np.full(3, 0.5) * [1, 1, 0], (1.0, 1.0), 0.0, 10_000.0)
    # every second leg: those that share no point are independent
    legs = np.linalg.norm(np.diff(path.points[1::2], axis=0), axis=1)[::2]
    # Bettstetter, Hartenstein, Pérez-Costa (2004): 0.521405 and the second moment 1/3
    error = np.sqrt((1 / 3 - 0.521405**2) / len(legs))
    assert legs.mean() == pytest.approx(0.521405, abs=5 * error)


def test_mean_speed_over_time(test_seed):
    generator = np.random.default_rng(test_seed)
    path = random_waypoint(generator, SQUARE, np.zeros(3), (0.2, 2.0), 0.0, 20_000.0)
    # arrivals and departures alternate; of the legs every second one: those that share no point
    legs = np.linalg.norm(np.diff(path.points, axis=0), axis=1)[::4]
    spans = np.diff(path.times)[::4]
    # Yoon, Liu, Noble (2003): E[D] / E[D / V]; a ratio's standard error by the delta method
    expected = (2.0 - 0.2) / np.log(2.0 / 0.2)
    ratio = legs.sum() / spans.sum()
    error = np.std(legs - ratio * spans) / (spans.mean() * np.sqrt(len(legs)))
    assert ratio == pytest.approx(expected, abs=5 * error)


def test_distribution_of_places_on_a_line(test_seed):
    # Bettstetter, Hartenstein, Pérez-Costa (2004): f(x) = 6 x (1 − x), in the long run
    places = []
    for number in range(2000):
        generator = np.random.default_rng([test_seed, number])
        start = generator.uniform(LINE.low, LINE.high)
        places.append(random_waypoint(generator, LINE, start, (1.0, 1.0), 0.0, 6.0).at(6.0).position[0])
    assert kstest(places, lambda x: x**2 * (3 - 2 * x)).pvalue > 1e-4
    assert kstest(places, "uniform").pvalue < 1e-12


def test_pauses_take_their_share(test_seed):
    generator = np.random.default_rng(test_seed)
    path = random_waypoint(generator, SQUARE, np.zeros(3), (1.0, 1.0), 0.4, 5000.0)
    spans = np.diff(path.times)
    np.testing.assert_allclose(spans[1::2], 0.4, atol=1e-9)
    moving = np.linalg.norm(path.at(float(path.times[2]) + 0.01).velocity)
    assert moving == pytest.approx(1.0, rel=1e-9)
    np.testing.assert_array_equal(path.at(float(path.times[1]) + 0.2).velocity, np.zeros(3))


@pytest.mark.parametrize("memory", [0.0, 0.6, 0.95])
def test_gauss_markov_velocities(test_seed, memory):
    generator = np.random.default_rng(test_seed)
    wide, mean, sd = (
        Area(np.full(3, -1e9), np.full(3, 1e9)),
        np.array([1.0, -0.5, 0.0]),
        np.array([0.3, 0.2, 0.1]),
    )
    interval, n = 0.5, 40_000
    path = gauss_markov(generator, wide, np.zeros(3), mean, sd, memory, interval, n * interval)
    velocities = np.diff(path.free_points, axis=0) / interval
    for axis in range(3):
        v = velocities[:, axis] - mean[axis]
        for values, expected in ((v, 0.0), (v**2, sd[axis] ** 2), (v[1:] * v[:-1], memory * sd[axis] ** 2)):
            found, error = batched(values)
            assert found == pytest.approx(expected, abs=5 * error)
        found, error = batched(v[7:] * v[:-7])
        assert found == pytest.approx(memory**7 * sd[axis] ** 2, abs=5 * error)


def test_gauss_markov_starts_like_it_goes_on(test_seed):
    first = []
    for number in range(2000):
        generator = np.random.default_rng([test_seed, number])
        wide = Area(np.full(3, -1e9), np.full(3, 1e9))
        motion = gauss_markov(generator, wide, np.zeros(3), np.zeros(3), np.full(3, 0.3), 0.9, 1.0, 1.0)
        first.append(motion.at(0.5).velocity)
    # standard error of a standard deviation: sd / √(2 n)
    assert np.std(first) == pytest.approx(0.3, abs=5 * 0.3 / np.sqrt(2 * 6000))


def test_full_memory_is_a_straight_line_thrown_back_by_mirrors():
    area = Area(np.array([0.0, 10.0, 1.0]), np.array([4.0, 12.0, 1.0]))
    generator = np.random.default_rng(3)
    mean = np.array([1.5, -0.25, 0.7])
    motion = gauss_markov(generator, area, np.array([1.0, 11.0, 1.0]), mean, np.zeros(3), 1.0, 1.0, 20.0)
    for time, x, vx in ((0.0, 1.0, 1.5), (2.0, 4.0, 1.5), (3.0, 2.5, -1.5), (6.0, 2.0, 1.5)):
        assert motion.at(time).position[0] == pytest.approx(x)
        assert motion.at(time + 1e-6).velocity[0] == pytest.approx(vx if time != 2.0 else -1.5)
    assert motion.at(8.0).position[1] == pytest.approx(11.0)  # down to 10 at 4 s, and up again
    assert motion.at(8.0).velocity[1] == pytest.approx(0.25)
    assert motion.at(8.0).position[2] == 1.0
    assert motion.at(8.0).velocity[2] == 0.0


def test_what_is_of_no_use_is_refused(monkeypatch):
    monkeypatch.setattr(random_motion, "_MOST_PARTS", 2000)
    generator = np.random.default_rng(0)
    point = Area(np.ones(3), np.ones(3))
    with pytest.raises(ValueError, match="must have an extent"):
        random_waypoint(generator, point, np.ones(3), (1.0, 1.0), 0.0, 1.0)
    tiny = Area(np.zeros(3), np.full(3, 1e-9))
    with pytest.raises(ValueError, match="must give less than 2000 legs"):
        random_waypoint(generator, tiny, np.zeros(3), (1.0, 1.0), 0.0, 1.0)
    with pytest.raises(ValueError, match="must give at most 2000 intervals"):
        gauss_markov(generator, SQUARE, np.zeros(3), np.zeros(3), np.zeros(3), 0.5, 1e-3, 1e6)
    with pytest.raises(ValueError, match="low: must be at most high"):
        Area(np.array([0.0, 2.0, 0.0]), np.ones(3))
    with pytest.raises(ValueError, match="none of 1024 was outside"):
        SQUARE.draw_clear(generator, lambda places: np.zeros(len(places), bool))


def test_starts_are_uniform_over_what_is_clear(test_seed):
    generator = np.random.default_rng(test_seed)
    starts = np.array([SQUARE.draw_clear(generator, lambda places: places[:, 0] > 0.25) for _ in range(4000)])
    assert kstest(starts[:, 0], "uniform", args=(0.25, 0.75)).pvalue > 1e-4
    assert kstest(starts[:, 1], "uniform").pvalue > 1e-4
