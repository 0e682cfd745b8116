"""Saturated stations of the distributed coordination function as a process of slots, their counters exact.

A counter of the standard stands still while the channel is busy, so on a clock
that runs in idle slots alone a station is due when its draw is over, whatever
the others do meanwhile; stations that are due at once collide.

References
----------
IEEE Std 802.11-2007, sec. 9.2.5.2: the backoff procedure.
"""

from collections.abc import Sequence
from heapq import heapify, heappop, heappush

import numpy as np


def failures(stations: int, windows: Sequence[int], attempts: int, rng: np.random.Generator) -> float:
    """Return the share of a station's attempts that fail.

    Parameters
    ----------
    stations : how many always have a frame to send
    windows : slots to draw from before each attempt at a frame, which is given up after the last
    attempts : of all stations together, at least
    rng : draws the counters
    """
    due = [(int(rng.random() * windows[0]), station) for station in range(stations)]
    heapify(due)
    tried = [0] * stations
    sent = failed = 0
    while sent < attempts:
        slot, station = heappop(due)
        sending = [station]
        while due and due[0][0] == slot:
            sending.append(heappop(due)[1])
        sent += len(sending)
        collides = len(sending) > 1
        failed += len(sending) * collides
        for each in sending:
            tried[each] = (tried[each] + 1) % len(windows) if collides else 0
            heappush(due, (slot + int(rng.random() * windows[tried[each]]), each))
    return failed / sent
