"""Sums of a per-pixel score inside ellipses, by prefix sums of the rows: one subtraction a row."""

from math import pi

import numpy as np
from numpy.typing import NDArray

from wsnsim.kernels.ellipses import CUT, NOWHERE, UNCOVERED, ellipse_chords, ellipse_rows
from wsnsim.kernels.jit import frozen, kernel
from wsnsim.types import BoolArray, FloatArray, IntArray


def log_ratio_scores(
    colour: NDArray[np.int16],
    texture: NDArray[np.int16],
    colour_table: FloatArray,
    texture_table: FloatArray,
) -> FloatArray:
    """Look up a score for each pixel's colour and texture, and add the two.

    With tables log p_target / p_background the result is the pixels' log-likelihood
    ratio, colour and texture taken as independent.

    Parameters
    ----------
    colour, texture : (h, w) - bins of a region
    colour_table : (c,) - score of each colour bin
    texture_table : (t,) - score of each texture bin; all 0 leaves texture out

    Returns
    -------
    (h, w) - the sums

    Raises
    ------
    ValueError : the shapes differ, or a bin is not in its table
    """
    if colour.shape != texture.shape:
        raise ValueError(f"texture: must have the shape of colour {colour.shape}, got {texture.shape}")
    scores, sound = _look_up(
        frozen(colour, np.int16),
        frozen(texture, np.int16),
        frozen(colour_table, np.float64),
        frozen(texture_table, np.float64),
    )
    if not sound:
        raise ValueError(
            f"colour, texture: bins must lie in the tables of {len(colour_table)} and {len(texture_table)}"
        )
    return scores


@kernel
def _look_up(
    colour: NDArray[np.int16],
    texture: NDArray[np.int16],
    colour_table: FloatArray,
    texture_table: FloatArray,
) -> tuple[FloatArray, bool]:
    rows, columns = colour.shape
    colours, textures = len(colour_table), len(texture_table)
    scores = np.empty((rows, columns))
    for i in range(rows):
        for j in range(columns):
            u, v = colour[i, j], texture[i, j]
            if u < 0 or u >= colours or v < 0 or v >= textures:
                return scores, False
            scores[i, j] = colour_table[u] + texture_table[v]
    return scores, True


def ellipse_sums(
    scores: FloatArray,
    x0: int,
    y0: int,
    width: int,
    height: int,
    centres: FloatArray,
    shapes: FloatArray,
    visible: BoolArray,
) -> tuple[FloatArray, IntArray, FloatArray]:
    """Sum the scores of the pixels (y - c)ᵀ B (y - c) ≤ 1 of many ellipses, all with weight 1.

    Parameters
    ----------
    scores : (h, w) - of the pixels of a region that holds the ellipses as far as the image shows them
    x0, y0 : the region's first pixel in the image
    width, height : of the whole image [px]
    centres : (m, 2) - (x, y) of the ellipses [px]
    shapes : (m, 2, 2) - B, symmetric, positive definite [1/px²]
    visible : (m,) - False: the ellipse is left out

    Returns
    -------
    sums : (m,) - of the scores; 0 where an ellipse has no pixels
    pixels : (m,) - pixels whose centres lie in the ellipse and in the image
    inside : (m,) - share of the ellipse's area that lies in the image: 1 where nothing is cut off,
        0 where it is not visible or covers no pixel's centre

    Raises
    ------
    ValueError : the region does not hold an ellipse

    References
    ----------
    Crow (1984), Summed-area tables for texture mapping: prefix sums, here of single rows.
    """
    sums, pixels, inside, uncovered = _sums(
        frozen(scores, np.float64),
        x0,
        y0,
        width,
        height,
        frozen(centres, np.float64),
        frozen(shapes, np.float64),
        frozen(visible, np.bool_),
    )
    if uncovered >= 0:
        raise ValueError(
            f"region: must hold the ellipses as far as the image shows them, cuts ellipse {uncovered}"
        )
    return sums, pixels, inside


@kernel
def _sums(
    scores: FloatArray,
    x0: int,
    y0: int,
    width: int,
    height: int,
    centres: FloatArray,
    shapes: FloatArray,
    visible: BoolArray,
) -> tuple[FloatArray, IntArray, FloatArray, int]:
    """Return sums, pixels, shares inside, and the first ellipse that the region cuts, or -1."""
    count = len(centres)
    rows, columns = scores.shape
    sums, pixels, inside = np.zeros(count), np.zeros(count, np.int64), np.zeros(count)
    prefixes = np.empty((rows, columns + 1))
    for i in range(rows):
        total = 0.0
        prefixes[i, 0] = 0.0
        for j in range(columns):
            total += scores[i, j]
            prefixes[i, j + 1] = total
    starts, ends = np.empty(rows, np.int32), np.empty(rows, np.int32)
    for p in range(count):
        if not visible[p]:
            continue
        state, first, last = ellipse_rows(centres[p], shapes[p], x0, y0, columns, rows, width, height)
        if state == NOWHERE:
            continue
        if state == UNCOVERED:
            return sums, pixels, inside, p
        ellipse_chords(centres[p], shapes[p], x0, y0, columns, first, last, starts, ends)
        total, covered = 0.0, 0
        for i in range(first, last + 1):
            row = np.uint64(i)  # an unsigned index is not tested for counting from the end
            start, end = np.uint64(starts[row]), np.uint64(ends[row])
            total += prefixes[row, end] - prefixes[row, start]
            covered += ends[row] - starts[row]
        if covered == 0:
            continue
        sums[p], pixels[p] = total, covered
        determinant = shapes[p, 0, 0] * shapes[p, 1, 1] - shapes[p, 0, 1] ** 2
        inside[p] = min(covered * np.sqrt(determinant) / pi, 1.0) if state == CUT else 1.0
    return sums, pixels, inside, -1
