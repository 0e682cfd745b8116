"""All that the page rests on, and where in it the runs of a setting are."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pandas as pd

from wsnsim.claims.results import Results, read_results
from wsnsim.claims.scanline.speed import Speed, read_speed
from wsnsim.claims.scanline.studies import (
    BENCH,
    DEFAULT,
    KALMAN,
    PAPER_SD,
    PUBLISHED,
    RADIO_STUDY,
    STUDIES,
    USUAL_CAMERAS,
    units_m,
)

RMSE = "position_rmse_m"
BYTES, ON_AIR, JOULES = "app_bytes_per_step", "mac_bytes_per_step", "energy_per_step_j"
CYCLES, HEARD, LATE = "cpu_cycles_per_step", "heard_ratio", "latency_p95_s"
FIGURES = (RMSE, "position_error_median_m", BYTES, ON_AIR, HEARD)
"""Figures of the table of all runs."""


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
    unit_m: float

    def rmse(self) -> "pd.Series[float]":
        """Return the runs' root mean square errors over both axes, by seed [unit]."""
        return self.results.figure(self.cell, RMSE) / self.unit_m

    def figure(self, key: str) -> "pd.Series[float]":
        """Return another figure of the runs, by seed."""
        return self.results.figure(self.cell, key)

    @property
    def steps(self) -> int:
        """Frames of a run."""
        return int(self.figure("steps").iloc[0])


@dataclass(frozen=True)
class Known:
    """How well a room's occluders are known without a look at the object, and the object; over both axes.

    Parameters
    ----------
    filters : errors of the Kalman filters of the occluders, by kind of priors [unit]
    occluders : error of who takes all occluders to be in the room's centre: the paper's RMSE_max [unit]
    target : error of who takes the object to be there, the dotted line of Fig. 9 [unit]
    """

    filters: Mapping[str, float]
    occluders: float
    target: float


@dataclass(frozen=True)
class Rooms:
    """The three rooms: with the block (Fig. 9), without it (Figs. 10 to 12), the lab (Fig. 15)."""

    block: Known
    open: Known
    lab: Known


@dataclass(frozen=True, eq=False)
class Evidence:
    """All results, seen in one of the two forms of the tracker.

    Parameters
    ----------
    cameras, priors, tradeoff, crowds, trackers, hull, lab, radio : the studies' results
    nodes : the table of nodes of the runs over the radio, by cell
    units_m : what each study's scenario calls a unit, by the study's name [m]
    rooms : how well anybody knows where occluders and object are
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
    units_m: Mapping[str, float]
    rooms: Rooms
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
        return self._found(self.lab, f"N{cameras}-{prior}")

    def on_air(self, cell: str) -> Place | None:
        """Return a setting over IEEE 802.15.4."""
        return self._found(self.radio, cell)

    def _found(self, results: Results, cell: str) -> Place | None:
        name = f"{cell}-{PUBLISHED}" if self.form == PUBLISHED else cell
        return Place(results, name, self.units_m[results.study.name]) if name in results else None


def read_evidence(folder: Path) -> Evidence:
    """Read the studies' results, each from the folder of its name, and the CPU times if they are there.

    Raises
    ------
    OutputError : a study, a cell or a run is missing
    """
    # compiled kernels come in with the filters: what is missing is said without them
    from wsnsim.claims.scanline.rooms import measured_rooms

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
        units_m=units_m(),
        rooms=measured_rooms(),
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
