"""A front end at work on one camera's images, frame after frame, with what it learns of the background."""

from collections.abc import Callable

from wsnsim.hardware.work import Work
from wsnsim.systems.base import Site
from wsnsim.systems.scanline.front_end import FrontEnd
from wsnsim.systems.scanline.reading import Reading
from wsnsim.systems.scanline.rules import PixelFrontEnd
from wsnsim.types import ByteArray, NodeId
from wsnsim.vision.foreground import Background


class PixelReader:
    """Reads one camera's frames in their order.

    Parameters
    ----------
    rules : of the front end
    site : of the run; it has a picture of the empty room from each camera
    node : that carries the camera
    """

    def __init__(self, rules: PixelFrontEnd, site: Site, node: NodeId) -> None:
        self._front_end = FrontEnd(rules, site.cameras[node], site.targets[0])
        self._empty_view: Callable[[], ByteArray] = site.empty_views[node]
        self._background: Background | None = None

    def read(self, image: ByteArray) -> tuple[Reading, Work]:
        """Return what an image (h, w, 3) shows, and the work of seeing it."""
        background = self._background
        if background is None:
            background = self._front_end.start(self._empty_view())
        reading, self._background, work = self._front_end.read(image, background)
        return reading, work
