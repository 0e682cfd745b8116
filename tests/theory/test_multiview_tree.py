"""Fusion on a tree, as T2's relays and base station do it: equal to the flat product, whatever the tree.

Without reduction the posterior of N cameras is the product of their densities with the
prediction counted once (Kushwaha & Koutsoukos 2013, Eq. 30, mended). Expected values are
closed forms of normal densities, or the product multiplied out at points.
"""

import runpy
from dataclasses import replace
from itertools import permutations
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from wsnsim.estimation.kalman import Gaussian
from wsnsim.estimation.mixtures import GaussianMixture
from wsnsim.messages.base import decode_any
from wsnsim.messages.mixture import MixturePayload
from wsnsim.messages.state import StatePayload
from wsnsim.systems.base import GroupKey, Received, Site
from wsnsim.systems.multiview import t1, t2, t3
from wsnsim.systems.multiview.params import MultiviewParams
from wsnsim.systems.multiview.proposal import propose
from wsnsim.systems.multiview.relay import RelayProgram
from wsnsim.systems.multiview.system import SYSTEM
from wsnsim.systems.multiview.variants import Posterior, Question, Report
from wsnsim.systems.multiview.whitening import Whitening

scene = SimpleNamespace(**runpy.run_path(str(Path(__file__).parents[1] / "multiview_scene.py")))
CENTRE, UPRIGHT, at = scene.CENTRE, scene.UPRIGHT, scene.at
box = scene.Scene(5)
NODES = {f"c{number}": scene.camera(0.3 + number, 0.6, 2.4) for number in range(8)}
SITE = Site(NODES, (box.target,), scene.RATE_HZ, 20, box.streams)

Tree = int | tuple["Tree", ...]


def params(**mixtures: object) -> MultiviewParams:
    """Return parameters with so many components that four pairs need no reduction."""
    return scene.params(  # type: ignore[no-any-return]
        variant="T2", particles=50, mixtures={"components": 16, **mixtures}, particle_sd_m=0.3
    )


def message(camera: int, order: int, seed: int = 0) -> MixturePayload:
    """Return what one camera says: components of a half to a tenth of the prediction's width."""
    generator = np.random.default_rng((seed, camera))
    turns, _ = np.linalg.qr(generator.standard_normal((order, 3, 3)))
    variances = generator.uniform(0.1, 0.6, (order, 1, 3)) ** 2
    mixture = GaussianMixture(
        generator.uniform(-2.0, 0.0, order),
        0.4 * generator.standard_normal((order, 3)),
        (turns * variances) @ turns.transpose(0, 2, 1),
    )
    return MixturePayload(0, 1, mixture, (camera,), 0.9, (np.empty(0),))


def climbed(tree: Tree, rule: MultiviewParams, order: int, seed: int = 0, name: str = "r") -> MixturePayload:
    """Return what a tree of relays makes of the cameras' messages, each encoded on its way."""
    if isinstance(tree, int):
        return message(tree, order, seed)
    parts = []
    for number, child in enumerate(tree):
        data = climbed(child, rule, order, seed, f"{name}{number}").encode()
        parts.append(Received(f"n{number}", decode_any(data, SYSTEM.payloads)))
    fused = RelayProgram(rule, SITE, name).aggregate(at(0.3), GroupKey(1), parts).payload
    assert isinstance(fused, MixturePayload)
    return fused


def asked() -> Question:
    turn = np.array([[0.3, 0.0, 0.0], [0.1, 0.25, 0.0], [-0.05, 0.08, 0.35]])
    state = StatePayload(0, 1, CENTRE, np.array([0.4, -0.2, 0.0]), UPRIGHT, turn[np.tril_indices(3)])
    return Question(state, propose(state, params(), SITE), Gaussian(np.zeros(6), np.eye(6)))


def at_base(rule: MultiviewParams, *payloads: MixturePayload) -> Posterior:
    reports = [Report(tuple(f"c{number}" for number in said.cameras), said) for said in payloads]
    return t2.VARIANT.posterior(rule, SITE, asked(), reports)


def multiplied_out(order: int, cameras: tuple[int, ...], priors: int = 1, seed: int = 0) -> GaussianMixture:
    """Return the product, component by component in information form; N(0, I) in it `priors` times."""
    logs, means, covs = [], [], []
    mixtures = [message(camera, order, seed).mixture for camera in cameras]
    for choice in np.ndindex(*([order] * len(cameras))):
        spare = (len(cameras) - priors) * np.eye(3)
        information, pull, constant = -spare, np.zeros(3), 0.0
        for mixture, index in zip(mixtures, choice, strict=True):
            inverse, mean = np.linalg.inv(mixture.covs[index]), mixture.means[index]
            information, pull = information + inverse, pull + inverse @ mean
            constant += mixture.log_weights[index] + 0.5 * np.linalg.slogdet(inverse)[1]
            constant -= 0.5 * mean @ inverse @ mean
        cov = np.linalg.inv(information)
        logs.append(constant + 0.5 * pull @ cov @ pull + 0.5 * np.linalg.slogdet(cov)[1])
        means.append(cov @ pull)
        covs.append(0.5 * (cov + cov.T))
    return GaussianMixture(np.array(logs), np.array(means), np.array(covs))


