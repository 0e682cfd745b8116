"""The program of a node that only relays: the network does that for it."""

from wsnsim.systems.base import Context, Received, Step
from wsnsim.vision.frame import Frame


class SilentProgram:
    """Reacts to nothing."""

    def on_start(self, ctx: Context) -> Step:
        """Do nothing."""
        return Step()

    def on_frame(self, ctx: Context, frame: Frame) -> Step:
        """Do nothing."""
        return Step()

    def on_payload(self, ctx: Context, message: Received) -> Step:
        """Do nothing."""
        return Step()

    def on_timer(self, ctx: Context, key: str) -> Step:
        """Do nothing."""
        return Step()
