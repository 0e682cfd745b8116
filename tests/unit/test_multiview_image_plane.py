"""The prediction in a camera's image, particles about it, and the way back into space (T3, T4)."""

import runpy
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.geometry.lens import Distortion
from wsnsim.geometry.quadrics import ellipsoid_outlines
from wsnsim.messages.state import StatePayload
from wsnsim.systems.base import Site
from wsnsim.systems.multiview.image_proposal import (
    ImageProposal,
    image_prediction,
    image_spacing_variance,
    propose_in_image,
)
from wsnsim.systems.multiview.lifting import lifted
from wsnsim.systems.multiview.params import MultiviewParams
from wsnsim.systems.multiview.proposal import Proposal
from wsnsim.systems.multiview.whitening import Whitening

scene = SimpleNamespace(**runpy.run_path(str(Path(__file__).parents[1] / "multiview_scene.py")))
CENTRE, UPRIGHT, CAMERAS, SIZE = scene.CENTRE, scene.UPRIGHT, scene.CAMERAS, scene.SIZE
box = scene.Scene(5)
LENSES: tuple[Distortion, ...] = ((0.0, 0.0), (-0.25, 0.05), (0.3, 0.1))
TURN = np.array([[0.3, 0.0, 0.0], [0.02, 0.12, 0.0], [-0.05, 0.04, 0.15]])
"""Long at 45 degrees to the optical axes: depth and pixel go together."""
COV = TURN @ TURN.T


def params(**changes: object) -> MultiviewParams:
    return scene.params(**{"variant": "T3", **changes})  # type: ignore[no-any-return]


def lens(distortion: Distortion) -> PinholeCamera:
    return PinholeCamera.look_at((0.3, 0.6, 2.4), CENTRE, 300.0, SIZE, distortion)


def site(camera: PinholeCamera) -> Site:
    return Site({"c1": camera}, (box.target,), scene.RATE_HZ, 20, box.streams)


def state(place: np.ndarray) -> StatePayload:
    return StatePayload(0, 1, place, np.zeros(3), UPRIGHT)


def proposal(place: np.ndarray = CENTRE, cov: np.ndarray = COV) -> Proposal:
    return Proposal(place, cov, place[None])


def cloud(camera: PinholeCamera, asked: Proposal, rule: MultiviewParams) -> ImageProposal:
    there = site(camera)
    prediction = image_prediction(camera, asked, state(asked.mean), rule, there)
    assert prediction is not None
    return propose_in_image(prediction, 0, state(asked.mean), rule, there)


def nearly_equal_moments(points: np.ndarray, mean: np.ndarray, cov: np.ndarray, bias: float = 0.0) -> None:
    """Hold a sample's moments against what they must be: five standard errors, and a bias in sds."""
    count, sds = len(points), np.sqrt(np.diag(cov))
    assert (np.abs(points.mean(axis=0) - mean) < (5.0 / np.sqrt(count) + bias) * sds).all()
    # an element of a sample covariance has a variance of (Σ_ij² + Σ_ii Σ_jj) / n
    errors = np.sqrt((cov**2 + np.outer(sds**2, sds**2)) / count)
    assert (np.abs(np.cov(points.T) - cov) < 5.0 * errors + bias * np.outer(sds, sds)).all()


# The derivative of the projection


@pytest.mark.parametrize("distortion", LENSES)
def test_jacobians_are_the_derivatives_of_the_projection(distortion: Distortion, test_seed: int) -> None:
    """Central differences of 1e-5 m: their error is h² f''' / 6, below 1e-6 px/m; rounding gives 1e-7."""
    camera = lens(distortion)
    points = CENTRE + np.random.default_rng(test_seed).uniform(-0.7, 0.7, (100, 3))
    found, h = camera.jacobians(points), 1e-5
    assert found.shape == (100, 2, 3)
    for axis in range(3):
        shift = h * np.eye(3)[axis]
        slope = (camera.project(points + shift)[0] - camera.project(points - shift)[0]) / (2.0 * h)
        np.testing.assert_allclose(found[:, :, axis], slope, atol=1e-5)
    assert np.isfinite(found).all()


@pytest.mark.parametrize("distortion", LENSES)
def test_behind_the_camera_there_is_no_derivative(distortion: Distortion) -> None:
    camera = lens(distortion)
    ahead = camera.rotation[2]
    points = camera.position + np.array([2.0 * ahead, -2.0 * ahead, 0.0 * ahead])
    found = camera.jacobians(points)
    assert np.isfinite(found[0]).all()
    assert np.isnan(found[1:]).all()


