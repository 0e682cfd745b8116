"""An image as a program gets it, rendered when somebody looks at it; or what was measured in its place."""

from collections.abc import Callable
from typing import Any

import numpy as np

from wsnsim.types import ByteArray, NodeId, Seconds


class Frame:
    """One image of one camera.

    Parameters
    ----------
    step : number of the tracking step it belongs to
    time : when it was taken [s]
    camera : the node that took it
    render : makes the (h, w, 3) RGB image; called once, when `image` is first read
    measured : what a system's own sensor says of the same instant; None without one
    """

    __slots__ = ("_image", "_render", "camera", "measured", "step", "time")

    def __init__(
        self,
        step: int,
        time: Seconds,
        camera: NodeId,
        render: Callable[[], ByteArray],
        measured: Any = None,
    ) -> None:
        self.step = step
        self.time = time
        self.camera = camera
        self.measured = measured
        self._render = render
        self._image: ByteArray | None = None

    @property
    def image(self) -> ByteArray:
        """(h, w, 3) RGB, read-only."""
        if self._image is None:
            image = np.asarray(self._render()).view()
            image.flags.writeable = False
            self._image = image
        return self._image

    def __repr__(self) -> str:
        return f"Frame(step={self.step}, time={self.time}, camera={self.camera!r})"
