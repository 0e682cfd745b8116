"""Estimation against theory: Riccati's steady state, Bayes' rule for normals, consistency."""

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are
from scipy.stats import chi2

from wsnsim.estimation.kalman import Gaussian, constant_velocity, predict, update
from wsnsim.estimation.particles import mean_and_cov, normalised, spacing_variance, without_prior
from wsnsim.rng import RandomStreams

H = np.hstack([np.eye(3), np.zeros((3, 3))])


def test_steady_state_solves_the_riccati_equation() -> None:
    F, Q = constant_velocity(0.25, 2.0)
    R = 0.05**2 * np.eye(3)
    belief = Gaussian(np.zeros(6), np.eye(6))
    for _ in range(300):
        belief = predict(update(belief, np.zeros(3), H, R), F, Q)
    np.testing.assert_allclose(belief.cov, solve_discrete_are(F.T, H.T, Q, R), rtol=1e-9, atol=1e-12)


def test_the_filter_is_consistent() -> None:
    """NEES of 100 runs of 40 steps inside the 99.9 % band of its chi-square distribution."""
    rng = RandomStreams(1).stream("nees")
    F, Q = constant_velocity(0.25, 2.0)
    R = np.diag([0.02, 0.05, 0.1]) ** 2
    nees = 0.0
    for _ in range(100):
        truth = rng.standard_normal(6)
        belief = Gaussian(truth + 0.3 * rng.standard_normal(6), 0.09 * np.eye(6))
        for _ in range(40):
            noise = 2.0 * rng.standard_normal(3)
            truth = F @ truth + np.concatenate([0.5 * 0.25**2 * noise, 0.25 * noise])
            z = truth[:3] + np.sqrt(np.diag(R)) * rng.standard_normal(3)
            belief = update(predict(belief, F, Q), z, H, R)
        error = truth - belief.mean
        nees += error @ np.linalg.solve(belief.cov, error)
    low, high = chi2.ppf([0.0005, 0.9995], 600)
    assert low < nees < high


def test_constant_velocity_moves_by_velocity_times_time() -> None:
    F, _ = constant_velocity(0.5, 1.0)
    np.testing.assert_allclose(F @ np.array([1, 2, 3, 4, 6, 8.0]), [3, 5, 7, 4, 6, 8])


def test_weights_survive_any_scale_and_refuse_nonsense() -> None:
    np.testing.assert_allclose(normalised(np.array([-1e5, -1e5 + np.log(3)])), [0.25, 0.75])
    with pytest.raises(ValueError, match="finite"):
        normalised(np.array([-np.inf, -np.inf]))
    with pytest.raises(ValueError, match="finite"):
        normalised(np.array([0.0, np.nan]))


def test_mean_and_covariance_are_numpys() -> None:
    rng = RandomStreams(2).stream("moments")
    points, weights = rng.standard_normal((50, 3)), rng.random(50)
    weights /= weights.sum()
    mean, cov = mean_and_cov(points, weights)
    np.testing.assert_allclose(mean, np.average(points, axis=0, weights=weights))
    np.testing.assert_allclose(cov, np.cov(points.T, aweights=weights, ddof=0), atol=1e-12)


def test_spacing_variance_of_the_published_setups() -> None:
    # (1.25 * 0.22 / 1000^(1/3))^2 and (1.25 * 0.35 / 250^(1/3))^2 by hand
    assert spacing_variance(0.22**2 * np.eye(3), 1000) == pytest.approx(0.0275**2)
    assert spacing_variance(0.35**2 * np.eye(3), 250) == pytest.approx((0.4375 / 6.2996052) ** 2)


@pytest.mark.parametrize("seed", range(5))
def test_without_prior_gives_the_likelihood_back(seed: int) -> None:
    """prior × likelihood = posterior for normals; dividing the prior out must return the likelihood."""
    rng = RandomStreams(seed).stream("division")
    root = rng.standard_normal((3, 3)) + 2 * np.eye(3)
    prior_mean, prior_cov = rng.standard_normal(3), root @ root.T
    noise = rng.standard_normal((3, 3)) + np.eye(3)
    R, z = 0.02 * noise @ noise.T, rng.standard_normal(3)
    posterior = update(Gaussian(prior_mean, prior_cov), z, np.eye(3), R)
    evidence = without_prior(posterior.mean, posterior.cov, prior_mean, prior_cov, 0.0)
    information = evidence.matrix.T @ np.linalg.solve(evidence.cov, evidence.matrix)
    np.testing.assert_allclose(information, np.linalg.inv(R), rtol=1e-6)
    vector = evidence.matrix.T @ np.linalg.solve(evidence.cov, evidence.values)
    np.testing.assert_allclose(vector, np.linalg.solve(R, z), rtol=1e-6)


def test_a_direction_that_was_not_measured_is_left_out() -> None:
    """One camera knows nothing of depth: the evidence has two rows, and the filter's depth is untouched."""
    prior = 0.35**2 * np.eye(3)
    posterior = np.diag([0.02**2, 0.02**2, 0.35**2])
    evidence = without_prior(np.array([0.1, 0.2, 0.0]), posterior, np.zeros(3), prior, 1e-4)
    assert evidence.matrix.shape == (2, 3)
    np.testing.assert_allclose(evidence.matrix[:, 2], 0.0, atol=1e-12)


def test_nothing_measured_is_no_evidence() -> None:
    evidence = without_prior(np.zeros(3), 1.3 * np.eye(3), np.zeros(3), np.eye(3), 0.1)
    assert evidence.values.size == 0