def test_a_ray_leads_back_to_its_pixel() -> None:
    """Along the ray nothing moves in the image: J times the ray is 0."""
    for distortion in LENSES:
        camera = lens(distortion)
        places = CENTRE + np.random.default_rng(0).uniform(-0.5, 0.5, (20, 3))
        rays = camera.rays(camera.project(places)[0]) @ camera.rotation
        slopes = np.einsum("nij,nj->ni", camera.jacobians(places), rays)
        np.testing.assert_allclose(slopes, 0.0, atol=1e-7)


# The prediction in the image


@pytest.mark.parametrize("distortion", LENSES)
def test_the_prediction_in_the_image_has_the_moments_of_its_samples(distortion: Distortion) -> None:
    """Spread by 2 cm, a two-hundredth of the distance, where the projection is linear to 1 %."""
    camera, small = lens(distortion), 0.01 * COV
    asked = proposal(cov=small)
    prediction = image_prediction(camera, asked, state(CENTRE), params(), site(camera))
    assert prediction is not None
    generator = np.random.default_rng(0)
    places = CENTRE + 0.1 * generator.standard_normal((20_000, 3)) @ TURN.T
    outlines = ellipsoid_outlines(camera, places, UPRIGHT, box.target.semi_axes_m)
    blur = 0.5 * generator.standard_normal((20_000, 2))
    nearly_equal_moments(outlines.centres + blur, prediction.mean, prediction.cov, bias=0.02)
    (pixel,), _ = camera.project(CENTRE[None])
    np.testing.assert_allclose(prediction.mean - prediction.offset, pixel, atol=1e-9)
    assert 0.01 < np.linalg.norm(prediction.offset) < 3.0


def test_the_projected_spread_is_the_focal_length_over_the_distance() -> None:
    """f σ / z, and half a pixel: 300 · 0.2 / 4.55 = 13 px on the optical axis."""
    camera = CAMERAS["c1"]
    distance = float(np.linalg.norm(CENTRE - camera.position))
    asked = proposal(cov=0.04 * np.eye(3))
    prediction = image_prediction(camera, asked, state(CENTRE), params(), site(camera))
    assert prediction is not None
    expected = (300.0 * 0.2 / distance) ** 2 + 0.25
    np.testing.assert_allclose(prediction.cov, expected * np.eye(2), atol=1e-9)


def test_a_fixed_spread_is_what_was_asked_for_near_or_far() -> None:
    rule = params(image_spread={"kind": "fixed", "sd_px": 25.0})
    for distance in (1.0, 3.0, 10.0):
        camera = CAMERAS["c1"]
        place = camera.position + distance * camera.rotation[2]
        prediction = image_prediction(camera, proposal(place), state(place), rule, site(camera))
        assert prediction is not None
        np.testing.assert_allclose(prediction.cov, (25.0**2 + 0.25) * np.eye(2))


@pytest.mark.parametrize("depth", [-3.0, -0.1, 0.0, 0.2, 0.27])
def test_a_target_behind_the_camera_or_cut_by_its_plane_has_no_prediction_in_the_image(depth: float) -> None:
    camera = PinholeCamera.look_at((0.0, 0.0, 1.0), (1.0, 0.0, 1.0), 300.0, SIZE)
    place = camera.position + depth * camera.rotation[2]
    assert image_prediction(camera, proposal(place), state(place), params(), site(camera)) is None
    # the camera looks along x, where the target reaches 0.40 m
    before = camera.position + 0.41 * camera.rotation[2]
    assert image_prediction(camera, proposal(before), state(before), params(), site(camera)) is not None


def test_every_camera_draws_particles_of_its_own_and_the_same_each_time() -> None:
    camera, asked, rule = CAMERAS["c1"], proposal(), params(image_particles=50)
    there = site(camera)
    prediction = image_prediction(camera, asked, state(CENTRE), rule, there)
    assert prediction is not None
    one, same, other = (propose_in_image(prediction, node, state(CENTRE), rule, there) for node in (0, 0, 1))
    np.testing.assert_array_equal(one.particles, same.particles)
    assert one.particles.shape == (50, 2)
    assert not np.allclose(one.particles, other.particles)
    np.testing.assert_array_equal(one.outlines.centres, one.particles)
    np.testing.assert_array_equal(one.outlines.shapes, np.broadcast_to(prediction.shape, (50, 2, 2)))
    assert one.outlines.visible.all()


