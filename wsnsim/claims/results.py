"""Finished sweeps as a report reads them: every run must be there, or the error says what to run."""

import json
from dataclasses import dataclass
from pathlib import Path
from shlex import join

import pandas as pd

from wsnsim.errors import OutputError
from wsnsim.store.sweeps import COMPLETE, FAILED, read_sweep
from wsnsim.sweeps.sweep import DATABASE


@dataclass(frozen=True)
class StudyFile:
    """A study that a report is made of.

    Parameters
    ----------
    name : of the study, and of the folder of its results
    file : from the root of the project
    cells : those that the report cannot do without
    keeps_steps : whether the tables of steps are needed too
    """

    name: str
    file: str
    cells: tuple[str, ...]
    keeps_steps: bool


@dataclass(frozen=True, eq=False)
class Results:
    """All runs of a study.

    Parameters
    ----------
    study : what was read
    cells : one row for each cell
    runs : one row for each cell and seed, all of them complete
    steps : by the name of their cell, where they are kept; empty otherwise
    overrides : values that the command line put into every run
    provenance : versions that the runs were made with
    """

    study: StudyFile
    cells: pd.DataFrame
    runs: pd.DataFrame
    steps: dict[str, pd.DataFrame]
    overrides: tuple[str, ...]
    provenance: pd.DataFrame

    def __contains__(self, cell: str) -> bool:
        return bool((self.cells["name"] == cell).any())

    def number_of(self, cell: str) -> int:
        """Return the number of a cell by its name."""
        return int(self.cells.loc[self.cells["name"] == cell, "cell"].iloc[0])

    def of(self, cell: str) -> pd.DataFrame:
        """Return the runs of a cell, by seed."""
        return self.runs[self.runs["name"] == cell].set_index("seed")

    def figure(self, cell: str, key: str) -> "pd.Series[float]":
        """Return a figure of a cell's runs, by seed; NaN where a run has none."""
        return self.of(cell)[key].astype("float64")

    @property
    def seeds(self) -> tuple[int, ...]:
        """The seeds in their order."""
        return tuple(sorted(int(seed) for seed in self.runs["seed"].unique()))


def read_results(study: StudyFile, folder: Path) -> Results:
    """Read a sweep's folder.

    Raises
    ------
    OutputError : no sweep there, a cell that the report needs is not in it, or a run that is not complete
    """
    path = folder / DATABASE
    command = join(["wsnsim", "sweep", study.file, "--out", str(folder)])
    if not path.is_file():
        raise OutputError(f"{path}: the sweep must exist; run: {command}")
    asked, cells, runs = (read_sweep(path, name) for name in ("study", "cells", "runs"))
    named = list(asked["name"])
    if named != [study.name]:
        raise OutputError(f"{path}: must be a sweep of the study {study.name!r}, got {named}; run: {command}")
    absent = [cell for cell in study.cells if cell not in set(cells["name"])]
    if absent:
        raise OutputError(f"{path}: cell {absent[0]} must be in the study{_more(absent)}; run: {command}")
    _check_complete(path, runs, command)
    steps: dict[str, pd.DataFrame] = {}
    if study.keeps_steps:
        names = dict(zip(cells["cell"], cells["name"], strict=True))
        kept = read_sweep(path, "steps")
        steps = {str(names[cell]): own.reset_index(drop=True) for cell, own in kept.groupby("cell")}
    overrides = tuple(json.loads(asked["overrides"].iloc[0]))
    made = read_sweep(path, "provenance")
    used = made[made["provenance"].isin(runs["provenance"].unique())]
    return Results(study, cells, runs, steps, overrides, used)


def _check_complete(path: Path, runs: pd.DataFrame, command: str) -> None:
    open_runs = runs[runs["status"] != COMPLETE]
    if not len(open_runs):
        return
    names = [str(name) for name in open_runs["name"].unique()]
    own = runs[runs["name"] == names[0]]
    there = int((own["status"] == COMPLETE).sum())
    failed = own[own["status"] == FAILED]
    why = f"; seed {failed['seed'].iloc[0]} failed: {failed['error'].iloc[0]}" if len(failed) else ""
    raise OutputError(
        f"{path}: cell {names[0]} must have all of its {len(own)} runs, got {there}{_more(names)}{why}; "
        f"run: {command}"
    )


def _more(names: list[str]) -> str:
    """Say how many cells have the same problem."""
    return f" (and {len(names) - 1} more cells)" if len(names) > 1 else ""
