"""The kernels' work done plainly: NumPy over all pixels of the image, and OpenCV where it is installed.

What a straightforward program does, one ellipse after another: a mask of the full
image, the weights of its pixels, a histogram of it. The twins are the oracles of the
kernels' tests too.
"""

import numpy as np
from numpy.typing import NDArray

from wsnsim.geometry.quadrics import Outlines, outline_boxes
from wsnsim.types import FloatArray

_FRACTION_BITS = 4
"""Of OpenCV's coordinates: sixteenths of a pixel."""


def full_mask_similarities(
    colour: NDArray[np.int16],
    texture: NDArray[np.int16],
    outlines: Outlines,
    q_colour: FloatArray,
    q_texture: FloatArray,
    *,
    weighted: bool = True,
) -> FloatArray:
    """Do what `particle_histogram_similarities` does, in NumPy.

    Parameters
    ----------
    colour, texture : (h, w) - bins of the whole image
    outlines : m ellipses
    q_colour, q_texture : (c,), (t,) - the reference's histograms
    weighted : whether a pixel weighs 1 - d (Epanechnikov), or 1

    Returns
    -------
    (3, m) - coefficients of colour and texture, share inside

    References
    ----------
    Kushwaha, Koutsoukos (2013), eqs. 3, 16, 17.
    """
    found = np.zeros((3, len(outlines.centres)))
    for i in np.flatnonzero(outlines.visible).tolist():
        distances = _distances(outlines, i, colour.shape)
        mask = distances <= 1.0
        weights = 1.0 - distances[mask] if weighted else np.ones(np.count_nonzero(mask))
        mass = weights.sum()
        if mass <= 0.0:
            continue
        p_colour = np.bincount(colour[mask], weights, len(q_colour)) / mass
        p_texture = np.bincount(texture[mask], weights, len(q_texture)) / mass
        found[0, i] = np.sqrt(p_colour * q_colour).sum()
        found[1, i] = np.sqrt(p_texture * q_texture).sum()
        whole = np.pi / np.sqrt(np.linalg.det(outlines.shapes[i])) * (0.5 if weighted else 1.0)
        found[2, i] = min(mass / whole, 1.0) if _cut(outlines, i, colour.shape) else 1.0
    return found


def full_mask_sums(scores: FloatArray, outlines: Outlines) -> FloatArray:
    """Do what `ellipse_sums` does, in NumPy.

    Parameters
    ----------
    scores : (h, w) - of all pixels of the image
    outlines : m ellipses

    Returns
    -------
    (3, m) - sums, pixels, share inside
    """
    found = np.zeros((3, len(outlines.centres)))
    for i in np.flatnonzero(outlines.visible).tolist():
        covered = _distances(outlines, i, scores.shape) <= 1.0
        pixels = np.count_nonzero(covered)
        if not pixels:
            continue
        area = np.pi / np.sqrt(np.linalg.det(outlines.shapes[i]))
        found[0, i], found[1, i] = scores[covered].sum(), pixels
        found[2, i] = min(pixels / area, 1.0) if _cut(outlines, i, scores.shape) else 1.0
    return found


def has_opencv() -> bool:
    """Tell whether OpenCV is installed, and works."""
    try:
        import cv2  # noqa: F401
    except ImportError:
        return False
    return True


def opencv_similarities(
    colour: NDArray[np.int16],
    texture: NDArray[np.int16],
    outlines: Outlines,
    q_colour: FloatArray,
    q_texture: FloatArray,
) -> FloatArray:
    """Compare unweighted histograms by OpenCV's `ellipse` and `calcHist` with a mask.

    Of each ellipse only its own box is looked at. OpenCV draws ellipses as polygons
    with their outline, so that pixels there differ; an exact mask by NumPy takes longer.

    Parameters
    ----------
    colour, texture, outlines, q_colour, q_texture : as in `full_mask_similarities`

    Returns
    -------
    (2, m) - coefficients of colour and texture
    """
    import cv2

    height, width = colour.shape
    colours, textures = colour.astype(np.uint8), texture.astype(np.uint8)
    sqrt_colour, sqrt_texture = np.sqrt(q_colour), np.sqrt(q_texture)
    boxes = outline_boxes(outlines, width, height)
    values, vectors = np.linalg.eigh(outlines.shapes)
    angles = np.degrees(np.arctan2(vectors[:, 1, 0], vectors[:, 0, 0]))
    fine = 1 << _FRACTION_BITS
    axes = np.rint(fine / np.sqrt(values)).astype(int)
    centres = np.rint(fine * (outlines.centres - boxes[:, :2])).astype(int)
    found = np.zeros((2, len(boxes)))
    for i, (x0, y0, x1, y1) in enumerate(boxes.tolist()):
        mask = np.zeros((y1 - y0, x1 - x0), np.uint8)
        if not mask.size:
            continue
        cv2.ellipse(mask, centres[i], axes[i], angles[i], 0, 360, 255, -1, cv2.LINE_8, _FRACTION_BITS)
        pixels = max(float(cv2.countNonZero(mask)), 1.0)
        for row, (bins, root) in enumerate(((colours, sqrt_colour), (textures, sqrt_texture))):
            histogram = cv2.calcHist([bins[y0:y1, x0:x1]], [0], mask, [len(root)], [0, len(root)])
            found[row, i] = (np.sqrt(histogram.ravel()) @ root) / np.sqrt(pixels)
    return found


def _distances(outlines: Outlines, i: int, shape: tuple[int, ...]) -> FloatArray:
    """Return (y - c)ᵀ B (y - c) of all pixels (h, w)."""
    dx = np.arange(shape[1]) - outlines.centres[i, 0]
    dy = (np.arange(shape[0]) - outlines.centres[i, 1])[:, None]
    B = outlines.shapes[i]
    return np.asarray(B[0, 0] * dx * dx + 2.0 * B[0, 1] * dx * dy + B[1, 1] * dy * dy, dtype=np.float64)


def _cut(outlines: Outlines, i: int, shape: tuple[int, ...]) -> bool:
    """Tell whether the ellipse's box reaches beyond the image's outermost pixels."""
    spread = np.sqrt(np.diag(np.linalg.inv(outlines.shapes[i])))
    low, high = np.ceil(outlines.centres[i] - spread), np.floor(outlines.centres[i] + spread)
    return bool((low < 0).any() or (high > [shape[1] - 1, shape[0] - 1]).any())
