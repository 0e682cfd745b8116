"""The best place in space for densities in several images (T4): against scipy's optimum and closed forms."""

import runpy
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import minimize

from wsnsim.estimation.kalman import Gaussian
from wsnsim.estimation.mixtures import GaussianMixture
from wsnsim.geometry.camera import PinholeCamera
from wsnsim.geometry.lens import Distortion
from wsnsim.messages.mixture import MixturePayload
from wsnsim.messages.state import StatePayload
from wsnsim.systems.base import Site
from wsnsim.systems.multiview.image_proposal import image_prediction
from wsnsim.systems.multiview.map_estimate import ImageDensity, best_place
from wsnsim.systems.multiview.params import MultiviewParams
from wsnsim.systems.multiview.proposal import propose
from wsnsim.systems.multiview.t4 import posterior
from wsnsim.systems.multiview.variants import Question, Report

scene = SimpleNamespace(**runpy.run_path(str(Path(__file__).parents[1] / "multiview_scene.py")))
CENTRE, UPRIGHT, CAMERAS, SIZE = scene.CENTRE, scene.UPRIGHT, scene.CAMERAS, scene.SIZE
box = scene.Scene(5)
PRIOR = Gaussian(CENTRE, np.diag([0.3, 0.25, 0.2]) ** 2)
BARREL: Distortion = (-0.25, 0.05)


def cameras(distortion: Distortion = (0.0, 0.0)) -> list[PinholeCamera]:
    return [
        PinholeCamera.look_at(camera.position, CENTRE, 300.0, SIZE, distortion) for camera in CAMERAS.values()
    ]


def seen(camera: PinholeCamera, place: np.ndarray) -> np.ndarray:
    (pixel,), _ = camera.project(place[None])
    return np.asarray(pixel)


def single(camera: PinholeCamera, place: np.ndarray, cov: np.ndarray) -> ImageDensity:
    """Return one normal density about the image of a place."""
    return ImageDensity(camera, GaussianMixture.single(seen(camera, place), cov), place[None])


def several(camera: PinholeCamera, rng: np.random.Generator, order: int = 3) -> ImageDensity:
    """Return a density of some components about images of places near the prior's mean."""
    places = PRIOR.mean + rng.standard_normal((order, 3)) @ np.sqrt(PRIOR.cov)
    pixels, _ = camera.project(places)
    roots = 2.0 * rng.standard_normal((order, 2, 2)) + rng.uniform(3.0, 9.0, (order, 1, 1)) * np.eye(2)
    mixture = GaussianMixture(
        rng.uniform(-2.0, 0.0, order), pixels, roots @ roots.transpose(0, 2, 1) + np.eye(2)
    )
    return ImageDensity(camera, mixture, places)


def height(place: np.ndarray, prior: Gaussian, densities: list[ImageDensity]) -> float:
    """Return the logarithm of the posterior (Eq. 41), written out."""
    apart = place - prior.mean
    total = -0.5 * apart @ np.linalg.solve(prior.cov, apart)
    for density in densities:
        pixel, depth = density.camera.project(place[None])
        if not depth[0] > 0.0 or np.isnan(pixel).any():
            return -np.inf
        total += density.mixture.log_density(pixel)[0]
    return float(total)


def best_of_scipy(prior: Gaussian, densities: list[ImageDensity], starts: np.ndarray) -> np.ndarray:
    """Return the best of scipy's optima from many starts, refined by a simplex."""

    def depth(place: np.ndarray) -> float:
        # behind a camera: finite, for scipy's differences
        return -max(height(place, prior, densities), -1e6)

    found = [minimize(depth, start, method="BFGS", options={"gtol": 1e-5}) for start in starts]
    best = min(found, key=lambda one: one.fun)
    options = {"xatol": 1e-9, "fatol": 1e-12, "maxiter": 2000}
    refined = minimize(depth, best.x, method="Nelder-Mead", options=options)
    return np.asarray(refined.x if refined.fun < best.fun else best.x)


# Gauss-Newton


@pytest.mark.parametrize("distortion", [(0.0, 0.0), BARREL])
@pytest.mark.parametrize("count", [1, 2, 4])
def test_of_normal_densities_the_optimum_is_found(count: int, distortion: Distortion, test_seed: int) -> None:
    """Gauss-Newton leaves out how residuals bend the projection: its fixed point is the optimum."""
    rng = np.random.default_rng((test_seed, count))
    for _ in range(3):
        place = CENTRE + 0.3 * rng.standard_normal(3)
        densities = []
        for camera in cameras(distortion)[:count]:
            root = rng.standard_normal((2, 2)) + 4.0 * np.eye(2)
            moved = place + 0.05 * rng.standard_normal(3)
            densities.append(single(camera, moved, root @ root.T))
        expected = best_of_scipy(PRIOR, densities, np.array([CENTRE, place]))
        found = best_place(PRIOR, densities)
        np.testing.assert_allclose(found.place, expected, atol=2e-5)
        assert height(found.place, PRIOR, densities) >= height(expected, PRIOR, densities) - 1e-9


