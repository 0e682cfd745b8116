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
        wanted_mw, others_mw = reception.wanted_mw, (total - reception.wanted) * self._unit_mw
        frame, since_ns = reception.frame, reception.since_ns
        noise_mw, until_ns = self._noise_mw, now_ns
        while since_ns < now_ns:
            if self._noise is not None:
                step_ns = self._noise.step_ns
                noise_mw = self._noise.level_mw(reception.radio.index, since_ns)
                until_ns = min(now_ns, (since_ns // step_ns + 1) * step_ns)
            if self._watch_sinr:
                reception.worst_sinr = min(reception.worst_sinr, wanted_mw / (noise_mw + others_mw))
            stretch = (since_ns - frame.start_ns, until_ns - frame.start_ns, frame.mode)
            reception.log_success += self._survival(wanted_mw, noise_mw, others_mw, loud > 1, stretch)
            since_ns = until_ns
        reception.since_ns = now_ns
