"""What is known of the occluders, and how probable a set of seeing and blind cameras is (Ercan et al. 2007).

Each kind of knowledge answers one question: p(η | x), the probability that of the cameras that walls and
fields of view allow just the reported ones see an object at x. `NoKnowledge` and `KnownPlaces` are the
paper's extremes (Sec. 5), `NormalPriors` its Eqs. 4 to 6; `UniformPriors` (Sec. 4.4) spread each occluder
over a polygon of the visual hull. `ScanLines` goes beyond the paper: it asks only whether something was seen
where the object should have been. That a camera which could see the object does not recognise it is the
probability 1 − `detected` (end of Sec. 4.3).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from math import sqrt
from typing import Literal, Protocol

import numpy as np

from wsnsim.kernels.covering import joint_probabilities, normal_joint
from wsnsim.kernels.hulls import polygon_coverage
from wsnsim.kernels.jit import frozen
from wsnsim.kernels.occlusion import normal_coverage, normal_table
from wsnsim.kernels.sightlines import undisturbed
from wsnsim.systems.scanline.measurement import project, variance
from wsnsim.systems.scanline.regions import Rig
from wsnsim.types import FloatArray, IntArray

Joint = Literal["subsets", "covering", "printed"]
"""How Eq. 6 is evaluated: subset sums, fast; the covering recursion, without a subtraction of its own; or
subset sums without the rescaling of Eq. 5, as printed, which may give probabilities below 0."""


@cache
def _table() -> FloatArray:
    return frozen(normal_table(), np.float64)


@cache
def _table_places() -> FloatArray:
    return frozen(np.linspace(-6.0, 6.0, len(_table())), np.float64)


def _normal(places: FloatArray) -> FloatArray:
    return np.asarray(np.interp(places, _table_places(), _table()))


class Knowledge(Protocol):
    """Tells how probable a report's seeing and blind cameras are."""

    def probabilities(
        self, rig: Rig, points: FloatArray, masks: IntArray, seeing: int, blind: int, negligible: float
    ) -> FloatArray:
        """Return p(η | x) of points (m, 2), (m,), up to a factor that does not depend on the point.

        Parameters
        ----------
        rig : the cameras
        points : [m]
        masks : (m,) - cameras that walls and fields of view allow to see each point
        seeing, blind : cameras that do and do not see the object, as bit masks; others were not heard
        negligible : what is at most this may be returned as 0
        """


def consistent(masks: IntArray, seeing: int) -> FloatArray:
    """Return 1 where all seeing cameras are allowed to see, else 0, (m,)."""
    return np.asarray((seeing & ~masks) == 0, dtype=np.float64)


@dataclass(frozen=True)
class NoKnowledge:
    """Nothing is known of the occluders: any camera may be blind (RMSE_occ = RMSE_max in Sec. 5)."""

    def probabilities(
        self, rig: Rig, points: FloatArray, masks: IntArray, seeing: int, blind: int, negligible: float
    ) -> FloatArray:
        """Return 1 where all seeing cameras are allowed to see, else 0."""
        return consistent(masks, seeing)


@dataclass(frozen=True, eq=False)
class KnownPlaces:
    """The occluders' places are known exactly (RMSE_occ = 0 in Sec. 5).

    Parameters
    ----------
    centres : (k, 2) - [m]
    radius_m : of the cylinders [m]
    detected : probability that a camera that could see the object recognises it
    """

    centres: FloatArray
    radius_m: float
    detected: float = 1.0

    def probabilities(
        self, rig: Rig, points: FloatArray, masks: IntArray, seeing: int, blind: int, negligible: float
    ) -> FloatArray:
        """Return 1 or 0 for cylinders that are like walls, less for cameras that have missed the object."""
        asked = frozen(masks & (seeing | blind), np.int64)
        centres = frozen(self.centres, np.float64)
        visible = undisturbed(frozen(points, np.float64), asked, rig.rows, centres, self.radius_m)
        if self.detected == 1.0:
            return np.asarray(visible == seeing, dtype=np.float64)
        missed = sum((visible & blind) >> k & 1 for k in range(len(rig.cameras)))
        return consistent(visible, seeing) * (1.0 - self.detected) ** missed


