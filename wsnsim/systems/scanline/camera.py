"""What runs on a camera's mote: a frame in, a scan line in a few bytes out (Ercan et al. 2007, Sec. 3)."""

from dataclasses import dataclass, replace

import numpy as np

from wsnsim.hardware.work import Work
from wsnsim.messages.base import Payload
from wsnsim.messages.image_part import parts_of_image
from wsnsim.messages.scanline import MOST_BLOBS, WIDEST, PlacesPayload, ScanLinePayload
from wsnsim.systems.base import Site
from wsnsim.systems.scanline.jpeg import compressed
from wsnsim.systems.scanline.params import ScanlineParams
from wsnsim.systems.scanline.reader import PixelReader
from wsnsim.systems.scanline.reading import Measured, Reading
from wsnsim.systems.scanline.rules import PixelFrontEnd
from wsnsim.systems.scanline.stage import Stage
from wsnsim.types import FloatArray, NodeId
from wsnsim.vision.frame import Frame

# What a mote does to a frame before anything is known of it, whether or not the simulator makes the image.
# A quarter of the image is taken for foreground: those of `front_end` make 18.5 + .75 · 16 + .25 · 50.
_PIXEL_INTS = 43.0
_PIXEL_BYTES = 11.0  # image and background read, background written
_COLUMN_INTS = 10.0  # threshold, ends of blobs


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
        rules = params.front_end
        self._reader = PixelReader(rules, site, node) if isinstance(rules, PixelFrontEnd) else None

    def look(self, frame: Frame) -> Said:
        """Return what is to be said of a frame."""
        measured: Measured = frame.measured
        said = self._image(frame) if self._params.message == "jpeg" else self._told(frame, measured)
        if measured.occluders is not None and len(measured.occluders.ids):
            room = self._stage.rig.room
            shares = (measured.occluders.places - room.low) / room.sides
            places = PlacesPayload(frame.step & 0xFF, measured.occluders.ids, shares)
            return Said((*said.payloads, places), said.work)
        return said

    def _image(self, frame: Frame) -> Said:
        """Send the frame itself."""
        data, work = compressed(frame.image, self._params.jpeg_quality)
        return Said(parts_of_image(frame.step, data, self._params.jpeg_part_bytes), work)

    def _told(self, frame: Frame, measured: Measured) -> Said:
        """Send what the frame shows."""
        reading, work = self._read(frame, measured)
        return Said((self._line(frame.step, reading),), work)

    def _read(self, frame: Frame, measured: Measured) -> tuple[Reading, Work]:
        """Return what the frame shows, and what it took to see it."""
        if self._reader is None:
            return measured.reading, self._work()
        reading, work = self._reader.read(frame.image)
        if self._params.virtual_occluders is not None and measured.hidden:
            reading = replace(reading, value_px=np.nan)
        return reading, work

    def _line(self, step: int, reading: Reading) -> ScanLinePayload:
        edge = self._camera.half_width_px
        place = reading.value_px / edge
        share = None if np.isnan(place) else float(np.clip(place, -WIDEST, WIDEST))
        blobs = _widest(reading.blobs) / edge if self._params.says_lines else None
        return ScanLinePayload(step & 0xFF, share, blobs)

    def _work(self) -> Work:
        width, height = self._pixels
        return Work(
            int_ops=_PIXEL_INTS * width * height + _COLUMN_INTS * width,
            memory_bytes=_PIXEL_BYTES * width * height,
        )


def _widest(blobs: FloatArray) -> FloatArray:
    """Return as many blobs (b, 2) as a message holds, in their order."""
    if len(blobs) <= MOST_BLOBS:
        return blobs
    return blobs[np.sort(np.argsort(blobs[:, 0] - blobs[:, 1], kind="stable")[:MOST_BLOBS])]
