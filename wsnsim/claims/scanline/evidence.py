"""The studies behind the page, and where in them the runs of a setting are."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pandas as pd

from wsnsim.claims.results import Results, StudyFile, read_results
from wsnsim.claims.scanline.speed import Speed, read_speed

NONE, KALMAN, PERFECT = "none", "kalman", "perfect"
PRIORS = (NONE, KALMAN, PERFECT)
"""What is known of the occluders in the paper's figures: nothing, a Kalman filter's places, everything."""
PAPER_SD = 8
"""σ_v of Fig. 9, in units."""
SDS = (2, 4, 8, 16)
"""σ_v of Fig. 10, in units."""
BEYOND = ("stationary", "scan_lines")
"""Kinds of knowledge that the paper does not try."""
DEFAULT, PUBLISHED = "default", "published"
FORMS = (PUBLISHED, DEFAULT)
CAMERAS = (2, 3, 4, 6, 8)
TRADED = (3, 4, 5, 6, 8)
CROWDS = (1, 10, 20, 40, 80, 120, 160)
LAB_CAMERAS = (2, 4, 8, 12, 16)
USUAL_CAMERAS = 4
KALMAN_TRACKERS = ("extended", "unscented", "map")
PARTICLE_TRACKERS = ("auxiliary", "printed", "plain")
HULL_CROWDS = (10, 40)
HULLS = ("none", "ellipses", "polygons", "scan_lines")

RMSE = "position_rmse_m"
BYTES, ON_AIR, JOULES = "app_bytes_per_step", "mac_bytes_per_step", "energy_per_step_j"
CYCLES, HEARD, LATE = "cpu_cycles_per_step", "heard_ratio", "latency_p95_s"
FIGURES = (RMSE, "position_error_median_m", BYTES, ON_AIR, HEARD)
"""Figures of the table of all runs."""
UNIT_M, INCH_M = 0.2, 0.0254
BENCH = "scanline-bench.json"
"""What `wsnsim bench scanline --json` printed, in the folder of the sweeps."""

_STUDIES = "scenarios/studies"


def _study(name: str, cells: tuple[str, ...], keeps_steps: bool = False) -> StudyFile:
    return StudyFile(f"scanline-{name}", f"{_STUDIES}/scanline_{name}.yaml", cells, keeps_steps)


CAMERA_STUDY = _study("cameras", tuple(f"N{n}-{prior}" for n in CAMERAS for prior in PRIORS))
PRIOR_STUDY = _study(
    "priors",
    (
        NONE,
        PERFECT,
        *(f"{KALMAN}-{sd}" for sd in SDS),
        *BEYOND,
        *(f"{cell}-{PUBLISHED}" for cell in (NONE, PERFECT)),
    ),
)
TRADE_STUDY = _study(
    "tradeoff", tuple(f"N{n}-{prior}" for n in TRADED if n != USUAL_CAMERAS for prior in (NONE, PERFECT))
)
CROWD_STUDY = _study("occluders", tuple(f"M{m}-{prior}" for m in CROWDS for prior in (NONE, PERFECT)))
TRACKER_STUDY = _study(
    "trackers",
    (*(f"{tracker}-{prior}" for tracker in PARTICLE_TRACKERS for prior in (NONE, PERFECT)), *KALMAN_TRACKERS),
)
HULL_STUDY = _study("hull", tuple(f"M{m}-{kind}" for m in HULL_CROWDS for kind in HULLS))
LAB_STUDY = _study("lab", tuple(f"N{n}-{prior}" for n in LAB_CAMERAS for prior in PRIORS))
RADIO_CELLS = ("bearing", "stationary", "kalman", "perfect", "scan_line", "jpeg")
ALONE = "jpeg-alone"
"""A single camera that sends an image in ten seconds: all of it arrives."""
RADIO_STUDY = _study("radio", (*RADIO_CELLS, ALONE))
STUDIES = (
    CAMERA_STUDY,
    PRIOR_STUDY,
    TRADE_STUDY,
    CROWD_STUDY,
    TRACKER_STUDY,
    HULL_STUDY,
    LAB_STUDY,
    RADIO_STUDY,
)


@dataclass(frozen=True, eq=False)
class Place:
    """Where the runs of a setting are.

    Parameters
    ----------
    results : of a study
    cell : its name there
    unit_m : the length in which its errors are told [m]
    """

    results: Results
    cell: str
    unit_m: float = UNIT_M

    def rmse(self) -> "pd.Series[float]":
        """Return the runs' root mean square errors over both axes, by seed [unit]."""
        return self.results.figure(self.cell, RMSE) / self.unit_m

    def figure(self, key: str) -> "pd.Series[float]":
        """Return another figure of the runs, by seed."""
        return self.results.figure(self.cell, key)


