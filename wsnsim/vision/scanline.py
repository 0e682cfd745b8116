"""A scan line: an image summed along its columns, cut at a threshold, and told by the ends of its blobs.

Columns are counted as pixels are, with integer coordinates in their middles: a line of w pixels goes from
-0.5 to w - 0.5. Left out: cameras that do not stand upright; what is vertical in the room must be nearly
so in the image, since all rows of a column count as one direction.
"""

import numpy as np

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.types import BoolArray, FloatArray, IntArray

_UPRIGHT = 1e-3
"""Least horizontal part of the direction in which a camera looks."""


def column_sums(mask: BoolArray) -> IntArray:
    """Return how many pixels of each column of a mask (h, w) are set, (w,)."""
    return np.asarray(np.count_nonzero(mask, axis=0), dtype=np.int64)


def blobs(sums: IntArray, least_px: float, gap_px: float = 0.0, width_px: float = 0.0) -> FloatArray:
    """Return the ends (b, 2) of the runs of columns whose sums reach a threshold, ascending [px].

    An end lies where the line between two columns' sums passes half of the step that the run begins with,
    or the threshold where that is higher; at the side of the image it is the image's own.

    Parameters
    ----------
    sums : (w,) - of the columns [px]
    least_px : threshold, above 0 [px]
    gap_px : runs that are closer become one [px]
    width_px : narrower runs are left out, after that [px]
    """
    over = np.concatenate(([False], sums >= least_px, [False]))
    first = np.flatnonzero(~over[:-1] & over[1:])
    last = np.flatnonzero(over[:-1] & ~over[1:]) - 1
    if not len(first):
        return np.empty((0, 2))
    line = np.concatenate((sums[:1], sums, sums[-1:])).astype(np.float64)
    starts = first - _share_before(line[first + 1], line[first], least_px)
    ends = last + _share_before(line[last + 1], line[last + 2], least_px)
    starts[first == 0] = -0.5
    ends[last == len(sums) - 1] = len(sums) - 0.5
    apart = starts[1:] - ends[:-1] >= gap_px
    runs = np.stack((starts[np.append(True, apart)], ends[np.append(apart, True)]), axis=1)
    return np.asarray(runs[runs[:, 1] - runs[:, 0] >= width_px], dtype=np.float64)


def heaviest(runs: FloatArray, sums: IntArray) -> tuple[int, float]:
    """Return the number of the run (b, 2) with the largest sum over its columns, and that sum [px].

    Raises
    ------
    ValueError : there is no run
    """
    if not len(runs):
        raise ValueError("runs: must be at least one, got none")
    low, high = _columns(runs, len(sums))
    totals = np.concatenate(([0], np.cumsum(sums)))
    weights = totals[high] - totals[low]
    number = int(weights.argmax())
    return number, float(weights[number])


def wide_runs(runs: FloatArray, sums: IntArray, least_px: float, columns_per_px: float) -> FloatArray:
    """Return the runs (b, 2) that are no outlines: those that are wide for their height.

    Colours mix in the column where an outline lies, from top to bottom, and may then be anybody's. Two
    outlines side by side make two such columns, so that a third between them is of one thing. Where colour
    is told more coarsely, as in JPEG files, there are more of them, but still few for their height, which
    is told in the same pixels, near and far.

    Parameters
    ----------
    runs : of `blobs`
    sums : (w,) - of the columns [px]
    least_px : threshold that the runs were found with; columns below, in gaps, do not count [px]
    columns_per_px : a run has so many columns, at least, for each pixel of the highest of them [-]
    """
    over = sums >= least_px
    inner = np.convolve(over, np.ones(3), mode="same") == 3.0
    wide = [
        bool(inner[low:high].any())
        and np.count_nonzero(over[low:high]) >= columns_per_px * sums[low:high].max()
        for low, high in zip(*_columns(runs, len(sums)), strict=True)
    ]
    return runs[np.array(wide, dtype=np.bool_)]


def line_places(camera: PinholeCamera, columns: FloatArray) -> FloatArray:
    """Return f tan α of columns (...), α the angle to the left of where the camera looks, (...) [px].

    The angle is that of the column's ray in the plane of the horizon, seen from above, so that a point
    there has h / d times the focal length, whatever the lens bends and however the camera is tilted, up
    to where the horizon leaves the image; then the row next to it stands for it. One row does for the
    whole horizon, which a lens bends a little where the camera is tilted.

    Raises
    ------
    ValueError : the camera looks straight down or up
    """
    ahead = camera.rotation[2].copy()
    ahead[2] = 0.0
    length = float(np.linalg.norm(ahead))
    if length < _UPRIGHT:
        raise ValueError(
            "camera: must look to a side for a scan line, got one that looks straight down or up"
        )
    ahead /= length
    (horizon,), _ = camera.project(camera.position[np.newaxis] + ahead)
    row = min(max(float(horizon[1]), -0.5), camera.resolution_px[1] - 0.5)
    flat = np.asarray(columns, dtype=np.float64).ravel()
    rays = camera.rays(np.column_stack((flat, np.full(len(flat), row)))) @ camera.rotation
    left = np.array([-ahead[1], ahead[0], 0.0])
    places = camera.focal_px * (rays @ left) / (rays @ ahead)
    return np.asarray(places.reshape(np.shape(columns)), dtype=np.float64)


def middle_place(camera: PinholeCamera, ends_px: FloatArray) -> float:
    """Return the place of the axis of an upright cylinder whose sides are at two places (2,) [px].

    The rays along its sides lie at equal angles on either side of the one to its axis; the mean of the
    places themselves would lie too far out.
    """
    return camera.focal_px * float(np.tan(np.arctan(ends_px / camera.focal_px).mean()))


def _columns(runs: FloatArray, count: int) -> tuple[IntArray, IntArray]:
    """Return the first column of each run (b, 2), and the one behind its last, of so many in the image."""
    low, high = np.ceil(runs[:, 0]).astype(np.int64), np.floor(runs[:, 1]).astype(np.int64) + 1
    return np.maximum(low, 0), np.minimum(high, count)


def _share_before(inside: FloatArray, outside: FloatArray, least_px: float) -> FloatArray:
    """Return how far outside of a run's last column (0–1) its end lies."""
    level = np.maximum(0.5 * inside, least_px)
    return np.asarray((inside - level) / np.maximum(inside - outside, 1e-9), dtype=np.float64)
