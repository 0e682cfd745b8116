"""The receptions under way: how likely each frame is to get through at the node that it is for.

A reception is a row of stretches in which signal, noise and interference are
constant; its probability of success is the product over them. A stretch ends
where a frame that arrives at the receiver begins or ends, and where its noise
changes.
"""

from dataclasses import dataclass
from math import inf

from wsnsim.net.channel.channel import Noise
from wsnsim.net.phy.base import Transmission
from wsnsim.net.phy.interference import Survival
from wsnsim.net.phy.radios import Radio
from wsnsim.types import Nanoseconds


@dataclass(slots=True, eq=False)
class Reception:
    """A frame at one receiver that wants it, so far."""

    frame: Transmission
    radio: Radio
    wanted_mw: float
    wanted: int
    """The same in units of power."""
    since_ns: Nanoseconds
    """Until when its fate is accounted for [ns]."""
    log_success: float
    worst_sinr: float = inf
    """So far; infinity before any time has passed."""
    given_up: bool = False
    """Whether the receiver has turned away from it."""


class Receptions:
    """Takes account of stretches.

    Parameters
    ----------
    survival : what a stretch does to a frame
    unit_mw : one unit of the powers at a node [mW]
    noise_mw : in every receiver [mW]
    noise : noise that changes in time, or None
    watch_sinr : whether anybody wants to know the worst SINR of a reception
    """

    def __init__(
        self, survival: Survival, unit_mw: float, noise_mw: float, noise: Noise | None, watch_sinr: bool
    ) -> None:
        self._survival, self._unit_mw = survival, unit_mw
        self._noise_mw, self._noise, self._watch_sinr = noise_mw, noise, watch_sinr

    def account(self, reception: Reception, total: int, loud: int, now_ns: Nanoseconds) -> None:
        """Note that a reception has met the same power all the time since the last note.

        Parameters
        ----------
        total : of the powers at the receiver, the wanted frame's among them [unit]
        loud : number of frames there above the sensitivity, the wanted one among them
        """
        if now_ns == reception.since_ns:
            return
        others_mw = (total - reception.wanted) * self._unit_mw
        if self._noise is None:
            self._stretch(reception, self._noise_mw, others_mw, loud > 1, now_ns)
            return
        step_ns, at = self._noise.step_ns, reception.radio.index
        while True:
            level_mw = self._noise.level_mw(at, reception.since_ns)
            until_ns = min(now_ns, (reception.since_ns // step_ns + 1) * step_ns)
            self._stretch(reception, level_mw, others_mw, loud > 1, until_ns)
            if until_ns == now_ns:
                return

    def _stretch(
        self, reception: Reception, noise_mw: float, others_mw: float, loud: bool, until_ns: Nanoseconds
    ) -> None:
        if self._watch_sinr:
            sinr = reception.wanted_mw / (noise_mw + others_mw)
            reception.worst_sinr = min(reception.worst_sinr, sinr)
        frame = reception.frame
        stretch = (reception.since_ns - frame.start_ns, until_ns - frame.start_ns, frame.mode)
        reception.log_success += self._survival(reception.wanted_mw, noise_mw, others_mw, loud, stretch)
        reception.since_ns = until_ns
