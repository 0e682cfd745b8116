"""Filters of many occluders at the head, some of whose measurements are missing."""

import numpy as np

from wsnsim.estimation.kalman import Gaussian, predict, update
from wsnsim.systems.scanline.occluder_filter import OccluderBeliefs, stepped
from wsnsim.systems.scanline.priors import INPUT, TURN

SENSOR_SD, Q, SPEED = 1.5, 0.05, 1.0
OCCLUDERS, STEPS = 4, 40


def measured(seed):
    """Return walks (steps, k, 2) and noisy measurements of them, a third of which is missing."""
    generator = np.random.default_rng(seed)
    walks = np.cumsum(generator.normal(0.0, 0.5, (STEPS, OCCLUDERS, 2)), axis=0)
    places = walks + generator.normal(0.0, SENSOR_SD, walks.shape)
    places[generator.uniform(size=(STEPS, OCCLUDERS)) < 0.35] = np.nan
    return walks, places


def test_each_is_a_kalman_filter_of_its_own(test_seed):
    """A measurement that is missing is a prediction; the first one begins the filter."""
    _, places = measured(test_seed)
    beliefs, alone = OccluderBeliefs.unknown(OCCLUDERS), {}
    for at in places:
        beliefs = stepped(beliefs, at, SENSOR_SD, Q, SPEED)
        for k, place in enumerate(at):
            for axis in range(2):
                one = alone.get((k, axis))
                if one is None:
                    if not np.isnan(place[axis]):
                        first = np.diag([SENSOR_SD**2, 0.5 * SPEED**2])
                        alone[k, axis] = Gaussian(np.array([place[axis], 0.0]), first)
                    continue
                one = predict(one, TURN, Q * INPUT)
                if not np.isnan(place[axis]):
                    one = update(one, place[[axis]], np.array([[1.0, 0.0]]), np.array([[SENSOR_SD**2]]))
                alone[k, axis] = one
        assert beliefs.known.tolist() == [(k, 0) in alone for k in range(OCCLUDERS)]
        for (k, axis), one in alone.items():
            np.testing.assert_allclose(beliefs.means[k, :, axis], one.mean, rtol=1e-9, atol=1e-9)
            np.testing.assert_allclose(beliefs.covs[k], one.cov, rtol=1e-9)
    assert beliefs.known.all()


def test_who_was_never_reported_is_unknown_and_changes_nothing():
    beliefs = OccluderBeliefs.unknown(2)
    for _ in range(5):
        beliefs = stepped(beliefs, np.array([[1.0, 2.0], [np.nan, np.nan]]), SENSOR_SD, Q, SPEED)
    assert beliefs.known.tolist() == [True, False]
    np.testing.assert_allclose(beliefs.places[0], [1.0, 2.0])
    assert np.isfinite(beliefs.covs).all()


def test_without_reports_the_variance_grows_and_with_them_it_settles():
    beliefs = OccluderBeliefs.unknown(1)
    for _ in range(100):
        beliefs = stepped(beliefs, np.zeros((1, 2)), SENSOR_SD, Q, SPEED)
    settled = beliefs.variances[0]
    assert settled < SENSOR_SD**2
    variances = []
    for _ in range(20):
        beliefs = stepped(beliefs, np.full((1, 2), np.nan), SENSOR_SD, Q, SPEED)
        variances.append(beliefs.variances[0])
    assert (np.diff([settled, *variances]) > 0.0).all()