TREES: dict[str, Tree] = {
    "flat": (0, 1, 2, 3),
    "chain": (0, (1, (2, 3))),
    "chain, the other way": (((0, 1), 2), 3),
    "two pairs": ((0, 2), (1, 3)),
    "relays of one child": ((((0,), 1),), ((2,), (3,))),
}


@pytest.mark.parametrize("tree", TREES.values(), ids=TREES)
def test_a_tree_equals_the_flat_product(tree: Tree) -> None:
    expected = multiplied_out(2, (0, 1, 2, 3))
    fused = climbed(tree, params(), 2)
    assert fused.cameras == (0, 1, 2, 3)
    assert fused.mixture.order == 16
    for found, wanted in zip(fused.mixture.mean_and_cov(), expected.mean_and_cov(), strict=True):
        np.testing.assert_allclose(found, wanted, atol=1e-10)
    # not its moments only: the density itself, up to the constant that nobody needs
    points = np.random.default_rng(0).standard_normal((50, 3))
    apart = fused.mixture.log_density(points) - expected.log_density(points)
    np.testing.assert_allclose(apart - apart[0], 0.0, atol=1e-8)


def test_the_order_of_fusion_does_not_matter() -> None:
    """Nor whether the last relays' messages meet at a relay or at the base station."""
    results = [at_base(params(), climbed(order, params(), 2)) for order in permutations(range(4))]
    results += [
        at_base(params(), *(climbed(part, params(), 2) for part in parts))
        for parts in ((0, 1, 2, 3), (3, 1, 0, 2), ((0, 1), (2, 3)), ((1, (3, 0)), 2))
    ]
    for result in results[1:]:
        np.testing.assert_allclose(result.position, results[0].position, atol=1e-10)
        np.testing.assert_allclose(result.cov, results[0].cov, atol=1e-10)


def test_the_base_station_reads_the_product_in_metres() -> None:
    question = asked()
    proposal = question.proposal
    frame = Whitening.of(proposal.mean, proposal.cov)
    mean, cov = multiplied_out(2, (0, 1, 2, 3)).mean_and_cov()
    found = at_base(params(), climbed(((0, 1), (2, 3)), params(), 2))
    np.testing.assert_allclose(found.position, proposal.mean + frame.root @ mean, atol=1e-10)
    np.testing.assert_allclose(found.cov, frame.root @ cov @ frame.root.T, atol=1e-10)
    np.testing.assert_allclose(found.prior.mean, proposal.mean)
    np.testing.assert_allclose(found.prior.cov, proposal.cov)
    for other in (t1.VARIANT, t3.VARIANT):
        reports = [Report((f"c{number}",), message(number, 2)) for number in range(4)]
        same = other.posterior(params(), SITE, question, reports)
        np.testing.assert_allclose(same.position, found.position, atol=1e-10)


@pytest.mark.parametrize("count", [1, 2, 4, 8])
@pytest.mark.parametrize("prior", ["once", "every_camera"])
def test_normal_densities_count_the_prediction_once_or_once_a_camera(prior: str, count: int) -> None:
    """Each density is N(0, I) times a likelihood N(z, R): (k I + Σ R⁻¹)⁻¹ with k of 1, or N as printed."""
    generator = np.random.default_rng(count)
    likelihoods, parts = [], []
    for camera in range(count):
        root = generator.standard_normal((3, 3)) + np.eye(3)
        noise, seen = root @ root.T + 0.05 * np.eye(3), generator.standard_normal(3)
        information = np.eye(3) + np.linalg.inv(noise)
        cov = np.linalg.inv(information)
        mixture = GaussianMixture.single(cov @ np.linalg.solve(noise, seen), 0.5 * (cov + cov.T))
        parts.append(replace(message(camera, 1), mixture=mixture))
        likelihoods.append((seen, noise))
    rule = params(prior=prior)
    tree = [Received("n", part) for part in parts]
    half = count // 2
    heads = [tree] if count == 1 else [tree[:half], tree[half:]]
    fused = [RelayProgram(rule, SITE, "r").aggregate(at(0.3), GroupKey(1), head).payload for head in heads]
    found = at_base(rule, *fused)  # type: ignore[arg-type]
    times = 1 if prior == "once" else count
    information = times * np.eye(3) + sum(np.linalg.inv(noise) for _, noise in likelihoods)
    cov = np.linalg.inv(information)
    mean = cov @ sum(np.linalg.solve(noise, seen) for seen, noise in likelihoods)
    proposal = asked().proposal
    root = Whitening.of(proposal.mean, proposal.cov).root
    np.testing.assert_allclose(found.cov, root @ cov @ root.T, atol=1e-10)
    np.testing.assert_allclose(found.position, proposal.mean + root @ mean, atol=1e-10)


