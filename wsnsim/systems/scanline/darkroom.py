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
        self._rules = params.front_end
        self._site = site
        self._readers: dict[NodeId, PixelReader] = {}
        self._parts: dict[NodeId, tuple[int, list[ImagePartPayload]]] = {}
        """Of each camera the first frame that is still wanted, and what came of it."""

    def take(self, step: int, node: NodeId, part: ImagePartPayload) -> tuple[Reading | None, Work]:
        """Return what a camera's image shows, as soon as it is whole, and the work of opening and reading it.

        Parts of a frame before the one that is being put together come too late, and so do those of one that
        was whole.

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
        if data is None:
            return None, Work()
        self._parts[node] = (step + 1, [])
        width, height = self._site.cameras[node].resolution_px
        image = opened(data, (width, height))
        reading, work = self._reader(node).read(image)
        return reading, work + coding_work(width * height, len(data))

    def _reader(self, node: NodeId) -> PixelReader:
        """Return what reads a camera's images; it takes pictures of the object first."""
        if node not in self._readers:
            assert isinstance(self._rules, PixelFrontEnd)
            self._readers[node] = PixelReader(self._rules, self._site, node)
        return self._readers[node]
