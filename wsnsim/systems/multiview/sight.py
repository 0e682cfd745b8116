"""One camera's look at the places where a target may be: its outlines there, and the pixels they hold."""

from dataclasses import dataclass, replace
from typing import Self

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.geometry.quadrics import Outlines, ellipsoid_outlines, outline_box
from wsnsim.geometry.rotations import quaternion_to_matrix
from wsnsim.hardware.work import Work
from wsnsim.systems.multiview.reference_model import ReferenceModel
from wsnsim.systems.multiview.viewpoints import nearest_viewpoint
from wsnsim.types import ByteArray, FloatArray
from wsnsim.vision.features import BinnedRegion, FeatureSpace

# Operations of the mote's own integer implementation, counted from its inner loops.
_BINNING_OPS_PER_PIXEL = 90.0  # hue by division, saturation, eight LBP comparisons, table look-ups
_OUTLINE_FLOATS = 120.0  # dual conic, its inverse, one particle


@dataclass(frozen=True, eq=False)
class Sight:
    """Outlines of a target at M places, and the bins of the pixels around them.

    Parameters
    ----------
    outlines : M ellipses
    region : holds them as far as the image shows them
    resolution_px : (width, height) of the image [px]
    work : what it cost to find them
    """

    outlines: Outlines
    region: BinnedRegion
    resolution_px: tuple[int, int]
    work: Work

    def only(self, number: int) -> Self:
        """Return the sight of one of the places, which costs nothing more."""
        one = slice(number, number + 1)
        outlines = self.outlines
        return replace(
            self,
            outlines=Outlines(outlines.centres[one], outlines.shapes[one], outlines.visible[one]),
            work=Work(),
        )


def look(
    image: ByteArray,
    camera: PinholeCamera,
    places: FloatArray,
    orientation: FloatArray,
    semi_axes: FloatArray,
    features: FeatureSpace,
) -> Sight:
    """Find outlines and pixels of a target that may be at `places`.

    Parameters
    ----------
    image : (h, w, 3) RGB
    places : (M, 3) [m]
    orientation : (4,) unit quaternion of the target
    semi_axes : (3,) [m]
    """
    outlines = ellipsoid_outlines(camera, places, orientation, semi_axes)
    sight = look_at_outlines(image, camera, outlines, features)
    return replace(sight, work=sight.work + Work(float_ops=len(places) * _OUTLINE_FLOATS))


def look_at_outlines(
    image: ByteArray, camera: PinholeCamera, outlines: Outlines, features: FeatureSpace
) -> Sight:
    """Find the pixels of outlines that are known already.

    Parameters
    ----------
    image : (h, w, 3) RGB
    """
    region = features.bin_region(image, outline_box(outlines, *camera.resolution_px))
    pixels = region.colour.size
    work = Work(int_ops=_BINNING_OPS_PER_PIXEL * pixels, memory_bytes=3.0 * pixels)
    return Sight(outlines, region, camera.resolution_px, work)


def facing_viewpoint(
    model: ReferenceModel, camera: PinholeCamera, place: FloatArray, orientation: FloatArray
) -> int:
    """Return the model's viewpoint from which a camera sees a target at `place` (3,) (Eqs. 12–14)."""
    return nearest_viewpoint(model.directions, camera.position - place, quaternion_to_matrix(orientation))
