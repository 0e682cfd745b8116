"""Slow changes of light against their formulas, and what they do to an image."""

import numpy as np
import pytest

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.rng import RandomStreams
from wsnsim.vision.drift import RandomDrift, SinusoidalDrift
from wsnsim.vision.renderer import Renderer

RATE_HZ = 4.0


def wander(seed, sd=0.2, correlation_s=3.0, camera="c1"):
    return RandomDrift(sd, correlation_s, RATE_HZ, RandomStreams(seed).stream("illumination", camera))


def test_a_sinusoid_by_hand():
    drift = SinusoidalDrift(0.2, 60.0, np.radians(30.0), RATE_HZ)
    # 60 s are 240 steps; 30° + 60° is the crest, half a period later comes the trough.
    assert [drift(step) for step in (0, 40, 160, 240)] == pytest.approx([1.1, 1.2, 0.8, 1.1])


def test_a_random_walk_of_light_is_stationary_with_the_asked_correlation(test_seed):
    # Each run gives one sample of x at three instants, so that all samples are independent.
    steps, runs = (0, 12, 300), 1500
    samples = np.array(
        [[np.log(drift(step)) for step in steps] for drift in map(wander, _seeds(test_seed, runs))]
    )
    for column in samples.T:
        assert column.mean() == pytest.approx(0.0, abs=4 * 0.2 / np.sqrt(runs))
        assert column.std() == pytest.approx(0.2, abs=4 * 0.2 / np.sqrt(2 * runs))
    # 12 steps are one correlation time; a correlation r has the standard error (1 - r²) / √n.
    kept = np.exp(-1.0)
    found = np.corrcoef(samples.T)
    assert found[0, 1] == pytest.approx(kept, abs=4 * (1 - kept**2) / np.sqrt(runs))
    assert found[0, 2] == pytest.approx(0.0, abs=4 / np.sqrt(runs))


def _seeds(first, count):
    return range(10_000 * first, 10_000 * first + count)


def test_the_order_of_steps_changes_nothing(test_seed):
    steps = np.random.default_rng(test_seed).permutation(700)
    drift, again = wander(test_seed), wander(test_seed)
    forwards = [drift(step) for step in range(700)]
    shuffled = {int(step): again(int(step)) for step in steps}
    assert [shuffled[step] for step in range(700)] == forwards
    assert wander(test_seed, camera="c2")(5) != forwards[5]


def test_an_image_is_brighter_by_the_factor():
    camera = PinholeCamera.look_at((0.0, 0.0, 2.0), (4.0, 0.0, 2.0), 300.0, (64, 48))
    grey = np.full((48, 64, 3), 100, np.uint8)
    parts = (camera, "c1", grey, 0.0, 0.03, np.array([0.0, 0.0, 1.0]), 1.0, RandomStreams(1))
    steady = Renderer(*parts)
    drifting = Renderer(*parts, drift=SinusoidalDrift(0.5, 4.0, 0.0, 4.0))
    for step, factor in [(0, 1.0), (4, 1.5), (12, 0.5)]:
        ratio = drifting.render(step, [], []) / steady.render(step, [], [])
        assert ratio == pytest.approx(np.full(ratio.shape, factor), abs=0.01)
