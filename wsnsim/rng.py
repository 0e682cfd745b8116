"""Named random streams: the one place where generators are made.

Each use of randomness has its own stream, found by name and numbers, so that
two trackers or two radios under one seed see the same world and the same
images, and a node that skips a step stays in step with the others.
"""

from dataclasses import dataclass
from zlib import crc32

import numpy as np


@dataclass(frozen=True)
class RandomStreams:
    """All random streams of one run.

    Parameters
    ----------
    seed : the run's seed, a non-negative integer
    """

    seed: int

    def stream(self, name: str, *ids: int | str) -> np.random.Generator:
        """Return a new generator at the beginning of the stream `name`, `ids`.

        The same arguments give the same numbers, whatever else was drawn.
        Text in `ids` (a node's or camera's name) counts by its CRC-32, so that
        adding a node changes nobody else's stream.
        """
        key = tuple(crc32(i.encode()) if isinstance(i, str) else i for i in ids)
        sequence = np.random.SeedSequence(self.seed, spawn_key=(crc32(name.encode()), *key))
        return np.random.default_rng(sequence)
