"""What a camera makes of one frame, whether from pixels or at the level of measurements."""

from dataclasses import dataclass, field

import numpy as np

from wsnsim.types import FloatArray, IntArray


def _no_blobs() -> FloatArray:
    return np.empty((0, 2))


@dataclass(frozen=True, eq=False)
class Reading:
    """A scan line, told in numbers.

    Parameters
    ----------
    value_px : z of the object, left of the optical axis; NaN where the camera does not see it [px] (Eq. 1)
    blobs : (b, 2) - ends of what stands out from the background, the object's own included, ascending and
        not overlapping, on the axis of z [px]
    """

    value_px: float
    blobs: FloatArray = field(default_factory=_no_blobs)


@dataclass(frozen=True, eq=False)
class OccluderPlaces:
    """What a node's further sensor says of some occluders: a virtual measurement of each (Sec. 5).

    Parameters
    ----------
    ids : (k,) - numbers of the occluders, from 0
    places : (k, 2) - measured [m]
    """

    ids: IntArray
    places: FloatArray


@dataclass(frozen=True, eq=False)
class Measured:
    """All that a camera's mote measures at one instant without looking at pixels.

    Parameters
    ----------
    reading : of the camera
    occluders : of its further sensor; None without one
    hidden : what is not in the world hides the object from the camera (Sec. 6): what is seen of it in real
        pixels is thrown away
    """

    reading: Reading
    occluders: OccluderPlaces | None = None
    hidden: bool = False