def test_of_several_components_the_highest_of_the_tops_is_found(test_seed: int) -> None:
    """At least as high as the best of BFGS from a dozen starts."""
    rng = np.random.default_rng(test_seed)
    for _ in range(4):
        densities = [several(camera, rng) for camera in cameras()]
        starts = np.vstack(
            [PRIOR.mean, *[density.guides for density in densities], rng.normal(PRIOR.mean, 0.2, (3, 3))]
        )
        expected = best_of_scipy(PRIOR, densities, starts)
        found = best_place(PRIOR, densities)
        assert height(found.place, PRIOR, densities) >= height(expected, PRIOR, densities) - 1e-6


def test_a_lower_component_near_the_prediction_does_not_hide_a_higher_one() -> None:
    """From the prediction climbing ends at the near top; a guide leads to the far one, e¹⁰ as high."""
    far = CENTRE + [0.35, -0.3, 0.2]
    densities = []
    for camera in cameras():
        pixels, _ = camera.project(np.array([CENTRE, far]))
        mixture = GaussianMixture(np.array([-6.0, 0.0]), pixels, np.array([4.0 * np.eye(2)] * 2))
        densities.append(ImageDensity(camera, mixture, np.array([CENTRE, far])))
    found = best_place(PRIOR, densities)
    assert np.linalg.norm(found.place - far) < 0.02
    unguided = [ImageDensity(density.camera, density.mixture, np.empty((0, 3))) for density in densities]
    assert np.linalg.norm(best_place(PRIOR, unguided).place - CENTRE) < 0.02


def test_the_covariance_is_that_of_gauss_newton() -> None:
    """(Σ0⁻¹ + Σ Jᵀ R⁻¹ J)⁻¹, J by differences; with residuals of 0 that is the curvature at the top too."""
    covs = [np.diag([4.0, 9.0]), np.array([[9.0, 3.0], [3.0, 6.0]]), 16.0 * np.eye(2), np.diag([25.0, 1.0])]
    densities = [single(camera, CENTRE, cov) for camera, cov in zip(cameras(), covs, strict=True)]
    found = best_place(PRIOR, densities)
    np.testing.assert_allclose(found.place, CENTRE, atol=1e-9)
    information, h = np.linalg.inv(PRIOR.cov), 1e-5
    for camera, cov in zip(cameras(), covs, strict=True):
        jacobian = np.column_stack(
            [
                (seen(camera, CENTRE + h * axis) - seen(camera, CENTRE - h * axis)) / (2 * h)
                for axis in np.eye(3)
            ]
        )
        information = information + jacobian.T @ np.linalg.solve(cov, jacobian)
    np.testing.assert_allclose(found.cov, np.linalg.inv(information), rtol=1e-6)
    curvature, h = np.empty((3, 3)), 1e-4
    for i, one in enumerate(np.eye(3)):
        for j, other in enumerate(np.eye(3)):
            corners = [
                a * b * height(CENTRE + h * (a * one + b * other), PRIOR, densities)
                for a in (-1, 1)
                for b in (-1, 1)
            ]
            curvature[i, j] = -sum(corners) / (4.0 * h * h)
    np.testing.assert_allclose(found.cov, np.linalg.inv(curvature), rtol=1e-3)


def test_components_that_disagree_widen_the_covariance() -> None:
    camera = cameras()[0]
    apart = np.array([[-6.0, 0.0], [6.0, 0.0]]) + seen(camera, CENTRE)
    mixture = GaussianMixture(np.zeros(2), apart, np.array([25.0 * np.eye(2)] * 2))
    two = best_place(PRIOR, [ImageDensity(camera, mixture, np.empty((0, 3)))])
    one = best_place(PRIOR, [single(camera, CENTRE, 25.0 * np.eye(2))])
    joined = best_place(PRIOR, [single(camera, CENTRE, np.diag([61.0, 25.0]))])
    np.testing.assert_allclose(two.place, CENTRE, atol=1e-6)
    np.testing.assert_allclose(two.cov, joined.cov, rtol=1e-6)
    assert np.trace(two.cov) > np.trace(one.cov)


