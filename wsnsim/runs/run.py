"""Runs a scenario and leaves the results in a folder, whole or marked as what they are."""

import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from wsnsim.errors import OutputError, WsnsimError
from wsnsim.metrics.steps import passed_over, steps_table
from wsnsim.metrics.summary import summary
from wsnsim.records import ROW_TYPES
from wsnsim.runs.expectations import check, check_keys
from wsnsim.runs.interrupt import Interrupts, interrupts
from wsnsim.runs.provenance import peak_memory_bytes, provenance
from wsnsim.runs.result import Run
from wsnsim.scenario.load import LoadedScenario, load_scenario, scenario_from_dict
from wsnsim.scenario.resolved import resolved_yaml, scenario_hash
from wsnsim.sim.build import build
from wsnsim.sim.engine import Progress, Simulation
from wsnsim.sim.macs import channel_bps
from wsnsim.store.derived import write_table
from wsnsim.store.folder import RunFolder, Status, write_text
from wsnsim.store.reader import RunStore
from wsnsim.store.writer import FULL, SqliteSink
from wsnsim.units import to_s

_LOST_LENGTHS = 2.0
"""A target is lost when the last error exceeds so many of its lengths (1.6 m for the published target)."""


def run(
    scenario: str | Path | Mapping[str, Any] | LoadedScenario,
    *,
    seed: int | None = None,
    overrides: Sequence[str] = (),
    out: str | Path | None = None,
    force: bool = False,
    progress: Progress | None = None,
) -> Run:
    """Run a scenario.

    Parameters
    ----------
    scenario : a YAML file, the same as plain data, or a scenario already loaded
    seed : in place of the scenario's (of a file or data)
    overrides : as after ``--set``: ``"system.particles=250"`` (of a file)
    out : folder for the results; None keeps them in memory only
    force : replace the run that `out` holds
    progress : called with the number of steps done and their total

    Raises
    ------
    ScenarioError : the scenario cannot be run
    OutputError : `out` holds another run, or cannot be written
    SimulationError : a program failed
    ValueError : `seed` or `overrides` with a scenario that cannot take them
    """
    loaded = _load(scenario, seed, overrides)
    if out is not None:
        return _run_into(loaded, RunFolder(Path(out)), force, progress, report=True)
    with TemporaryDirectory(prefix="wsnsim-") as folder:
        result = _run_into(loaded, RunFolder(Path(folder)), force, progress, report=False)
    return Run(result.summary, result.tables, result.expectations, None)


def default_folder(loaded: LoadedScenario) -> Path:
    """Return where the command line puts a run that says nothing else."""
    return Path("runs") / f"{loaded.scenario.name}-seed{loaded.scenario.seed}"


def _load(
    scenario: str | Path | Mapping[str, Any] | LoadedScenario, seed: int | None, overrides: Sequence[str]
) -> LoadedScenario:
    seed = None if seed is None else int(seed)  # NumPy's integers are taken too
    if isinstance(scenario, str | Path):
        return load_scenario(scenario, (overrides,) if isinstance(overrides, str) else overrides, seed)
    if overrides:
        raise ValueError("overrides go with a scenario's file, not with data or a loaded scenario")
    if isinstance(scenario, Mapping):
        return scenario_from_dict(scenario if seed is None else {**scenario, "seed": seed})
    if seed is not None:
        raise ValueError("a loaded scenario has its seed already; give the seed when loading it")
    return scenario


@dataclass
class _Manifest:
    """What the manifest says while a run goes on."""

    folder: RunFolder
    facts: dict[str, Any]
    began: float

    def mark(self, status: Status) -> None:
        facts = {**self.facts, "wall_s": self.wall_s(), "peak_memory_bytes": peak_memory_bytes()}
        self.folder.write_manifest(status, facts)

    def wall_s(self) -> float:
        return round(time.monotonic() - self.began, 3)


def _run_into(
    loaded: LoadedScenario, folder: RunFolder, force: bool, progress: Progress | None, report: bool
) -> Run:
    began = time.monotonic()
    folder.check(force)
    check_keys(loaded)
    with _room_needed(folder):
        simulation = build(loaded)
    facts = {
        "scenario": loaded.scenario.name,
        "scenario_sha256": scenario_hash(loaded),
        "seed": loaded.scenario.seed,
        **provenance(),
    }
    with folder.held(), _room_needed(folder):
        folder.create(force)
        return _recorded(loaded, simulation, folder, _Manifest(folder, facts, began), progress, report)


