"""Fusion of mixtures against theory: consistency on a tree, the prior counted once, long chains."""

import numpy as np
import pytest
from scipy.stats import chi2

from wsnsim.estimation.divergence import fixed_sample
from wsnsim.estimation.kalman import Gaussian
from wsnsim.estimation.mixtures import GaussianMixture
from wsnsim.estimation.products import fuse, fuse_reduced, product
from wsnsim.estimation.reduction import reduce

RUNS = 200


def posterior(prior, matrix, noise, measurement):
    """Bayes' rule for z = H x + v: what a camera says, the prior in it."""
    information = np.linalg.inv(prior.cov) + matrix.T @ np.linalg.solve(noise, matrix)
    cov = np.linalg.inv(information)
    mean = cov @ (np.linalg.solve(prior.cov, prior.mean) + matrix.T @ np.linalg.solve(noise, measurement))
    return GaussianMixture.single(mean, 0.5 * (cov + cov.T))


def in_pairs(mixtures, prior):
    """A balanced tree: neighbours fuse, then what came of it."""
    while len(mixtures) > 1:
        mixtures = [fuse(mixtures[i : i + 2], prior) for i in range(0, len(mixtures), 2)]
    return mixtures[0]


@pytest.mark.parametrize("cameras", [2, 4, 8])
def test_a_linear_gaussian_tree_is_consistent(cameras):
    """The normalised squared errors of the fused density add up to χ² with 3 × runs degrees of freedom."""
    generator = np.random.default_rng(cameras)
    root = np.array([[0.35, 0.0, 0.0], [0.1, 0.3, 0.0], [-0.05, 0.1, 0.4]])
    prior = Gaussian(np.array([16.0, 11.0, 1.0]), root @ root.T)
    total = 0.0
    for _ in range(RUNS):
        truth = prior.mean + root @ generator.standard_normal(3)
        said = []
        for _ in range(cameras):
            matrix = generator.standard_normal((2, 3))  # a camera measures two of three directions
            noise = np.diag(generator.uniform(0.01, 1.0, 2))
            measurement = matrix @ truth + np.sqrt(np.diag(noise)) * generator.standard_normal(2)
            said.append(posterior(prior, matrix, noise, measurement))
        tree, flat = in_pairs(said, prior), fuse(said, prior)
        np.testing.assert_allclose(tree.means, flat.means, rtol=0.0, atol=1e-10)
        np.testing.assert_allclose(tree.covs, flat.covs, rtol=0.0, atol=1e-10)
        assert tree.log_mass == pytest.approx(flat.log_mass, abs=1e-10)
        error = tree.means[0] - truth
        total += error @ np.linalg.solve(tree.covs[0], error)
    low, high = chi2.ppf([0.025, 0.975], 3 * RUNS)
    assert low <= total <= high


@pytest.mark.parametrize(("cameras", "known"), [(4, 3.59), (8, 7.03)])
def test_the_prior_counted_once_a_camera_is_overconfident(cameras, known, test_seed):
    """With the prior's information 1 and each camera's 0.16, J = 0.16 n: E[NEES] = (n² + J) / (n + J)."""
    generator = np.random.default_rng([test_seed, cameras])
    prior = Gaussian(np.zeros(3), np.eye(3))
    information = 0.16 * cameras
    theory = (cameras**2 + information) / (cameras + information)
    assert theory == pytest.approx(known, abs=0.005)
    wrong, right = np.zeros(RUNS), np.zeros(RUNS)
    for run in range(RUNS):
        truth = generator.standard_normal(3)
        noise = np.eye(3) / 0.16
        said = [
            posterior(prior, np.eye(3), noise, truth + 2.5 * generator.standard_normal(3))
            for _ in range(cameras)
        ]
        for errors, fused in ((wrong, fuse(said, None)), (right, fuse(said, prior))):
            error = fused.means[0] - truth
            errors[run] = error @ np.linalg.solve(fused.covs[0], error) / 3.0
    # a normalised squared error of d degrees of freedom has the standard error √(2 / (d runs)) of its mean
    margin = 4.0 * np.sqrt(2.0 / (3.0 * RUNS))
    assert wrong.mean() == pytest.approx(theory, rel=margin)
    assert right.mean() == pytest.approx(1.0, rel=margin)


