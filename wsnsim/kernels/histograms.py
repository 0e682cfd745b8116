"""Kernel-weighted histograms inside ellipses, and how similar they are to a reference.

The weight of a pixel y inside the ellipse (y - c)ᵀ B (y - c) = d ≤ 1 is Epanechnikov's
1 - d, or 1. Colour and texture are counted together, in one joint histogram with one
addition a pixel, and separated once for each ellipse. Colours that the reference does
not have share one bin: they add to the mass only.
"""

from math import pi

import numpy as np
from numpy.typing import NDArray

from wsnsim.kernels.ellipses import CUT, NOWHERE, UNCOVERED, ellipse_chords, ellipse_rows
from wsnsim.kernels.jit import frozen, kernel
from wsnsim.types import BoolArray, FloatArray

_LANES = 4
"""Partial sums kept apart, so that the order of additions is the same on every processor."""
_MOST_BINS = 2**16


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
    *,
    weighted: bool = True,
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
    weighted : whether a pixel weighs 1 - d; False: all pixels inside weigh the same

    Returns
    -------
    rho_colour, rho_texture : (m,) - Bhattacharyya coefficients Σ √(p q) [0–1]; 0 where `inside` is 0
    inside : (m,) - share of the ellipse's weight that lies in the image: 1 where nothing is cut off,
        0 where it is not visible or covers no pixel's centre

    Raises
    ------
    ValueError : the region does not hold an ellipse; a bin is not in the reference; too many bins

    References
    ----------
    Kushwaha, Koutsoukos (2013), eqs. 3, 16, 17; Comaniciu, Ramesh, Meer (2003), eqs. 3-7.
    """
    colours, textures = len(sqrt_q_colour), len(sqrt_q_texture)
    present = np.flatnonzero(sqrt_q_colour)
    ranks = np.full(colours, len(present))
    ranks[present] = np.arange(len(present))
    stride = (len(present) + _LANES) // _LANES * _LANES  # the bin of all other colours, and no weight beyond
    reference = np.zeros(stride)
    reference[: len(present)] = sqrt_q_colour[present]
    if stride * textures > _MOST_BINS:
        raise ValueError(
            f"bins: colours times textures must be at most {_MOST_BINS}, got {stride * textures}"
        )
    joint, sound = _joint_bins(
        frozen(colour, np.int16), frozen(texture, np.int16), frozen(ranks, np.uint16), stride, textures
    )
    if not sound:
        raise ValueError(f"colour, texture: bins must be below the reference's {colours} and {textures}")
    rho_colour, rho_texture, inside, uncovered = _similarities(
        joint,
        x0,
        y0,
        width,
        height,
        frozen(centres, np.float64),
        frozen(shapes, np.float64),
        frozen(visible, np.bool_),
        reference,
        frozen(sqrt_q_texture, np.float64),
        1.0 if weighted else 0.0,
    )
    if uncovered >= 0:
        raise ValueError(
            f"region: must hold the ellipses as far as the image shows them, cuts ellipse {uncovered}"
        )
    return rho_colour, rho_texture, inside


@kernel
def _joint_bins(
    colour: NDArray[np.int16],
    texture: NDArray[np.int16],
    ranks: NDArray[np.uint16],
    stride: int,
    textures: int,
) -> tuple[NDArray[np.uint16], bool]:
    """Return texture · stride + rank of the colour, each row one pixel longer; False: a bin is wrong."""
    rows, columns = colour.shape
    joint = np.zeros((rows, columns + 1), np.uint16)
    for i in range(rows):
        for j in range(columns):
            u, v = colour[i, j], texture[i, j]
            if u < 0 or u >= len(ranks) or v < 0 or v >= textures:
                return joint, False
            joint[i, j] = v * stride + ranks[u]
    return joint, True


@kernel
def _similarities(
    joint: NDArray[np.uint16],
    x0: int,
    y0: int,
    width: int,
    height: int,
    centres: FloatArray,
    shapes: FloatArray,
    visible: BoolArray,
    sqrt_q_colour: FloatArray,
    sqrt_q_texture: FloatArray,
    falloff: float,
) -> tuple[FloatArray, FloatArray, FloatArray, int]:
    """Return the coefficients, the shares inside, and the first ellipse that the region cuts, or -1.

    The weight is 1 - falloff · d.
    """
    count = len(centres)
    rows, columns = joint.shape[0], joint.shape[1] - 1
    stride, textures = len(sqrt_q_colour), len(sqrt_q_texture)
    rho_colour, rho_texture, inside = np.zeros(count), np.zeros(count), np.zeros(count)
    starts, ends = np.empty(rows, np.int32), np.empty(rows, np.int32)
    weights, slopes = np.empty(rows), np.empty(rows)
    even, odd = np.empty(textures * stride), np.empty(textures * stride)
    by_colour, by_texture = np.empty(stride), np.empty(textures)
    for p in range(count):
        if not visible[p]:
            continue
        state, first, last = ellipse_rows(centres[p], shapes[p], x0, y0, columns, rows, width, height)
        if state == NOWHERE:
            continue
        if state == UNCOVERED:
            return rho_colour, rho_texture, inside, p
        ellipse_chords(centres[p], shapes[p], x0, y0, columns, first, last, starts, ends)
        a, b, c = shapes[p, 0, 0], shapes[p, 0, 1], shapes[p, 1, 1]
        # Along a row the weight is a parabola: its first value, first and second differences.
        second = -2.0 * falloff * a
        for i in range(first, last + 1):
            dy, dx = np.int32(i) - (centres[p, 1] - y0), starts[i] - (centres[p, 0] - x0)
            weights[i] = 1.0 - falloff * ((a * dx + 2.0 * b * dy) * dx + c * dy * dy)
            slopes[i] = -falloff * (a * (2.0 * dx + 1.0) + 2.0 * b * dy)
        even[:] = 0.0
        odd[:] = 0.0
        for i in range(first, last + 1):
            row = np.uint64(i)  # an unsigned index is not tested for counting from the end
            k, pixels = np.uint64(starts[row]), ends[row] - starts[row]
            w_even, w_odd = weights[row], weights[row] + slopes[row]
            s_even = 2.0 * slopes[row] + second
            s_odd = s_even + 2.0 * second
            # Neighbours go to histograms of their own: a bin's next addition need not wait for the last.
            for _ in range(pixels // 2):
                even[joint[row, k]] += w_even
                odd[joint[row, k + np.uint64(1)]] += w_odd
                w_even += s_even
                w_odd += s_odd
                s_even += 4.0 * second
                s_odd += 4.0 * second
                k += np.uint64(2)
            even[joint[row, k]] += w_even if pixels % 2 == 1 else 0.0
        _separate(even, odd, by_colour, by_texture)
        mass = 0.0
        for v in range(textures):
            mass += by_texture[v]
        if mass <= 0.0:
            continue
        rho_colour[p] = min(_root_product(by_colour, sqrt_q_colour) / np.sqrt(mass), 1.0)
        rho_texture[p] = min(_root_product(by_texture, sqrt_q_texture) / np.sqrt(mass), 1.0)
        # The weight's integral over the whole ellipse is (1 - falloff / 2) π / √det B.
        whole = (1.0 - 0.5 * falloff) * pi / np.sqrt(a * c - b * b)
        inside[p] = min(mass / whole, 1.0) if state == CUT else 1.0
    return rho_colour, rho_texture, inside, -1


@kernel
def _separate(even: FloatArray, odd: FloatArray, by_colour: FloatArray, by_texture: FloatArray) -> None:
    """Write the sums over textures and over colours of a joint histogram in two parts; `even` is spent."""
    stride, textures = len(by_colour), len(by_texture)
    for u in range(len(even)):
        even[u] += odd[u]
    by_colour[:] = 0.0
    for v in range(textures):
        base = v * stride
        for u in range(stride):
            by_colour[u] += even[base + u]
        s0, s1, s2, s3 = 0.0, 0.0, 0.0, 0.0
        for u in range(base, base + stride, _LANES):
            s0 += even[u]
            s1 += even[u + 1]
            s2 += even[u + 2]
            s3 += even[u + 3]
        by_texture[v] = max((s0 + s1) + (s2 + s3), 0.0)


@kernel
def _root_product(histogram: FloatArray, sqrt_q: FloatArray) -> float:
    """Return Σ √(p q); `histogram` is spent. Sums of weights next to 0 may be rounded below it."""
    for u in range(len(histogram)):
        histogram[u] = np.sqrt(max(histogram[u], 0.0)) * sqrt_q[u]
    total = 0.0
    for u in range(len(histogram)):
        total += histogram[u]
    return total


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
