"""Products of Gaussian mixtures, and the division by what the factors share.

Logarithms and differences throughout: the means enter as distances from one another, never
by their own size, and the mass of a product of densities far apart is kept as a logarithm.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from wsnsim.estimation.kalman import Gaussian
from wsnsim.estimation.mixtures import GaussianMixture
from wsnsim.estimation.reduction import Reduction, reduce
from wsnsim.kernels.products import divide, multiply
from wsnsim.types import FloatArray

MOST_COMPONENTS = 4096
"""Of a product; the lightest beyond them are left out. Six mixtures of four components have as many."""

INTERMEDIATE_ORDER = 16
"""Components that `fuse_reduced` keeps between two fusions, at least."""


def product(first: GaussianMixture, second: GaussianMixture) -> GaussianMixture:
    """Return the product of two densities, a component for each pair of components.

    Raises
    ------
    ValueError : the dimensions differ

    References
    ----------
    Kushwaha, Koutsoukos (2013), sec. 5.2.1, z_c = (μ − λ)ᵀ(V + W)⁻¹(μ − λ) in place of its printed form,
    which is a difference of large numbers.
    """
    size = first.dimension
    if second.dimension != size:
        raise ValueError(f"product: mixtures must have one dimension, got {size} and {second.dimension}")
    return GaussianMixture(
        *multiply(first.log_weights, first.means, first.covs, second.log_weights, second.means, second.covs)
    )


def without_normal(mixture: GaussianMixture, normal: Gaussian, times: int = 1) -> GaussianMixture:
    """Divide a mixture by a normal density, `times` times.

    Raises
    ------
    ValueError : the quotient of a component is no normal density: the component is too wide
    """
    root, back = _root_and_inverse(normal.cov)
    inner = _without_standard(mixture.moved(back, -back @ normal.mean), times)
    # a density in x is one in u = root⁻¹ (x − mean), divided by |root|
    log_weights = inner.log_weights + times * np.log(np.diagonal(root)).sum()
    return replace(inner, log_weights=log_weights).moved(root, normal.mean)


def _without_standard(mixture: GaussianMixture, times: int) -> GaussianMixture:
    """Divide a mixture by N(0, I), `times` times."""
    *quotient, unsound = divide(mixture.log_weights, mixture.means, mixture.covs, float(times))
    if unsound >= 0:
        raise ValueError(
            f"division: every component must be narrower than the normal's covariance / {times}, "
            f"component {unsound} is not; limit the factors first"
        )
    return GaussianMixture(*quotient)


def limited(mixture: GaussianMixture, prior: Gaussian) -> GaussianMixture:
    """Return the mixture with no component wider than the prior in any direction.

    In coordinates in which the prior is N(0, I) a covariance's eigenvalues above 1 become 1:
    there the component, divided by the prior, says nothing of the spread. A component that is
    narrower everywhere stays as it is.
    """
    root, back = _root_and_inverse(prior.cov)
    inner = mixture.moved(back, -back @ prior.mean)
    held = _limited_to_standard(inner)
    if held is inner:
        return mixture
    wide = (held.covs != inner.covs).any(axis=(1, 2))
    return replace(
        mixture, covs=np.where(wide[:, None, None], held.moved(root, prior.mean).covs, mixture.covs)
    )


def _limited_to_standard(mixture: GaussianMixture) -> GaussianMixture:
    """Return the mixture with no eigenvalue of a covariance above 1."""
    variances, axes = np.linalg.eigh(mixture.covs)
    wide = variances[:, -1] > 1.0
    if not wide.any():
        return mixture
    covs = (axes * np.minimum(variances, 1.0)[:, None, :]) @ axes.transpose(0, 2, 1)
    covs = np.where(wide[:, None, None], 0.5 * (covs + covs.transpose(0, 2, 1)), mixture.covs)
    return replace(mixture, covs=covs)


def fuse(mixtures: Sequence[GaussianMixture], prior: Gaussian | None) -> GaussianMixture:
    """Return the product of densities that each contain one prior, which then counts once.

    The order of the densities does not matter, and a product of products is the product of
    all, as long as no product has more than `MOST_COMPONENTS`.

    Parameters
    ----------
    mixtures : at least one; their components are limited to the prior (`limited`)
    prior : None: they contain none, and nothing is divided out

    Raises
    ------
    ValueError : no mixture, or dimensions that differ
    """
    return _accumulate(mixtures, prior, lambda product_so_far: product_so_far)


def fuse_reduced(
    mixtures: Sequence[GaussianMixture],
    prior: Gaussian | None,
    order: int,
    rule: Reduction = "runnalls",
    rng: np.random.Generator | None = None,
) -> GaussianMixture:
    """Return `fuse(mixtures, prior)` with at most `order` components, reduced between the factors too.

    Parameters
    ----------
    mixtures, prior : as in `fuse`
    order : at least 1; between the factors as many are kept, or `INTERMEDIATE_ORDER` if that is more
    rule, rng : as in `reduce`

    Raises
    ------
    ValueError : as in `fuse` and `reduce`
    """
    between = max(INTERMEDIATE_ORDER, order)
    fused = _accumulate(mixtures, prior, lambda product_so_far: reduce(product_so_far, between, rule, rng))
    return reduce(fused, order, rule, rng)


def _accumulate(
    mixtures: Sequence[GaussianMixture],
    prior: Gaussian | None,
    between: Callable[[GaussianMixture], GaussianMixture],
) -> GaussianMixture:
    """Multiply mixtures one after the other, `between` applied to what is multiplied further."""
    if not mixtures:
        raise ValueError("fusion: must have at least one mixture, got none")
    if prior is None:
        fused = mixtures[0]
        for number, mixture in enumerate(mixtures[1:]):
            fused = _heaviest(product(between(fused) if number else fused, mixture))
        return fused
    # in coordinates in which the prior is N(0, I): a factor more and a divisor more leave the mass as it is
    root, back = _root_and_inverse(prior.cov)
    inner = [_limited_to_standard(mixture.moved(back, -back @ prior.mean)) for mixture in mixtures]
    fused = inner[0]
    for number, mixture in enumerate(inner[1:]):
        so_far = _limited_to_standard(between(fused)) if number else fused
        fused = _heaviest(_without_standard(product(so_far, mixture), 1))
    return fused.moved(root, prior.mean)


def _heaviest(mixture: GaussianMixture) -> GaussianMixture:
    """Leave out the lightest components beyond `MOST_COMPONENTS`."""
    if mixture.order <= MOST_COMPONENTS:
        return mixture
    kept = np.sort(np.argsort(-mixture.log_weights, kind="stable")[:MOST_COMPONENTS])
    return GaussianMixture(mixture.log_weights[kept], mixture.means[kept], mixture.covs[kept])


def _root_and_inverse(cov: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the Cholesky factor (d, d) of a covariance and its inverse."""
    root = np.asarray(np.linalg.cholesky(cov), dtype=np.float64)
    return root, np.asarray(np.linalg.inv(root), dtype=np.float64)
