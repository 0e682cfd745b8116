"""Log-normal shadowing: its moments, what its two parts are, and on what it does not depend."""

import numpy as np
import pytest
from scipy.stats import chi2, kstest

from wsnsim.net.channel.propagation import LogDistance, every_pair, mean_of
from wsnsim.net.channel.shadowing import Shadowed
from wsnsim.rng import RandomStreams

NODES = [f"n{i}" for i in range(60)]
PAIRS = np.triu_indices(len(NODES), 1)
ALPHA = 1e-3


def shadowing_db(nodes, shadowing_sd_db, asymmetry_sd_db, streams):
    """Return what is lost beyond the mean (n, n) from node i to node j."""
    model = Shadowed(LogDistance(), nodes, shadowing_sd_db, asymmetry_sd_db, streams)
    extra, pairs = np.zeros((len(nodes), len(nodes))), every_pair(len(nodes))
    extra[pairs] = model.extra_db(*pairs)
    return extra


@pytest.mark.parametrize(("shared_db", "between_db"), [(4.0, 1.0), (0.0, 2.0), (6.0, 0.0)])
def test_each_part_is_normal_with_its_standard_deviation(shared_db, between_db, test_seed):
    extra = shadowing_db(NODES, shared_db, between_db, RandomStreams(test_seed))
    there, back = extra[PAIRS], extra.T[PAIRS]
    for part, sd in (((there + back) / 2, shared_db), (there - back, between_db)):
        n = len(part)
        if sd == 0.0:
            assert np.allclose(part, 0.0, atol=1e-12)
            continue
        # a false alarm in 1000 for each of the three, whatever the seed
        assert abs(part.mean()) < 3.3 * sd / np.sqrt(n)
        squares = float((part**2).sum()) / sd**2
        assert chi2.ppf(ALPHA / 2, n) < squares < chi2.ppf(1 - ALPHA / 2, n)
        assert kstest(part / sd, "norm").pvalue > ALPHA
    assert not np.diag(extra).any()


def test_one_direction_has_the_variance_of_both_parts(test_seed):
    """Castalia: the loss of one direction is normal(0, sigma) plus half of normal(0, bidirectionalSigma)."""
    extra = shadowing_db(NODES, 3.0, 4.0, RandomStreams(test_seed))
    squares = float((extra[PAIRS] ** 2).sum()) / (3.0**2 + (4.0 / 2) ** 2)
    assert chi2.ppf(ALPHA / 2, len(PAIRS[0])) < squares < chi2.ppf(1 - ALPHA / 2, len(PAIRS[0]))


def test_a_link_hangs_on_its_nodes_and_the_seed_alone():
    streams = RandomStreams(5)
    whole = shadowing_db(NODES, 4.0, 1.0, streams)
    order = np.random.default_rng(0).permutation(len(NODES))
    shuffled = shadowing_db([NODES[i] for i in order], 4.0, 1.0, streams)
    assert np.array_equal(shuffled, whole[np.ix_(order, order)])
    few = [3, 17, 41]
    assert np.array_equal(shadowing_db([NODES[i] for i in few], 4.0, 1.0, streams), whole[np.ix_(few, few)])
    assert not np.array_equal(shadowing_db(NODES, 4.0, 1.0, RandomStreams(6)), whole)
    # the common part stays when the asymmetry changes, and grows in proportion
    symmetric = shadowing_db(NODES, 8.0, 0.0, streams)
    assert np.allclose(symmetric, whole + whole.T, atol=1e-12)


def test_shadowing_is_added_to_the_mean_of_fixed_nodes_only():
    places = np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [0.0, 30.0, 0.0]])
    model = Shadowed(LogDistance(), NODES[:3], 4.0, 1.0, RandomStreams(0))
    pairs = every_pair(3)
    assert np.array_equal(
        model.loss_db(places, *pairs), LogDistance().loss_db(places, *pairs) + model.extra_db(*pairs)
    )
    assert mean_of(model) is model.mean
    with pytest.raises(ValueError, match="must be those of 3 nodes, got 2"):
        model.loss_db(places[:2], np.array([0]), np.array([1]))