def camera(generator, target):
    """What a camera says of a target: four or five guesses, sharp across its ray, dull along it."""
    ray = generator.standard_normal(3)
    ray /= np.linalg.norm(ray)
    means, covs = [], []
    for _ in range(int(generator.integers(4, 6))):
        across, along = 0.2 * np.exp(generator.normal(0.0, 0.3)), generator.uniform(0.5, 1.5)
        noise = across**2 * (np.eye(3) - np.outer(ray, ray)) + along**2 * np.outer(ray, ray)
        guess = target + 0.25 * generator.standard_normal(3)
        cov = np.linalg.inv(np.eye(3) + np.linalg.inv(noise))
        means.append(cov @ np.linalg.solve(noise, guess))
        covs.append(0.5 * (cov + cov.T))
    return GaussianMixture(
        np.log(generator.dirichlet(2.0 * np.ones(len(means)))), np.array(means), np.array(covs)
    )


def chain(said, prior, rule, generator):
    """Each hop multiplies what came by what it says itself, and reduces to a message's four components."""
    passed = said[0]
    for own in said[1:]:
        passed = reduce(fuse([passed, own], prior), 4, rule, generator)
    return passed


def test_a_chain_of_four_cameras_stays_near_the_flat_product(test_seed):
    prior = Gaussian(np.zeros(3), np.eye(3))
    divergences = {"runnalls": [], "kmeans": [], "together": []}
    for seed in range(30):
        generator = np.random.default_rng([test_seed, seed])
        target = 0.7 * generator.standard_normal(3)
        said = [camera(generator, target) for _ in range(4)]
        flat = fuse(said, prior)
        points, weights = fixed_sample(flat, 1500)
        entropy = weights @ flat.normalised().log_density(points)
        fused = {rule: chain(said, prior, rule, generator) for rule in ("runnalls", "kmeans")}
        fused["together"] = fuse_reduced(said, prior, 4)
        for rule, mixture in fused.items():
            divergences[rule].append(entropy - weights @ mixture.normalised().log_density(points))
    means = {rule: np.mean(values) for rule, values in divergences.items()}
    assert means["runnalls"] <= 0.030
    # one random start of the k-means is worse; where all four meet at one node, less is lost
    assert means["runnalls"] < means["kmeans"]
    assert means["together"] < means["runnalls"]


def test_a_shift_by_a_kilometre_changes_no_weight(test_seed):
    generator = np.random.default_rng(test_seed)
    prior = Gaussian(np.zeros(3), np.eye(3))
    said = [camera(generator, np.zeros(3)) for _ in range(3)]
    away = np.array([1000.0, -1000.0, 1000.0])
    shifted = [mixture.moved(np.eye(3), away) for mixture in said]
    for here, there in (
        (product(said[0], said[1]), product(shifted[0], shifted[1])),
        (fuse(said, prior), fuse(shifted, Gaussian(away, prior.cov))),
        (reduce(fuse(said, prior), 4), reduce(fuse(shifted, Gaussian(away, prior.cov)), 4)),
    ):
        np.testing.assert_allclose(there.weights, here.weights, rtol=0.0, atol=1e-6)
        assert there.log_mass == pytest.approx(here.log_mass, abs=1e-6)
        np.testing.assert_allclose(there.means - away, here.means, rtol=0.0, atol=1e-6)


def test_cameras_that_contradict_each_other_keep_a_finite_mass():
    """2 m apart with σ = 5 cm, five hops in a row: e^-400 and less a hop, which no plain number holds."""
    prior = Gaussian(np.zeros(3), np.eye(3))
    cov = 0.05**2 * np.eye(3)
    passed = GaussianMixture.single(np.zeros(3), cov)
    first = fuse([passed, GaussianMixture.single([2.0, 0.0, 0.0], cov)], prior)
    # without the prior's small part: −¼ (2 / 0.05)²
    assert first.log_mass == pytest.approx(-400.0, abs=10.0)
    for hop in range(1, 6):
        other = GaussianMixture(
            np.log([0.5, 0.5]),
            np.array([[2.0 * hop, 0.0, 0.0], [2.0 * hop, 0.1, 0.0]]),
            np.tile(cov, (2, 1, 1)),
        )
        passed = reduce(fuse([passed, other], prior), 4)
        assert np.isfinite(passed.log_mass)
    assert passed.log_mass < -3000.0
    mean, spread = passed.mean_and_cov()
    # six guesses 2 m apart, each as sure as the others, the prior's information 1 beside 6 × 400
    assert mean[0] == pytest.approx(5.0, abs=0.02)
    assert spread[0, 0] == pytest.approx(0.05**2 / 6.0, rel=0.01)
