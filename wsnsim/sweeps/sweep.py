"""Runs a study: what is missing, in worker processes, into one file; then its tables and its report."""

import os
import shlex
import tempfile
from collections.abc import Callable, Collection, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from json import dumps
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from wsnsim.errors import OutputError, OutputFolderError, Problem, ScenarioError
from wsnsim.runs.interrupt import Interrupts, interrupts
from wsnsim.runs.provenance import provenance
from wsnsim.scenario.faults import did_you_mean, shown
from wsnsim.store.folder import RunFolder, write_text
from wsnsim.store.sweeps import CellRow, SweepFile, check_study, complete_results, read_sweep
from wsnsim.store.writer import cannot_write
from wsnsim.sweeps.study import LoadedStudy, PlannedRun, load_study
from wsnsim.sweeps.supervisor import Outcome, Supervisor
from wsnsim.sweeps.worker import Task

if TYPE_CHECKING:
    import pandas as pd

RunsProgress: TypeAlias = Callable[[int, int, int], None]
"""Told the runs that are there, their total, and how many of them have failed in this call."""


@dataclass(frozen=True)
class FailedRun:
    """A run that came to nothing.

    Parameters
    ----------
    cell : name of its cell
    seed : its seed
    error : what went wrong
    command : line for a shell that runs it by itself
    """

    cell: str
    seed: int
    error: str
    command: str


@dataclass(frozen=True)
class Sweep:
    """A study's results.

    Parameters
    ----------
    folder : where the files are
    runs : one row for each cell and seed: what was asked, what became of it, its figures
    cells : one row for each cell: means with 95 % intervals, lost runs
    failed : the runs that failed in this call
    done : runs that this call has made
    other_versions : complete runs that an earlier call made with other versions of wsnsim or its libraries
    """

    folder: Path
    runs: "pd.DataFrame" = field(repr=False)
    cells: "pd.DataFrame" = field(repr=False)
    failed: tuple[FailedRun, ...]
    done: int
    other_versions: int

    def table(self, name: str) -> "pd.DataFrame":
        """Return a table of the sweep's file, one that the study keeps for example: `steps`."""
        return read_sweep(self.folder / DATABASE, name)

    @property
    def complete(self) -> bool:
        """Whether every run of the study is there."""
        return bool((self.runs["status"] == "complete").all())


DATABASE, CELLS, REPORT = "sweep.sqlite", "summary.csv", "report.html"


def default_folder(loaded: LoadedStudy) -> Path:
    """Return where a study's results go that says nothing else."""
    return Path("runs") / loaded.study.name


def sweep(
    study: str | Path | LoadedStudy,
    *,
    out: str | Path | None = None,
    workers: int | None = None,
    overrides: Sequence[str] = (),
    only: Sequence[str] = (),
    limit: int | None = None,
    fresh: bool = False,
    progress: RunsProgress | None = None,
) -> Sweep:
    """Run what is missing of a study.

    Runs that the folder has, of the same scenarios, are not run again: a call that
    was interrupted is resumed by the same call.

    Parameters
    ----------
    study : a YAML file, or a study already loaded
    out : folder for the results; None: runs/NAME
    workers : processes; None: one for each processor that this one may use
    overrides : as after ``--set``, put into every run last (of a file)
    only : cells to run now, by names or patterns such as ``B/*``; empty: all
    limit : runs to make now at most
    fresh : delete what the folder has of a study
    progress : called whenever a run is done

    Raises
    ------
    ScenarioError : the study, or one of its scenarios, cannot be run
    OutputError : `out` holds something else, or cannot be written
    KeyboardInterrupt : somebody asked to stop; what was done is kept
    """
    loaded = study if isinstance(study, LoadedStudy) else load_study(study, overrides)
    selected = selected_cells(loaded, only)
    folder = Path(out) if out is not None else default_folder(loaded)
    _check_folder(folder)
    hashes = {run.scenario_sha256 for run in loaded.runs}
    with RunFolder(folder).held():
        _clear(folder, everything=fresh)
        with interrupts() as asked, SweepFile(folder / DATABASE, loaded.study.name) as file:
            _plan(file, loaded)
            there = file.complete(loaded.study.keep)
            todo = _distinct(loaded, selected, there)[:limit]
            _check_buildable(todo, asked)
            made = file.provenance(provenance())
            state = _State(file, loaded, todo, made, progress)
            state.run(workers or _processors(), asked, len(hashes & there.keys()))
            there = file.complete(loaded.study.keep)
        others = sum(there.get(digest, made) != made for digest in hashes)
        cells, runs = _finish(loaded, folder)
    failed = tuple(FailedRun(run.cell.name, run.seed, error, _command(run)) for run, error in state.failed)
    return Sweep(folder, runs, cells, failed, state.done, others)


