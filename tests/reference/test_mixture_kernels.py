"""The compiled mixture kernels against their plain twins, and mixtures of reference beside the project."""

import os

import numpy as np
import pytest

from wsnsim.bench.mixture_twins import (
    plain_climb,
    plain_em,
    plain_fit_mixture,
    plain_fuse,
    plain_merged_labels,
    plain_seeded_labels,
)
from wsnsim.estimation.density import KernelDensity, kernel_density
from wsnsim.estimation.divergence import kl_divergence
from wsnsim.estimation.em import Standardised, monomials
from wsnsim.estimation.kalman import Gaussian
from wsnsim.estimation.mixtures import GaussianMixture
from wsnsim.estimation.modes import highest_mode
from wsnsim.estimation.order import TOLERANCE, fit_mixture
from wsnsim.estimation.products import fuse
from wsnsim.estimation.reduction import STARTS, merged, reduce
from wsnsim.kernels.em import maximise, mean_log_density
from wsnsim.kernels.merging import merged_labels
from wsnsim.kernels.seeding import seeded_labels

SEED = int(os.environ.get("WSNSIM_TEST_SEED", "0"))


def random_covs(generator, count, size, log_sd=(-1.5, 0.0)):
    turns = np.linalg.qr(generator.standard_normal((count, size, size)))[0]
    return (turns * np.exp(2.0 * generator.uniform(*log_sd, (count, 1, size)))) @ turns.transpose(0, 2, 1)


def random_mixture(generator, count, size=3, log_sd=(-1.5, 0.0)):
    covs = random_covs(generator, count, size, log_sd)
    log_weights = np.log(generator.dirichlet(np.ones(count)))
    return GaussianMixture(log_weights, generator.standard_normal((count, size)), covs)


def assert_equal_mixtures(mixture, expected, tolerance=1e-9):
    np.testing.assert_allclose(mixture.log_weights, expected.log_weights, rtol=0.0, atol=tolerance)
    np.testing.assert_allclose(mixture.means, expected.means, rtol=0.0, atol=tolerance)
    np.testing.assert_allclose(mixture.covs, expected.covs, rtol=0.0, atol=tolerance)


@pytest.mark.parametrize("size", [1, 2, 3, 4])
@pytest.mark.parametrize("own_kernels", [False, True])
def test_em_equals_its_twin(size, own_kernels):
    generator = np.random.default_rng(SEED)
    points = random_mixture(generator, 4, size).sample(300, generator)
    weights = generator.dirichlet(np.ones(300))
    kernels = 0.1 * random_covs(generator, 300 if own_kernels else 1, size)
    density = Standardised.of(KernelDensity(points, weights, kernels)).density
    start = generator.dirichlet(np.ones(4), 300)
    for most_steps, tolerance in ((0, 0.0), (7, 0.0), (100, 1e-3)):
        expected = plain_em(density, start, most_steps, tolerance)
        features = monomials(density.points, density.covs)
        shares, means, covs, steps = maximise(
            features, density.weights, density.weights[:, None] * start, most_steps, tolerance
        )
        assert_equal_mixtures(GaussianMixture(np.log(shares), means, covs), expected)
        assert steps == most_steps or tolerance > 0.0


def test_mean_log_density_equals_the_mixtures():
    generator = np.random.default_rng(SEED)
    mixture = random_mixture(generator, 5)
    points, weights = generator.standard_normal((200, 3)), generator.dirichlet(np.ones(200))
    mean = mean_log_density(monomials(points), weights, mixture.weights, mixture.means, mixture.covs)
    assert mean == pytest.approx(weights @ mixture.log_density(points), abs=1e-11)


def test_seeds_equal_their_twin():
    generator = np.random.default_rng(SEED)
    for order in (1, 2, 5):
        points, weights = generator.standard_normal((200, 3)), generator.dirichlet(np.ones(200))
        uniforms = generator.random((order, 3))
        for rounds in (0, 3):
            np.testing.assert_array_equal(
                seeded_labels(points, weights, uniforms, rounds),
                plain_seeded_labels(points, weights, uniforms, rounds),
            )


def test_fewer_points_than_seeds():
    points = np.repeat(np.eye(3)[:2], 5, axis=0)
    labels = seeded_labels(points, np.full(10, 0.1), np.array([[0.3], [0.9], [0.5], [0.1]]), 2)
    assert len(set(labels.tolist())) == 2
    assert set(labels[:5].tolist()).isdisjoint(labels[5:].tolist())


@pytest.mark.parametrize("size", [2, 3])
@pytest.mark.parametrize("rounds", [0, 50])
def test_merging_equals_its_twin(size, rounds):
    generator = np.random.default_rng(SEED + 1)
    for count in (5, 12, 20):
        mixture = random_mixture(generator, count, size)
        mean, cov = mixture.mean_and_cov()
        back = np.linalg.inv(np.linalg.cholesky(cov))
        features = monomials((mixture.means - mean) @ back.T, back @ mixture.covs @ back.T)
        for order in (1, 4):
            labels = merged_labels(features, mixture.weights, order, rounds)
            assert sorted(set(labels.tolist())) == list(range(order))
            expected = plain_merged_labels(mixture, order, rounds)
            clusters = {frozenset(np.flatnonzero(labels == j).tolist()) for j in range(order)}
            assert clusters == {frozenset(np.flatnonzero(expected == j).tolist()) for j in range(order)}


