"""Particle filters against the optimum on recorded bearings, and against a Kalman filter."""

from dataclasses import dataclass

import numpy as np
import pytest

from wsnsim.estimation.kalman import Gaussian, predict, update
from wsnsim.estimation.particle_filter import Lost, Particles, auxiliary_step, plain_step, systematic


@dataclass(frozen=True, eq=False)
class Points:
    values: np.ndarray

    def take(self, indices):
        return Points(self.values[indices])


def step_of(kind, generator, particles, expected, noise, log_density, **options):
    """Take one step of a filter whose states move to `expected` plus `noise`."""

    def propagate(points):
        return Points(expected(points.values) + noise(len(points.values)))

    def weigh(points):
        return log_density(points.values)

    if kind == "plain":
        return plain_step(generator, particles, propagate, weigh, **options)
    return auxiliary_step(
        generator, particles, lambda points: Points(expected(points.values)), propagate, weigh, **options
    )


def stays(x):
    return x


def still(count):
    return 0.0


def equal(values):
    return Particles(Points(values), np.full(len(values), 1.0 / len(values)))


@pytest.mark.parametrize("kind", ["plain", "auxiliary"])
@pytest.mark.parametrize("model", ["rw", "cv"])
def test_recorded_bearings(shared, test_seed, kind, model):
    """A peer's filters reach .848 and .846 on the random walk, .756 and .754 with a velocity; ours ± 2 %."""
    data = np.load(shared / "reference" / "tracking" / f"bearings_{model}.npz")
    generator = np.random.default_rng(test_seed)
    sensors, sd, q, dt = data["sensors"], float(data["sigma"]), float(data["q"]), float(data["dt"])
    runs = data["z"] if model == "cv" else data["z"][np.newaxis]
    truths = data["pos"] if model == "cv" else data["pos"][np.newaxis]
    squares = []
    for bearings, truth in zip(runs, truths, strict=True):
        size = len(data["x0_mean"])
        particles = equal(data["x0_mean"] + data["x0_std"] * generator.standard_normal((1000, size)))
        if model == "rw":

            def expected(x):
                return x

            def noise(count):
                return q * generator.standard_normal((count, 2))
        else:
            order = np.array([[1, dt, 0, 0], [0, 1, 0, 0], [0, 0, 1, dt], [0, 0, 0, 1]])
            root = np.linalg.cholesky(q * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]]))

            def expected(x, order=order):
                return x @ order.T

            def noise(count, root=root):
                return (generator.standard_normal((count, 2, 2)) @ root.T).reshape(count, 4)

        for z, place in zip(bearings, truth, strict=True):

            def log_density(x, z=z):
                at = x if model == "rw" else x[:, ::2]
                ways = at[:, None] - sensors
                errors = z - np.arctan2(ways[..., 1], ways[..., 0])
                errors = np.mod(errors + np.pi, 2 * np.pi) - np.pi
                return -0.5 * ((errors / sd) ** 2).sum(axis=1)

            particles = step_of(kind, generator, particles, expected, noise, log_density)
            mean = particles.weights @ particles.states.values
            squares.append(((mean if model == "rw" else mean[::2]) - place) ** 2)
    rmse = float(np.sqrt(np.sum(squares, axis=1).mean()))
    peer = {"rw": {"plain": 0.848, "auxiliary": 0.846}, "cv": {"plain": 0.756, "auxiliary": 0.754}}[model]
    assert rmse == pytest.approx(peer[kind], rel=0.02)


@pytest.mark.parametrize("kind", ["plain", "auxiliary"])
def test_a_linear_model_gives_the_kalman_filters_posterior(test_seed, kind):
    """The mean over runs, within its own error: the tail of t with 15 degrees of freedom at 5.5 is 3e-5."""
    turn, row = np.array([[0.9, 0.3], [-0.3, 0.9]]), np.array([1.0, 0.5])
    readings = (2.0, 1.0, -3.0, 0.5)
    start = Gaussian(np.array([1.0, -1.0]), np.diag([1.0, 4.0]))
    means, covs = [], []
    for run in range(16):
        generator = np.random.default_rng([test_seed, run])
        particles = equal(start.mean + generator.standard_normal((4000, 2)) * np.sqrt(np.diag(start.cov)))
        for z in readings:
            particles = step_of(
                kind,
                generator,
                particles,
                lambda x: x @ turn.T,
                lambda n, generator=generator: 0.5 * generator.standard_normal((n, 2)),
                lambda x, z=z: -((z - x @ row) ** 2),
            )
        means.append(particles.weights @ particles.states.values)
        centred = particles.states.values - means[-1]
        covs.append((particles.weights[:, None] * centred).T @ centred)
    belief = start
    for z in readings:
        belief = predict(belief, turn, 0.25 * np.eye(2))
        belief = update(belief, np.array([z]), row[None], np.array([[0.5]]))
    for found, expected in ((means, belief.mean), (covs, belief.cov)):
        error = np.std(found, axis=0, ddof=1) / 4.0
        # a covariance from weights that sum to one is too small by 1 part in their effective number
        assert (np.abs(np.mean(found, axis=0) - expected) < 5.5 * error + 1e-3).all()


def test_systematic_draws(test_seed):
    generator = np.random.default_rng(test_seed + 2)
    weights = generator.dirichlet(np.full(50, 0.3))
    counts = np.zeros(50)
    for _ in range(2000):
        drawn = np.bincount(systematic(generator, weights), minlength=50)
        assert (drawn >= np.floor(50 * weights - 1e-9)).all()
        assert (drawn <= np.ceil(50 * weights + 1e-9)).all()
        counts += drawn
    np.testing.assert_allclose(counts / 2000, 50 * weights, atol=5.0 * 0.5 / np.sqrt(2000))


@pytest.mark.parametrize("kind", ["plain", "auxiliary"])
def test_what_no_particle_explains_is_said(kind):
    generator = np.random.default_rng(0)
    with pytest.raises(Lost):
        step_of(kind, generator, equal(np.zeros((5, 1))), stays, still, lambda x: np.full(5, -np.inf))
    one = step_of(
        kind,
        generator,
        equal(np.arange(5.0)[:, None]),
        stays,
        still,
        lambda x: np.where(x[:, 0] == 3.0, -1e6, -np.inf),
    )
    assert one.weights @ one.states.values[:, 0] == pytest.approx(3.0)


def test_the_floor_gives_what_is_ruled_out_descendants():
    """A particle whose expected state is impossible may still move to the one possible place."""

    def after(floor):
        generator = np.random.default_rng(1)
        return step_of(
            "auxiliary",
            generator,
            equal(np.repeat([[0.0], [10.0]], 5000, axis=0)),
            lambda x: x,
            lambda n: generator.normal(0.0, 1.0, (n, 1)),
            lambda x: np.where((x[:, 0] > 1.0) & (x[:, 0] < 5.0) | (x[:, 0] == 10.0), 0.0, -np.inf),
            floor=floor,
        )

    with pytest.raises(Lost):
        after(0.0)
    found = after(0.02)
    assert 1.0 < found.weights @ found.states.values[:, 0] < 2.0
