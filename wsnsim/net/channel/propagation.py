"""How much power of one node arrives at another.

A propagation model gives the loss between pairs of nodes, so that a large network
need not ask for all of them, and how far a loss reaches at most. Whatever it models
must not change while a run lasts.

Two nodes at one place are allowed: no model's loss falls any more below its reference
distance, so they are to each other what nodes at that distance are.

References
----------
Rappaport, Wireless Communications (2nd ed., 2002), sec. 4.11.1 (log-distance
path loss).
"""

from dataclasses import dataclass
from math import inf
from typing import Protocol

import numpy as np

from wsnsim.types import FloatArray, IntArray


class Propagation(Protocol):
    """Path loss between fixed nodes."""

    def loss_db(self, positions: FloatArray, senders: IntArray, receivers: IntArray) -> FloatArray:
        """Return what is lost on the way from nodes to others.

        Parameters
        ----------
        positions : (n, 3) - where the nodes are [m]
        senders, receivers : (m,), (m,) - pairs of different nodes

        Returns
        -------
        (m,) - path loss [dB]
        """

    def reach_m(self, positions: FloatArray, loss_db: float) -> float:
        """Return a distance beyond which no pair of nodes at `positions` (n, 3) loses less [m]."""


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
        check_positive(self, "exponent", "reference_distance_m")

    def loss_db(self, positions: FloatArray, senders: IntArray, receivers: IntArray) -> FloatArray:
        """Return the loss (m,) from nodes to others [dB]."""
        ratio = np.maximum(apart_m(positions, senders, receivers) / self.reference_distance_m, 1.0)
        return np.asarray(self.reference_loss_db + 10.0 * self.exponent * np.log10(ratio))

    def reach_m(self, positions: FloatArray, loss_db: float) -> float:
        """Return the distance at which the loss is `loss_db` [m]."""
        over_db = loss_db - self.reference_loss_db
        return 0.0 if over_db < 0.0 else self.reference_distance_m * _ratio(over_db, 10.0 * self.exponent)


class Altered:
    """A propagation that adds to another what belongs to nodes, to pairs or to places."""

    mean: Propagation


def mean_of(propagation: Propagation) -> Propagation:
    """Return the path loss by distance alone, which holds at any place."""
    while isinstance(propagation, Altered):
        propagation = propagation.mean
    return propagation


def apart_m(positions: FloatArray, senders: IntArray, receivers: IntArray) -> FloatArray:
    """Return how far nodes are from others.

    Parameters
    ----------
    positions : (n, 3) - where the nodes are [m]
    senders, receivers : (m,), (m,) - pairs of nodes

    Returns
    -------
    (m,) - distance [m]
    """
    offsets = positions[senders] - positions[receivers]
    return np.asarray(np.sqrt(np.einsum("mk,mk->m", offsets, offsets)))


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


def every_pair(nodes: int) -> tuple[IntArray, IntArray]:
    """Return all ordered pairs of different nodes, (m,) and (m,), by sender, then by receiver."""
    senders, receivers = np.nonzero(~np.eye(nodes, dtype=np.bool_))
    return senders, receivers


def to_mw(power_dbm: float) -> float:
    """Turn decibels over a milliwatt [dBm] into milliwatts [mW]."""
    return float(10.0 ** (power_dbm / 10.0))


def check_positive(model: object, *names: str) -> None:
    """Raise ValueError where one of a model's numbers is not positive."""
    for name in names:
        if not getattr(model, name) > 0.0:
            raise ValueError(f"{name}: must be positive, got {getattr(model, name)}")


def _ratio(decibels: float, per_decade: float) -> float:
    """Return the ratio of distances over which the loss grows by so much; infinite where no float is."""
    return inf if decibels / per_decade > 300.0 else float(10.0 ** (decibels / per_decade))
