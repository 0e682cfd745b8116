"""The measurement's variance, Eq. 4 and the motion model's mean, against sampling and quadrature."""

from math import atan2, cos, erf, sin, sqrt

import numpy as np
import pytest

from wsnsim.geometry.polygons import is_convex, least_width, polygon_moments
from wsnsim.systems.scanline.measurement import (
    MeasurementNoise,
    ScanCamera,
    camera_frame,
    displaced,
    gradient,
    measure,
    project,
    report,
    variance,
)
from wsnsim.systems.scanline.motion import CHANGE, TOWARDS, WAIT, Walkers, WaypointWalk, mean_direction
from wsnsim.systems.scanline.occlusion import NormalPriors
from wsnsim.systems.scanline.regions import Rig, Room

CAMERA = ScanCamera((50.0, 0.0), np.pi / 2, 320.0, np.pi / 2)
ROOM = Room(np.zeros(2), np.full(2, 100.0))
PLACES = np.array([[50.0, 40.0], [30.0, 45.0], [75.0, 60.0], [90.0, 95.0]])


def test_frame_of_a_camera():
    h, d = camera_frame(CAMERA, np.array([[40.0, 30.0], [60.0, -5.0]]))
    np.testing.assert_allclose(h, [10.0, -10.0], atol=1e-12)
    np.testing.assert_allclose(d, [30.0, -5.0], atol=1e-12)
    z = project(CAMERA, np.array([[40.0, 30.0], [60.0, -5.0]]))
    assert z[0] == pytest.approx(320.0 / 3.0)
    assert np.isnan(z[1])


