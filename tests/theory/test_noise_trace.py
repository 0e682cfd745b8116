"""Noise by closest-pattern matching: the successors of patterns, the marginal and the memory of a trace."""

from collections import defaultdict

import numpy as np
import pytest

from wsnsim.net.channel.noise import HISTORY, STEP_NS, NoisePattern, PatternNoise, WhiteNoise
from wsnsim.rng import RandomStreams
from wsnsim.sim.link_files import read_noise

LEVELS_DBM = np.array([-98.0, -97.0, -93.0, -86.0, -71.0])


def trace(samples, seed=0):
    """Return noise that stays where it is three times out of five, and else is anywhere."""
    rng = np.random.default_rng(seed)
    moves, fresh = (
        rng.random(samples) < 0.4,
        rng.choice(len(LEVELS_DBM), samples, p=[0.3, 0.3, 0.2, 0.15, 0.05]),
    )
    last = np.maximum.accumulate(np.where(moves, np.arange(samples), 0))
    return LEVELS_DBM[fresh[last]]


def generated(pattern, steps, seed=0, receiver=0):
    """Return the noise of a receiver millisecond by millisecond [dBm]."""
    noise = PatternNoise(pattern, ["a", "b"], RandomStreams(seed))
    levels = [noise.level_mw(receiver, at * STEP_NS + 17) for at in range(steps)]
    return 10.0 * np.log10(levels)


def correlation(samples, lag=1):
    return float(np.corrcoef(samples[:-lag], samples[lag:])[0, 1])


def batch_error(samples, statistic, batches=50):
    """Return the standard error of a statistic of samples that hang on each other, by batch means."""
    values = [statistic(batch) for batch in np.array_split(samples, batches)]
    return float(np.std(values, ddof=1)) / np.sqrt(batches)


def test_every_sample_followed_its_pattern_in_the_trace():
    """A plain twin: 20 samples in bins of 5 dB from -115 dBm, and all that ever came after them."""
    samples = trace(3000)
    bins = [int((each + 115.0) // 5.0) for each in samples]
    followers = defaultdict(set)
    for at in range(len(samples)):
        followers[tuple(bins[at - HISTORY + step] for step in range(HISTORY))].add(samples[at])
    found = generated(NoisePattern(samples), 4000)
    several = 0
    for at in range(HISTORY, len(found)):
        history = tuple(int((round(each, 9) + 115.0) // 5.0) for each in found[at - HISTORY : at])
        assert round(float(found[at]), 9) in followers[history]
        several += len(followers[history]) > 1
    assert several > 100


def test_followers_are_drawn_as_often_as_they_followed():
    # 30 samples, round and round: after 20 of -100 comes -100 nine times and -60 once
    samples = np.full(30, -100.0)
    samples[29] = -60.0
    pattern = NoisePattern(samples)
    calm = pattern.pattern[np.arange(20, 30)]
    assert len(set(calm.tolist())) == 1
    order, starts = pattern.followers
    own = samples[order[starts[calm[0]] : starts[calm[0] + 1]]]
    assert sorted(own.tolist()) == [-100.0] * 9 + [-60.0]
    found = generated(pattern, 30_000)
    peaks = np.flatnonzero(found > -80.0)
    # after a peak 20 calm samples are certain, then each has one chance in ten: a mean period of 20 + 10
    gaps = np.diff(peaks)
    assert gaps.min() == 21
    assert gaps.mean() == pytest.approx(30.0, abs=3.3 * np.sqrt(90.0 / len(gaps)))


def test_the_marginal_and_the_memory_are_those_of_the_trace(test_seed):
    samples = trace(20_000, test_seed)
    found = generated(NoisePattern(samples), 60_000, test_seed)
    for level in LEVELS_DBM:

        def share(batch, level=level):
            return float(np.mean(np.abs(batch - level) < 1e-6))

        assert abs(share(found) - share(samples)) < 4.0 * batch_error(found, share)
    # the pattern knows a sample by its bin of 5 dB: what is left of the memory inside a bin is lost
    for lag in (1, 2, 5):
        error = batch_error(found, lambda batch, lag=lag: correlation(batch, lag))
        assert abs(correlation(found, lag) - correlation(samples, lag)) < 4.0 * error + 0.005


def test_receivers_and_seeds_differ_and_each_repeats():
    pattern = NoisePattern(trace(5000))
    first = generated(pattern, 3000)
    assert np.array_equal(first, generated(pattern, 3000))
    assert not np.array_equal(first, generated(pattern, 3000, seed=1))
    assert not np.array_equal(first, generated(pattern, 3000, receiver=1))
    # whoever asks seldom hears the same
    noise = PatternNoise(pattern, ["a", "b"], RandomStreams(0))
    for at in (0, 999, 1000, 990, 2999):
        assert 10.0 * np.log10(noise.level_mw(0, at * STEP_NS)) == pytest.approx(first[at])


@pytest.mark.parametrize(
    ("samples", "words"),
    [
        (np.full(HISTORY, -98.0), "more than 20 samples, got 20"),
        (np.array([-98.0] * 30 + [np.nan]), "must be finite, got nan as number 31"),
    ],
)
def test_a_trace_must_be_long_and_finite(samples, words):
    with pytest.raises(ValueError, match=words):
        NoisePattern(samples)


def test_white_noise_has_each_nodes_floor_and_deviation(test_seed):
    noise = WhiteNoise(np.array([-105.0, -99.0]), np.array([4.0, 0.0]), ["a", "b"], RandomStreams(test_seed))
    found = 10.0 * np.log10([noise.level_mw(0, at * STEP_NS) for at in range(5000)])
    assert found.mean() == pytest.approx(-105.0, abs=3.3 * 4.0 / np.sqrt(5000))
    assert found.std() == pytest.approx(4.0, rel=3.3 / np.sqrt(2 * 5000))
    assert 10.0 * np.log10(noise.level_mw(1, 10**12)) == pytest.approx(-99.0)
    # a millisecond has one level, whenever it is asked for
    assert noise.level_mw(0, 77 * STEP_NS + 999_999) == pytest.approx(10 ** (found[77] / 10.0))


def test_the_measured_trace_of_a_library(shared, test_seed):
    """Heavy interference by a network beside: a mean of -87.4 dBm and a lag-1 correlation of 0.48."""
    samples = read_noise(shared / "data/tossim/noise/meyer-heavy.txt")
    assert len(samples) == 196_608
    assert samples.mean() == pytest.approx(-87.4, abs=0.05)
    assert correlation(samples) == pytest.approx(0.48, abs=0.005)
    found = generated(NoisePattern(samples), 300_000, test_seed)
    assert abs(found.mean() - samples.mean()) < 4.0 * batch_error(found, np.mean)
    assert abs(found.std() - samples.std()) < 4.0 * batch_error(found, np.std)
    assert abs(correlation(found) - correlation(samples)) < 4.0 * batch_error(found, correlation)
    for level in (-98.0, -90.0, -80.0, -60.0):

        def below(batch, level=level):
            return float(np.mean(batch <= level + 1e-6))

        assert abs(below(found) - below(samples)) < 4.0 * batch_error(found, below)
