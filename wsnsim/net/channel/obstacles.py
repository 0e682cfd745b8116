"""Walls that weaken what passes through them: so many decibels for each that a straight line crosses.

Left out: the slant under which a wall is passed, what goes round it, floors, and the
loss that fewer walls cost in proportion than many (COST 231 fits one number to each kind).

References
----------
COST Action 231, Digital mobile radio towards future generation systems, final report (1999), sec. 4.7.2,
eq. 4.7.2: multi-wall model, the sum of the losses of all walls between the antennas beside free space's.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

from wsnsim.net.channel.propagation import Altered, Propagation
from wsnsim.types import FloatArray, IntArray

Crossing: TypeAlias = Callable[[FloatArray, FloatArray], FloatArray]
"""Begins (m, 3) and ends (m, 3) of straight lines [m] to what the walls on them cost (m,) [dB], 0 or more."""


@dataclass(frozen=True, eq=False)
class Obstructed(Altered):
    """Path loss among walls.

    Parameters
    ----------
    mean : loss where nothing is in the way
    walls_db : what stands on straight lines costs
    """

    mean: Propagation
    walls_db: Crossing

    def loss_db(self, positions: FloatArray, senders: IntArray, receivers: IntArray) -> FloatArray:
        """Return the loss (m,) from nodes to others [dB]."""
        free_db = self.mean.loss_db(positions, senders, receivers)
        return free_db + self.walls_db(positions[senders], positions[receivers])

    def reach_m(self, positions: FloatArray, loss_db: float) -> float:
        """Return a distance beyond which no pair loses less [m]."""
        return self.mean.reach_m(positions, loss_db)