def _recorded(
    loaded: LoadedScenario,
    simulation: Simulation,
    folder: RunFolder,
    state: _Manifest,
    progress: Progress | None,
    report: bool,
) -> Run:
    """Run a simulation into an empty folder, whose manifest says how it went."""
    state.mark(Status.RUNNING)
    try:
        write_text(folder.scenario, resolved_yaml(loaded, folder.path))
        with interrupts() as asked, SqliteSink(folder.database) as sink:
            simulation.run(sink, _attentive(asked, progress))
        result = _finish(loaded, simulation, folder, state, report)
    except BaseException as error:
        folder.discard_results()
        status = Status.INTERRUPTED if isinstance(error, KeyboardInterrupt) else Status.FAILED
        # the first error is the one to hear of, even where the disk has no room left to note it
        with suppress(WsnsimError):
            state.mark(status)
        raise
    state.facts["expectations"] = [str(expectation) for expectation in result.expectations]
    state.mark(Status.COMPLETE)
    return result


@contextmanager
def _room_needed(folder: RunFolder) -> Iterator[None]:
    """Say where room is missing, whoever needed it: numba keeps compiled kernels, and knows of no folder.

    Raises
    ------
    OutputError : the disk is full
    """
    try:
        yield
    except OutputError:
        raise
    except Exception as error:
        cause: BaseException | None = error
        while cause is not None:
            if isinstance(cause, OSError) and cause.errno in FULL:
                raise OutputError(
                    f"{folder.path}: there must be room for results and compiled kernels, "
                    f"got '{cause.strerror}'; free some space, or name folders on another disk "
                    "with --out and NUMBA_CACHE_DIR"
                ) from error
            cause = cause.__cause__ or cause.__context__
        raise


def _attentive(asked: Interrupts, progress: Progress | None) -> Progress:
    """Return a progress report that stops the run where somebody asked for it."""

    def report(done: int, total: int) -> None:
        asked.raise_if_asked()
        if progress is not None:
            progress(done, total)

    return report


def _finish(
    loaded: LoadedScenario, simulation: Simulation, folder: RunFolder, state: _Manifest, report: bool
) -> Run:
    """Derive steps and summary from the records on disk, and write the report where there is to be one."""
    store = RunStore(folder.database)
    tables = {row_type.table: store.table(row_type.table) for row_type in ROW_TYPES}
    cameras = {camera.node.id: camera.renderer.camera for camera in simulation.cameras}
    steps = steps_table(tables["truth"], tables["estimates"], tables["views"], cameras)
    tables["steps"] = passed_over(steps, tables["events"])
    write_table(folder.database, "steps", tables["steps"])
    lost_above_m = _lost_above_m(loaded)
    figures = summary(
        steps=tables["steps"],
        nodes=tables["nodes"],
        messages=tables["messages"],
        load=tables["load"],
        base=loaded.scenario.motes.base.id,
        step_s=1.0 / simulation.schedule.rate_hz,
        lost_above_m=lost_above_m,
        channel_bps=channel_bps(loaded.scenario.network),
        simulated_s=to_s(simulation.schedule.end_ns),
        wall_s=state.wall_s(),
        active_s=simulation.schedule.duration_s,
    )
    if report:
        # takes half a second, which runs in memory and those of a sweep have no use for
        from wsnsim.report.page import write_report
        from wsnsim.runs.report_context import report_context

        largest_m = max(lost_above_m.values(), default=0.0)
        write_report(folder.report, report_context(loaded, simulation, tables, figures, largest_m))
    folder.write_summary(figures)
    expectations = check(loaded.scenario.expect, figures)
    return Run(figures, tables, expectations, folder.path)


def _lost_above_m(loaded: LoadedScenario) -> dict[str, float]:
    """Return for each target the last error above which it is lost [m]."""
    world = loaded.scenario.world
    targets = () if world is None else world.targets
    return {target.id: _LOST_LENGTHS * 2.0 * max(target.shape.semi_axes_m) for target in targets}
