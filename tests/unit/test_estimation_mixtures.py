"""Gaussian mixtures one piece at a time: densities, draws, distances, modes, and what they refuse."""

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from wsnsim.estimation.density import KernelDensity, effective_number, kernel_density
from wsnsim.estimation.divergence import (
    SAMPLE,
    fixed_sample,
    integrated_squared_difference,
    kl_divergence,
    normal_points,
)
from wsnsim.estimation.em import Standardised, fit
from wsnsim.estimation.kalman import Gaussian
from wsnsim.estimation.mixtures import GaussianMixture
from wsnsim.estimation.modes import highest_mode
from wsnsim.estimation.order import fit_density, fit_mixture, quadrature
from wsnsim.estimation.products import (
    MOST_COMPONENTS,
    fuse,
    fuse_reduced,
    limited,
    product,
    without_normal,
)
from wsnsim.estimation.reduction import reduce

STANDARD = Gaussian(np.zeros(2), np.eye(2))
TWO = GaussianMixture(
    np.log([0.5, 1.5]),
    np.array([[0.0, 1.0], [2.0, -1.0]]),
    np.array([[[0.5, 0.2], [0.2, 0.4]], [[0.3, 0.0], [0.0, 0.9]]]),
)


def test_log_density_is_that_of_a_peer():
    points = np.random.default_rng(0).uniform(-3.0, 3.0, (50, 2))
    expected = sum(
        np.exp(log_weight) * multivariate_normal(mean, cov).pdf(points)
        for log_weight, mean, cov in zip(TWO.log_weights, TWO.means, TWO.covs, strict=True)
    )
    np.testing.assert_allclose(np.exp(TWO.log_density(points)), expected, rtol=1e-12)


def test_log_density_where_the_density_is_nothing():
    far = TWO.log_density(np.array([[1e4, 0.0]]))
    assert np.isfinite(far).all()
    assert far[0] < -1e7


def test_draws_have_the_mixtures_moments(test_seed):
    count = 100_000
    draws = TWO.sample(count, np.random.default_rng(test_seed))
    mean, cov = TWO.mean_and_cov()
    np.testing.assert_allclose(draws.mean(axis=0), mean, rtol=0.0, atol=5.0 * np.sqrt(cov.max() / count))
    # the error of a variance is at most √(kurtosis / n) of it; no mixture here has a kurtosis above 6
    np.testing.assert_allclose(np.cov(draws.T), cov, rtol=0.0, atol=5.0 * cov.max() * np.sqrt(6.0 / count))


@pytest.mark.parametrize(
    ("log_weights", "means", "covs", "match"),
    [
        ([0.0], [[0.0, 0.0]], [[[1.0, 2.0], [2.0, 1.0]]], "positive definite"),
        ([0.0], [[0.0, 0.0]], [[[1.0, 0.0], [0.0, 0.0]]], "positive definite"),
        ([0.0], [[0.0, np.nan]], [np.eye(2)], "means must be finite"),
        ([-np.inf], [[0.0, 0.0]], [np.eye(2)], "log weights must be finite"),
        ([0.0], [[0.0, 0.0]], [np.full((2, 2), np.inf)], "covs must be finite"),
        ([0.0, 0.0], [[0.0, 0.0]], [np.eye(2)], "log weights"),
        ([], np.zeros((0, 2)), np.zeros((0, 2, 2)), "at least 1"),
    ],
)
def test_unsound_parameters_are_refused(log_weights, means, covs, match):
    with pytest.raises(ValueError, match=match):
        GaussianMixture(np.array(log_weights), np.array(means), np.array(covs))


@pytest.mark.parametrize(
    ("points", "weights", "match"),
    [
        (np.zeros((3, 2)), np.zeros(3), "sum above 0"),
        (np.zeros((3, 2)), np.array([1.0, 2.0, -1.0]), "no weight below 0"),
        (np.zeros((3, 2)), np.array([1.0, np.nan, 1.0]), "finite"),
        (np.full((3, 2), np.inf), np.ones(3), "finite"),
        (np.zeros((3, 2)), np.ones(4), r"weights \(m,\)"),
    ],
)
def test_unsound_particles_are_refused(points, weights, match):
    with pytest.raises(ValueError, match=match):
        kernel_density(points, weights)


def test_bandwidths_are_those_of_the_rules():
    """Equal weights, far more particles than the floor of half their distance asks for."""
    points = np.random.default_rng(1).standard_normal((2000, 2)) * [1.0, 3.0]
    cov = np.cov(points.T, bias=True)
    weights = np.ones(2000)
    assert effective_number(weights / 2000.0) == pytest.approx(2000.0)
    scott = kernel_density(points, weights, "scott").covs[0]
    np.testing.assert_allclose(scott, 2000.0 ** (-1.0 / 3.0) * cov, rtol=1e-10)
    # in two dimensions the rules are one
    np.testing.assert_allclose(kernel_density(points, weights).covs[0], scott, rtol=1e-10)


