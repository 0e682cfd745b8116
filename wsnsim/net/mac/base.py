"""What the layers above and the network's assembly know of a medium access, whatever it is."""

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np

from wsnsim.net.clock import Clock
from wsnsim.net.interface import LinkCounters, Outcome
from wsnsim.net.phy.base import Listener, Phy
from wsnsim.net.phy.medium import Medium, Radio
from wsnsim.types import Nanoseconds


class Upper(Protocol):
    """The layer above the MAC."""

    def received(self, payload: bytes, source: int, cargo: Any) -> None:
        """Take the payload of a new frame for this node, and what its sender keeps beside it."""

    def done(self, outcome: Outcome | None) -> None:
        """Learn that the submitted frame is finished: sent well (None), or lost for that reason."""


class Mac(Listener, Protocol):
    """The medium access of one node. It holds one frame at a time."""

    counters: LinkCounters

    @property
    def idle(self) -> bool:
        """Whether a frame may be submitted."""

    def connect(self, radio: Radio, upper: Upper) -> None:
        """Join the MAC to its radio and to the layer above, before anything else."""

    def submit(self, payload: bytes, destination: int, meant: tuple[int, ...], cargo: Any) -> None:
        """Send a payload to a neighbour or to all; the MAC must be idle.

        Its fate comes back through `Upper.done`, never before this call is over.

        Parameters
        ----------
        payload : at most `MacFamily.max_payload_bytes`
        destination : address, or `BROADCAST`
        meant : nodes whose reception is worth a record
        cargo : kept beside the bytes, for the receiver's upper layer
        """

    def stop(self) -> None:
        """Stop for good."""


class MacFamily(Protocol):
    """A medium access and the physical layer below it: what all nodes of a network have alike."""

    @property
    def phy(self) -> Phy:
        """The physical layer."""

    @property
    def max_payload_bytes(self) -> int:
        """What one frame carries for the layer above [B]."""

    @property
    def overhead_bytes(self) -> int:
        """What the MAC adds to it, frame check sequence included [B]."""

    @property
    def ack_bytes(self) -> int:
        """Length of an acknowledgement [B]."""

    def mac(self, clock: Clock, medium: Medium, address: int, rng: np.random.Generator) -> Mac:
        """Return the MAC of the node with that address."""

    def service_ns(self, payload_bytes: Sequence[int], contenders: int) -> Nanoseconds:
        """Return the time in which a datagram crosses one hop, as a rule [ns].

        Parameters
        ----------
        payload_bytes : what its frames carry, one after the other [B]
        contenders : nodes that have such a datagram to send at the same time, the node itself among them
        """
