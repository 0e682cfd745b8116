"""Cholesky factors of small matrices, in place: without calls and allocations of LAPACK's size."""

import numpy as np

from wsnsim.kernels.jit import kernel
from wsnsim.types import FloatArray


@kernel
def factorise(matrix: FloatArray, root: FloatArray, least: float) -> float:
    """Write the lower triangle of the factor L with L Lᵀ = matrix; return log|matrix|.

    Parameters
    ----------
    matrix : (d, d) - symmetric; only its lower triangle is read
    root : (d, d) - L; may be `matrix` itself
    least : pivot up to which the matrix counts as singular, or not positive definite

    Returns
    -------
    -inf for such a matrix
    """
    product = 1.0
    for a in range(len(matrix)):
        for b in range(a + 1):
            rest = matrix[a, b]
            for c in range(b):
                rest -= root[a, c] * root[b, c]
            if b < a:
                root[a, b] = rest / root[b, b]
            elif rest > least:
                product *= rest
                root[a, a] = np.sqrt(rest)
            else:
                return -np.inf
    return float(np.log(product))


@kernel
def invert(root: FloatArray, back: FloatArray) -> None:
    """Write the inverse of a lower triangle (d, d) into the lower triangle of `back`."""
    for a in range(len(root)):
        back[a, a] = 1.0 / root[a, a]
        for b in range(a):
            rest = 0.0
            for c in range(b, a):
                rest -= root[a, c] * back[c, b]
            back[a, b] = rest / root[a, a]


@kernel
def solve(root: FloatArray, values: FloatArray) -> None:
    """Replace values (d,) by the solution x of L Lᵀ x = values, L the lower triangle of `root`."""
    d = len(values)
    for a in range(d):
        for b in range(a):
            values[a] -= root[a, b] * values[b]
        values[a] /= root[a, a]
    for a in range(d - 1, -1, -1):
        for b in range(a + 1, d):
            values[a] -= root[b, a] * values[b]
        values[a] /= root[a, a]