def test_a_lone_heavy_particle_has_a_kernel_of_half_the_distance_between_particles():
    points = np.random.default_rng(2).standard_normal((1000, 3))
    weights = np.zeros(1000)
    weights[17] = 1.0
    kernel = kernel_density(points, weights).covs[0]
    spread = np.cov(points.T, bias=True)
    half = 0.5 * np.sqrt(2.0 * np.pi) / 10.0
    np.testing.assert_allclose(kernel, half**2 * spread, rtol=1e-9)


def test_lightest_particles_are_left_out():
    density = KernelDensity(
        np.arange(4.0)[:, None], np.array([0.0004, 0.5, 0.0005, 0.4991]), np.ones((1, 1, 1))
    )
    kept = density.without_negligible(0.001)
    np.testing.assert_array_equal(kept.points[:, 0], [1.0, 3.0])
    assert kept.weights.sum() == pytest.approx(1.0)


def test_quadrature_has_the_densitys_moments():
    generator = np.random.default_rng(3)
    for count in (20, 600):
        points, weights = generator.standard_normal((count, 3)), generator.dirichlet(np.ones(count))
        density = kernel_density(points, weights)
        found, shares = quadrature(density)
        assert shares.sum() == pytest.approx(1.0)
        mean, cov = density.mean_and_cov()
        np.testing.assert_allclose(shares @ found, mean, atol=1e-12)
        second = (shares[:, None] * (found - mean)).T @ (found - mean)
        # few kernels: exact; of many each has one axis, and only their average is right
        np.testing.assert_allclose(
            second, cov, atol=1e-12 if count == 20 else 0.1 * np.trace(density.covs[0])
        )


def test_order_follows_what_the_particles_say(test_seed):
    generator = np.random.default_rng(test_seed)
    points = generator.uniform(-3.0, 3.0, (4000, 2))
    one = np.exp(-2.0 * (points**2).sum(axis=1))
    two = np.exp(-8.0 * ((points - 1.5) ** 2).sum(axis=1)) + np.exp(-8.0 * ((points + 1.5) ** 2).sum(axis=1))
    assert fit_mixture(points, one, 4, "tolerance", generator).order == 1
    fitted = fit_mixture(points, two, 4, "tolerance", generator)
    assert fitted.order > 1
    for sign in (-1.0, 1.0):
        side = sign * fitted.means[:, 0] > 0.0
        assert fitted.weights[side].sum() == pytest.approx(0.5, abs=0.2)
        np.testing.assert_allclose(fitted.weights[side] @ fitted.means[side], sign * 0.75, atol=0.3)
    assert fitted.log_mass == pytest.approx(0.0, abs=1e-12)
    # whatever the tolerance, an order within it is taken; a huge one asks for one component
    assert fit_mixture(points, two, 4, "tolerance", generator, tolerance=10.0).order == 1
    # the printed rule wants more components than one even where one does
    assert fit_mixture(points, one, 4, "argmin", generator).order > 1


def test_the_smallest_order_near_the_least_divergence_is_taken():
    """Against the divergences themselves, by a sample, for tolerances between any two of them."""
    generator = np.random.default_rng(5)
    points = np.concatenate([generator.normal(centre, 0.3, (60, 2)) for centre in (-2.0, 0.5, 2.0)])
    density = KernelDensity(points, np.full(180, 1.0 / 180.0), 0.2**2 * np.eye(2)[None])
    standardised = Standardised.of(density.without_negligible())
    starts = np.random.default_rng(6)
    fits = [fit(standardised, order, starts) for order in range(1, 5)]
    whole = standardised.density.as_mixture()
    divergences = np.array([kl_divergence(whole, mixture, 20_000) for mixture in fits])
    found = []
    for tolerance in (0.02, 0.4, 1.0):
        expected = int(np.argmax(divergences <= divergences.min() + tolerance)) + 1
        chosen = fit_density(density, 4, "tolerance", np.random.default_rng(6), tolerance=tolerance)
        assert chosen.order == expected
        found.append(expected)
    assert found == [3, 2, 1]
    assert fit_density(density, 4, "argmin", np.random.default_rng(6)).order > 2


