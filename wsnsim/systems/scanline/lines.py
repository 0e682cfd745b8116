"""Whole scan lines from the truth: which of a line's pixels show somebody who is before the walls.

What a camera would have after background subtraction, vertical sum and threshold: the blobs of cylinders on
the floor plan, walls being background. Left out: heights, and shapes other than discs.
"""

from functools import cached_property

import numpy as np

from wsnsim.geometry.polygons import half_planes
from wsnsim.systems.scanline.measurement import ScanCamera, camera_frame
from wsnsim.systems.scanline.regions import Room
from wsnsim.types import BoolArray, FloatArray


class LineOfSight:
    """One camera's line of pixels in a room.

    Parameters
    ----------
    camera : where it is believed to stand: walls are where it sees them
    room : around it
    """

    def __init__(self, camera: ScanCamera, room: Room) -> None:
        self._camera = camera
        self._room = room

    def blobs(self, camera: ScanCamera, centres: FloatArray, radii_m: FloatArray | float) -> FloatArray:
        """Return what discs on the floor leave in the scan line, ends of whole pixels.

        Parameters
        ----------
        camera : where it really stands in this frame
        centres : (k, 2) - of the discs [m]
        radii_m : of each disc (k,), or of all [m]

        Returns
        -------
        (b, 2) - ascending, not overlapping [px]
        """
        h, d = camera_frame(camera, centres)
        distances = np.hypot(h, d)
        half = np.arcsin(np.minimum(radii_m / np.maximum(distances, radii_m), 1.0))
        angles = np.arctan2(h, d)
        within = np.abs(self._angles[:, np.newaxis] - angles) <= half
        shown = (within & (distances < self._walls[:, np.newaxis])).any(axis=1)
        return self._runs(np.asarray(shown, dtype=np.bool_))

    @cached_property
    def _edges(self) -> FloatArray:
        """Borders of the pixels (w + 1,) on the axis of z [px]."""
        edge = self._camera.half_width_px
        return np.linspace(-edge, edge, max(2, round(2.0 * edge)) + 1)

    @cached_property
    def _angles(self) -> FloatArray:
        """Directions of the pixels' middles (w,), anticlockwise from the optical axis [rad]."""
        middles = 0.5 * (self._edges[1:] + self._edges[:-1])
        return np.arctan(middles / self._camera.focal_px)

    @cached_property
    def _walls(self) -> FloatArray:
        """How far each pixel sees before a wall (w,) [m]."""
        directions = self._camera.heading_rad + self._angles
        rays = np.stack([np.cos(directions), np.sin(directions)], axis=1)
        nearest = np.full(len(rays), np.inf)
        for polygon in self._room.walls:
            planes, _ = half_planes([polygon])
            starts = planes[:, :2] @ np.asarray(self._camera.position) - planes[:, 2]
            changes = rays @ planes[:, :2].T
            with np.errstate(divide="ignore", invalid="ignore"):
                meets = -starts / changes
            # a ray alongside a plane never meets it; it is inside for good, or never
            enters = np.where(changes < 0.0, meets, np.where((changes == 0.0) & (starts > 0.0), np.inf, 0.0))
            leaves = np.where(changes > 0.0, meets, np.inf)
            first = enters.max(axis=1)
            nearest = np.where(first < leaves.min(axis=1), np.minimum(nearest, first), nearest)
        return nearest

    def _runs(self, shown: BoolArray) -> FloatArray:
        """Return the ends (b, 2) of runs of pixels that show something."""
        padded = np.concatenate(([False], shown, [False]))
        turns = np.flatnonzero(padded[1:] != padded[:-1])
        return self._edges[turns].reshape(-1, 2)
