"""The visual hull of the occluders: scan lines, cones, polygons, priors (Ercan et al. 2007, Sec. 4.4).

The room is cut by the borders of all blobs, camera by camera. What a camera sees the background at is
empty; what it does not see at all it leaves as it is. The pieces that remain hold all occluders, and
besides them space that is only never seen empty: parts of larger pieces, and phantoms. Left out: pieces
that touch are not joined, so that somebody at the edge of a field of view may be in two.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import pi

import numpy as np

from wsnsim.geometry.polygons import least_width, polygon_moments
from wsnsim.kernels.hulls import cones_pieces
from wsnsim.kernels.jit import frozen
from wsnsim.systems.scanline.measurement import Report, ScanCamera, project
from wsnsim.systems.scanline.regions import Rig
from wsnsim.types import BoolArray, FloatArray

_MOST_PIECES = 4096
_LEAST_SHARE = 1e-9
"""Of the room, that a piece takes."""


class TooManyPiecesError(ValueError):
    """Scan lines cut the floor into more pieces than can be reckoned with."""


@dataclass(frozen=True, eq=False)
class Hull:
    """Convex pieces of the floor that may be occupied.

    Parameters
    ----------
    polygons : each (k, 2) - corners in turn [m]
    """

    polygons: tuple[FloatArray, ...]

    @property
    def area_m2(self) -> float:
        """Of all pieces [m²]."""
        return float(sum(abs(polygon_moments(polygon)[0]) for polygon in self.polygons))

    def priors(self) -> tuple[FloatArray, FloatArray]:
        """Return means (k, 2) [m] and covariances (k, 2, 2) [m²] of uniform distributions over the pieces."""
        if not self.polygons:
            return np.empty((0, 2)), np.empty((0, 2, 2))
        moments = [polygon_moments(polygon) for polygon in self.polygons]
        return np.array([mean for _, mean, _ in moments]), np.array([cov for _, _, cov in moments])


def visual_hull(rig: Rig, blobs: Sequence[FloatArray], heard: BoolArray, margin_px: float = 0.0) -> Hull:
    """Cut the room by the blobs of whole scan lines.

    Parameters
    ----------
    rig : cameras and room; where a wall is seen, nothing is known of what is behind it
    blobs : for each camera (b, 2), the ends of its blobs, not overlapping [px]
    heard : (n,) - cameras whose scan lines came
    margin_px : by which blobs are widened on either side: cones of cameras whose pose is not exact may miss
        each other [px]

    Raises
    ------
    TooManyPiecesError : there are thousands
    """
    room = rig.room
    corners = np.array(
        [room.low, [room.high[0], room.low[1]], room.high, [room.low[0], room.high[1]]], dtype=np.float64
    )
    flat, starts = corners, np.array([0, 4])
    for k, camera in enumerate(rig.cameras):
        if not heard[k]:
            continue
        edge = camera.half_width_px
        wide = np.clip(np.asarray(blobs[k]).reshape(-1, 2) + [-margin_px, margin_px], -edge, edge)
        cones = _merged([*wide, *_wall_blobs(camera, rig)])
        flat, starts, whole = cones_pieces(
            frozen(flat, np.float64),
            frozen(starts, np.int64),
            rig.rows[k],
            frozen(cones, np.float64),
            _MOST_PIECES,
            _LEAST_SHARE * float(np.prod(room.sides)),
        )
        if not whole:
            raise TooManyPiecesError(
                f"blobs: must cut the room into at most {_MOST_PIECES} pieces, camera {k} makes more"
            )
    return Hull(tuple(flat[first:last] for first, last in pairwise(starts)))


def without_small(hull: Hull, diameter_m: float) -> Hull:
    """Leave out pieces in which no cylinder of that diameter has room, by their area and least width."""
    keep = [
        polygon
        for polygon in hull.polygons
        if polygon_moments(polygon)[0] >= 0.25 * pi * diameter_m**2 and least_width(polygon) >= diameter_m
    ]
    return Hull(tuple(keep))


def without_own(hull: Hull, rig: Rig, report: Report, margin_px: float) -> Hull:
    """Leave out the piece that the object itself has made.

    That is the piece whose outlines hold the object's place in every scan line of a camera that sees it, at
    least two of them: with fewer, nothing can be told and all remain. Of several such pieces the smallest.

    Parameters
    ----------
    hull : of scan lines in which the object is a blob too
    rig : cameras
    report : where they see the object
    margin_px : by which its place may be beside the outlines [px]
    """
    seeing = [k for k in range(len(rig.cameras)) if report.seeing >> k & 1]
    if len(seeing) < 2:
        return hull
    own = []
    for number, polygon in enumerate(hull.polygons):
        outlines = [_outline(rig.cameras[k], polygon) for k in seeing]
        if all(
            low - margin_px <= report.values_px[k] <= high + margin_px
            for k, (low, high) in zip(seeing, outlines, strict=True)
        ):
            own.append((polygon_moments(polygon)[0], number))
    if not own:
        return hull
    removed = min(own)[1]
    return Hull(tuple(polygon for number, polygon in enumerate(hull.polygons) if number != removed))


def without_phantoms(hull: Hull, rig: Rig, blobs: Sequence[FloatArray]) -> Hull:
    """Keep the pieces that are needed to explain the blobs.

    A blob that one piece alone explains proves that piece. The proven pieces explain their blobs; of what
    remains the piece is kept that explains most blobs that are not explained yet, and so on until all
    are. What is left over may be phantoms: no camera contradicts that they are empty. Nor does one prove it.

    Parameters
    ----------
    hull : to be thinned
    rig : cameras
    blobs : for each camera (b, 2) [px]

    References
    ----------
    Yang, González-Baños, Guibas (2003), Counting people in crowds with a real-time network of simple image
    sensors, ICCV: a polygon is proven by a projection that has no other.
    """
    if not hull.polygons:
        return hull
    explained = np.array(
        [
            [
                low < high and min(high, end) - max(low, start) > 0.0
                for camera, own in zip(rig.cameras, blobs, strict=True)
                for low, high in [_outline(camera, polygon)]
                for start, end in np.asarray(own).reshape(-1, 2)
            ]
            for polygon in hull.polygons
        ],
        dtype=np.bool_,
    ).reshape(len(hull.polygons), -1)
    proven = np.asarray(explained[:, explained.sum(axis=0) == 1].any(axis=1), dtype=np.bool_)
    open_blobs = explained.any(axis=0) & ~explained[proven].any(axis=0)
    while open_blobs.any():
        best = int((explained & open_blobs).sum(axis=1).argmax())
        proven[best] = True
        open_blobs &= ~explained[best]
    return Hull(tuple(polygon for polygon, kept in zip(hull.polygons, proven, strict=True) if kept))


def _outline(camera: ScanCamera, polygon: FloatArray) -> tuple[float, float]:
    """Return where a polygon begins and ends in a scan line [px]; (0, 0) unless all of it is before."""
    places = project(camera, polygon)
    if np.isnan(places).any():
        return 0.0, 0.0
    edge = camera.half_width_px
    return max(float(places.min()), -edge), min(float(places.max()), edge)


def _wall_blobs(camera: ScanCamera, rig: Rig) -> list[FloatArray]:
    """Return the parts of a scan line in which a wall is."""
    edge = camera.half_width_px
    blobs = []
    for polygon in rig.room.walls:
        places = project(camera, polygon)
        if np.isnan(places).any():  # a wall beside the camera: nothing is known of that side
            blobs.append(np.array([-edge, edge]))
        elif places.max() > -edge and places.min() < edge:
            blobs.append(np.array([max(places.min(), -edge), min(places.max(), edge)]))
    return blobs


def _merged(blobs: Sequence[FloatArray]) -> FloatArray:
    """Return intervals (b, 2) that do not overlap and cover the same."""
    merged: list[list[float]] = []
    for start, end in sorted((float(start), float(end)) for start, end in blobs):
        if merged and start <= merged[-1][1]:
            merged[-1][1] = max(merged[-1][1], end)
        else:
            merged.append([start, end])
    return np.array(merged, dtype=np.float64).reshape(-1, 2)
