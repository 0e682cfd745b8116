"""Ctrl-C, and the signals by which batch systems stop a program, taken between two steps of a run.

An exception raised inside compiled code or half way through a record would come
out as something else; a flag that is looked at between steps does not.
"""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))


class Interrupts:
    """Whether somebody asked this process to stop."""

    def __init__(self) -> None:
        self._asked = False

    def raise_if_asked(self) -> None:
        """Stop here if asked to.

        Raises
        ------
        KeyboardInterrupt : one of the signals came
        """
        if self._asked:
            raise KeyboardInterrupt

    def _ask(self, number: int, frame: FrameType | None) -> None:
        if self._asked:
            # asked twice: at once, wherever we are
            raise KeyboardInterrupt
        self._asked = True


@contextmanager
def interrupts() -> Iterator[Interrupts]:
    """Keep the signals until they are asked for; outside the main thread Python keeps them itself."""
    asked = Interrupts()
    if threading.current_thread() is not threading.main_thread():
        yield asked
        return
    before = {number: signal.signal(number, asked._ask) for number in _SIGNALS}
    try:
        yield asked
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
