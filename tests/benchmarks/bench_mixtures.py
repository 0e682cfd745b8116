"""The time of what a relay and a camera do with mixtures, beside plain NumPy.

Not collected with the tests, and nothing is asserted. Run it with
``pytest -s tests/benchmarks/bench_mixtures.py``; a machine with nothing else to do gives the best figures.
"""

import numpy as np
import pytest

from wsnsim.bench.mixture_twins import plain_climb, plain_fit_mixture, plain_fuse, plain_merged_labels
from wsnsim.bench.timing import by_turns
from wsnsim.estimation.kalman import Gaussian
from wsnsim.estimation.mixtures import GaussianMixture
from wsnsim.estimation.modes import highest_mode
from wsnsim.estimation.order import TOLERANCE, fit_mixture
from wsnsim.estimation.products import fuse, fuse_reduced, product
from wsnsim.estimation.reduction import merged, reduce


def mixture(generator, count, size=3):
    roots = np.tril(0.1 * generator.standard_normal((count, size, size))) + 0.2 * np.eye(size)
    log_weights = np.log(generator.dirichlet(np.ones(count)))
    return GaussianMixture(
        log_weights, 0.3 * generator.standard_normal((count, size)), roots @ roots.transpose(0, 2, 1)
    )


def show(what, times):
    print(
        f"\n{what}: {1e3 * times.typical('ours'):.2f} ms, "
        f"NumPy × {times.ratio('plain', 'ours'):.1f} ({1e3 * times.typical('plain'):.2f} ms)",
        end="",
    )


@pytest.mark.parametrize("size", [2, 3])
def test_fit(size):
    generator = np.random.default_rng(0)
    points = generator.standard_normal((1000, size))
    weights = np.exp(mixture(generator, 3, size).log_density(points) / 3.0)
    times = by_turns(
        {
            "plain": lambda: plain_fit_mixture(points, weights, 4, np.random.default_rng(1), TOLERANCE),
            "ours": lambda: fit_mixture(points, weights, 4, "tolerance", np.random.default_rng(1)),
        },
        turns=9,
    )
    show(f"1000 particles in {size} dimensions, orders 1 to 4", times)


@pytest.mark.parametrize("count", [16, 64])
def test_reduce(count):
    whole = mixture(np.random.default_rng(1), count)
    times = by_turns(
        {
            "plain": lambda: merged(whole, plain_merged_labels(whole, 4, 50)),
            "ours": lambda: reduce(whole, 4),
        },
        turns=3,  # the plain twin is slow
    )
    show(f"{count} components to 4", times)


def test_fuse():
    generator = np.random.default_rng(2)
    prior = Gaussian(np.zeros(3), np.eye(3))
    said = [mixture(generator, 4) for _ in range(6)]
    times = by_turns({"plain": lambda: plain_fuse(said[:3], prior), "ours": lambda: fuse(said[:3], prior)}, 9)
    show("three times 4 components fused", times)
    times = by_turns({"ours": lambda: fuse_reduced(said, prior, 4)}, 9)
    print(f"\nsix times 4 components fused and reduced to 4: {1e3 * times.typical('ours'):.2f} ms", end="")


def test_mode():
    whole = product(*(mixture(np.random.default_rng(seed), 4) for seed in (3, 4)))
    times = by_turns(
        {
            "plain": lambda: [plain_climb(whole, mean, 50) for mean in whole.means],
            "ours": lambda: highest_mode(whole),
        },
        turns=9,
    )
    show("highest mode of 16 components (NumPy: 50 steps each)", times)