def test_smoothing_tells_how_much_of_the_kernel_stays():
    generator = np.random.default_rng(7)
    points = generator.standard_normal((500, 3))
    weights = np.exp(-2.0 * (points**2).sum(axis=1))
    kernel = kernel_density(points, weights).covs[0]
    smooth, sharp = (
        fit_mixture(points, weights, 1, "tolerance", generator, smoothing=share).mean_and_cov()[1]
        for share in (1.0, 0.25)
    )
    np.testing.assert_allclose(smooth - sharp, 0.75 * kernel, atol=1e-12)
    for share in (0.0, 1.1):
        with pytest.raises(ValueError, match="smoothing must be above 0 and at most 1"):
            fit_mixture(points, weights, 1, "tolerance", generator, smoothing=share)


def test_one_component_has_the_kernel_densitys_moments():
    generator = np.random.default_rng(4)
    density = kernel_density(generator.standard_normal((100, 3)), np.ones(100))
    fitted = fit_density(density.without_negligible(0.0), 1, "argmin", generator)
    for found, kept in zip(fitted.mean_and_cov(), density.mean_and_cov(), strict=True):
        np.testing.assert_allclose(found, kept, atol=0.05)
    # nothing is left out of the fit itself
    mixture = fit(Standardised.of(density), 4, generator)
    mean, cov = mixture.mean_and_cov()
    np.testing.assert_allclose(mean, 0.0, atol=1e-12)
    np.testing.assert_allclose(cov, np.eye(3), atol=1e-12)


@pytest.mark.parametrize("order", [0, -1])
def test_orders_below_one_are_refused(order):
    generator = np.random.default_rng(0)
    density = kernel_density(generator.standard_normal((10, 2)), np.ones(10))
    with pytest.raises(ValueError, match="order must be at least 1"):
        fit_density(density, order, "tolerance", generator)
    with pytest.raises(ValueError, match="order must be at least 1"):
        fit(Standardised.of(density), order, generator)
    with pytest.raises(ValueError, match="order must be at least 1"):
        reduce(TWO, order)


def test_reduction_refuses_what_it_cannot_do():
    with pytest.raises(ValueError, match="needs a generator"):
        reduce(TWO, 1, "kmeans")
    with pytest.raises(ValueError, match=r"one of runnalls, kmeans, kmeans_best, got 'salmond'"):
        reduce(TWO, 1, "salmond")
    assert reduce(TWO, 2) is TWO
    assert reduce(TWO, 7, "kmeans") is TWO


def test_product_refuses_other_dimensions():
    with pytest.raises(ValueError, match="one dimension, got 2 and 3"):
        product(TWO, GaussianMixture.single(np.zeros(3), np.eye(3)))
    with pytest.raises(ValueError, match="at least one mixture"):
        fuse([], STANDARD)


def test_division_refuses_what_is_too_wide():
    with pytest.raises(ValueError, match="component 0 is not"):
        without_normal(GaussianMixture.single([0.0, 0.0], np.diag([1.5, 0.5])), STANDARD)
    narrow = GaussianMixture.single([0.0, 0.0], 0.4 * np.eye(2))
    with pytest.raises(ValueError, match=r"covariance / 3"):
        without_normal(narrow, STANDARD, 3)
    assert without_normal(narrow, STANDARD, 2).covs[0, 0, 0] == pytest.approx(1.0 / (2.5 - 2.0))


def test_limiting_touches_wide_directions_only():
    wide = GaussianMixture(
        np.zeros(2), np.zeros((2, 2)), np.array([np.diag([4.0, 0.25]), [[0.5, 0.1], [0.1, 0.7]]])
    )
    prior = Gaussian(np.zeros(2), np.diag([1.0, 2.0]))
    found = limited(wide, prior)
    np.testing.assert_allclose(found.covs[0], np.diag([1.0, 0.25]), atol=1e-12)
    np.testing.assert_array_equal(found.covs[1], wide.covs[1])
    assert limited(found, prior).covs[0] == pytest.approx(found.covs[0], abs=1e-15)


def test_a_density_as_wide_as_the_prior_says_nothing():
    prior = Gaussian(np.array([1.0, -2.0]), np.array([[2.0, 0.3], [0.3, 0.5]]))
    said = GaussianMixture.single([1.5, -2.2], 0.2 * prior.cov)
    nothing = GaussianMixture.single(prior.mean, prior.cov)
    fused = fuse([said, nothing, GaussianMixture.single(prior.mean, 3.0 * prior.cov)], prior)
    np.testing.assert_allclose(fused.means, said.means, atol=1e-12)
    np.testing.assert_allclose(fused.covs, said.covs, atol=1e-12)
    assert fused.log_mass == pytest.approx(0.0, abs=1e-12 + 2.0 * np.log(3.0))