def test_gradient_by_differences():
    for axis in range(2):
        step = 1e-5 * np.eye(2)[axis]
        expected = (project(CAMERA, PLACES + step) - project(CAMERA, PLACES - step)) / 2e-5
        np.testing.assert_allclose(gradient(CAMERA, PLACES)[:, axis], expected, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("place", PLACES)
def test_variance_by_sampling(test_seed, place):
    """Eq. 2 within 1 %: of first order in the pose's errors, and the sample's own error is 0.2 %."""
    generator = np.random.default_rng(test_seed)
    count = 500_000
    noise = MeasurementNoise()
    # a camera moved by e and turned by a sees the point moved by -e and turned by -a about it
    away = place - np.asarray(CAMERA.position) - generator.normal(0.0, noise.position_sd_m, (count, 2))
    turn = CAMERA.heading_rad + generator.normal(0.0, noise.angle_sd_rad, count)
    h = np.cos(turn) * away[:, 1] - np.sin(turn) * away[:, 0]
    d = np.cos(turn) * away[:, 0] + np.sin(turn) * away[:, 1]
    z = CAMERA.focal_px * h / d + generator.normal(0.0, noise.read_sd_px, count)
    assert z.var() == pytest.approx(float(variance(CAMERA, place, noise)), rel=0.01)


def test_measurements_have_the_models_errors(test_seed):
    generator = np.random.default_rng(test_seed + 1)
    points = np.broadcast_to(PLACES[1], (200_000, 2))
    noise = MeasurementNoise()
    z = measure(CAMERA, points, noise, generator)
    expected = float(variance(CAMERA, PLACES[1], noise))
    assert z.var() == pytest.approx(expected, rel=5.0 * np.sqrt(2.0 / len(z)))
    assert z.mean() == pytest.approx(float(project(CAMERA, PLACES[1])), abs=5.0 * np.sqrt(expected / len(z)))
    # with a bias, the camera itself is elsewhere and only the read-out is noisy
    real = displaced(CAMERA, noise, generator)
    biased = measure(real, points, noise, generator, white_pose=False)
    assert biased.std() == pytest.approx(noise.read_sd_px, rel=5.0 / np.sqrt(2.0 * len(z)))
    assert biased.mean() == pytest.approx(float(project(real, PLACES[1])), abs=5.0 * 2.0 / np.sqrt(len(z)))
    assert real != CAMERA


def test_missing_is_not_blind():
    heard = report(np.array([1.0, np.nan, 2.0]))
    assert (heard.seeing, heard.blind) == (0b101, 0b010)


def printed_coverage(place, mean, sd, ratio, diameter):
    """Return Eq. 4 as printed: the camera at the origin, the axes those of the occluder's covariance.

    Parameters
    ----------
    place : (2,) x, of the object [m]
    mean : (2,) μ, of the occluder's place [m]
    sd : σ along the first axis [m]
    ratio : α at least 1: the variance along the second axis is σ²/α
    diameter : D of the occluder [m]
    """
    angle = atan2(place[1], place[0])
    first = np.array([cos(angle), sqrt(ratio) * sin(angle)])
    scaled = sqrt(2.0) * sd * float(np.linalg.norm(first))
    second = np.array([cos(angle), ratio * sin(angle)])
    across = float(mean[1] * cos(angle) - mean[0] * sin(angle))
    along = float(mean @ second)
    reach = float(np.linalg.norm(place) * (first @ first))
    width = sqrt(ratio) / scaled
    return 0.25 * (
        (erf(width * (0.5 * diameter - across)) + erf(width * (0.5 * diameter + across)))
        * (erf((reach - along) / scaled) + erf(along / scaled))
    )


def test_eq_4_in_the_principal_frame_is_ours(test_seed):
    generator = np.random.default_rng(test_seed + 2)
    origin = ScanCamera((0.0, 0.0), 0.0, 320.0, 3.0)
    rig = Rig([origin], MeasurementNoise(), ROOM)
    for _ in range(100):
        place, mean = generator.uniform(5.0, 100.0, 2), generator.uniform(-20.0, 120.0, 2)
        sd, ratio, turn = generator.uniform((4.0, 1.0, 0.0), (25.0, 9.0, 7.0))
        expected = printed_coverage(place, mean, sd, ratio, 3.33)
        axes = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        cov = axes @ np.diag([sd**2, sd**2 / ratio]) @ axes.T
        priors = NormalPriors((axes @ mean)[None], cov[None], 3.33 / 2)
        found = priors.coverage(rig, (axes @ place)[None], np.array([1]))[0, 0, 0]
        assert found == pytest.approx(expected, abs=8e-6)


def in_rectangle(place, mean, cov, diameter):
    """Return the exact probability of the rectangle between CAMERA and a place, its frame and length."""
    from scipy.stats import norm

    ray = place - np.asarray(CAMERA.position)
    length = float(np.linalg.norm(ray))
    frame = np.array([ray, [-ray[1], ray[0]]]) / length
    middle, turned = frame @ (mean - CAMERA.position), frame @ cov @ frame.T
    nodes, weights = np.polynomial.legendre.leggauss(20)
    across = 0.5 * diameter * nodes
    along = middle[0] + turned[0, 1] / turned[1, 1] * (across - middle[1])
    sd = np.sqrt(turned[0, 0] - turned[0, 1] ** 2 / turned[1, 1])
    inside = norm.cdf((length - along) / sd) - norm.cdf(-along / sd)
    density = norm.pdf(across, middle[1], np.sqrt(turned[1, 1]))
    return float(0.5 * diameter * weights @ (density * inside)), frame, length


def test_coverage_is_the_integral_over_the_rectangle(test_seed):
    """Eq. 4 within .003 where standard deviations are 2 diameters at least, in any direction."""
    generator = np.random.default_rng(test_seed + 3)
    diameter, cases, count = 3.33, 400, 50_000
    rig = Rig([CAMERA], MeasurementNoise(), ROOM)
    normal = generator.standard_normal((count, 2))
    errors = []
    for case in range(cases):
        angle = generator.uniform(0.0, np.pi)
        axes = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        sds = diameter * generator.uniform(2.0, 8.0, 2)
        place = generator.uniform(0.0, 100.0, 2)
        # near the line of sight, or all are 0
        mean = np.asarray(CAMERA.position) + generator.uniform(0.0, 1.2) * (place - CAMERA.position)
        mean += axes @ (sds * generator.normal(0.0, 1.0, 2))
        cov = axes * sds**2 @ axes.T
        priors = NormalPriors(mean[None], cov[None], diameter / 2)
        q = priors.coverage(rig, place[None], np.array([1]))[0, 0, 0]
        exact, frame, length = in_rectangle(place, mean, cov, diameter)
        errors.append(q - exact)
        if case < 10:  # the integral itself, by sampling
            along, across = frame @ (mean + normal * sds @ axes.T - CAMERA.position).T
            share = ((along > 0) & (along < length) & (np.abs(across) < diameter / 2)).mean()
            assert share == pytest.approx(exact, abs=5.0 * np.sqrt(exact * (1 - exact) / count) + 1e-5)
    assert np.abs(errors).max() <= 0.003


def test_an_isotropic_prior_is_exact():
    from scipy.stats import norm

    rig = Rig([CAMERA], MeasurementNoise(), ROOM)
    priors = NormalPriors(np.array([[49.0, 30.0]]), 0.5**2 * np.eye(2)[None], 1.665)
    q = priors.coverage(rig, np.array([[50.0, 30.2]]), np.array([1]))[0, 0, 0]
    width = norm.cdf((1.665 + 1.0) / 0.5) - norm.cdf((-1.665 + 1.0) / 0.5)
    assert q == pytest.approx(width * norm.cdf(0.2 / 0.5), abs=1e-5)


def test_mean_direction_by_quadrature():
    side = (np.arange(600) + 0.5) / 600
    room = Room(np.array([-3.0, 2.0]), np.array([7.0, 8.0]))
    grid = np.stack(np.meshgrid(-3.0 + 10.0 * side, 2.0 + 6.0 * side, indexing="ij"), axis=-1).reshape(-1, 2)
    places = np.array([[0.3, 4.0], [-3.0, 2.0], [7.0, 5.0], [9.0, 1.0], [2.0, 5.0]])
    for place, found in zip(places, mean_direction(places, room), strict=True):
        ways = grid - place
        expected = (ways / np.linalg.norm(ways, axis=1, keepdims=True)).mean(axis=0)
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-3)


