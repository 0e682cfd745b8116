"""A film as background: the frame nearest in time, decoded when it is needed.

Needs PyAV (`pip install "wsnsim[vision]"`), which reads what FFmpeg reads. At the
beginning the file's packets are counted, without decoding, to know when each frame is
shown; then only one frame is held at a time. Sound is ignored.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from wsnsim.errors import SimulationError
from wsnsim.types import ByteArray, FloatArray, Seconds
from wsnsim.vision.photos import fitted

if TYPE_CHECKING:
    from av.container import InputContainer
    from av.video.frame import VideoFrame

_INSTALL = 'pip install "wsnsim[vision]"'


class Film:
    """Gives the picture of each step; earlier steps may be asked for again, at the price of a new start.

    Parameters
    ----------
    path : of the file
    resolution_px : (width, height) of the pictures, cut out of the middle and resized [px]
    rate_hz : steps a second; step 0 is at `start_s` [Hz]
    start_s : time of the film at step 0 [s]
    loop : begin again after the last frame

    Raises
    ------
    ValueError : PyAV is missing, or the file is missing, no film, or cut short, or begins after it ends
    """

    def __init__(
        self,
        path: str | Path,
        resolution_px: tuple[int, int],
        rate_hz: float,
        start_s: Seconds = 0.0,
        loop: bool = False,
    ) -> None:
        self.path = Path(path)
        self._resolution_px = resolution_px
        self._rate_hz = rate_hz
        self._start_s = start_s
        self._loop = loop
        self._times = _frame_times(self.path)
        steps_s = np.diff(self._times)
        self.length_s: Seconds = float(self._times[-1] + np.median(steps_s))
        """From the first frame to the end of the last [s]."""
        if not loop and start_s >= self.length_s:
            raise ValueError(
                f"the film must begin before it ends, {self.path} is {self.length_s:g} s long and start_s "
                f"is {start_s:g}; start earlier, or let it loop"
            )
        self._frames: Iterator[VideoFrame] = iter(())
        self._decoded = -1
        self._picture: ByteArray | None = None

    def check_length(self, last_step: int) -> None:
        """See that the film lasts until a step.

        Raises
        ------
        ValueError : it does not
        """
        end_s = self._start_s + last_step / self._rate_hz
        if not self._loop and end_s > self.length_s:
            raise ValueError(
                f"the film must last as long as the run, {self.path} is {self.length_s:g} s long and the "
                f"last image is taken {end_s:g} s from its beginning; shorten the run, start the film "
                "earlier, or let it loop"
            )

    def __call__(self, step: int) -> ByteArray:
        """Return the (h, w, 3) RGB picture of a step.

        Raises
        ------
        wsnsim.errors.SimulationError : the film cannot be decoded so far
        """
        from PIL import Image

        time_s = self._start_s + step / self._rate_hz
        number = self.frame_at(time_s)
        if number == self._decoded and self._picture is not None:
            return self._picture
        try:
            if number <= self._decoded or self._decoded < 0:
                self._frames, self._decoded = _decoding(self.path), -1
            for frame in self._frames:
                self._decoded += 1
                if self._decoded == number:
                    picture = Image.fromarray(frame.to_ndarray(format="rgb24"))
                    self._picture = fitted(picture, self._resolution_px)
                    return self._picture
        except _failures() as error:
            raise SimulationError(f"{self._broken(number)}: {error}", step / self._rate_hz) from error
        raise SimulationError(self._broken(number), step / self._rate_hz)

    def frame_at(self, time_s: Seconds) -> int:
        """Return the number of the frame shown nearest to a time of the film [s]."""
        if self._loop:
            time_s %= self.length_s
        after = int(np.searchsorted(self._times, time_s))
        if after == 0:
            return 0
        if after == len(self._times):
            return after - 1
        return after if self._times[after] - time_s < time_s - self._times[after - 1] else after - 1

    def _broken(self, number: int) -> str:
        return f"the film {self.path} cannot be decoded as far as frame {number + 1}"


def _failures() -> tuple[type[Exception], ...]:
    """Return what PyAV raises; only some of it is an OSError or a ValueError."""
    from av import FFmpegError

    return FFmpegError, OSError, ValueError


def _open(path: Path) -> "InputContainer":
    """Open a file that holds a film.

    Raises
    ------
    ValueError : PyAV is missing, or the file is missing or holds no film
    """
    try:
        import av
    except ImportError as error:
        raise ValueError(
            f"a film as background needs PyAV, which cannot be imported ({error}): {_INSTALL}"
        ) from error
    try:
        container = av.open(str(path))
    except OSError as error:
        raise ValueError(f"a film must be a file that can be read, {path}: {error.strerror}") from error
    except _failures() as error:
        raise ValueError(f"a film must be a video file, {path} is damaged or none at all") from error
    if not container.streams.video:
        container.close()
        raise ValueError(f"a film must hold moving pictures, {path} has none")
    return container


def _frame_times(path: Path) -> FloatArray:
    """Return when each frame is shown, from the first on (n,) [s], from the packets alone.

    Raises
    ------
    ValueError : the file is missing, holds no film, or ends too early
    """
    with _open(path) as container:
        stream = container.streams.video[0]
        stamps, whole = [], True
        try:
            for packet in container.demux(stream):
                stamp = packet.dts if packet.pts is None else packet.pts
                if packet.size and stamp is not None:
                    stamps.append(stamp)
                    whole = not packet.is_corrupt
        except _failures():
            whole = False
        promised, tick = stream.frames, stream.time_base
    if not whole or len(stamps) < promised:
        of = f" of {promised}" if promised else ""
        raise ValueError(f"a film must be whole, {path} breaks off after frame {len(stamps)}{of}")
    if len(stamps) < 2 or tick is None:
        raise ValueError(f"a film must have two frames or more, {path} has {len(stamps)}")
    times = np.sort(np.array(stamps, dtype=np.float64)) * float(tick)
    return np.asarray(times - times[0], dtype=np.float64)


def _decoding(path: Path) -> "Iterator[VideoFrame]":
    """Yield the frames of a film in the order in which they are shown."""
    with _open(path) as container:
        stream = container.streams.video[0]
        # One thread: a run takes the processors that it was given.
        stream.codec_context.thread_count = 1
        yield from container.decode(stream)
