"""Keeps the images that a scenario asks for, as the programs of the motes get them."""

from io import BytesIO

from wsnsim.records import ImageRow, Sink
from wsnsim.scenario.schema import Record
from wsnsim.types import ByteArray
from wsnsim.vision.frame import Frame

_PNG_EFFORT = 6
"""zlib's level: part of what makes the same image the same bytes."""


class ImageRecorder:
    """Writes frames to a sink, those that are asked for.

    A frame is rendered once: what is kept is what the program looks at, and is
    kept too where no program looks.

    Parameters
    ----------
    asked : the scenario's wishes
    sink : takes the rows
    """

    def __init__(self, asked: Record, sink: Sink) -> None:
        self._asked = asked
        self._sink = sink

    def keep(self, frame: Frame) -> None:
        """Keep a frame that a program is about to get, if it is asked for."""
        if self._asked.keeps_image(frame.camera, frame.step):
            self._sink.write(ImageRow(frame.time, frame.step, frame.camera, png_bytes(frame.image)))


def png_bytes(image: ByteArray) -> bytes:
    """Return an (h, w, 3) RGB image as a PNG file; the same pixels give the same bytes."""
    from PIL import Image

    file = BytesIO()
    Image.fromarray(image).save(file, "PNG", compress_level=_PNG_EFFORT)
    return file.getvalue()