def selected_cells(loaded: LoadedStudy, only: Sequence[str]) -> frozenset[int]:
    """Return the numbers of the cells that patterns name.

    Raises
    ------
    ScenarioError : a pattern that names none
    """
    if not only:
        return frozenset(cell.number for cell in loaded.cells)
    found: set[int] = set()
    problems = []
    names = [cell.name for cell in loaded.cells]
    for pattern in only:
        hits = [cell.number for cell in loaded.cells if fnmatchcase(cell.name, pattern)]
        if not hits:
            message = f"must name a cell, got {shown(pattern)}{did_you_mean(pattern, names)}"
            problems.append(Problem("", message, argument=f"--only {pattern}"))
        found.update(hits)
    if problems:
        raise ScenarioError(problems)
    return frozenset(found)


def missing_runs(
    loaded: LoadedStudy, folder: Path, only: Sequence[str] = (), fresh: bool = False
) -> list[PlannedRun]:
    """Return what a sweep would run now; nothing is written."""
    selected = selected_cells(loaded, only)
    _check_folder(folder)
    if fresh or not (folder / DATABASE).exists():
        return _distinct(loaded, selected, ())
    check_study(folder / DATABASE, loaded.study.name)
    results = read_sweep(folder / DATABASE, "results")
    return _distinct(loaded, selected, complete_results(results, loaded.study.keep))


@dataclass
class _State:
    """A sweep under way: what comes in is kept, counted and told."""

    file: SweepFile
    loaded: LoadedStudy
    todo: Sequence[PlannedRun]
    made: int
    progress: RunsProgress | None
    failed: list[tuple[PlannedRun, str]] = field(default_factory=list)
    done: int = 0

    def run(self, workers: int, asked: Interrupts, there: int) -> None:
        total = there + len(self.todo)

        def take(outcome: Outcome) -> None:
            run = self.todo[outcome.task]
            self.file.record(run.scenario_sha256, outcome.result, outcome.attempts, self.made)
            self.done += 1
            if outcome.result.error is not None:
                self.failed.append((run, outcome.result.error))
            if self.progress is not None:
                self.progress(there + self.done, total, len(self.failed))

        if self.progress is not None:
            self.progress(there, total, 0)
        with tempfile.TemporaryDirectory(prefix="wsnsim-sweep-", ignore_cleanup_errors=True) as scratch:
            tasks = [_task(run, self.loaded.study.keep) for run in self.todo]
            Supervisor(tasks, workers, Path(scratch), take, asked.raise_if_asked).run()
        order = {run.scenario_sha256: at for at, run in enumerate(self.todo)}
        self.failed.sort(key=lambda each: order[each[0].scenario_sha256])


def _task(run: PlannedRun, keep: tuple[str, ...]) -> Callable[[], Task]:
    def make() -> Task:
        return Task(run.loaded.scenario.model_dump(mode="json"), str(run.loaded.base_dir), keep)

    return make


def _plan(file: SweepFile, loaded: LoadedStudy) -> None:
    """Put down what the study asks for."""
    cells = [
        CellRow(c.number, c.name, c.scenario, c.factor, c.level, loaded.baseline_of(c).number, c.values)
        for c in loaded.cells
    ]
    runs = sorted((run.cell.number, run.seed, run.scenario_sha256) for run in loaded.runs)
    file.plan(loaded.study.name, loaded.text, loaded.overrides, cells, runs)