def test_products_stay_below_the_cap(test_seed):
    generator = np.random.default_rng(test_seed)
    many = [
        GaussianMixture(
            np.log(generator.dirichlet(np.ones(20))),
            0.1 * generator.standard_normal((20, 2)),
            np.tile(0.5 * np.eye(2), (20, 1, 1)),
        )
        for _ in range(3)
    ]
    fused = fuse(many, STANDARD)
    assert fused.order == MOST_COMPONENTS < 20**3
    # in fives of the cap the lightest are left out: the heaviest carry nearly all
    reduced = fuse_reduced(many, STANDARD, 4)
    assert reduced.order == 4
    np.testing.assert_allclose(reduced.mean_and_cov()[0], fused.mean_and_cov()[0], atol=0.02)


def test_squared_difference_is_its_integral():
    other = GaussianMixture.single([1.0, 0.0], 0.8 * np.eye(2))

    # on an even grid a sum converges faster than any power of the spacing
    axis = np.arange(-8.0, 10.0, 0.05)
    grid = np.stack(np.meshgrid(axis, axis), -1).reshape(-1, 2)
    apart = np.exp(TWO.log_density(grid)) - np.exp(other.log_density(grid))
    expected = (apart**2).sum() * 0.05**2
    assert integrated_squared_difference(TWO, other) == pytest.approx(expected, abs=1e-9)
    assert integrated_squared_difference(TWO, TWO) == 0.0


def test_squared_difference_of_huge_densities_is_refused():
    huge = GaussianMixture(np.array([1000.0]), np.zeros((1, 2)), np.eye(2)[None])
    with pytest.raises(OverflowError, match="must have a squared integral below"):
        integrated_squared_difference(huge, TWO)


def test_fixed_sample_divergence_of_two_normal_densities():
    """Closed form: ½ [tr(W⁻¹V) + δᵀW⁻¹δ − d + log|W|/|V|]."""
    first = Gaussian(np.array([0.3, -0.2, 0.1]), np.diag([0.5, 0.8, 0.3]))
    second = Gaussian(np.zeros(3), np.eye(3))
    closed = 0.5 * (first.cov.trace() + first.mean @ first.mean - 3.0 - np.log(np.linalg.det(first.cov)))
    found = kl_divergence(
        GaussianMixture.single(first.mean, first.cov), GaussianMixture.single(second.mean, second.cov)
    )
    # log f / g is ½ Σ (x² − (x − m)² / v) and a constant; independent draws would err by its deviation / √n
    deviation = np.sqrt(0.5 * ((1.0 - np.diag(first.cov)) ** 2).sum() + first.cov @ first.mean @ first.mean)
    assert found == pytest.approx(closed, abs=0.5 * deviation / np.sqrt(SAMPLE))


def test_divergence_does_not_see_mass():
    heavier = GaussianMixture(TWO.log_weights + 100.0, TWO.means, TWO.covs)
    assert kl_divergence(TWO, heavier) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("size", [1, 2, 3])
def test_normal_points_are_more_even_than_draws(size):
    points = normal_points(4096, size)
    draws = np.sqrt(1.0 / 4096.0)
    np.testing.assert_allclose(points.mean(axis=0), 0.0, atol=0.5 * draws)
    np.testing.assert_allclose(points.T @ points / 4096.0, np.eye(size), atol=1.5 * draws)
    with pytest.raises(ValueError, match="read-only"):
        points[0, 0] = 1.0


def test_fixed_sample_is_fixed():
    for first, second in zip(fixed_sample(TWO, 300), fixed_sample(TWO, 300), strict=True):
        np.testing.assert_array_equal(first, second)
    assert fixed_sample(TWO, 300)[1].sum() == pytest.approx(1.0)


def test_mode_of_one_normal_density_is_its_mean():
    mode = highest_mode(GaussianMixture.single([3.0, 4.0], [[2.0, 1.0], [1.0, 1.0]]))
    np.testing.assert_allclose(mode.point, [3.0, 4.0], atol=1e-12)
    assert mode.log_density == pytest.approx(-np.log(2.0 * np.pi))


def test_highest_of_two_modes():
    mode = highest_mode(TWO)
    around = mode.point + 1e-3 * np.random.default_rng(0).standard_normal((100, 2))
    assert (TWO.log_density(around) <= mode.log_density).all()
    grid = np.stack(np.meshgrid(np.linspace(-3, 5, 200), np.linspace(-5, 4, 200)), -1).reshape(-1, 2)
    assert mode.log_density >= TWO.log_density(grid).max()


def test_mode_where_masses_are_nothing():
    light = GaussianMixture(
        np.array([-2000.0, -2001.0]), 1e3 * np.eye(2), np.tile(1e-4 * np.eye(2), (2, 1, 1))
    )
    mode = highest_mode(light)
    np.testing.assert_allclose(mode.point, [1e3, 0.0])
    assert mode.log_density == pytest.approx(-2000.0 - np.log(2.0 * np.pi * 1e-4))
