"""How much power of one node arrives at another.

A propagation model is a plain callable: node positions in, the loss between
any two of them out. Whatever it models must not change while a run lasts.

References
----------
Rappaport, Wireless Communications (2nd ed., 2002), sec. 4.11.1 (log-distance
path loss).
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from typing import TypeAlias

import numpy as np

from wsnsim.types import FloatArray

Propagation: TypeAlias = Callable[[FloatArray], FloatArray]
"""Positions (n, 3) [m] to path loss (n, n) [dB], [i, j] from node i to node j; the diagonal is not used."""


@dataclass(frozen=True)
class LogDistance:
    """Loss that grows with the logarithm of the distance.

    Parameters
    ----------
    exponent : 2 in free space, 3 to 4 near the ground or among obstacles [-]
    reference_loss_db : loss at the reference distance [dB]; 40.05 is free space at 2.4 GHz and 1 m
    reference_distance_m : distance below which the loss stays what it is there [m]

    Raises
    ------
    ValueError : an exponent or a reference distance that is not positive
    """

    exponent: float = 3.0
    reference_loss_db: float = 40.05
    reference_distance_m: float = 1.0

    def __post_init__(self) -> None:
        for name in ("exponent", "reference_distance_m"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name}: must be positive, got {getattr(self, name)}")

    def __call__(self, positions: FloatArray) -> FloatArray:
        """Return the loss between all nodes.

        Parameters
        ----------
        positions : (n, 3) - where the nodes are [m]

        Returns
        -------
        (n, n) - path loss [dB]
        """
        return self.at(distances(positions))

    def at(self, distance_m: FloatArray) -> FloatArray:
        """Return the loss at distances [m] of any shape [dB]."""
        ratio = np.maximum(distance_m / self.reference_distance_m, 1.0)
        return np.asarray(self.reference_loss_db + 10.0 * self.exponent * np.log10(ratio))


def distances(positions: FloatArray) -> FloatArray:
    """Return how far nodes are from each other.

    Parameters
    ----------
    positions : (n, 3) - where the nodes are [m]

    Returns
    -------
    (n, n) - distance [m]
    """
    offsets = positions[:, None, :] - positions[None, :, :]
    return np.asarray(np.sqrt(np.einsum("ijk,ijk->ij", offsets, offsets)))


def received_dbm(propagation: Propagation, positions: FloatArray, tx_power_dbm: float) -> FloatArray:
    """Return the power that arrives.

    Parameters
    ----------
    propagation : the path loss
    positions : (n, 3) - where the nodes are [m]
    tx_power_dbm : what every node sends [dBm]

    Returns
    -------
    (n, n) - power of node i at node j [dBm], minus infinity on the diagonal
    """
    power = np.asarray(tx_power_dbm - propagation(positions), dtype=np.float64).copy()
    np.fill_diagonal(power, -inf)
    return power


def range_m(propagation: Propagation, loss_db: float, longest_m: float = 1e5) -> float:
    """Return the distance at which the loss between two lone nodes reaches `loss_db` [m].

    Parameters
    ----------
    propagation : the path loss, not falling with distance
    loss_db : largest loss that may be [dB]
    longest_m : where the search ends [m]
    """
    low, high = 0.0, longest_m
    for _ in range(60):
        middle = (low + high) / 2.0
        pair = np.array([[0.0, 0.0, 0.0], [middle, 0.0, 0.0]])
        if float(propagation(pair)[0, 1]) <= loss_db:
            low = middle
        else:
            high = middle
    return low


def to_mw(power_dbm: float) -> float:
    """Turn decibels over a milliwatt [dBm] into milliwatts [mW]."""
    return float(10.0 ** (power_dbm / 10.0))