def _distinct(loaded: LoadedStudy, selected: frozenset[int], there: Collection[str]) -> list[PlannedRun]:
    """Return the runs of selected cells that are not there; of those that come to the same the first one."""
    found: dict[str, PlannedRun] = {}
    for run in loaded.runs:
        if run.cell.number in selected and run.scenario_sha256 not in there:
            found.setdefault(run.scenario_sha256, run)
    return list(found.values())


def _check_buildable(todo: Sequence[PlannedRun], asked: Interrupts) -> None:
    """Build the first run of each cell: what the schema cannot see is told before anything runs.

    Raises
    ------
    ScenarioError : every cell that cannot be built
    """
    from wsnsim.sim.build import build

    first: dict[int, PlannedRun] = {}
    for run in todo:
        first.setdefault(run.cell.number, run)
    found: dict[str, list[Problem]] = {}
    for run in first.values():
        asked.raise_if_asked()
        try:
            build(run.loaded)
        except ScenarioError as error:
            for problem in error.problems:
                found.setdefault(str(problem), []).append(
                    Problem(
                        problem.path,
                        f"{problem.message} (cell {run.cell.name})",
                        problem.file,
                        problem.line,
                        problem.column,
                        problem.argument,
                    )
                )
    if found:
        raise ScenarioError([problems[0] for problems in found.values()])


def _check_folder(folder: Path) -> None:
    """Refuse a folder with a single run in it, whose report a sweep's would replace."""
    if (folder / DATABASE).exists():
        return
    try:
        RunFolder(folder).check()
    except OutputFolderError:
        if folder.is_dir():
            raise OutputFolderError(
                f"{folder}: output folder must not hold a single run; choose another --out"
            ) from None
        raise


def _clear(folder: Path, everything: bool) -> None:
    """Remove what will be written anew, so that a sweep that stops half way does not look whole."""
    names = [CELLS, REPORT]
    if everything:
        names += [DATABASE, *(f"{DATABASE}{end}" for end in ("-wal", "-shm", "-journal"))]
    try:
        for name in names:
            (folder / name).unlink(missing_ok=True)
    except OSError as error:
        raise cannot_write(folder, error) from error


def _finish(loaded: LoadedStudy, folder: Path) -> "tuple[pd.DataFrame, pd.DataFrame]":
    """Write the table of cells and the report."""
    from wsnsim.metrics.cells import cells_table
    from wsnsim.report.keyfigures import KEY_FIGURES
    from wsnsim.report.sweep import SweepContext, write_sweep_report
    from wsnsim.store.sweeps import COMPLETE, FIGURES

    runs, rows = read_sweep(folder / DATABASE, "runs"), read_sweep(folder / DATABASE, "cells")
    figures = [each.key for each in KEY_FIGURES if each.key in FIGURES]
    figures += [key for key in FIGURES if key not in figures]
    cells = cells_table(rows, runs, figures)
    write_text(folder / CELLS, cells.to_csv(index=False, lineterminator="\n"))
    charts = loaded.study.charts
    context = SweepContext(
        name=loaded.study.name,
        cells=cells.assign(baseline=rows["baseline"], settings=rows["settings"]),
        runs=runs,
        x=charts.x,
        y=charts.y,
        tracking=bool(runs["steps"].notna().any()) or not (runs["status"] == COMPLETE).any(),
        overrides=loaded.overrides,
        made_with=read_sweep(folder / DATABASE, "provenance"),
    )
    try:
        write_sweep_report(folder / REPORT, context)
    except OutputError:
        with suppress(OSError):
            (folder / CELLS).unlink()
        raise
    return cells, runs


def _command(run: PlannedRun) -> str:
    """Return a line for a shell that makes a run by itself."""
    parts = ["wsnsim", "run", str(run.loaded.path), "--seed", str(run.seed)]
    for path, value in run.settings:
        # JSON is YAML in one line
        parts += ["--set", f"{path}={dumps(value, ensure_ascii=False)}"]
    return shlex.join(parts)


def _processors() -> int:
    affinity = getattr(os, "sched_getaffinity", None)
    return len(affinity(0)) if affinity is not None else os.cpu_count() or 1
