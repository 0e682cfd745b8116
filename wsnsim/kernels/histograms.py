"""Kernel-weighted histograms inside ellipses, and how similar they are to a reference.

The weight of a pixel y inside the ellipse (y - c)ᵀ B (y - c) = d ≤ 1 is Epanechnikov's
1 - d. Colour and texture are counted together, in one joint histogram with one addition
a pixel, and separated once for each ellipse.
"""

from math import pi

import numpy as np
from numpy.typing import NDArray

from wsnsim.kernels.jit import frozen, kernel
from wsnsim.types import BoolArray, FloatArray

_LANES = 4
_FAR = 1e9
"""Pixels from the image beyond which an ellipse is nowhere; also what keeps NaN out."""
"""Partial sums kept apart, so that the order of additions is the same on every processor."""


def particle_histogram_similarities(
    colour: NDArray[np.int16],
    texture: NDArray[np.int16],
    x0: int,
    y0: int,
    width: int,
    height: int,
    centres: FloatArray,
    shapes: FloatArray,
    visible: BoolArray,
    sqrt_q_colour: FloatArray,
    sqrt_q_texture: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Compare the histograms inside many ellipses with one reference.

    Parameters
    ----------
    colour, texture : (h, w) - bins of a region that holds the ellipses as far as the image shows them
    x0, y0 : the region's first pixel in the image
    width, height : of the whole image [px]
    centres : (m, 2) - (x, y) of the ellipses [px]
    shapes : (m, 2, 2) - symmetric, positive definite [1/px²]
    visible : (m,) - False: the ellipse is left out
    sqrt_q_colour : (c,) - square root of the reference's colour histogram
    sqrt_q_texture : (t,) - square root of the reference's texture histogram

    Returns
    -------
    rho_colour, rho_texture : (m,) - Bhattacharyya coefficients Σ √(p q) [0–1]; 0 where `inside` is 0
    inside : (m,) - share of the ellipse's weight that lies in the image: 1 where nothing is cut off,
        0 where it is not visible or covers no pixel's centre

    Raises
    ------
    ValueError : the region does not hold an ellipse

    References
    ----------
    Kushwaha, Koutsoukos (2013), eqs. 3, 16, 17; Comaniciu, Ramesh, Meer (2003), eqs. 3-7.
    """
    rho_colour, rho_texture, inside, uncovered = _similarities(
        frozen(colour, np.int16),
        frozen(texture, np.int16),
        x0,
        y0,
        width,
        height,
        frozen(centres, np.float64),
        frozen(shapes, np.float64),
        frozen(visible, np.bool_),
        frozen(sqrt_q_colour, np.float64),
        frozen(sqrt_q_texture, np.float64),
    )
    if uncovered >= 0:
        raise ValueError(
            f"region: must hold the ellipses as far as the image shows them, cuts ellipse {uncovered}"
        )
    return rho_colour, rho_texture, inside


@kernel
def _similarities(
    colour: NDArray[np.int16],
    texture: NDArray[np.int16],
    x0: int,
    y0: int,
    width: int,
    height: int,
    centres: FloatArray,
    shapes: FloatArray,
    visible: BoolArray,
    sqrt_q_colour: FloatArray,
    sqrt_q_texture: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray, int]:
    """Return the coefficients, the shares inside, and the first ellipse that the region cuts, or -1."""
    count = len(centres)
    rows, columns = colour.shape
    colours, textures = len(sqrt_q_colour), len(sqrt_q_texture)
    stride = (colours + _LANES - 1) // _LANES * _LANES
    rho_colour, rho_texture, inside = np.zeros(count), np.zeros(count), np.zeros(count)
    joint = np.empty((rows, columns), np.uint16)
    for i in range(rows):
        for j in range(columns):
            joint[i, j] = texture[i, j] * stride + colour[i, j]
    xs = np.arange(columns).astype(np.float64)
    histogram, by_colour = np.empty(textures * stride), np.empty(colours)
    for p in range(count):
        if not visible[p]:
            continue
        a, b, c = shapes[p, 0, 0], shapes[p, 0, 1], shapes[p, 1, 1]
        determinant = a * c - b * b
        # Written so that a NaN is passed over too; an index made of one writes anywhere.
        if not (determinant > 0.0 and a > 0.0 and abs(centres[p, 0]) < _FAR and abs(centres[p, 1]) < _FAR):
            continue
        half_width, half_height = np.sqrt(c / determinant), np.sqrt(a / determinant)
        left, right = np.ceil(centres[p, 0] - half_width), np.floor(centres[p, 0] + half_width)
        top, bottom = np.ceil(centres[p, 1] - half_height), np.floor(centres[p, 1] + half_height)
        cut = left < 0 or top < 0 or right > width - 1 or bottom > height - 1
        left, right = max(left, 0.0), min(right, width - 1.0)
        top, bottom = max(top, 0.0), min(bottom, height - 1.0)
        if left > right or top > bottom:
            continue
        if left < x0 or top < y0 or right > x0 + columns - 1 or bottom > y0 + rows - 1:
            return rho_colour, rho_texture, inside, p
        histogram[:] = 0.0
        cx, cy = centres[p, 0] - x0, centres[p, 1] - y0
        per_a, slope = 1.0 / a, b / a
        for i in range(int(top) - y0, int(bottom) - y0 + 1):
            dy = i - cy
            chord = a - determinant * dy * dy
            if chord < 0.0:
                continue
            middle, half = cx - slope * dy, np.sqrt(chord) * per_a
            first = int(max(np.ceil(middle - half), 0.0))
            last = int(min(np.floor(middle + half), columns - 1.0))
            # 1 - d along the row as a polynomial in x.
            constant = 1.0 - c * dy * dy - cx * (a * cx - 2.0 * b * dy)
            linear = 2.0 * (a * cx - b * dy)
            bins = joint[i]
            for j in range(first, last + 1):
                k = np.uint64(j)
                histogram[bins[k]] += constant + (linear - a * xs[k]) * xs[k]
        by_colour[:] = 0.0
        mass, sum_texture = 0.0, 0.0
        for v in range(textures):
            base = v * stride
            for u in range(colours):
                by_colour[u] += histogram[base + u]
            s0, s1, s2, s3 = 0.0, 0.0, 0.0, 0.0
            for u in range(base, base + stride, _LANES):
                s0 += histogram[u]
                s1 += histogram[u + 1]
                s2 += histogram[u + 2]
                s3 += histogram[u + 3]
            weight = max(s0 + s1 + s2 + s3, 0.0)
            mass += weight
            sum_texture += np.sqrt(weight) * sqrt_q_texture[v]
        if mass <= 0.0:
            continue
        for u in range(colours):
            by_colour[u] = np.sqrt(max(by_colour[u], 0.0)) * sqrt_q_colour[u]
        sum_colour = 0.0
        for u in range(colours):
            sum_colour += by_colour[u]
        rho_colour[p] = min(sum_colour / np.sqrt(mass), 1.0)
        rho_texture[p] = min(sum_texture / np.sqrt(mass), 1.0)
        # The weight's integral over the whole ellipse is π / (2 √det B).
        inside[p] = min(mass * 2.0 * np.sqrt(determinant) / pi, 1.0) if cut else 1.0
    return rho_colour, rho_texture, inside, -1


def kernel_histogram(
    colour: NDArray[np.int16],
    texture: NDArray[np.int16],
    x0: int,
    y0: int,
    centre: FloatArray,
    shape: FloatArray,
    colour_bins: int,
    texture_bins: int,
) -> tuple[FloatArray, FloatArray]:
    """Return the normalised histograms inside one ellipse, as far as the region shows it.

    Parameters
    ----------
    colour, texture : (h, w) - bins of a region
    x0, y0 : the region's first pixel in the image
    centre : (2,) - (x, y) of the ellipse [px]
    shape : (2, 2) - symmetric, positive definite [1/px²]
    colour_bins, texture_bins : numbers of bins c and t

    Returns
    -------
    (c,) and (t,) - each with sum 1, or all 0 where the ellipse covers no pixel's centre
    """
    rows, columns = colour.shape
    dx = np.arange(x0, x0 + columns) - centre[0]
    dy = (np.arange(y0, y0 + rows) - centre[1])[:, None]
    distances = shape[0, 0] * dx * dx + 2.0 * shape[0, 1] * dx * dy + shape[1, 1] * dy * dy
    weights = np.maximum(1.0 - distances, 0.0).ravel()
    mass = weights.sum()
    if mass > 0.0:
        weights /= mass
    return (
        np.bincount(colour.ravel(), weights, colour_bins).astype(np.float64),
        np.bincount(texture.ravel(), weights, texture_bins).astype(np.float64),
    )
