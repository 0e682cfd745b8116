"""Links that lose frames as links did that somebody measured: constant ratios, or a recording.

A measured ratio holds all that noise and fading did. Whoever makes links of it must give
them power enough that the noise of the radio does no more; interference still does, and how much
hangs on the powers.
"""

from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import dataclass
from math import inf, log

from wsnsim.types import FloatArray, IntArray, Nanoseconds


@dataclass(frozen=True, eq=False)
class ConstantLosses:
    """Losses of links that never change.

    Parameters
    ----------
    log_ratios : for each sender and receiver, the logarithm of the share that gets through; pairs that are
        not there lose nothing
    """

    log_ratios: Mapping[tuple[int, int], float]

    def log_success(self, sender: int, receiver: int, now_ns: Nanoseconds) -> float:
        """Return the logarithm of the probability that a frame gets through."""
        return self.log_ratios.get((sender, receiver), 0.0)

    @classmethod
    def of(cls, senders: IntArray, receivers: IntArray, ratios: FloatArray) -> "ConstantLosses":
        """Return the losses of links (m,) that let through those shares (m,)."""
        pairs = zip(senders.tolist(), receivers.tolist(), strict=True)
        return cls({pair: log_ratio(ratio) for pair, ratio in zip(pairs, ratios.tolist(), strict=True)})


@dataclass(frozen=True, eq=False)
class Track:
    """What was measured of one link: (k,) times from the recording's beginning, ascending, and shares."""

    times_ns: list[Nanoseconds]
    ratios: list[float]


@dataclass(frozen=True, eq=False)
class RecordedLosses:
    """Losses that were recorded, replayed: of each link the record that is nearest in time holds.

    The recording goes round: after its end it begins again. Where the nearest record
    is farther away than `gap_ns`, nobody heard anything of the link, and nothing gets
    through; nor does anything over a link that was never recorded.

    Parameters
    ----------
    tracks : of each sender and receiver
    length_ns : after which the recording begins again [ns]
    gap_ns : longest time to the nearest record at which it still holds [ns]
    start_ns : time of the recording at which the run begins [ns]
    """

    tracks: Mapping[tuple[int, int], Track]
    length_ns: Nanoseconds
    gap_ns: Nanoseconds
    start_ns: Nanoseconds = 0

    def log_success(self, sender: int, receiver: int, now_ns: Nanoseconds) -> float:
        """Return the logarithm of the probability that a frame that begins now gets through."""
        return log_ratio(self.ratio(sender, receiver, now_ns))

    def ratio(self, sender: int, receiver: int, now_ns: Nanoseconds) -> float:
        """Return the share of frames that get through at a time [-]; of two records as near the earlier's."""
        track = self.tracks.get((sender, receiver))
        if track is None:
            return 0.0
        now, times = (now_ns + self.start_ns) % self.length_ns, track.times_ns
        after = bisect_right(times, now)
        # before the first record comes the last of the round before, after the last the first of the next
        since = now - times[after - 1] + (self.length_ns if after == 0 else 0)
        if after == len(times):
            until, following = times[0] + self.length_ns - now, 0
        else:
            until, following = times[after] - now, after
        if min(since, until) > self.gap_ns:
            return 0.0
        return track.ratios[after - 1] if since <= until else track.ratios[following]


def log_ratio(ratio: float) -> float:
    """Return the logarithm of a share, minus infinity of none."""
    return log(ratio) if ratio > 0.0 else -inf
