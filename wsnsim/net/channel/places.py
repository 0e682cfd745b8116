"""In which order the nodes of a large network are numbered: neighbours in space side by side.

A frame concerns those near its sender. Where their numbers are near each other
too, so is in memory what is kept of them, and the processor's cache holds it.

References
----------
Morton, A computer oriented geodetic data base and a new technique in file sequencing (IBM, 1966): the order
of points along a curve that fills the plane.
"""

from collections.abc import Hashable, Mapping
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

from wsnsim.net.channel.links import SMALL_NODES
from wsnsim.types import FloatArray, IntArray

Name = TypeVar("Name", bound=Hashable)
Place = TypeVar("Place", bound=ArrayLike)

_BITS = 16
"""Of each coordinate."""


def along_curve(xy: FloatArray) -> IntArray:
    """Return the order (n,) of points (n, 2) along the Z-order curve; equal ones keep theirs."""
    low, high = xy.min(axis=0), xy.max(axis=0)
    cells = ((xy - low) / np.maximum(high - low, 1e-9) * ((1 << _BITS) - 1)).astype(np.int64)
    key = np.zeros(len(xy), dtype=np.int64)
    for bit in range(_BITS):
        for axis in (0, 1):
            key |= (cells[:, axis] >> bit & 1) << (2 * bit + axis)
    return np.argsort(key, kind="stable")


def numbered_by_place(positions: Mapping[Name, Place]) -> dict[Name, Place]:
    """Return where nodes are [m], in the order in which they are numbered; few keep the order they have."""
    if len(positions) <= SMALL_NODES:
        return dict(positions)
    names = list(positions)
    order = along_curve(np.array([positions[node] for node in names], dtype=np.float64)[:, :2])
    return {names[at]: positions[names[at]] for at in order.tolist()}
