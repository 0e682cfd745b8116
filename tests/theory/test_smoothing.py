"""Smoothing against batch least squares, and the history that hands it out some steps late."""

import numpy as np
import pytest

from wsnsim.estimation.kalman import Gaussian, constant_velocity, predict, update
from wsnsim.estimation.smoothing import smoothed
from wsnsim.rng import RandomStreams

DT, ACCELERATION_SD = 0.25, 2.0
H = np.hstack([np.eye(3), np.zeros((3, 3))])
F, Q = constant_velocity(DT, ACCELERATION_SD)


def filtered_run(
    seed: int, count: int, unmeasured: tuple[int, ...] = ()
) -> tuple[Gaussian, list[np.ndarray | None], list[np.ndarray], list[Gaussian], np.ndarray]:
    """Return prior, measurements, their covariances, filtered beliefs and the truth (count, 6)."""
    generator = RandomStreams(seed).stream("smoothing")
    prior = Gaussian(generator.standard_normal(6), np.diag([0.2**2] * 3 + [0.5**2] * 3))
    truth = generator.multivariate_normal(prior.mean, prior.cov)
    belief, beliefs, values, covs, truths = prior, [], [], [], []
    for step in range(count):
        root = 0.05 * generator.standard_normal((3, 3)) + 0.05 * np.eye(3)
        cov = root @ root.T + 1e-4 * np.eye(3)
        if step > 0:
            acceleration = ACCELERATION_SD * generator.standard_normal(3)
            truth = F @ truth + np.concatenate([0.5 * DT**2 * acceleration, DT * acceleration])
            belief = predict(belief, F, Q)
        value = generator.multivariate_normal(truth[:3], cov)
        measured = step not in unmeasured
        if measured:
            belief = update(belief, value, H, cov)
        values.append(value if measured else None)
        covs.append(cov)
        beliefs.append(belief)
        truths.append(truth)
    return prior, values, covs, beliefs, np.array(truths)


def batch(
    prior: Gaussian, values: list[np.ndarray | None], covs: list[np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Return the MAP path (n, 6) and its marginal covariances (n, 6, 6), by one linear system.

    The unknowns are the first state and the accelerations, so that Q may be singular.
    """
    count = len(values)
    gain = np.vstack([0.5 * DT**2 * np.eye(3), DT * np.eye(3)])
    size = 6 + 3 * (count - 1)
    maps = [np.hstack([np.eye(6), np.zeros((6, size - 6))])]
    for step in range(1, count):
        following = F @ maps[-1]
        following[:, 6 + 3 * (step - 1) : 9 + 3 * (step - 1)] += gain
        maps.append(following)
    information = np.diag(np.full(size, ACCELERATION_SD**-2.0))
    information[:6, :6] = np.linalg.inv(prior.cov)
    vector = np.zeros(size)
    vector[:6] = information[:6, :6] @ prior.mean
    for value, cov, state in zip(values, covs, maps, strict=True):
        if value is not None:
            seen = H @ state
            information += seen.T @ np.linalg.solve(cov, seen)
            vector += seen.T @ np.linalg.solve(cov, value)
    cov_all = np.linalg.inv(information)
    solution = cov_all @ vector
    return np.array([state @ solution for state in maps]), np.array([s @ cov_all @ s.T for s in maps])


@pytest.mark.parametrize(("seed", "unmeasured"), [(0, ()), (1, ()), (2, (3, 4, 5)), (3, (0, 11))])
def test_the_smoothed_path_is_the_batch_least_squares_solution(
    seed: int, unmeasured: tuple[int, ...]
) -> None:
    prior, values, covs, beliefs, _ = filtered_run(seed, 12, unmeasured)
    means, marginals = batch(prior, values, covs)
    result = smoothed(beliefs, F, Q)
    np.testing.assert_allclose([belief.mean for belief in result], means, atol=1e-9)
    np.testing.assert_allclose([belief.cov for belief in result], marginals, atol=1e-9)


def test_the_last_belief_is_the_filters_and_one_belief_stays_alone() -> None:
    *_, beliefs, _ = filtered_run(4, 6)
    assert smoothed(beliefs, F, Q)[-1] is beliefs[-1]
    assert smoothed(beliefs[:1], F, Q) == beliefs[:1]


@pytest.mark.parametrize("seed", range(4))
def test_smoothing_never_widens_a_covariance(seed: int) -> None:
    *_, beliefs, _ = filtered_run(seed, 15, (6, 7))
    for before, after in zip(beliefs, smoothed(beliefs, F, Q), strict=True):
        gained = np.linalg.eigvalsh(before.cov - after.cov)
        assert gained.min() > -1e-12
        assert np.linalg.eigvalsh(after.cov).min() > -1e-12


def test_smoothed_errors_are_smaller_by_what_the_covariances_say() -> None:
    """300 runs: the mean squared position error is the smoothed covariance's trace, to five standard errors.

    A squared error of three normals has a relative standard deviation of at most √2; runs are independent.
    """
    squares, traces, filtered_squares = [], [], []
    for seed in range(300):
        *_, beliefs, truth = filtered_run(100 + seed, 8)
        middle = smoothed(beliefs, F, Q)[3]
        squares.append(float(((middle.mean - truth[3])[:3] ** 2).sum()))
        filtered_squares.append(float(((beliefs[3].mean - truth[3])[:3] ** 2).sum()))
        traces.append(float(np.trace(middle.cov[:3, :3])))
    assert np.mean(np.array(squares) / traces) == pytest.approx(1.0, abs=5 * np.sqrt(2 / 300))
    assert np.mean(squares) < 0.8 * np.mean(filtered_squares)
