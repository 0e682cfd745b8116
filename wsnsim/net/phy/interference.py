"""What overlapping frames do to each other.

Each model is one small function; the medium asks it and knows no more. What
overlaps within a receiver's noise is noise to its decoder in every model; they
differ in what a frame does that a receiver would notice by itself.

References
----------
Texas Instruments, CC2420 data sheet (SWRS041), receiver parameters: co-channel
rejection, the wanted frame 3 dB above another 802.15.4 signal. Landsiedel,
Ferrari, Zimmerling, Chaos (SenSys 2013), sec. 2: a stronger frame captures the
receiver if it begins within the synchronisation header of a weaker one.
"""

from collections.abc import Callable
from math import inf
from typing import TypeAlias

from wsnsim.net.channel.propagation import to_mw
from wsnsim.net.config import RadioConfig
from wsnsim.net.phy.base import Phy
from wsnsim.types import Nanoseconds

Stretch: TypeAlias = tuple[Nanoseconds, Nanoseconds, int]
"""Begin and end of a part of a frame, from the frame's begin on [ns], and the frame's bit rate."""

Survival: TypeAlias = Callable[[float, float, float, bool, Stretch], float]
"""Power of the wanted frame, noise, sum of the powers of the frames over it [mW], whether one of those is
above the sensitivity, the stretch → logarithm of the probability of success."""


def survival(config: RadioConfig, phy: Phy) -> Survival:
    """Return how a stretch of a frame survives what overlaps it.

    Parameters
    ----------
    config : the model, see `RadioConfig.collision`
    phy : what noise does to bits
    """
    capture_ratio = to_mw(config.capture_db)

    def by_sinr(wanted_mw: float, noise_mw: float, others_mw: float, loud: bool, stretch: Stretch) -> float:
        return phy.log_success(wanted_mw / (noise_mw + others_mw), *stretch)

    def destroyed(wanted_mw: float, noise_mw: float, others_mw: float, loud: bool, stretch: Stretch) -> float:
        return -inf if loud else by_sinr(wanted_mw, noise_mw, others_mw, loud, stretch)

    def captured(wanted_mw: float, noise_mw: float, others_mw: float, loud: bool, stretch: Stretch) -> float:
        if loud and wanted_mw < capture_ratio * others_mw:
            return -inf
        return by_sinr(wanted_mw, noise_mw, others_mw, loud, stretch)

    return {"sinr": by_sinr, "destructive": destroyed, "capture": captured}[config.collision]
