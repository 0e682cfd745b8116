"""A likelihood from single pixels: each is the target's, or the background's beside it.

Each pixel's colour and texture are so much likelier under the target's histogram
than under that of the background around it; the sum over an outline is how much
likelier the target is there. Unlike the similarity of two histograms it loses by
background inside the outline and by target outside, and one prefix sum a row makes it
cheap. It goes beyond Kushwaha & Koutsoukos 2013.
"""

from dataclasses import dataclass
from math import pi

import numpy as np

from wsnsim.hardware.work import Work
from wsnsim.kernels.ellipse_sums import ellipse_sums, log_ratio_scores
from wsnsim.systems.multiview.sight import Sight
from wsnsim.types import FloatArray

_TARGET_FLOOR = 0.02
"""Share of the target's pixels that may have any colour: light, noise and edges make new ones."""

# Operations of the mote's own integer implementation, counted from its inner loops.
_SCORE_OPS_PER_PIXEL = 8.0  # two counts, two look-ups, two sums
_ROW_OPS = 25.0  # one particle's chord in one row: its ends in fixed point, clipping, difference


@dataclass(frozen=True, eq=False)
class LogRatios:
    """Log-likelihood ratios of particles in one image.

    Parameters
    ----------
    scores : (M,) sum over what the image shows of the outline, in units of a whole target's pixels; 0
        where it shows nothing: as likely as that the target is not in the image
    work : what it cost
    """

    scores: FloatArray
    work: Work


def log_ratios(
    sight: Sight, colour: FloatArray, texture: FloatArray, colour_share: float, clip: float
) -> LogRatios:
    """Compare target and background at every particle.

    Parameters
    ----------
    colour, texture : (c,), (t,) the target's histograms, from this side
    colour_share : α_HS; 1 leaves texture out
    clip : most that one pixel counts
    """
    outlines, region = sight.outlines, sight.region
    seen = outlines.visible
    none = LogRatios(np.zeros(seen.size), Work())
    if region.colour.size == 0:
        return none
    areas = pi / np.sqrt(np.linalg.det(outlines.shapes))
    area = float(np.median(areas[seen]))
    share = min(area / region.colour.size, 0.9)
    tables = []
    for bins, target, weight in (
        (region.colour, colour, 2.0 * colour_share),
        (region.texture, texture, 2.0 * (1.0 - colour_share)),
    ):
        counts = np.bincount(bins.ravel(), minlength=target.size).astype(np.float64)
        table = weight * _table(counts, target, share)
        tables.append(np.clip(table, -clip, clip))
    sums, pixels, _ = ellipse_sums(
        log_ratio_scores(region.colour, region.texture, tables[0], tables[1]),
        region.x0,
        region.y0,
        *sight.resolution_px,
        outlines.centres,
        outlines.shapes,
        outlines.visible,
    )
    shown = pixels > 0
    if not shown.any():
        return none
    rows = 2.0 * np.sqrt(areas[shown] / pi).sum()
    work = Work(int_ops=_SCORE_OPS_PER_PIXEL * region.colour.size + _ROW_OPS * float(rows))
    return LogRatios(sums / area, work)


def _table(counts: FloatArray, target: FloatArray, share: float) -> FloatArray:
    """Return log p_target / p_background of each bin.

    The region's histogram is the background's and, with about `share` of its
    pixels, the target's: what the target can account for is taken off.
    """
    total = float(counts.sum())
    background = np.maximum(counts - share * total * target, 0.0) + 1.0
    background /= background.sum()
    known = (1.0 - _TARGET_FLOOR) * target + _TARGET_FLOOR / target.size
    return np.asarray(np.log(known / background))