@dataclass(frozen=True, eq=False)
class NormalPriors:
    """Each occluder's place is normal, and independent of the others (Eqs. 4 to 6).

    Parameters
    ----------
    means : (k, 2) - [m]
    covs : (k, 2, 2) - [m²]; a singular one counts as very thin
    radius_m : of the cylinders [m]
    joint : how Eq. 6 is evaluated
    detected : probability that a camera that could see the object recognises it
    exponent : of p(η), above 0. 1, as printed, takes the occlusions of successive steps as independent; but
        they last, and so do the errors of the priors: less keeps the tracker from being too sure of itself
    """

    means: FloatArray
    covs: FloatArray
    radius_m: float
    joint: Joint = "subsets"
    detected: float = 1.0
    exponent: float = 1.0

    def coverage(self, rig: Rig, points: FloatArray, masks: IntArray) -> FloatArray:
        """Return q (m, k, n), the probability that occluder k hides point m from camera n (Eq. 4)."""
        q = normal_coverage(
            frozen(points, np.float64),
            frozen(masks, np.int64),
            rig.rows,
            frozen(self.means, np.float64),
            self._triangles,
            self.radius_m,
            _table(),
        )
        return q.transpose(0, 2, 1)

    def probabilities(
        self, rig: Rig, points: FloatArray, masks: IntArray, seeing: int, blind: int, negligible: float
    ) -> FloatArray:
        """Return p(η | x) by Eqs. 4 to 6."""
        result = normal_joint(
            frozen(points, np.float64),
            frozen(masks, np.int64),
            rig.rows,
            frozen(self.means, np.float64),
            self._triangles,
            self.radius_m,
            _table(),
            seeing,
            blind,
            self.detected,
            self.joint == "covering",
            self.joint != "printed",
            negligible ** (1.0 / self.exponent),
        )
        return _raised(_not_below_0(result, self.joint), self.exponent)

    @cached_property
    def _triangles(self) -> FloatArray:
        thinnest = (1e-3 * self.radius_m) ** 2
        covs = self.covs + thinnest * np.eye(2)
        return frozen(covs.reshape(-1, 4)[:, [0, 1, 3]], np.float64)


@dataclass(frozen=True, eq=False)
class UniformPriors:
    """Each occluder is uniformly distributed over a convex polygon, as of the visual hull (Sec. 4.4).

    Parameters
    ----------
    polygons : each (k, 2) - [m]
    radius_m : of the cylinders [m]
    joint : how Eq. 6 is evaluated
    detected : probability that a camera that could see the object recognises it
    exponent : of p(η), above 0, as of `NormalPriors`
    """

    polygons: Sequence[FloatArray]
    radius_m: float
    joint: Joint = "subsets"
    detected: float = 1.0
    exponent: float = 1.0

    def coverage(self, rig: Rig, points: FloatArray, masks: IntArray) -> FloatArray:
        """Return q (m, k, n): the share of polygon k in the rectangle round the line of sight."""
        starts = np.concatenate([[0], np.cumsum([len(polygon) for polygon in self.polygons])])
        corners = np.concatenate([np.empty((0, 2)), *self.polygons])
        q = polygon_coverage(
            frozen(points, np.float64),
            frozen(masks, np.int64),
            rig.rows,
            frozen(corners, np.float64),
            frozen(starts, np.int64),
            self.radius_m,
        )
        return q.transpose(0, 2, 1)

    def probabilities(
        self, rig: Rig, points: FloatArray, masks: IntArray, seeing: int, blind: int, negligible: float
    ) -> FloatArray:
        """Return p(η | x) by Eqs. 5 and 6."""
        q = self.coverage(rig, points, masks)
        least = negligible ** (1.0 / self.exponent)
        result = joint_probability(q, masks, seeing, blind, self.joint, self.detected, least)
        return _raised(result, self.exponent)