def test_a_lost_child_costs_its_own_camera_only() -> None:
    """Whichever is lost, the rest is what it would have been without that camera."""
    rule = params()
    for lost in range(4):
        rest = tuple(camera for camera in range(4) if camera != lost)
        fused = climbed((tuple(camera for camera in (0, 1) if camera != lost), (rest[-1],)), rule, 2)
        expected = multiplied_out(2, fused.cameras)
        for found, wanted in zip(fused.mixture.mean_and_cov(), expected.mean_and_cov(), strict=True):
            np.testing.assert_allclose(found, wanted, atol=1e-10)
        assert lost not in fused.cameras


def test_a_late_child_that_comes_by_itself_is_fused_at_the_base_station() -> None:
    rule = params()
    found = at_base(rule, climbed((0, (2, 3)), rule, 2), message(1, 2))
    everyone = at_base(rule, climbed((0, 1, 2, 3), rule, 2))
    np.testing.assert_allclose(found.position, everyone.position, atol=1e-10)
    np.testing.assert_allclose(found.cov, everyone.cov, atol=1e-10)


@pytest.mark.parametrize("count", [2, 4, 8])
def test_nees_of_a_linear_gaussian_tree_is_inside_its_band(count: int) -> None:
    """Truth ~ N(0, I), z = x + v: the mean of 300 NEES of 3 coordinates is 3 ± 1.96 √(6 / 300) in 95 %."""
    generator = np.random.default_rng((0, count))
    mended, as_printed = params(), params(prior="every_camera")
    scores: list[float] = []
    printed: list[float] = []
    proposal = asked().proposal
    root = Whitening.of(proposal.mean, proposal.cov).root
    for run in range(300):
        truth = generator.standard_normal(3)
        parts = []
        for camera in range(count):
            noise = np.diag(generator.uniform(0.2, 1.0, 3) ** 2) * 4.0
            seen = truth + np.sqrt(np.diag(noise)) * generator.standard_normal(3)
            cov = np.linalg.inv(np.eye(3) + np.linalg.inv(noise))
            mixture = GaussianMixture.single(cov @ np.linalg.solve(noise, seen), cov)
            parts.append(replace(message(camera, 1), mixture=mixture))
        for rule, into in ((mended, scores), *(((as_printed, printed),) if run < 50 else ())):
            found = at_base(rule, *parts)
            apart = found.position - (proposal.mean + root @ truth)
            into.append(apart @ np.linalg.solve(found.cov, apart))
    assert abs(np.mean(scores) - 3.0) < 1.96 * np.sqrt(6.0 / 300)
    # the printed form believes itself too much the more cameras there are
    assert np.mean(printed) > np.mean(scores) + 4.0 * np.sqrt(6.0 / 50)


@pytest.mark.parametrize(("estimator", "place"), [("mmse", -0.6), ("map", -1.0), ("mle", 1.0)])
def test_the_estimator_is_what_its_name_says(estimator: str, place: float) -> None:
    """Mean, highest mode, and the component where density over prediction is largest, of two far apart.

    The first has 0.8 of the mass; at the second the prediction is e⁻² of what it is at the first,
    so that over the prediction the second is higher, 0.2 e² against 0.8.
    """
    rule = params().model_copy(update={"estimator": estimator})
    means = np.array([[-1.0, 0.0, 0.0], [1.0, 2.0, 0.0]])
    mixture = GaussianMixture(np.log([0.8, 0.2]), means, np.array([0.01 * np.eye(3)] * 2))
    found = at_base(rule, replace(message(0, 2), mixture=mixture))
    frame = Whitening.of(asked().proposal.mean, asked().proposal.cov)
    np.testing.assert_allclose(frame.whitened(found.position[None])[0, 0], place, atol=1e-6)


def test_a_map_estimate_is_the_highest_point_of_the_product() -> None:
    rule = params().model_copy(update={"estimator": "map"})
    density = multiplied_out(2, (0, 1))
    found = at_base(rule, climbed((0, 1), rule, 2))
    frame = Whitening.of(asked().proposal.mean, asked().proposal.cov)
    place = frame.whitened(found.position[None])
    around = place + 0.02 * np.random.default_rng(0).standard_normal((2000, 3))
    assert density.log_density(place)[0] >= density.log_density(around).max()
    far = np.random.default_rng(1).standard_normal((20_000, 3))
    assert density.log_density(place)[0] >= density.log_density(far).max()
