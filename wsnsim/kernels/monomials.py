"""Normal densities as numbers on monomials: 1, xₐ, xₐ x_b (a ≤ b, row by row), 1 + d + d (d + 1) / 2 of them.

The logarithm of a normal density is a sum of monomials, and the expected monomials of a
density are its moments; the moments of several add up to those of their sum. All in
coordinates in which the whole has about mean 0 and variance 1, so that nothing cancels.
"""

import numpy as np

from wsnsim.kernels.cholesky import factorise, invert
from wsnsim.kernels.jit import kernel
from wsnsim.types import FloatArray

LEAST_MASS = 1e-9
"""Share of the whole below which a component is given up."""

LEAST_VARIANCE = 1e-12
"""Conditional variance, where the whole has variance 1, below which a component is given up."""


@kernel
def dimension(size: int) -> int:
    """Return how many coordinates have `size` monomials."""
    d = 1
    while 1 + d + d * (d + 1) // 2 < size:
        d += 1
    return d


@kernel
def describe(moments: FloatArray, mean: FloatArray, cov: FloatArray) -> None:
    """Write mean (d,) and covariance (d, d) of a component from its moments (f,), the first its mass."""
    d = len(mean)
    mass = max(moments[0], LEAST_MASS)
    for a in range(d):
        mean[a] = moments[1 + a] / mass
    place = 1 + d
    for a in range(d):
        for b in range(a, d):
            cov[a, b] = moments[place] / mass - mean[a] * mean[b]
            cov[b, a] = cov[a, b]
            place += 1


@kernel
def expand(mass: float, mean: FloatArray, cov: FloatArray, coefficients: FloatArray) -> float:
    """Write log(mass N(x; mean, cov)) as coefficients (f,) of monomials; return the mass, 0 if given up."""
    d = len(mean)
    root, back = np.zeros((d, d)), np.zeros((d, d))
    coefficients[:] = 0.0
    coefficients[0] = -np.inf
    if mass < LEAST_MASS:
        return 0.0
    log_determinant = factorise(cov, root, LEAST_VARIANCE)
    if log_determinant == -np.inf:
        return 0.0
    invert(root, back)
    constant = np.log(mass) - 0.5 * (d * np.log(2.0 * np.pi) + log_determinant)
    place = 1 + d
    for a in range(d):
        for b in range(a, d):
            precision = 0.0
            for c in range(b, d):
                precision += back[c, a] * back[c, b]
            coefficients[1 + a] += precision * mean[b]
            if b > a:
                coefficients[1 + b] += precision * mean[a]
                precision *= 2.0
            coefficients[place] = -0.5 * precision
            constant -= 0.5 * precision * mean[a] * mean[b]
            place += 1
    coefficients[0] = constant
    return mass