def test_without_a_density_the_prediction_is_the_best_place() -> None:
    for solver in ("gauss_newton", "printed"):
        found = best_place(PRIOR, [], solver)  # type: ignore[arg-type]
        np.testing.assert_allclose(found.place, PRIOR.mean, atol=1e-12)
        np.testing.assert_allclose(found.cov, PRIOR.cov, rtol=1e-12)


@pytest.mark.parametrize("off_px", [500.0, 5e4, 1e6])
def test_a_camera_that_is_sure_of_nonsense_leaves_finite_numbers(off_px: float) -> None:
    """A pixel far outside the image, known to a thousandth of a pixel; guides behind the camera."""
    camera = cameras()[0]
    mixture = GaussianMixture.single(np.array([off_px, -off_px]), 1e-6 * np.eye(2))
    behind = camera.position - camera.rotation[2]
    density = ImageDensity(camera, mixture, behind[None])
    found = best_place(PRIOR, [density, single(cameras()[1], CENTRE, np.eye(2))])
    assert np.isfinite(found.place).all()
    assert np.linalg.eigvalsh(found.cov).min() > 0.0
    assert camera.to_camera_axes(found.place[None])[0, 2] > 0.0


# The printed step


def share_of_the_way(place: np.ndarray, densities: list[ImageDensity]) -> float:
    """Return how much of the way from the prediction to the best place the printed step goes."""
    step = best_place(PRIOR, densities, "printed").place - PRIOR.mean
    whole = best_place(PRIOR, densities).place - PRIOR.mean
    return float(step @ whole / (whole @ whole))


def test_the_printed_step_goes_nearly_all_the_way_for_normal_densities(test_seed: int) -> None:
    """Its derivative is that at the prediction: the rest is of second order, 0.3 m at 4.5 m."""
    rng = np.random.default_rng(test_seed)
    for _ in range(10):
        place = CENTRE + 0.15 * rng.standard_normal(3)
        densities = [single(camera, place, 9.0 * np.eye(2)) for camera in cameras()]
        assert 0.85 < share_of_the_way(place, densities) < 1.15
        step, whole = (best_place(PRIOR, densities, solver).place for solver in ("printed", "gauss_newton"))  # type: ignore[arg-type]
        assert np.linalg.norm(step - whole) < 0.15 * np.linalg.norm(whole - CENTRE)


def test_what_the_printed_step_leaves_is_of_second_order() -> None:
    """Half the way leaves a quarter: its fixed point is the best place (equation 45, iterated)."""
    direction, left = np.array([0.2, -0.15, 0.1]), []
    for share in (0.2, 0.1, 0.05):
        densities = [single(camera, CENTRE + share * direction, 9.0 * np.eye(2)) for camera in cameras()]
        step, whole = (best_place(PRIOR, densities, solver).place for solver in ("printed", "gauss_newton"))  # type: ignore[arg-type]
        left.append(np.linalg.norm(step - whole))
    np.testing.assert_allclose(np.array(left[:-1]) / left[1:], 4.0, rtol=0.15)


def test_the_printed_step_is_exact_where_the_prediction_is_the_best_place_already() -> None:
    """Also of several components that pull against one another: nothing moves."""
    densities = []
    for camera in cameras():
        apart = np.array([[-5.0, 2.0], [5.0, -2.0]]) + seen(camera, CENTRE)
        mixture = GaussianMixture(np.zeros(2), apart, np.array([30.0 * np.eye(2)] * 2))
        densities.append(ImageDensity(camera, mixture, np.empty((0, 3))))
    np.testing.assert_allclose(best_place(PRIOR, densities, "printed").place, CENTRE, atol=1e-8)
    np.testing.assert_allclose(best_place(PRIOR, densities).place, CENTRE, atol=1e-6)


def test_of_several_components_the_printed_step_goes_anywhere() -> None:
    """A broad component about the prediction holds it back, though the sharp one elsewhere is higher."""
    place = CENTRE + [0.25, 0.2, -0.1]
    densities = []
    for camera in cameras():
        pixels = np.array([seen(camera, CENTRE), seen(camera, place)])
        mixture = GaussianMixture(np.log([0.5, 0.5]), pixels, np.array([200.0 * np.eye(2), 9.0 * np.eye(2)]))
        densities.append(ImageDensity(camera, mixture, np.array([CENTRE, place])))
    assert np.linalg.norm(best_place(PRIOR, densities).place - place) < 0.03
    assert share_of_the_way(place, densities) < 0.5


# What a message becomes