@dataclass(frozen=True, eq=False)
class ScanLines:
    """Whole scan lines: a blind camera must show some blob where the object would be. Not in the paper.

    What hides the object from a camera is itself in the camera's scan line, whoever it is: no association,
    no prior. The blob may be off by the error of the pose, so that the test is soft by Eq. 2. Who hides it
    is nearer, and so looks at least as wide as he would at the object's place.

    Parameters
    ----------
    blobs : for each camera the (b, 2) ends of its blobs, not overlapping [px]
    radius_m : of the cylinders: narrower blobs than one at the object's place do not count; 0: all do [m]
    missed : probability of a blind camera without a blob there: of a blob that was missed, or an object
    """

    blobs: Sequence[FloatArray]
    radius_m: float = 0.0
    missed: float = 1e-3

    def probabilities(
        self, rig: Rig, points: FloatArray, masks: IntArray, seeing: int, blind: int, negligible: float
    ) -> FloatArray:
        """Return the product over the blind cameras of the probability of a blob before the object."""
        result = consistent(masks, seeing)
        for k, camera in enumerate(rig.cameras):
            if not blind >> k & 1:
                continue
            asked = np.flatnonzero((masks >> k & 1 == 1) & (result > 0.0))
            ends = np.asarray(self.blobs[k]).reshape(-1, 2)
            centre = project(camera, points[asked])[:, np.newaxis]
            sd = np.sqrt(variance(camera, points[asked], rig.noise))[:, np.newaxis]
            inside = _normal((ends[:, 1] - centre) / sd) - _normal((ends[:, 0] - centre) / sd)
            if self.radius_m > 0.0:
                inside *= self._wide_enough(rig, k, points[asked], ends)
            inside = np.minimum(inside.sum(axis=1), 1.0)
            result[asked] *= self.missed + (1.0 - self.missed) * inside
        return result

    def _wide_enough(self, rig: Rig, k: int, points: FloatArray, ends: FloatArray) -> FloatArray:
        """Return how probable it is that blobs (b, 2) are not narrower than a cylinder at points (m, 2)."""
        camera = rig.cameras[k]
        edge = camera.half_width_px
        slopes = project(camera, points) / camera.focal_px
        distances = np.hypot(*(points - np.asarray(camera.position)).T)
        half = np.arcsin(np.minimum(self.radius_m / np.maximum(distances, self.radius_m), 1.0))
        # to first order in the angle, which is that of a cylinder some diameters away
        expected = 2.0 * camera.focal_px * (1.0 + slopes * slopes) * half
        sd = sqrt(2.0) * max(rig.noise.read_sd_px, 0.5)
        excess = (ends[:, 1] - ends[:, 0] - expected[:, np.newaxis]) / sd
        # a blob that leaves the image is wider than it looks
        cut = (ends[:, 0] <= -edge + 2.0 * sd) | (ends[:, 1] >= edge - 2.0 * sd)
        return np.where(cut, 1.0, _normal(excess))


def joint_probability(
    q: FloatArray,
    masks: IntArray,
    seeing: int,
    blind: int,
    joint: Joint = "subsets",
    detected: float = 1.0,
    negligible: float = 0.0,
) -> FloatArray:
    """Return p(η | x) from the probabilities that single occluders hide x from single cameras (Eqs. 5, 6).

    Parameters
    ----------
    q : (m, k, n) - of occluder k, point m and camera n
    masks : (m,) - cameras that walls and fields of view allow to see each point, as bit masks
    seeing, blind : cameras that do and do not see the object, as bit masks
    joint : how Eq. 6 is evaluated
    detected : probability that a camera that could see the object recognises it
    negligible : what is at most this may be returned as 0

    Returns
    -------
    (m,) - at least 0, but for `printed`
    """
    result = joint_probabilities(
        frozen(q.transpose(0, 2, 1), np.float64),
        frozen(masks, np.int64),
        seeing,
        blind,
        detected,
        joint == "covering",
        joint != "printed",
        negligible,
    )
    return _not_below_0(result, joint)


def _raised(probabilities: FloatArray, exponent: float) -> FloatArray:
    return probabilities if exponent == 1.0 else np.maximum(probabilities, 0.0) ** exponent


def _not_below_0(probabilities: FloatArray, joint: Joint) -> FloatArray:
    """Return p(η): subset sums cancel, and what is below 0 is so by rounding."""
    return np.maximum(probabilities, 0.0) if joint == "subsets" else probabilities
