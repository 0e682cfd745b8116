"""The transceivers of all nodes: one table of numbers, and a handle for each of them.

What frames do to those who hear them is the business of two compiled kernels,
which change the table; what a MAC does to its own radio, and what it or an
account of energy asks of it, is here.

References
----------
IEEE Std 802.15.4-2006, sec. 6.9.9: clear channel assessment by energy or by a
reception in progress (mode 3 with OR, the CC2420's default).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from wsnsim.kernels.radio import (
    ABOVE_NS,
    AIR_COLUMNS,
    BELOW_NS,
    BURST_NS,
    COLUMNS,
    DEAF_NS,
    EARLIER_BURST_NS,
    FLAGS,
    LISTEN,
    LOCKED_NS,
    LOCKED_SHIFT,
    LOUD_MASK,
    LOUD_SHIFT,
    NO_LOCK_MASK,
    NOISE,
    ONE_LOCKED,
    OPENED_NS,
    RECEIVE,
    RECEIVED_NS,
    SINCE_NS,
    SLEEP,
    SPENT_NS,
    STATE,
    TOLD,
    TOTAL,
    TRANSMIT,
    UNLOCKED_NS,
    WANTED,
    WATCHED,
)
from wsnsim.net.config import CcaModel
from wsnsim.net.phy.base import Listener, Transmission
from wsnsim.types import IntArray, Nanoseconds

CAUSES = ("listen", "receive", "transmit", "sleep", "start")
"""States of a radio, as the table numbers them."""
NEVER: Nanoseconds = 2**62
_LONG_AGO: Nanoseconds = -NEVER


_LINE_BYTES = 64
"""Of the processor's cache, on all common machines."""


def _aligned(rows: int, columns: int) -> IntArray:
    """Return a table of zeros (rows, columns) that begins with a line of the cache."""
    room = np.zeros(rows * columns * 8 + _LINE_BYTES, dtype=np.uint8)
    first = -room.ctypes.data % _LINE_BYTES
    return room[first : first + rows * columns * 8].view(np.int64).reshape(rows, columns)


def view(array: NDArray[Any]) -> "memoryview[Any]":
    """Return the numbers of an array; one is read or written several times faster than through the array."""
    return memoryview(cast(Any, array.reshape(-1)))


@dataclass(slots=True, eq=False)
class Radio:
    """The transceiver of one node."""

    index: int
    rng: np.random.Generator
    listener: Listener
    deaf_until_ns: Nanoseconds = 0
    """Until when it cannot begin to receive: turned to sending, sending, on its way back, or off [ns]."""
    sending: Transmission | None = None
    on: bool = True
    """Whether it will ever do anything again."""
    asleep: bool = False
    overhear: Callable[[Transmission | None], None] | None = None
    """Where it is set, before anything is sent: told of each frame that the radio locked on, stayed with to
    its end, and that its listener is not given: the frame if it is for another node, None if bits failed."""


