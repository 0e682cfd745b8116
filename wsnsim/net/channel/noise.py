"""Noise in receivers that changes from one millisecond to the next.

References
----------
Lee, Cerpa, Levis, Improving wireless simulation through noise modeling (IPSN 2007), sec. 4: closest-pattern
matching; TOSSIM (TinyOS 2), sim_noise.c and sim_noise.h, for the numbers: history, bins, milliseconds.
Zuniga, Building a network topology for TOSSIM (2007): noise floors with white noise in decibels.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from wsnsim.rng import RandomStreams
from wsnsim.types import FloatArray, IntArray, Nanoseconds, NodeId

STEP_NS: Nanoseconds = 1_000_000
"""The noise of a millisecond holds all through it (sim_noise_generate is called with milliseconds)."""
HISTORY = 20
"""Samples by which patterns are compared (NOISE_HISTORY)."""
_LOWEST_DBM, _HIGHEST_DBM, _BIN_DB = -115.0, -5.0, 5.0
"""NOISE_MIN, NOISE_MAX and NOISE_QUANTIZE_INTERVAL."""
_STREAM = "net.noise"
_BLOCK = 1024
"""Steps that are made at a time."""
_KEPT = 512
"""Steps by which the time may go back."""


@dataclass(frozen=True, eq=False)
class NoisePattern:
    """What a trace of noise says of the next sample, after each pattern of 20 that occurs in it.

    A pattern is the last 20 samples in bins of 5 dB. TOSSIM draws the bin of the next
    sample by how often it followed, and where a pattern has several successors gives the
    lower edge of that bin; here the next is one of the samples themselves that followed, all equally
    likely, so that the long-run distribution of the noise is that of the trace. The trace goes round: its
    first samples follow its last, and no pattern is without a successor (where TOSSIM meets one
    it goes on from the pattern that is most frequent).

    Parameters
    ----------
    samples_dbm : (k,) - a trace, one sample a millisecond [dBm]

    Raises
    ------
    ValueError : a trace that is not longer than a pattern, or a sample that is no finite number
    """

    samples_dbm: FloatArray

    def __post_init__(self) -> None:
        if len(self.samples_dbm) <= HISTORY:
            raise ValueError(f"trace: must have more than {HISTORY} samples, got {len(self.samples_dbm)}")
        if not np.isfinite(self.samples_dbm).all():
            odd = int(np.flatnonzero(~np.isfinite(self.samples_dbm))[0])
            raise ValueError(
                f"trace: samples must be finite, got {self.samples_dbm[odd]} as number {odd + 1}"
            )

    @cached_property
    def levels_mw(self) -> FloatArray:
        """(k,) - the samples [mW]."""
        return np.asarray(10.0 ** (self.samples_dbm / 10.0))

    @cached_property
    def pattern(self) -> IntArray:
        """(k,) - number of the pattern that each sample follows."""
        within = (self.samples_dbm >= _LOWEST_DBM) & (self.samples_dbm <= _HIGHEST_DBM)
        noise = np.where(within, self.samples_dbm, _LOWEST_DBM)
        bins = np.floor((noise - _LOWEST_DBM) / _BIN_DB).astype(np.int64)
        # equal patterns by doubling: of 1, 2, 4, 8 and 16 samples, then of 16 and 4 more before them
        spans = {1: bins}
        for length in (1, 2, 4, 8):
            spans[2 * length] = _numbered(spans[length], np.roll(spans[length], length))
        whole = _numbered(spans[16], np.roll(spans[4], 16))
        return np.roll(whole, 1)

    @cached_property
    def followers(self) -> tuple[IntArray, IntArray]:
        """Samples (k,), sorted by the pattern they follow, and where each pattern's begin (patterns + 1,)."""
        order = np.argsort(self.pattern, kind="stable")
        starts = np.searchsorted(self.pattern[order], np.arange(int(self.pattern.max()) + 2))
        return order, starts


@dataclass(slots=True)
class _Walk:
    """One receiver's way through the patterns."""

    rng: np.random.Generator
    at: int
    """The sample that came last, as a place in the trace."""
    first_step: int
    levels_mw: list[float]


class PatternNoise:
    """Noise of receivers that behaves like a trace, each by itself.

    Parameters
    ----------
    pattern : learned from a trace
    nodes : names, in the order of the receivers
    streams : `net.noise` of each node is used
    """

    step_ns = STEP_NS

    def __init__(self, pattern: NoisePattern, nodes: Sequence[NodeId], streams: RandomStreams) -> None:
        self._pattern, self._nodes, self._streams = pattern, nodes, streams
        self._walks: dict[int, _Walk] = {}

    def level_mw(self, receiver: int, now_ns: Nanoseconds) -> float:
        """Return the noise in a receiver [mW]; the time goes back by half a second at most."""
        walk = self._walks.get(receiver)
        if walk is None:
            rng = self._streams.stream(_STREAM, self._nodes[receiver])
            walk = _Walk(rng, int(rng.integers(len(self._pattern.samples_dbm))), 0, [])
            self._walks[receiver] = walk
        step = now_ns // STEP_NS
        while step >= walk.first_step + len(walk.levels_mw):
            self._go_on(walk)
        return walk.levels_mw[step - walk.first_step]

    def _go_on(self, walk: _Walk) -> None:
        from wsnsim.kernels.noise import follow

        pattern = self._pattern
        places = follow(walk.at, walk.rng.random(_BLOCK), pattern.pattern, *pattern.followers)
        walk.first_step += max(0, len(walk.levels_mw) - _KEPT)
        walk.levels_mw = walk.levels_mw[-_KEPT:] + pattern.levels_mw[places].tolist()
        walk.at = int(places[-1])


class WhiteNoise:
    """Noise that is normal in decibels about each receiver's own floor, drawn anew every millisecond.

    Parameters
    ----------
    floors_dbm : (n,) - mean of each receiver [dBm]
    sd_db : (n,) - standard deviation of each [dB]
    nodes : names, in the order of the receivers
    streams : `net.noise` of each node is used
    """

    step_ns = STEP_NS

    def __init__(
        self, floors_dbm: FloatArray, sd_db: FloatArray, nodes: Sequence[NodeId], streams: RandomStreams
    ) -> None:
        self._floors_dbm, self._sd_db = floors_dbm, sd_db
        self._nodes, self._streams = nodes, streams
        self._blocks: dict[int, tuple[int, list[float]]] = {}

    def level_mw(self, receiver: int, now_ns: Nanoseconds) -> float:
        """Return the noise in a receiver [mW]."""
        block, step = divmod(now_ns // STEP_NS, _BLOCK)
        known = self._blocks.get(receiver)
        if known is None or known[0] != block:
            rng = self._streams.stream(_STREAM, self._nodes[receiver], block)
            noise_dbm = self._floors_dbm[receiver] + self._sd_db[receiver] * rng.standard_normal(_BLOCK)
            known = self._blocks[receiver] = block, (10.0 ** (noise_dbm / 10.0)).tolist()
        return known[1][step]


def _numbered(one: IntArray, other: IntArray) -> IntArray:
    """Return numbers from 0 (k,) that are equal where both of two numbers are."""
    numbers: IntArray = np.unique(one * (int(other.max()) + 1) + other, return_inverse=True)[1]
    return numbers
