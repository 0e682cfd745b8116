"""What runs on a camera's mote: a frame in, a scan line in a few bytes out (Ercan et al. 2007, Sec. 3)."""

from dataclasses import dataclass

import numpy as np

from wsnsim.hardware.work import Work
from wsnsim.messages.base import Payload
from wsnsim.messages.scanline import PlacesPayload, ScanLinePayload
from wsnsim.systems.base import Site
from wsnsim.systems.scanline.params import ScanlineParams
from wsnsim.systems.scanline.reading import Measured, Reading
from wsnsim.systems.scanline.stage import Stage
from wsnsim.types import NodeId
from wsnsim.vision.frame import Frame

# What a mote does to a frame before anything is known of it, whether or not the simulator makes the image.
_PIXEL_INTS = 21.0  # difference to the background and threshold in three channels, running mean, vertical sum
_PIXEL_BYTES = 9.0  # image and background read, background written
_COLUMN_INTS = 6.0  # threshold, ends of blobs


@dataclass(frozen=True)
class Said:
    """What a camera has to say of a frame.

    Parameters
    ----------
    payloads : one message each
    work : that it took
    """

    payloads: tuple[Payload, ...]
    work: Work


class Eye:
    """A camera's part: what it says of each frame.

    Parameters
    ----------
    params : of the system
    site : of the run
    stage : the deployment
    node : that carries the camera
    """

    def __init__(self, params: ScanlineParams, site: Site, stage: Stage, node: NodeId) -> None:
        self._params = params
        self._stage = stage
        self._camera = stage.rig.cameras[stage.names.index(node)]
        self._pixels = site.cameras[node].resolution_px

    def look(self, frame: Frame) -> Said:
        """Return what is to be said of a frame."""
        measured: Measured = frame.measured
        payloads: list[Payload] = [self._line(frame.step, measured.reading)]
        if measured.occluders is not None and len(measured.occluders.ids):
            room = self._stage.rig.room
            shares = (measured.occluders.places - room.low) / room.sides
            payloads.append(PlacesPayload(frame.step & 0xFF, measured.occluders.ids, shares))
        return Said(tuple(payloads), self._work())

    def _line(self, step: int, reading: Reading) -> ScanLinePayload:
        edge = self._camera.half_width_px
        share = None if np.isnan(reading.value_px) else reading.value_px / edge
        blobs = reading.blobs / edge if self._params.says_lines else None
        return ScanLinePayload(step & 0xFF, share, blobs)

    def _work(self) -> Work:
        width, height = self._pixels
        return Work(
            int_ops=_PIXEL_INTS * width * height + _COLUMN_INTS * width,
            memory_bytes=_PIXEL_BYTES * width * height,
        )
