"""How often frames went over a link before it was known whether they had arrived, and whose they were."""

from wsnsim.net.interface import LinkCounters, Outcome
from wsnsim.net.phy.base import BROADCAST
from wsnsim.net.routing.base import Router


class LinkUse:
    """Reads from the MAC's counters what each frame has cost.

    Parameters
    ----------
    counters : of the node's MAC; the routing protocol's share is counted in them
    overhead_bytes : what the MAC adds to a packet [B]
    """

    def __init__(self, counters: LinkCounters, overhead_bytes: int) -> None:
        self._counters, self._overhead_bytes = counters, overhead_bytes
        self._attempts_before = self._copies_before = 0

    def data(self, router: Router, hop: int | None, outcome: Outcome | None) -> None:
        """Tell the router of a data frame to a neighbour; None: it was for all."""
        self._tell(router, hop, outcome, *self._since())

    def control(self, router: Router, sent: tuple[int, int], outcome: Outcome | None) -> None:
        """Count a frame of the routing protocol, and tell the router of it.

        Parameters
        ----------
        router : of the node
        sent : the frame's payload [B], and for whom it was
        outcome : what became of it
        """
        payload_bytes, destination = sent
        attempts, copies = self._since()
        hop = None if destination == BROADCAST else destination
        times = attempts if hop is not None else (1 + copies) * (outcome is None)
        self._counters.control_frames_tx += times
        self._counters.control_tx_bytes += times * (payload_bytes + self._overhead_bytes)
        self._tell(router, hop, outcome, attempts, copies)

    def _since(self) -> tuple[int, int]:
        """Return attempts, and copies among them, since the last frame."""
        counters = self._counters
        attempts, self._attempts_before = counters.attempts - self._attempts_before, counters.attempts
        copies, self._copies_before = counters.copies - self._copies_before, counters.copies
        return attempts, copies

    def _tell(
        self, router: Router, hop: int | None, outcome: Outcome | None, attempts: int, copies: int
    ) -> None:
        # a train of copies is one use of the link
        if hop is not None and outcome in (None, Outcome.NO_ACK):
            router.sent(hop, max(1, attempts - copies), outcome is None)
