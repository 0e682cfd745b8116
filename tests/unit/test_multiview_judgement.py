"""What a camera says of particles: weights of each kind of likelihood, and images that say nothing."""

import runpy
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.messages.numbers import ENCODINGS
from wsnsim.messages.weights import WeightsPayload
from wsnsim.systems.multiview.judgement import Judgement, judge
from wsnsim.systems.multiview.params import MultiviewParams
from wsnsim.systems.multiview.proposal import Proposal
from wsnsim.systems.multiview.sight import facing_viewpoint, look
from wsnsim.systems.multiview.similarity import view_similarities
from wsnsim.vision.features import FeatureSpace

scene = SimpleNamespace(**runpy.run_path(str(Path(__file__).parents[1] / "multiview_scene.py")))
CAMERAS, CENTRE, UPRIGHT = scene.CAMERAS, scene.CENTRE, scene.UPRIGHT
box = scene.Scene(5)
KINDS = ("raw", "bhattacharyya", "log_ratio")


def cloud(mean: np.ndarray, count: int = 300, sd: float = 0.25, seed: int = 0) -> Proposal:
    draws = np.random.default_rng(seed).standard_normal((count, 3))
    return Proposal(mean, sd**2 * np.eye(3), mean + sd * draws)


def judged(
    image: np.ndarray,
    camera: PinholeCamera,
    proposal: Proposal,
    rule: MultiviewParams,
    who: object = box,
) -> Judgement:
    features = FeatureSpace(rule.colour_space)
    semi_axes, (model,) = who.body.semi_axes_m, who.models(rule.colour_space)  # type: ignore[attr-defined]
    sight = look(image, camera, proposal.particles, UPRIGHT, semi_axes, features)
    view = facing_viewpoint(model, camera, proposal.mean, UPRIGHT)
    return judge(sight, model.sqrt_colour[view], model.sqrt_texture[view], rule)


def across(camera: PinholeCamera, points: np.ndarray, place: np.ndarray = CENTRE) -> np.ndarray:
    """Return how far points are beside the ray to a place [m]."""
    axis = (place - camera.position) / np.linalg.norm(place - camera.position)
    offsets = points - place
    return np.linalg.norm(offsets - np.outer(offsets @ axis, axis), axis=1)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("space", ["hs", "hsv"])
def test_particles_near_the_target_weigh_most(kind: str, space: str) -> None:
    rule = scene.params(likelihood={"kind": kind}, colour_space=space)
    proposal = cloud(CENTRE, 600)
    says = judged(box.image("c1", photo=True), CAMERAS["c1"], proposal, rule)
    aside = across(CAMERAS["c1"], proposal.particles)
    assert says.weights[aside < 0.1].mean() > 1.2 * says.weights[aside > 0.4].mean()
    assert aside[np.argmax(says.weights)] < 0.15
    assert says.similarity > 0.5
    assert says.work.int_ops > 0
    if kind != "raw":
        assert says.weights.max() == 1.0
        mean = says.weights @ proposal.particles / says.weights.sum()
        assert across(CAMERAS["c1"], mean[None])[0] < 0.15


def test_a_sharper_likelihood_is_a_power_of_the_other() -> None:
    """exp(λ s) to the power μ/λ is exp(μ s)."""
    image, proposal = box.image("c1", photo=True), cloud(CENTRE)
    for kind in ("bhattacharyya", "log_ratio"):
        one, other = (
            judged(
                image,
                CAMERAS["c1"],
                proposal,
                scene.params(likelihood={"kind": kind, "sharpness": sharpness}),
            ).weights
            for sharpness in (2.0, 6.0)
        )
        np.testing.assert_allclose(one**3, other, rtol=1e-9)


def test_raw_weights_are_the_similarity() -> None:
    """And sharpened ones its exponential, relative to the best."""
    image, proposal = box.image("c1", photo=True), cloud(CENTRE)
    raw = judged(image, CAMERAS["c1"], proposal, scene.params(likelihood={"kind": "raw"}))
    assert raw.weights.max() == raw.similarity
    sharpened = judged(
        image, CAMERAS["c1"], proposal, scene.params(likelihood={"kind": "bhattacharyya", "sharpness": 9.0})
    )
    assert sharpened.similarity == raw.similarity
    np.testing.assert_allclose(sharpened.weights, np.exp(9.0 * (raw.weights - raw.weights.max())))


