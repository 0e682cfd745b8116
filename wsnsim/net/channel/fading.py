"""Block fading: what multipath makes of a link's power, the same for a while, then drawn anew.

Both directions of a link fade alike. A block is as long as the coherence time; blocks
are independent of each other, and begin for each pair at an instant of its own, so that not all
links change at once. A frame has the gain of its beginning all through it. Nothing is stored: the
gain of a pair in a block is a function of a key of the run, the two nodes and the block's number.
Left out: how the gain goes from one block to the next (a Doppler spectrum), fading that
differs inside the channel's bandwidth, and links that were left out as hopeless and might rise.

References
----------
Rappaport, Wireless Communications (2nd ed., 2002), sec. 5.6 (Rayleigh and Ricean fading); Tse, Viswanath,
Fundamentals of Wireless Communication (2005), sec. 5.4.5 (block fading), eq. 2.55 (Rician, K factor);
Salmon et al., Parallel random numbers: as easy as 1, 2, 3 (SC 2011), for the generator, Philox 4x32-10.
"""

from math import sqrt

import numpy as np

from wsnsim.rng import RandomStreams
from wsnsim.types import FloatArray, IntArray, Nanoseconds

_STREAM = "net.fading"


class BlockFading:
    """Rayleigh fading, or Rician where one way is stronger than the others; the mean gain is 1.

    Parameters
    ----------
    coherence_ns : length of a block [ns]
    k_ratio : power of the way in sight over that of all others together [-]; 0 is Rayleigh fading
    streams : `net.fading` is used

    Raises
    ------
    ValueError : a coherence time that is not positive, or a negative ratio
    """

    def __init__(self, coherence_ns: Nanoseconds, k_ratio: float, streams: RandomStreams) -> None:
        if coherence_ns < 1:
            raise ValueError(f"coherence_ns: must be positive, got {coherence_ns} [ns]")
        if not k_ratio >= 0.0:
            raise ValueError(f"k_ratio: must be 0 or more, got {k_ratio}")
        self._coherence_ns = coherence_ns
        self._sight, self._scatter = sqrt(k_ratio / (1.0 + k_ratio)), sqrt(0.5 / (1.0 + k_ratio))
        key = streams.stream(_STREAM).integers(0, 2**32, 2, dtype=np.uint64)
        self._key = key[0], key[1]

    def gains(self, sender: int, receivers: IntArray, now_ns: Nanoseconds) -> FloatArray:
        """Return the factors (m,) by which the powers at `receivers` (m,) differ from their means [-]."""
        from wsnsim.kernels.fading import block_gains

        return block_gains(
            sender, receivers, now_ns, self._coherence_ns, *self._key, self._sight, self._scatter
        )
