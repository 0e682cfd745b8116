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

    What was garbage before waits until it is over. Where somebody has frozen objects already, all stays
    as it is.
    """
    if gc.get_freeze_count():
        yield
        return
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()