class Radios:
    """The table of all radios.

    Parameters
    ----------
    nodes : how many there will be
    noise : in every receiver [unit]
    cca : threshold of clear channel assessment [unit]
    cca_model : what the assessment looks at
    cca_ns : length of its window [ns]
    """

    def __init__(self, nodes: int, noise: int, cca: int, cca_model: CcaModel, cca_ns: Nanoseconds) -> None:
        self.air: IntArray = np.zeros((nodes, AIR_COLUMNS), dtype=np.int64)
        self.table = _aligned(nodes, COLUMNS)
        for column, value in (
            (NOISE, noise),
            (UNLOCKED_NS, _LONG_AGO),
            (DEAF_NS, NEVER),
            (BELOW_NS, _LONG_AGO),
            (BURST_NS, _LONG_AGO),
            (EARLIER_BURST_NS, _LONG_AGO),
            (STATE, SLEEP),
        ):
            self.table[:, column] = value
        self.cells: memoryview[int] = view(self.table)
        self._air: memoryview[int] = view(self.air)
        self._flags = self._air[FLAGS::AIR_COLUMNS]
        self._cca, self._cca_ns = cca, cca_ns
        self._whole_window = cca_model == "whole_window"

    def locked(self, at: int) -> int:
        """Return the sender of the frame that a node is receiving, -1 for none."""
        return (self._air[at * AIR_COLUMNS + FLAGS] >> LOCKED_SHIFT) - 1

    def locked_on(self, sender: int, nodes: Sequence[int]) -> list[int]:
        """Return those of some nodes that are receiving a sender's frame."""
        flags, wanted = self._flags, sender + 1
        return [at for at in nodes if flags[at] >> LOCKED_SHIFT == wanted]

    def arriving(self, at: int) -> tuple[int, int]:
        """Return the sum of the powers at a node [unit], and how many frames are above sensitivity."""
        row = at * AIR_COLUMNS
        return self._air[row + TOTAL], self._air[row + FLAGS] >> LOUD_SHIFT & LOUD_MASK

    def want(self, at: int) -> None:
        """Note that the frame that a node is receiving is for it."""
        self._air[at * AIR_COLUMNS + FLAGS] |= WANTED

    def turn(self, radio: Radio, now_ns: Nanoseconds) -> None:
        """Let a radio give up what it is receiving, if anything, and begin no reception."""
        at = radio.index
        cells, row = self.cells, at * COLUMNS
        flags = self._air[at * AIR_COLUMNS + FLAGS]
        if flags >= ONE_LOCKED:
            cells[row + UNLOCKED_NS] = now_ns
            cells[row + RECEIVED_NS] += now_ns - cells[row + LOCKED_NS]
            self._air[at * AIR_COLUMNS + FLAGS] = flags & NO_LOCK_MASK & ~WANTED
        cells[row + DEAF_NS] = radio.deaf_until_ns = NEVER

    def deafen(self, radio: Radio, until_ns: Nanoseconds) -> None:
        """Let a radio begin no reception before a time."""
        radio.deaf_until_ns = until_ns
        self.cells[radio.index * COLUMNS + DEAF_NS] = until_ns

    def enter(self, at: int, state: int, now_ns: Nanoseconds) -> None:
        """Let a node's radio be in a state from now on."""
        cells, row = self.cells, at * COLUMNS
        before = cells[row + STATE]
        if before != LISTEN:
            cells[row + SPENT_NS + before - TRANSMIT] += now_ns - cells[row + SINCE_NS]
        cells[row + STATE] = state
        cells[row + SINCE_NS] = now_ns

    def open(self, at: int, now_ns: Nanoseconds) -> None:
        """Switch a node's radio on for the first time."""
        cells, row = self.cells, at * COLUMNS
        cells[row + STATE] = LISTEN
        cells[row + SINCE_NS] = cells[row + OPENED_NS] = now_ns
        cells[row + DEAF_NS] = now_ns

    def assess(self, at: int, now_ns: Nanoseconds) -> bool:
        """Return whether the window that ends now shows a busy channel to a node."""
        cells, row = self.cells, at * COLUMNS
        if self._air[at * AIR_COLUMNS + FLAGS] >= ONE_LOCKED and cells[row + LOCKED_NS] < now_ns:
            return True
        since_ns = now_ns - self._cca_ns
        # A frame that begins now is not in the window.
        if self._air[at * AIR_COLUMNS + TOTAL] >= self._cca and cells[row + ABOVE_NS] < now_ns:
            return True
        if self._whole_window:
            return cells[row + UNLOCKED_NS] > since_ns or cells[row + BELOW_NS] > since_ns
        burst_ns = cells[row + BURST_NS]
        if burst_ns == now_ns:
            burst_ns = cells[row + EARLIER_BURST_NS]
        return cells[row + BELOW_NS] == now_ns or burst_ns >= since_ns

    def busy_now(self, at: int) -> bool:
        """Return whether a reception is in progress, or enough power arrives now."""
        row = at * AIR_COLUMNS
        return self._air[row + FLAGS] >= ONE_LOCKED or self._air[row + TOTAL] >= self._cca

    def watch(self, at: int, watched: bool) -> bool:
        """Look out for changes of `busy_now` from now on, or no more; return what it is."""
        busy = self.busy_now(at)
        flags = self._air[at * AIR_COLUMNS + FLAGS] & ~(WATCHED | TOLD)
        self._air[at * AIR_COLUMNS + FLAGS] = flags | (WATCHED if watched else 0) | (TOLD if busy else 0)
        return busy

    def told(self, at: int) -> tuple[bool, bool]:
        """Return whether a node watches the channel, and whether it was found busy last."""
        flags = self._air[at * AIR_COLUMNS + FLAGS]
        return flags & WATCHED != 0, flags & TOLD != 0


@dataclass(frozen=True, slots=True)
class RadioTimes:
    """How long one radio has been in each of its states."""

    radios: Radios
    index: int

    @property
    def state(self) -> str:
        """What it does now, one of `CAUSES`."""
        state = self.radios.cells[self.index * COLUMNS + STATE]
        return CAUSES[state if self.radios.locked(self.index) < 0 else RECEIVE]

    def spent_ns(self, now_ns: Nanoseconds) -> Mapping[str, Nanoseconds]:
        """Return the time spent in each state from the first on until now [ns]; their sum is all of it."""
        cells, row = self.radios.cells, self.index * COLUMNS
        later = cells[row + SPENT_NS : row + SPENT_NS + len(CAUSES) - TRANSMIT]
        spent = [0, cells[row + RECEIVED_NS], *later.tolist()]
        if cells[row + STATE] != LISTEN:
            spent[cells[row + STATE]] += now_ns - cells[row + SINCE_NS]
        if self.radios.locked(self.index) >= 0:
            spent[RECEIVE] += now_ns - cells[row + LOCKED_NS]
        spent[LISTEN] = now_ns - cells[row + OPENED_NS] - sum(spent)
        return dict(zip(CAUSES, spent, strict=True))
