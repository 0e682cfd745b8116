"""What a report is made from."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.types import FloatArray, NodeId, Seconds
from wsnsim.world.world import Placed

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, eq=False)
class ReportContext:
    """A finished run, as the report sees it.

    Parameters
    ----------
    name : of the scenario
    seed : of the run
    system : the tracking system, as a person would call it
    citation : where it was published
    standard : the network's, as a person would call it: ``IEEE 802.15.4``
    size_m : of the world along x, y and z [m]; None where there is none but the nodes
    cameras : by the node that carries each
    tables : `steps` and the record tables by name
    summary : the figures of summary.json
    lost_above_m : largest of the errors above which a target counts as lost [m]
    semi_axes_m : of each target (3,), by its name [m]
    scenery : what stands about in the world
    walks : (n, 2) way from above of everybody who moves and is not tracked, by name [m]
    wait_s : how long after a frame the base station waits for what cameras say of it [s]; None: not known
    platforms : processor board of each node, by its name
    choices : kind that each part of the tracking system was given, by the part's name
    settings : what else of the system decides the result, in a few words each
    unit_m : length that counts as one unit beside the published figures [m]; None: the metre
    particles : key of the number of the tracker's particles; None: it has none
    """

    name: str
    seed: int
    system: str
    citation: str
    standard: str
    size_m: tuple[float, float, float] | None
    cameras: Mapping[NodeId, PinholeCamera]
    tables: "Mapping[str, pd.DataFrame]"
    summary: Mapping[str, float | int | None]
    lost_above_m: float
    semi_axes_m: Mapping[str, FloatArray] = field(default_factory=dict)
    scenery: tuple[Placed, ...] = ()
    walks: Mapping[str, FloatArray] = field(default_factory=dict)
    wait_s: Seconds | None = None
    platforms: Mapping[NodeId, str] = field(default_factory=dict)
    choices: Mapping[str, str] = field(default_factory=dict)
    settings: tuple[str, ...] = ()
    unit_m: float | None = None
    particles: str | None = None
