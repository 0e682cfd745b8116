"""Parameters of routing while a network runs, in plain values."""

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class RepairConfig:
    """How nodes keep their routes up.

    Defaults are those of TinyOS 2.1's CTP where it has the parameter (`CtpRoutingEngineP`,
    `LinkEstimatorP` of the 4-bit estimator), but for the longest beacon interval, which is 512 s there.

    Raises
    ------
    ValueError : a number outside its range
    """

    initial: Literal["tree", "discover"] = "tree"
    """What nodes know at first: the planned tree, or nothing."""
    beacon_min_s: float = 0.128
    """Shortest interval of the Trickle timer [s]."""
    beacon_doublings: int = 8
    """How often it doubles while nothing changes."""
    redundancy: int = 0
    """Trickle's k: beacons with no news heard in an interval that make the own one superfluous; 0: it is
    always sent, as link estimation wants it."""
    switch_etx: float = 1.5
    """By how much another way must be cheaper before a node changes its parent."""
    link_etx_max: float = 5.0
    """ETX above which a link is used only where there is no other."""
    path_etx_max: float = 100.0
    """ETX of a whole way above which it counts as none."""
    lost_after: int = 5
    """Frames in a row that the MAC gave up for want of an acknowledgement, and the neighbour is gone."""
    tries: int = 10
    """How often a frame is given to the MAC, by the way that is best then, before it is lost."""
    hop_limit: int = 32
    """Hops that a packet may take."""
    silent_intervals: float = 3.0
    """A neighbour that was not heard for so many longest beacon intervals is gone."""
    no_route: Literal["hold", "drop"] = "hold"
    """What happens to packets at a node without a way."""

    def __post_init__(self) -> None:
        if not self.beacon_min_s > 0.0:
            raise ValueError(f"beacon_min_s: must be positive, got {self.beacon_min_s} [s]")
        least = {"beacon_doublings": 0, "redundancy": 0, "lost_after": 1, "tries": 1, "hop_limit": 1}
        for name, lowest in least.items():
            if getattr(self, name) < lowest:
                raise ValueError(f"{name}: must be at least {lowest}, got {getattr(self, name)}")
        for name, low in {"switch_etx": 0.0, "link_etx_max": 1.0, "path_etx_max": 1.0}.items():
            if not getattr(self, name) >= low:
                raise ValueError(f"{name}: must be at least {low}, got {getattr(self, name)}")
        if self.path_etx_max > 500.0:
            raise ValueError(f"path_etx_max: 16 bits of a beacon hold at most 500, got {self.path_etx_max}")
        if not self.silent_intervals > 1.0:
            raise ValueError(f"silent_intervals: must be more than 1, got {self.silent_intervals}")
        if self.hop_limit > 255:
            raise ValueError(f"hop_limit: must be at most 255, got {self.hop_limit}")

    @property
    def beacon_max_s(self) -> float:
        """Longest interval of the Trickle timer [s]."""
        return self.beacon_min_s * 2.0**self.beacon_doublings

    @property
    def lifetime_s(self) -> float:
        """How long a neighbour is believed in that says nothing [s]."""
        return self.silent_intervals * self.beacon_max_s


@dataclass(frozen=True)
class DisseminationConfig:
    """How what is for all nodes is spread.

    Raises
    ------
    ValueError : a number outside its range
    """

    repeats: int = 0
    """How often each node broadcasts a frame again after the first time."""
    pause_s: float = 0.1
    """Longest of the random pauses before each repetition [s]."""
    accept: Literal["parent", "anyone"] = "parent"
    """Whose broadcasts a node takes, and passes on: its parent's, or those of any node in reach."""

    def __post_init__(self) -> None:
        if not 0 <= self.repeats <= 100:
            raise ValueError(f"repeats: must be 0 to 100, got {self.repeats}")
        if not self.pause_s > 0.0:
            raise ValueError(f"pause_s: must be positive, got {self.pause_s} [s]")