@pytest.mark.parametrize("distortion", [(0.0, 0.0), BARREL])
@pytest.mark.parametrize("prior", ["once", "every_camera"])
def test_a_message_becomes_a_density_of_the_pixel_of_the_targets_centre(
    prior: str, distortion: Distortion
) -> None:
    """N(0, I) times a likelihood N(z, r I) came; divided out, the likelihood is left."""
    camera = cameras(distortion)[0]
    there = Site({"c1": camera}, (box.target,), scene.RATE_HZ, 20, box.streams)
    state = StatePayload(0, 1, CENTRE, np.zeros(3), UPRIGHT)
    rule: MultiviewParams = scene.params(variant="T4", spread={"kind": "fixed"})
    proposal = propose(state, rule, there)
    prediction = image_prediction(camera, proposal, state, rule, there)
    assert prediction is not None
    z, r = np.array([0.6, -0.3]), 0.25
    posterior_in_u = GaussianMixture.single(z / (1.0 + r), r / (1.0 + r) * np.eye(2))
    place = Gaussian(proposal.mean, proposal.cov)
    density = ImageDensity.of(camera, prediction, posterior_in_u, prior, place)  # type: ignore[arg-type]
    root = np.linalg.cholesky(prediction.cov)
    mean, cov = (z, r * np.eye(2)) if prior == "once" else (z / (1.0 + r), r / (1.0 + r) * np.eye(2))
    centre = seen(camera, CENTRE)
    np.testing.assert_allclose(density.mixture.means[0], centre + root @ mean, atol=1e-9)
    np.testing.assert_allclose(density.mixture.covs[0], root @ cov @ root.T, atol=1e-9)
    # the guide is, to first order, a place that is seen there
    (guide,) = density.guides
    slope = camera.jacobians(CENTRE[None])[0]
    shift = root @ posterior_in_u.means[0]
    np.testing.assert_allclose(slope @ (guide - CENTRE), shift, atol=1e-9)
    assert np.linalg.norm(seen(camera, guide) - centre - shift) < 1.5


def test_a_density_as_wide_as_the_prediction_says_nothing() -> None:
    """Fitted mixtures may be a little wider than what they were drawn from: no division may fail."""
    there = Site(CAMERAS, (box.target,), scene.RATE_HZ, 20, box.streams)
    rule: MultiviewParams = scene.params(variant="T4", spread={"kind": "fixed"})
    state = StatePayload(0, 1, CENTRE, np.zeros(3), UPRIGHT)
    proposal = propose(state, rule, there)
    for width in (0.99, 1.0, 1.3, 50.0):
        reports = []
        for number, node in enumerate(CAMERAS):
            mixture = GaussianMixture.single(np.zeros(2), width * np.eye(2))
            said = MixturePayload(0, 1, mixture, (number,), 0.9, (np.empty(0),))
            reports.append(Report((node,), said))
        question = Question(state, proposal, Gaussian(np.zeros(6), np.eye(6)))
        found = posterior(rule, there, question, reports)
        np.testing.assert_allclose(found.position, CENTRE, atol=1e-3)
        # a variance of 0.98 leaves a likelihood 49 times as wide as the prediction: four add 4 · 2 %
        ratio = np.linalg.eigvalsh(np.linalg.solve(proposal.cov, found.cov)).real
        assert (ratio > 0.9).all()


def test_normal_posteriors_of_all_cameras_count_the_prediction_once() -> None:
    """Linear closed form: J of each camera, R its likelihood, and the prediction once."""
    there = Site(CAMERAS, (box.target,), scene.RATE_HZ, 20, box.streams)
    rule: MultiviewParams = scene.params(variant="T4", spread={"kind": "fixed"}, particle_sd_m=0.1)
    state = StatePayload(0, 1, CENTRE, np.zeros(3), UPRIGHT)
    proposal = propose(state, rule, there)
    information, reports, r = np.linalg.inv(proposal.cov), [], 0.3
    for number, (node, camera) in enumerate(CAMERAS.items()):
        prediction = image_prediction(camera, proposal, state, rule, there)
        assert prediction is not None
        mixture = GaussianMixture.single(np.zeros(2), r / (1.0 + r) * np.eye(2))
        reports.append(Report((node,), MixturePayload(0, 1, mixture, (number,), 0.9, (np.empty(0),))))
        jacobian = prediction.jacobian
        information = information + jacobian.T @ np.linalg.solve(r * prediction.cov, jacobian)
    question = Question(state, proposal, Gaussian(np.zeros(6), np.eye(6)))
    found = posterior(rule, there, question, reports)
    np.testing.assert_allclose(found.position, CENTRE, atol=1e-6)
    np.testing.assert_allclose(found.cov, np.linalg.inv(information), rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(found.prior.cov, proposal.cov)
