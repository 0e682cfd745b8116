"""Names for the array and scalar types that cross the seams between rooms."""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

FloatArray: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.int64]
BoolArray: TypeAlias = NDArray[np.bool_]
ByteArray: TypeAlias = NDArray[np.uint8]

Seconds: TypeAlias = float
Nanoseconds: TypeAlias = int
"""The event clock counts integer nanoseconds: carrier sensing turns on ties."""

NodeId: TypeAlias = str
