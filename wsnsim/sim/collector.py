"""Python's garbage collector while time passes: it leaves alone what was built before.

The nodes of a large network are millions of objects that live as long as the
run. Looking through all of them once takes as long as thousands of frames,
and finds nothing.
"""

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def only_the_new() -> Iterator[None]:
    """Let the collector look, meanwhile, only at objects that come into being meanwhile.

    What is garbage already goes first: the collector counts anew from here, and many short runs, each of
    which froze what the last has left, would never be rid of it. Where somebody has frozen objects already,
    all stays as it is.
    """
    if gc.get_freeze_count():
        yield
        return
    gc.collect()
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()
