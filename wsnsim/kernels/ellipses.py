"""The pixels of an ellipse (y - c)ᵀ B (y - c) ≤ 1, row by row, as the kernels share them.

Pixel (x, y) is the point (x, y): an image of w × h pixels shows 0 ≤ x ≤ w - 1, 0 ≤ y ≤ h - 1.
"""

import numpy as np
from numpy.typing import NDArray

from wsnsim.kernels.jit import kernel
from wsnsim.types import FloatArray

FAR = 1e9
"""Pixels from the image beyond which an ellipse is nowhere; also what keeps NaN out."""

NOWHERE, WHOLE, CUT, UNCOVERED = 0, 1, 2, 3


@kernel
def ellipse_rows(
    centre: FloatArray, shape: FloatArray, x0: int, y0: int, columns: int, rows: int, width: int, height: int
) -> tuple[int, int, int]:
    """Find the rows of a region of an image that an ellipse may have pixels in.

    Parameters
    ----------
    centre : (2,) - (x, y) of the ellipse [px]
    shape : (2, 2) - B, symmetric [1/px²]
    x0, y0 : the region's first pixel in the image
    columns, rows : of the region
    width, height : of the image [px]

    Returns
    -------
    state : NOWHERE for an ellipse that is not finite or has no pixel's centre in its box; WHOLE or CUT by
        the image's border; UNCOVERED where the region does not hold what the image shows of it
    first, last : rows, counted in the region
    """
    a, b, c = shape[0, 0], shape[0, 1], shape[1, 1]
    determinant = a * c - b * b
    # Written so that a NaN is passed over too; an index made of one writes anywhere.
    if not (determinant > 0.0 and a > 0.0 and abs(centre[0]) < FAR and abs(centre[1]) < FAR):
        return NOWHERE, 0, -1
    half_width, half_height = np.sqrt(c / determinant), np.sqrt(a / determinant)
    left, right = np.ceil(centre[0] - half_width), np.floor(centre[0] + half_width)
    top, bottom = np.ceil(centre[1] - half_height), np.floor(centre[1] + half_height)
    cut = left < 0 or top < 0 or right > width - 1 or bottom > height - 1
    left, right = max(left, 0.0), min(right, width - 1.0)
    top, bottom = max(top, 0.0), min(bottom, height - 1.0)
    if left > right or top > bottom:
        return NOWHERE, 0, -1
    if left < x0 or top < y0 or right > x0 + columns - 1 or bottom > y0 + rows - 1:
        return UNCOVERED, 0, -1
    return CUT if cut else WHOLE, int(top) - y0, int(bottom) - y0


@kernel
def ellipse_chords(
    centre: FloatArray,
    shape: FloatArray,
    x0: int,
    y0: int,
    columns: int,
    first: int,
    last: int,
    starts: NDArray[np.int32],
    ends: NDArray[np.int32],
) -> None:
    """Write where the ellipse begins and ends in the rows `first` to `last` of a region.

    Parameters
    ----------
    centre, shape, x0, y0, columns : as in `ellipse_rows`
    first, last : rows, counted in the region
    starts, ends : (rows,) - pixels starts[i] ≤ x < ends[i] of row i, counted in the region; written
    """
    a, b, c = shape[0, 0], shape[0, 1], shape[1, 1]
    determinant = a * c - b * b
    cx, cy = centre[0] - x0, centre[1] - y0
    per_a, slope = 1.0 / a, b / a
    low, high = 0.0, float(columns)
    for i in range(first, last + 1):
        dy = np.int32(i) - cy
        chord = a - determinant * dy * dy
        middle, half = cx - slope * dy, np.sqrt(chord if chord > 0.0 else 0.0) * per_a
        start, end = np.ceil(middle - half), np.floor(middle + half) + 1.0
        # Clipped as floats, and so that a NaN is clipped too: beyond 2³¹ an integer is anything.
        start, end = start if start > low else low, end if end < high else high
        start = start if start < high else high
        end = end if end > start and chord >= 0.0 else start
        starts[i], ends[i] = np.int32(start), np.int32(end)
