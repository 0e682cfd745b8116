"""What the MACs over IEEE 802.15.4's frames share: the frame in hand, and which frames came before.

References
----------
IEEE Std 802.15.4-2006, sec. 7.5.6.2: a frame that was received already is known by its sequence number.
"""

from typing import Any, NamedTuple

from wsnsim.types import Nanoseconds


class Job(NamedTuple):
    """A data frame in the hands of a MAC."""

    mpdu: bytes
    destination: int
    meant: tuple[int, ...]
    cargo: Any


class Duplicates:
    """The last frame of each sender.

    Parameters
    ----------
    lifetime_ns : how long its number is remembered; less than 256 frames take [ns]
    """

    __slots__ = ("_heard", "_lifetime_ns")

    def __init__(self, lifetime_ns: Nanoseconds) -> None:
        self._lifetime_ns = lifetime_ns
        self._heard: dict[int, tuple[int, Nanoseconds]] = {}

    def is_new(self, source: int, sequence: int, now_ns: Nanoseconds) -> bool:
        """Note a frame, and return whether it is another than the last one of its sender."""
        last, since_ns = self._heard.get(source, (-1, 0))
        self._heard[source] = (sequence, now_ns)
        return sequence != last or now_ns - since_ns > self._lifetime_ns
