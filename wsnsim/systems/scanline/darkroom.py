"""Images at the cluster head: put together from their parts, opened, and read as their cameras might have.

What the baseline of whole frames costs: a part that is missing loses the image, and the head does for every
camera what else each camera does for itself.
"""

from wsnsim.hardware.work import Work
from wsnsim.messages.image_part import ImagePartPayload, joined
from wsnsim.systems.base import Site
from wsnsim.systems.scanline.jpeg import coding_work, opened
from wsnsim.systems.scanline.params import ScanlineParams
from wsnsim.systems.scanline.reader import PixelReader
from wsnsim.systems.scanline.reading import Reading
from wsnsim.systems.scanline.rules import PixelFrontEnd
from wsnsim.types import NodeId


class Darkroom:
    """Reads the images that cameras send.

    Parameters
    ----------
    params : of the system, whose front end looks at pixels
    site : of the run
    """

    def __init__(self, params: ScanlineParams, site: Site) -> None:
        self._site = site
        self._readers: dict[NodeId, PixelReader] = {}
        if isinstance(params.front_end, PixelFrontEnd):
            self._readers = {name: PixelReader(params.front_end, site, name) for name in site.cameras}
        self._parts: dict[NodeId, tuple[int, list[ImagePartPayload]]] = {}

    def take(self, step: int, node: NodeId, part: ImagePartPayload) -> tuple[Reading | None, Work]:
        """Return what a camera's image shows, as soon as it is whole, and the work of opening and reading it.

        Parts of a frame before the one that is being put together come too late.

        Raises
        ------
        DecodeError : parts that do not go together, or a damaged file
        """
        number, parts = self._parts.get(node, (0, []))
        if step < number:
            return None, Work()
        if step > number:
            parts = []
        parts = [*parts, part]
        self._parts[node] = (step, parts)
        data = joined(parts)
        if data is None or len(parts) > part.parts:
            return None, Work()
        width, height = self._site.cameras[node].resolution_px
        image = opened(data, (width, height))
        reading, work = self._readers[node].read(image)
        return reading, work + coding_work(width * height, len(data))
