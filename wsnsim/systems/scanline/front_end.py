"""From an image to a scan line and the object in it, as a camera's mote does it (Sec. 3).

Background subtraction, vertical sums and a threshold give the blobs. The paper assumes that a camera can
tell the object from the occluders, by some feature; here it is the object's colours, known from pictures
that were taken of it before. The centre of the columns in these colours is the measurement: where an
occluder hides one side of the object, it is the centre of what is left. Slivers do not count: colours mix
at the outlines of others, and two or three columns there often look like the object's.
"""

from math import cos, pi, sin

import numpy as np

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.hardware.work import Work
from wsnsim.systems.base import TrackedTarget
from wsnsim.systems.scanline.reading import Reading
from wsnsim.systems.scanline.rules import PixelFrontEnd
from wsnsim.types import ByteArray, IntArray
from wsnsim.vision.backprojection import learned_colours, object_pixels
from wsnsim.vision.foreground import GAIN_STRIDE, Background, foreground, gain, learned, updated
from wsnsim.vision.scanline import blobs, column_sums, heaviest, line_places, middle_place, wide_runs

_SIDES = 8
"""Pictures of the object, all round it, at its own height."""

_LEAST_SHOWN = 0.4
"""Share of the object's width that must show. Half of it does where its axis does and somebody hides one
side, which is when the measurement's model has it seen; a column at the end may be covered by half."""

# Operations of the mote's own integer implementation, counted from its inner loops, a pixel.
_DIFFERENCE_OPS = 18.0
"""Each channel: times the gain and a shift, minus, squared, added (5); times 1 / variance, compared, added to
the column's sum (3)."""
_GAIN_OPS = 32.0
"""Of the sample: two sums (4), two limits (8), a division (16), a count in the histogram (4)."""
_UPDATE_OPS = 16.0
"""Each channel: the difference shifted and added to the mean (4); the variance likewise (4)."""
_COLOUR_OPS = 50.0
"""Largest and smallest channel (5), hue and saturation with a division each (38), a count, and later a
look-up and the column's sum (7)."""
_COLUMN_OPS = 10.0
"""Of each column: two thresholds, with the run that it begins or ends."""
_IMAGE_BYTES, _MODEL_BYTES = 3.0, 4.0
"""A pixel's image; its mean and variance, a byte each channel and one more."""


class FrontEnd:
    """Reads scan lines from one camera's images.

    Parameters
    ----------
    params : thresholds
    camera : calibrated
    target : the object, of which pictures are taken or given

    Raises
    ------
    ValueError : the camera looks straight down or up
    """

    def __init__(self, params: PixelFrontEnd, camera: PinholeCamera, target: TrackedTarget) -> None:
        self._params, self._camera = params, camera
        turns = [2.0 * pi * k / _SIDES for k in range(_SIDES)]
        portraits = [view.portrait for view in target.album] or [
            target.portrait(np.array([cos(turn), sin(turn), 0.0])) for turn in turns
        ]
        self._colours = learned_colours(portraits, target.semi_axes_m)
        # from its narrow side; columns and rows are of one size
        self._columns_per_px = _LEAST_SHOWN * float(target.semi_axes_m[:2].min() / target.semi_axes_m[2])
        line_places(camera, np.zeros(1))

    def start(self, empty: ByteArray) -> Background:
        """Return the background from a picture (h, w, 3) of the room before anybody is in it."""
        return learned((empty,))

    def read(self, image: ByteArray, background: Background) -> tuple[Reading, Background, Work]:
        """Read one frame.

        Parameters
        ----------
        image : (h, w, 3) - RGB
        background : after the frame before

        Returns
        -------
        reading : the object's place, NaN where too few pixels have its colours, and the blobs
        background : with what this frame shows of it
        work : of the mote

        Raises
        ------
        ValueError : the image has not the background's shape
        """
        params = self._params
        brightness = gain(background, image)
        mask = foreground(background, image, params.foreground_sd, brightness)
        sums = column_sums(mask)
        own = object_pixels(self._colours, image, mask, params.colour_share, params.colour_ratio)
        runs = blobs(sums, params.column_px, params.gap_px, params.width_px)
        # columns run to the right, places to the left
        line = line_places(self._camera, runs)[::-1, ::-1]
        after = updated(background, image, mask, params.learning_rate, brightness)
        return Reading(self._place(column_sums(own), sums), line), after, _work(image, int(sums.sum()))

    def _place(self, own: IntArray, whole: IntArray) -> float:
        """Return where the object has its middle [px]; NaN where too little shows its colours.

        Parameters
        ----------
        own, whole : (w,), (w,) - pixels of each column in the object's colours, and in the foreground
        """
        params = self._params
        sums = np.where(own >= params.object_share * whole, own, 0)
        runs = blobs(sums, params.object_column_px, params.gap_px, params.width_px)
        runs = wide_runs(runs, sums, params.object_column_px, self._columns_per_px)
        if not len(runs):
            return float("nan")
        number, pixels = heaviest(runs, sums)
        if pixels < params.object_px:
            return float("nan")
        return middle_place(self._camera, line_places(self._camera, runs[number]))


def _work(image: ByteArray, coloured: int) -> Work:
    """Return the work of one frame, of which so many pixels are foreground."""
    height, width, _ = image.shape
    pixels = float(height * width)
    return Work(
        int_ops=(_DIFFERENCE_OPS + _GAIN_OPS / GAIN_STRIDE**2) * pixels
        + _UPDATE_OPS * (pixels - coloured)
        + _COLOUR_OPS * coloured
        + _COLUMN_OPS * width,
        memory_bytes=(_IMAGE_BYTES + _MODEL_BYTES) * pixels
        + _MODEL_BYTES * (pixels - coloured)
        + _IMAGE_BYTES * coloured,
    )