def test_fusion_equals_natural_parameters():
    """The twin multiplies all at once, in other parameters than the kernels."""
    generator = np.random.default_rng(SEED + 2)
    for size in (2, 3):
        cov = 4.0 * random_covs(generator, 1, size)[0]
        prior = Gaussian(10.0 * generator.standard_normal(size), cov)
        inner = [random_mixture(generator, count, size, (-2.0, -0.1)) for count in (2, 3, 2)]
        mixtures = [mixture.moved(np.linalg.cholesky(cov), prior.mean) for mixture in inner]
        assert_equal_mixtures(fuse(mixtures, prior), plain_fuse(mixtures, prior), tolerance=1e-8)


def test_climb_reaches_what_the_fixed_point_does():
    generator = np.random.default_rng(SEED + 3)
    for size in (2, 3):
        mixture = random_mixture(generator, 5, size)
        ends = np.array([plain_climb(mixture, mean, 2000) for mean in mixture.means])
        logs = mixture.log_density(ends)
        mode = highest_mode(mixture)
        assert mode.log_density == pytest.approx(logs.max(), abs=1e-9)
        np.testing.assert_allclose(mode.point, ends[logs.argmax()], rtol=0.0, atol=1e-6)


def test_fit_is_as_good_as_the_plain_fit():
    """Without negligible particles and with a coarser quadrature: twice the order's tolerance is allowed."""
    generator = np.random.default_rng(SEED + 4)
    truth = random_mixture(generator, 3)
    points = generator.standard_normal((400, 3)) * 1.5
    weights = np.exp(truth.log_density(points))
    plain = plain_fit_mixture(points, weights, 4, np.random.default_rng(SEED), TOLERANCE)
    fast = fit_mixture(points, weights, 4, "tolerance", np.random.default_rng(SEED))
    whole = kernel_density(points, weights).as_mixture()
    assert kl_divergence(whole, fast) < kl_divergence(whole, plain) + 2.0 * TOLERANCE


REFERENCE = "reference/tracking/mixtures.npz"


def reference_mixtures(shared, name):
    with np.load(shared / REFERENCE) as arrays:
        return [
            GaussianMixture(np.log(arrays[f"{name}_{i}_w"]), arrays[f"{name}_{i}_m"], arrays[f"{name}_{i}_P"])
            for i in range(15)
        ]


@pytest.mark.parametrize(("name", "bar"), [("product25", 0.010), ("product64", 0.009)])
def test_reduction_of_products_of_reference(shared, name, bar):
    mixtures = reference_mixtures(shared, name)
    divergences = [kl_divergence(mixture, reduce(mixture, 4), 8000) for mixture in mixtures]
    assert np.mean(divergences) <= bar


def test_rules_on_products_of_reference(shared):
    """Ten starts are better than one, whose tail is heavy; merging draws nothing and has none."""
    mixtures = reference_mixtures(shared, "product25")
    divergences = {
        rule: np.array(
            [
                kl_divergence(mixture, reduce(mixture, 4, rule, np.random.default_rng(SEED + i)), 3000)
                for i, mixture in enumerate(mixtures)
            ]
        )
        for rule in ("runnalls", "kmeans", "kmeans_best")
    }
    assert divergences["kmeans_best"].mean() < divergences["kmeans"].mean()
    assert np.percentile(divergences["runnalls"], 90) < np.percentile(divergences["kmeans"], 90)
    assert STARTS == 10


@pytest.mark.parametrize("rule", ["runnalls", "kmeans", "kmeans_best"])
def test_reduction_of_reference_keeps_mass_mean_and_covariance(shared, rule):
    for mixture in reference_mixtures(shared, "product64") + reference_mixtures(shared, "random25"):
        reduced = reduce(mixture, 4, rule, np.random.default_rng(SEED))
        assert reduced.order == 4
        assert reduced.log_mass == pytest.approx(mixture.log_mass, abs=1e-9)
        for found, kept in zip(reduced.mean_and_cov(), mixture.mean_and_cov(), strict=True):
            np.testing.assert_allclose(found, kept, rtol=0.0, atol=1e-9)


def test_refinement_lowers_the_divergence(shared):
    before, after = [], []
    for mixture in reference_mixtures(shared, "product64"):
        mean, cov = mixture.mean_and_cov()
        back = np.linalg.inv(np.linalg.cholesky(cov))
        features = monomials((mixture.means - mean) @ back.T, back @ mixture.covs @ back.T)
        for rounds, divergences in ((0, before), (50, after)):
            labels = merged_labels(features, mixture.weights, 4, rounds)
            divergences.append(kl_divergence(mixture, merged(mixture, labels), 4000))
    assert np.mean(after) < np.mean(before)