@dataclass(frozen=True)
class Occluders:
    """How well the occluders are known, in the room without the block.

    Parameters
    ----------
    rmse : over both axes, by σ_v in units [unit]
    unknown : of who is said to be at the room's centre: the paper's RMSE_max, over both axes [unit]
    """

    rmse: Mapping[int, float]
    unknown: float


@dataclass(frozen=True, eq=False)
class Evidence:
    """All results, seen in one of the two forms of the tracker.

    Parameters
    ----------
    cameras, priors, tradeoff, crowds, trackers, hull, lab, radio : the studies' results
    nodes : the table of nodes of the runs over the radio, by cell
    occluders : how well the priors of Fig. 10 know the occluders
    speed : CPU times of the tracker's step; None where nobody measured them
    form : the mended tracker, or the printed one
    """

    cameras: Results
    priors: Results
    tradeoff: Results
    crowds: Results
    trackers: Results
    hull: Results
    lab: Results
    radio: Results
    nodes: Mapping[str, pd.DataFrame]
    occluders: Occluders
    speed: Speed | None = None
    form: str = field(default=DEFAULT)

    def seen_as(self, form: str) -> "Evidence":
        """Return the same results in another form."""
        return replace(self, form=form)

    @property
    def studies(self) -> tuple[Results, ...]:
        """The studies in the order of the page."""
        return (
            self.cameras,
            self.priors,
            self.tradeoff,
            self.crowds,
            self.trackers,
            self.hull,
            self.lab,
            self.radio,
        )

    def behind_block(self, cameras: int, prior: str) -> Place | None:
        """Return a setting of Fig. 9; None where it was not run in this form."""
        return self._found(self.cameras, f"N{cameras}-{prior}")

    def known(self, prior: str) -> Place | None:
        """Return a setting of Fig. 10."""
        return self._found(self.priors, f"{KALMAN}-{PAPER_SD}" if prior == KALMAN else prior)

    def open_room(self, cameras: int, prior: str) -> Place | None:
        """Return a setting of Fig. 11, of which there is but one in the printed form."""
        if self.form == PUBLISHED:
            return None
        if cameras == USUAL_CAMERAS:
            return self.known(prior)
        return self._found(self.tradeoff, f"N{cameras}-{prior}")

    def crowd(self, occluders: int, prior: str) -> Place | None:
        """Return a setting of Fig. 12."""
        return self._found(self.crowds, f"M{occluders}-{prior}")

    def tracked(self, tracker: str) -> Place | None:
        """Return a run of one of the other trackers."""
        return self._found(self.trackers, tracker)

    def hulled(self, occluders: int, kind: str) -> Place | None:
        """Return a setting with the visual hull."""
        return self._found(self.hull, f"M{occluders}-{kind}")

    def in_lab(self, cameras: int, prior: str) -> Place | None:
        """Return a setting of Fig. 15; its errors are in inches."""
        return self._found(self.lab, f"N{cameras}-{prior}", INCH_M)

    def on_air(self, cell: str) -> Place | None:
        """Return a setting over IEEE 802.15.4."""
        return self._found(self.radio, cell)

    def _found(self, results: Results, cell: str, unit_m: float = UNIT_M) -> Place | None:
        name = f"{cell}-{PUBLISHED}" if self.form == PUBLISHED else cell
        return Place(results, name, unit_m) if name in results else None


def read_evidence(folder: Path) -> Evidence:
    """Read the studies' results, each from the folder of its name, and the CPU times if they are there.

    Raises
    ------
    OutputError : a study, a cell or a run is missing
    """
    # compiled kernels come in with the filters: what is missing is said without them
    from wsnsim.claims.scanline.occluders import measured_occluders

    cameras, priors, tradeoff, crowds, trackers, hull, lab, radio = (
        read_results(study, folder / study.name) for study in STUDIES
    )
    return Evidence(
        cameras,
        priors,
        tradeoff,
        crowds,
        trackers,
        hull,
        lab,
        radio,
        nodes=read_nodes(radio, folder / RADIO_STUDY.name),
        occluders=measured_occluders(PRIOR_STUDY),
        speed=read_speed(folder / BENCH),
    )


def read_nodes(results: Results, folder: Path) -> dict[str, pd.DataFrame]:
    """Return the kept tables of nodes of a study, by cell."""
    from wsnsim.store.sweeps import read_sweep
    from wsnsim.sweeps.sweep import DATABASE

    names = dict(zip(results.cells["cell"], results.cells["name"], strict=True))
    kept = read_sweep(folder / DATABASE, "nodes")
    return {str(names[cell]): own.reset_index(drop=True) for cell, own in kept.groupby("cell")}


def axis(rmse: float) -> float:
    """Return the root mean square error on one axis of one over both: the object's height is known."""
    return rmse / float(np.sqrt(2.0))