def test_expected_places_are_the_mean_of_the_draws(test_seed):
    generator = np.random.default_rng(test_seed + 4)
    walk = WaypointWalk(ROOM)
    count = 200_000
    for place, target in (((20.0, 30.0), (70.0, 80.0)), ((20.0, 30.0), (20.5, 30.0))):
        one = Walkers(np.array([place]), np.array([target]), np.array([1.3]), np.array([TOWARDS]))
        drawn = walk.propagate(generator, one.take(np.zeros(count, np.int64)))
        found = walk.expected(one).places[0]
        errors = drawn.places.std(axis=0) / np.sqrt(count)
        assert (np.abs(drawn.places.mean(axis=0) - found) < 5.0 * errors).all()
        shares = [(drawn.regimes == regime).mean() for regime in (TOWARDS, CHANGE, WAIT)]
        chances = (0.05, 0.9, 0.05) if target == (20.5, 30.0) else (0.9, 0.05, 0.05)
        np.testing.assert_allclose(shares, chances, atol=5.0 * np.sqrt(0.25 / count))
        waits = drawn.regimes == WAIT
        np.testing.assert_array_equal(drawn.places[waits], np.broadcast_to(place, (waits.sum(), 2)))
        assert (drawn.speeds[waits] == 1.3).all()
        np.testing.assert_array_equal(drawn.targets[drawn.regimes == TOWARDS][0], target)


def test_the_published_memory_lets_the_speed_drift(test_seed):
    """φ = 0.7 lets the noise's length into the speed: it grows where a small φ hardly does."""
    generator = np.random.default_rng(test_seed + 5)
    means = []
    for memory in (0.7, 0.0):
        walk = WaypointWalk(ROOM, memory=memory)
        walkers = walk.placed(generator, generator.uniform(20.0, 80.0, (4000, 2)))
        for _ in range(30):
            walkers = walk.propagate(generator, walkers)
        means.append(walkers.speeds.mean())
    assert means[1] == 1.0
    assert means[0] > 1.3


def test_moments_of_polygons(test_seed):
    generator = np.random.default_rng(test_seed + 6)
    square = np.array([[1.0, 2.0], [5.0, 2.0], [5.0, 4.0], [1.0, 4.0]])
    area, mean, cov = polygon_moments(square)
    assert area == pytest.approx(8.0)
    np.testing.assert_allclose(mean, [3.0, 3.0])
    np.testing.assert_allclose(cov, np.diag([16.0 / 12.0, 4.0 / 12.0]), atol=1e-12)
    assert least_width(square) == pytest.approx(2.0)
    triangle = np.array([[0.0, 0.0], [3.0, 1.0], [1.0, 4.0]])
    u, v = generator.uniform(size=(2, 400_000))
    over = u + v > 1.0
    u[over], v[over] = 1.0 - u[over], 1.0 - v[over]
    draws = u[:, None] * triangle[1] + v[:, None] * triangle[2]
    for order in (1, -1):
        area, mean, cov = polygon_moments(triangle[::order])
        assert area == pytest.approx(5.5)
        np.testing.assert_allclose(mean, draws.mean(axis=0), atol=0.01)
        np.testing.assert_allclose(cov, np.cov(draws.T), atol=0.01)
    star = np.array([[np.cos(a), np.sin(a)] for a in 4.0 * np.pi / 5.0 * np.arange(5)])
    assert is_convex(square)
    assert is_convex(square[::-1])
    assert not is_convex(star)
    assert not is_convex(np.array([[0.0, 0.0], [2.0, 0.0], [1.0, 0.5], [0.0, 2.0]]))
    assert not is_convex(square[:2])
