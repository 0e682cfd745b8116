"""Free space and the two-ray ground model: path loss that has no exponent to choose.

References
----------
Rappaport, Wireless Communications (2nd ed., 2002), eq. 4.1 (Friis' free space equation), eqs. 4.52-4.53
(two-ray ground reflection); ns-2 manual, ch. 18.2, for the distance at which the second takes over.
"""

from dataclasses import dataclass
from math import log10, pi

import numpy as np

from wsnsim.net.channel.propagation import apart_m, check_positive
from wsnsim.types import FloatArray, IntArray

SPEED_OF_LIGHT_MPS = 299_792_458.0


@dataclass(frozen=True)
class FreeSpace:
    """Friis' equation for antennas without gain: (4 pi d f / c) squared.

    Parameters
    ----------
    frequency_hz : of the carrier [Hz]
    reference_distance_m : distance below which the loss stays what it is there; the equation holds in the
        far field only [m]

    Raises
    ------
    ValueError : a number that is not positive
    """

    frequency_hz: float = 2.4e9
    reference_distance_m: float = 1.0

    def __post_init__(self) -> None:
        check_positive(self, "frequency_hz", "reference_distance_m")

    def loss_db(self, positions: FloatArray, senders: IntArray, receivers: IntArray) -> FloatArray:
        """Return the loss (m,) from nodes to others [dB]."""
        return self.at(apart_m(positions, senders, receivers))

    def at(self, distance_m: FloatArray) -> FloatArray:
        """Return the loss at distances [m] of any shape [dB]."""
        return np.asarray(20.0 * np.log10(np.maximum(distance_m, self.reference_distance_m) * self._per_m))

    def reach_m(self, positions: FloatArray, loss_db: float) -> float:
        """Return the distance at which the loss is `loss_db` [m]."""
        distance_m = float(np.power(10.0, min(loss_db / 20.0, 300.0))) / self._per_m
        return distance_m if distance_m >= self.reference_distance_m else 0.0

    @property
    def _per_m(self) -> float:
        return 4.0 * pi * self.frequency_hz / SPEED_OF_LIGHT_MPS


@dataclass(frozen=True)
class TwoRayGround:
    """A ray straight across and one off flat ground: d to the fourth over the squared heights.

    Near by, where the two rays swing against each other, free space holds; it ends at
    4 pi h_t h_r f / c, where both models give the same loss. Heights are the nodes' z.

    Parameters
    ----------
    near : what holds before that

    Raises
    ------
    ValueError : on use, a node that is not above the ground
    """

    near: FreeSpace = FreeSpace()

    def loss_db(self, positions: FloatArray, senders: IntArray, receivers: IntArray) -> FloatArray:
        """Return the loss (m,) from nodes to others [dB]."""
        self._check(positions)
        heights = positions[senders, 2] * positions[receivers, 2]
        distance_m = np.maximum(apart_m(positions, senders, receivers), self.near.reference_distance_m)
        crossover_m = 4.0 * pi * heights * self.near.frequency_hz / SPEED_OF_LIGHT_MPS
        far_db = 40.0 * np.log10(distance_m) - 20.0 * np.log10(heights)
        return np.where(distance_m > crossover_m, far_db, self.near.at(distance_m))

    def reach_m(self, positions: FloatArray, loss_db: float) -> float:
        """Return the distance at which the loss between nodes as high as the highest is `loss_db` [m]."""
        self._check(positions)
        highest_db = 40.0 * log10(float(positions[:, 2].max()))
        ground_m = float(np.power(10.0, min((loss_db + highest_db) / 40.0, 300.0)))
        crossover_m = 4.0 * pi * 10.0 ** (highest_db / 20.0) * self.near.frequency_hz / SPEED_OF_LIGHT_MPS
        return ground_m if ground_m > crossover_m else self.near.reach_m(positions, loss_db)

    def _check(self, positions: FloatArray) -> None:
        lowest_m = float(positions[:, 2].min(initial=np.inf))
        if not lowest_m > 0.0:
            raise ValueError(f"z of a node: must be above the ground at 0 for two rays, got {lowest_m:g} [m]")
