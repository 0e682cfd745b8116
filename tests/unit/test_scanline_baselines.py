"""The trackers of Sec. 4: good while everybody sees, lost where the paper says that they are."""

import numpy as np
import pytest

from wsnsim.estimation.kalman import Gaussian
from wsnsim.systems.scanline.baselines import Baseline
from wsnsim.systems.scanline.measurement import MeasurementNoise, ScanCamera, measure, report
from wsnsim.systems.scanline.regions import Rig, Room

CAMERAS = tuple(
    ScanCamera((50.0 + 50.0 * x, 50.0 + 50.0 * y), float(np.arctan2(-y, -x)), 320.0, np.pi / 2)
    for x, y in ((0, -1), (1, 0), (0, 1), (-1, 0))
)
BLOCK = np.array([[30.0, 40.0], [70.0, 40.0], [70.0, 60.0], [30.0, 60.0]])
KINDS = ("extended", "unscented", "map_kalman")


def stage(*walls):
    return Rig(CAMERAS, MeasurementNoise(), Room(np.zeros(2), np.full(2, 100.0), walls))


def walk(rig, path, generator, unseen=()):
    """Yield places and reports along a path; in the steps `unseen` no camera sees the object."""
    for k, place in enumerate(path):
        allowed = rig.masks(place[None])[0]
        z = np.array([measure(camera, place, rig.noise, generator) for camera in rig.cameras])
        z[[not allowed >> c & 1 or k in unseen for c in range(len(z))]] = np.nan
        yield place, report(z)


def errors(kind, rig, path, generator, unseen=()):
    baseline = Baseline(rig, 0.3)
    belief, found = Gaussian(np.concatenate([path[0], np.zeros(2)]), np.diag([4.0, 4.0, 1.0, 1.0])), []
    for place, heard in walk(rig, path, generator, unseen):
        belief = getattr(baseline, kind)(belief, heard)
        assert np.linalg.eigvalsh(belief.cov).min() > 0.0
        found.append(np.linalg.norm(belief.mean[:2] - place))
    return np.array(found)


def circle(steps=120):
    angles = np.linspace(0.0, 2 * np.pi, steps)
    return 50.0 + 25.0 * np.stack([np.cos(angles), np.sin(angles)], axis=1)


@pytest.mark.parametrize("kind", KINDS)
def test_all_follow_an_object_that_is_seen(kind, test_seed):
    found = errors(kind, stage(), circle(), np.random.default_rng(test_seed))
    # four bearings with 7 px at 320: a good metre on a straight line, and the path turns
    assert np.sqrt(np.mean(found[20:] ** 2)) < 2.0


def test_all_begin_with_the_room():
    belief = Baseline(stage()).start()
    np.testing.assert_array_equal(belief.mean, [50.0, 50.0, 0.0, 0.0])
    np.testing.assert_allclose(np.diag(belief.cov), [1e4 / 12, 1e4 / 12, 1.0, 1.0])


@pytest.mark.parametrize("kind", KINDS)
def test_an_object_that_nobody_sees_is_predicted_straight_on(kind, test_seed):
    found = errors(kind, stage(), circle(), np.random.default_rng(test_seed), unseen=range(60, 90))
    assert np.isfinite(found).all()
    assert found[60:90].max() > 10.0


def test_a_wall_discards_sigma_points_and_with_them_the_measurement():
    rig = stage(BLOCK)
    belief = Gaussian(np.array([50.0, 62.0, 0.0, 0.0]), np.diag([1.0, 1.0, 0.1, 0.1]))
    # camera 0 is below the block: none of the points can be seen from there
    values = np.array([5.0, np.nan, np.nan, np.nan])
    baseline = Baseline(rig, 0.3)
    after, predicted = baseline.unscented(belief, report(values)), baseline.predicted(belief)
    np.testing.assert_array_equal(after.mean, predicted.mean)
    assert (baseline.extended(belief, report(values)).mean != predicted.mean).any()


def test_the_map_estimate_stays_where_the_seeing_cameras_allow(test_seed):
    """The prior is behind the block, and the camera below the block sees the object."""
    rig = stage(BLOCK)
    belief = Gaussian(np.array([50.0, 62.0, 0.0, 0.0]), np.diag([30.0, 30.0, 0.1, 0.1]))
    heard = report(np.array([0.0, np.nan, np.nan, np.nan]))
    baseline = Baseline(rig, 0.3)
    place = baseline.map_kalman(belief, heard).mean[:2]
    # one camera says nothing of the distance: the update is along its line only, and x stays at 50
    assert place[0] == pytest.approx(50.0, abs=0.5)
    nowhere = report(np.array([0.0, 155.0, 0.0, 155.0]))
    assert np.isfinite(baseline.map_kalman(belief, nowhere).mean).all()


def test_the_map_estimate_is_the_kalman_filters_for_small_errors(test_seed):
    """Near the truth all three say the same: a bearing is nearly linear there."""
    rig = stage()
    generator = np.random.default_rng(test_seed)
    place = np.array([40.0, 55.0])
    z = np.array([measure(camera, place, rig.noise, generator) for camera in CAMERAS])
    belief = Gaussian(np.array([40.3, 54.8, 0.0, 0.0]), np.diag([1.0, 1.0, 0.01, 0.01]))
    means = [getattr(Baseline(rig, 0.1), kind)(belief, report(z)).mean for kind in KINDS]
    np.testing.assert_allclose(means[1], means[0], atol=0.03)
    np.testing.assert_allclose(means[2], means[0], atol=0.1)
