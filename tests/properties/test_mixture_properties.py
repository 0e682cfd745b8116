"""What holds for all mixtures: reduction keeps moments, fusion knows no order, fits are always sound."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wsnsim.estimation.kalman import Gaussian
from wsnsim.estimation.mixtures import GaussianMixture
from wsnsim.estimation.order import fit_mixture
from wsnsim.estimation.products import fuse, fuse_reduced, limited, product, without_normal
from wsnsim.estimation.reduction import reduce

SEEDS = st.integers(0, 2**32 - 1)


def mixture(generator, count, size, widest=1.0):
    """Components of all widths up to `widest`, needles among them, of weights over many powers of ten."""
    turns = np.linalg.qr(generator.standard_normal((count, size, size)))[0]
    variances = widest * np.exp(generator.uniform(-8.0, 0.0, (count, 1, size)))
    covs = (turns * variances) @ turns.transpose(0, 2, 1)
    return GaussianMixture(
        generator.uniform(-20.0, 0.0, count),
        generator.standard_normal((count, size)),
        0.5 * (covs + covs.transpose(0, 2, 1)),
    )


@settings(deadline=None, max_examples=60)
@given(
    seed=SEEDS,
    count=st.integers(1, 30),
    order=st.integers(1, 6),
    size=st.integers(1, 4),
    rule=st.sampled_from(["runnalls", "kmeans", "kmeans_best"]),
)
def test_reduction_keeps_mass_mean_and_covariance(seed, count, order, size, rule):
    generator = np.random.default_rng(seed)
    whole = mixture(generator, count, size)
    reduced = reduce(whole, order, rule, generator)
    assert reduced.order == min(count, order)
    assert reduced.log_mass == pytest.approx(whole.log_mass, abs=1e-9)
    for found, kept in zip(reduced.mean_and_cov(), whole.mean_and_cov(), strict=True):
        np.testing.assert_allclose(found, kept, rtol=0.0, atol=1e-9)


@settings(deadline=None, max_examples=40)
@given(seed=SEEDS, count=st.integers(2, 12), rule=st.sampled_from(["runnalls", "kmeans_best"]))
def test_reduction_does_not_depend_on_the_origin(seed, count, rule):
    whole = mixture(np.random.default_rng(seed), count, 3)
    far = whole.moved(np.eye(3), np.array([1000.0, -1000.0, 1000.0]))
    here = reduce(whole, 2, rule, np.random.default_rng(seed))
    there = reduce(far, 2, rule, np.random.default_rng(seed))
    np.testing.assert_allclose(there.log_weights, here.log_weights, atol=1e-6)


@settings(deadline=None, max_examples=60)
@given(seed=SEEDS, counts=st.tuples(st.integers(1, 5), st.integers(1, 5)), size=st.integers(1, 4))
def test_product_is_the_product_everywhere(seed, counts, size):
    generator = np.random.default_rng(seed)
    first, second = (mixture(generator, count, size) for count in counts)
    both = product(first, second)
    points = generator.standard_normal((20, size))
    expected = first.log_density(points) + second.log_density(points)
    np.testing.assert_allclose(both.log_density(points), expected, rtol=1e-9, atol=1e-7)


@settings(deadline=None, max_examples=60)
@given(seed=SEEDS, size=st.integers(1, 4), times=st.integers(1, 4))
def test_division_is_the_quotient_everywhere(seed, size, times):
    generator = np.random.default_rng(seed)
    normal = Gaussian(generator.standard_normal(size), np.diag(generator.uniform(1.0, 3.0, size)))
    whole = mixture(generator, 4, size, widest=0.9 / times)
    points = generator.standard_normal((20, size))
    shared = GaussianMixture.single(normal.mean, normal.cov).log_density(points)
    quotient = without_normal(whole, normal, times)
    expected = whole.log_density(points) - times * shared
    np.testing.assert_allclose(quotient.log_density(points), expected, rtol=1e-9, atol=1e-7)


@settings(deadline=None, max_examples=40)
@given(seed=SEEDS, size=st.integers(1, 3), count=st.integers(2, 4), turn=st.randoms(use_true_random=False))
def test_fusion_knows_no_order_and_no_tree(seed, size, count, turn):
    generator = np.random.default_rng(seed)
    prior = Gaussian(generator.standard_normal(size), np.diag(generator.uniform(0.5, 2.0, size)))
    # wider than the prior too, in some directions
    said = [mixture(generator, int(generator.integers(1, 4)), size, widest=3.0) for _ in range(count)]
    flat = fuse(said, prior)
    shuffled = said.copy()
    turn.shuffle(shuffled)
    tree = fuse([fuse(shuffled[: count // 2], prior), fuse(shuffled[count // 2 :], prior)], prior)
    assert tree.log_mass == pytest.approx(flat.log_mass, rel=1e-10, abs=1e-10)
    for found, kept in zip(tree.mean_and_cov(), flat.mean_and_cov(), strict=True):
        np.testing.assert_allclose(found, kept, rtol=0.0, atol=1e-10)
    # no fusion says less than the prior
    back = np.linalg.inv(np.linalg.cholesky(prior.cov))
    assert np.linalg.eigvalsh(back @ flat.covs @ back.T).max() <= 1.0 + 1e-9


@settings(deadline=None, max_examples=40)
@given(seed=SEEDS, size=st.integers(1, 3))
def test_limited_components_are_no_wider_than_the_prior(seed, size):
    generator = np.random.default_rng(seed)
    whole = mixture(generator, 4, size, widest=100.0)
    prior = Gaussian(np.zeros(size), np.eye(size))
    found = limited(whole, prior)
    assert np.linalg.eigvalsh(found.covs).max() <= 1.0 + 1e-12
    np.testing.assert_array_equal(found.means, whole.means)
    # what is left of a quotient by the prior's own width is flat, not indefinite
    assert np.isfinite(fuse([found, found], prior).log_mass)


@settings(deadline=None, max_examples=60)
@given(
    seed=SEEDS,
    size=st.integers(1, 3),
    count=st.integers(1, 60),
    order=st.integers(1, 6),
    kind=st.sampled_from(["equal", "one", "few", "steep", "flat cloud", "one place", "far"]),
    rule=st.sampled_from(["tolerance", "argmin"]),
    smoothing=st.sampled_from([1.0, 0.1]),
)
def test_fits_are_always_sound(seed, size, count, order, kind, rule, smoothing):
    generator = np.random.default_rng(seed)
    points, weights = generator.standard_normal((count, size)), np.ones(count)
    if kind == "one":
        weights = np.zeros(count)
        weights[generator.integers(count)] = 1e-200
    elif kind == "few":
        weights = np.where(np.arange(count) < 2, 1.0, 1e-9)
    elif kind == "steep":
        weights = np.exp(generator.uniform(-600.0, 0.0, count))
    elif kind == "flat cloud":
        points[:, -1] = 0.0
    elif kind == "one place":
        points[:] = points[0]
    elif kind == "far":
        points += 1e6
    fitted = fit_mixture(points, weights, order, rule, generator, smoothing=smoothing)
    assert 1 <= fitted.order <= order
    assert fitted.log_mass == pytest.approx(0.0, abs=1e-9)
    shares = weights / weights.sum()
    spread = np.sqrt(((points - points.mean(axis=0)) ** 2).sum() / count) + 1e-6
    np.testing.assert_allclose(fitted.mean_and_cov()[0], shares @ points, atol=0.2 * spread)


@settings(deadline=None, max_examples=30)
@given(seed=SEEDS, count=st.integers(1, 6))
def test_reduced_fusion_is_sound_and_small(seed, count):
    generator = np.random.default_rng(seed)
    prior = Gaussian(np.zeros(3), np.eye(3))
    said = [mixture(generator, 4, 3, widest=2.0) for _ in range(count)]
    fused = fuse_reduced(said, prior, 4)
    assert fused.order <= 4
    assert np.isfinite(fused.log_mass)