def test_particles_in_the_image_are_normal_about_the_prediction() -> None:
    drawn = cloud(CAMERAS["c1"], proposal(), params(image_particles=20_000))
    nearly_equal_moments(drawn.particles, drawn.prediction.mean, drawn.prediction.cov)
    white = Whitening(drawn.prediction.mean, drawn.root).whitened(drawn.particles)
    squares = (white**2).sum(axis=1)
    assert stats.kstest(squares, "chi2", args=(2,)).pvalue > 1e-4


def test_what_the_particles_in_an_image_resolve() -> None:
    """(1.25 σ / √M)², σ³ the product of the standard deviations."""
    asked = proposal(cov=np.diag([0.1, 0.2, 0.4]) ** 2)
    found = image_spacing_variance(asked, params(image_particles=400))
    assert found == pytest.approx((1.25 * 0.2 / 20.0) ** 2)


# Back into space


@pytest.mark.parametrize("distortion", LENSES)
def test_lifted_particles_are_spread_as_the_prediction_is(distortion: Distortion) -> None:
    """A cloud of 1 to 3 cm at 4.5 m: the ray bends nothing by more than a hundredth of a standard deviation.

    The half pixel that is added to every spread is 7.5 mm there: it is taken out of what is expected.
    """
    camera = lens(distortion)
    asked = proposal(cov=0.01 * COV)
    drawn = cloud(camera, asked, params(image_particles=20_000))
    points, work = lifted(drawn, camera, asked)
    jacobian = drawn.prediction.jacobian
    gain = asked.cov @ jacobian.T @ np.linalg.inv(jacobian @ asked.cov @ jacobian.T)
    nearly_equal_moments(points, CENTRE, asked.cov + 0.25 * gain @ gain.T, bias=0.02)
    assert work.float_ops > 0.0


def test_of_a_wide_cloud_too_moments_are_close_to_the_predictions() -> None:
    """20 cm at 4.5 m: the ray's bend is of second order, a twentieth of a standard deviation."""
    camera, asked = CAMERAS["c1"], proposal()
    points, _ = lifted(cloud(camera, asked, params(image_particles=20_000)), camera, asked)
    nearly_equal_moments(points, CENTRE, COV, bias=0.06)


@pytest.mark.parametrize("distortion", LENSES)
def test_a_lifted_particle_lies_on_the_ray_of_its_pixel(distortion: Distortion) -> None:
    """That of the target's centre, which is not the outline's."""
    camera, asked = lens(distortion), proposal()
    drawn = cloud(camera, asked, params(image_particles=200))
    points, _ = lifted(drawn, camera, asked)
    pixels, depths = camera.project(points)
    np.testing.assert_allclose(pixels, drawn.particles - drawn.prediction.offset, atol=1e-6)
    assert (depths > 0.0).all()


def test_particles_beyond_the_lens_or_behind_the_camera_stay_finite() -> None:
    """A cloud of 1.5 m, 0.6 m before a camera; a fixed spread far wider than a strongly bent image."""
    near = CAMERAS["c1"].position + 0.6 * CAMERAS["c1"].rotation[2]
    asked = proposal(near, 2.25 * np.eye(3))
    points, _ = lifted(cloud(CAMERAS["c1"], asked, params(image_particles=500)), CAMERAS["c1"], asked)
    assert (CAMERAS["c1"].to_camera_axes(points)[:, 2] >= 0.05 * 0.6 - 1e-12).all()
    barrel, asked = lens((-0.25, 0.0)), proposal()
    rule = params(image_particles=500, image_spread={"kind": "fixed", "sd_px": 400.0})
    drawn = cloud(barrel, asked, rule)
    assert np.isnan(barrel.rays(drawn.particles)).any()
    points, _ = lifted(drawn, barrel, asked)
    assert np.isfinite(points).all()


def test_a_long_and_thin_prediction_is_lifted_too() -> None:
    """Depth unknown to 1.5 m, across the ray 6 mm: what one camera leaves."""
    camera = CAMERAS["c1"]
    ahead = camera.rotation[2]
    thin = (1.5 / 254.0) ** 2 * (np.eye(3) - np.outer(ahead, ahead)) + 1.5**2 * np.outer(ahead, ahead)
    asked = proposal(cov=thin)
    points, _ = lifted(cloud(camera, asked, params(image_particles=5000)), camera, asked)
    along = (points - CENTRE) @ ahead
    # cut at a twentieth of 4.5 m of depth, 2.8 standard deviations away: nothing to see of it here
    assert abs(along.std() - 1.5) < 5.0 * 1.5 / np.sqrt(2 * 5000) + 0.02
    white = Whitening.of(asked.mean, asked.cov).whitened(points)
    assert np.isfinite(white).all()