ODD = {
    "no particle in the image": (CAMERAS["c1"], CENTRE + [-9.0, 7.0, 0.0], None),
    "all behind the camera": (CAMERAS["c1"], CAMERAS["c1"].position + [-3.0, -3.0, 1.0], None),
    "cut by the image's border": (CAMERAS["c1"], CENTRE + [-1.9, 1.9, 0.0], None),
    "round the camera itself": (CAMERAS["c1"], CAMERAS["c1"].position, None),
    "cut by the camera's plane": (scene.camera(3.5, 3.2, 1.1), CENTRE, None),
    "so far that they are points": (CAMERAS["c1"], CENTRE + 400.0 * CAMERAS["c1"].rotation[2], None),
    "an image of one colour": (CAMERAS["c1"], CENTRE, np.full((240, 320, 3), 77, np.uint8)),
    "a black image": (CAMERAS["c1"], CENTRE, np.zeros((240, 320, 3), np.uint8)),
    "a white image": (CAMERAS["c1"], CENTRE, np.full((240, 320, 3), 255, np.uint8)),
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("odd", ODD)
@pytest.mark.parametrize("colour_share", [0.0, 0.7, 1.0])
def test_weights_are_positive_and_finite_whatever_there_is_to_see(
    kind: str, odd: str, colour_share: float
) -> None:
    camera, mean, image = ODD[odd]
    rule = scene.params(likelihood={"kind": kind}, colour_share=colour_share)
    says = judged(box.image("c1") if image is None else image, camera, cloud(mean), rule)
    assert says.weights.shape == (300,)
    assert np.isfinite(says.weights).all()
    assert says.weights.min() > 0.0
    assert 0.0 <= says.similarity <= 1.0
    for encoding in ENCODINGS:
        sent = WeightsPayload(0, 1, says.weights, says.similarity, encoding=encoding)
        assert WeightsPayload.decode(sent.encode()).weights.size == 300


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("odd", ["no particle in the image", "all behind the camera"])
def test_an_image_that_shows_no_particle_tells_them_not_apart(kind: str, odd: str) -> None:
    camera, mean, _ = ODD[odd]
    says = judged(box.image("c1"), camera, cloud(mean), scene.params(likelihood={"kind": kind}))
    assert np.ptp(says.weights) == 0.0
    assert says.similarity == 0.0


@pytest.mark.parametrize("kind", KINDS)
def test_a_particle_out_of_the_image_is_neither_proved_nor_ruled_out(kind: str) -> None:
    """The target is seen elsewhere or not: what lies beside the image weighs between the extremes."""
    rule = scene.params(likelihood={"kind": kind})
    inside = cloud(CENTRE, 200).particles
    outside = cloud(CENTRE + [-9.0, 7.0, 0.0], 50).particles
    proposal = Proposal(CENTRE, np.eye(3), np.concatenate([inside, outside]))
    says = judged(box.image("c1", photo=True), CAMERAS["c1"], proposal, rule)
    beside = says.weights[200:]
    assert np.ptp(beside) == 0.0
    assert says.weights[:200].min() < beside[0] < says.weights[:200].max()


@cache
def best_particles() -> np.ndarray:
    """Return how far the best particle is beside the target [m], (images, kinds), over 32 images."""
    rows = []
    for seed in range(8):
        who = scene.Scene(20 + seed)
        for number, node in enumerate(CAMERAS):
            place = CENTRE + np.random.default_rng(100 * seed + number).uniform(-0.4, 0.4, 3)
            image = who.image(node, 1, place, photo=True)
            proposal = cloud(place, 1000, 0.2, seed)
            row = []
            for kind in ("bhattacharyya", "log_ratio"):
                rule = scene.params(likelihood={"kind": kind})
                weights = judged(image, CAMERAS[node], proposal, rule, who).weights
                row.append(across(CAMERAS[node], proposal.particles, place)[np.argmax(weights)])
            rows.append(row)
    return np.array(rows)


def test_single_pixels_tell_the_place_more_sharply_than_histograms() -> None:
    """Paired over 32 images: the best particle is nearer to the target's ray by log ratio, p < .001."""
    histograms, pixels = best_particles().T
    gained = histograms - pixels
    assert gained.mean() / (gained.std(ddof=1) / np.sqrt(gained.size)) > 3.375  # Student's t, 31 degrees
    assert np.median(pixels) < 0.7 * np.median(histograms)


def test_the_viewpoint_that_is_seen_fits_best() -> None:
    """Seen from each of its own viewpoints the target is most like that one, or a neighbour."""
    (model,) = box.models()
    features = FeatureSpace("hsv")
    right = 0
    for index, direction in enumerate(model.directions):
        camera = PinholeCamera.look_at(CENTRE + 4.0 * direction, CENTRE, 300.0, scene.SIZE)
        renderer = scene.Renderer(camera, "v", scene.GREY, 5.0, 0.02, scene.LIGHT, 0.6, box.streams)
        image = renderer.render(1, [box.body], [scene.Pose(CENTRE, np.zeros(3), UPRIGHT)])
        sight = look(image, camera, CENTRE[None], UPRIGHT, box.body.semi_axes_m, features)
        rho, work = view_similarities(sight, model, features, 0.7)
        assert rho.shape == (26,)
        assert work.float_ops > 0
        best = int(np.argmax(rho))
        right += best == index
        assert model.directions[best] @ direction > 0.7
    assert right >= 24


def test_a_target_out_of_the_image_is_like_no_viewpoint() -> None:
    (model,) = box.models()
    features = FeatureSpace("hsv")
    behind = CAMERAS["c1"].position + [-3.0, -3.0, 1.0]
    sight = look(box.image("c1"), CAMERAS["c1"], behind[None], UPRIGHT, box.body.semi_axes_m, features)
    rho, work = view_similarities(sight, model, features, 0.7)
    assert not rho.any()
    assert work.int_ops == 0
