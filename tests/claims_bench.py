"""Made-up sweeps of the studies behind a report, with planted errors, bytes and steps."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from zlib import crc32

import numpy as np
import pandas as pd

from wsnsim.claims.multiview.evidence import STUDIES, Evidence
from wsnsim.claims.results import Results, StudyFile
from wsnsim.store.sweeps import CellRow, Result, SweepFile, kept_table
from wsnsim.sweeps.study import LoadedStudy, PlannedRun, load_study
from wsnsim.sweeps.sweep import DATABASE

ROOT = Path(__file__).parent.parent
SEEDS = (0, 1, 2, 3, 10, 11, 12)
STEPS = {"A": 16, "B": 60, "LCR": 20, "FGH": 40}
SINGLE = (30, 32)
"""Steps of B at which a single camera sees the target."""
_BYTES = {"P": 300.0, "T0": 60_000.0, "T1": 2_000.0, "T2": 1_500.0, "T3": 1_500.0, "T4": 1_700.0}
_ERRORS_M = {"P": 0.3, "T0": 0.06, "T1": 0.06, "T2": 0.06, "T3": 0.07, "T4": 0.07}


@dataclass
class Plant:
    """What the made-up runs come to.

    Parameters
    ----------
    error_m : of a cell, by its name or by its tracker's
    lost : cells whose runs all lose the target
    single, after : by which an error in B grows in the single-camera interval and after it, by cell
    pixels : exponent with which errors of a cell follow the pixel share
    turning : by which errors grow where the target turns
    bytes_with_relays : by tracker
    measured : share of steps that a cell of the radio study measures
    turning_px : by which errors in the images grow where the target turns
    cycles : by tracker
    share : by which the target is larger in the images, by world
    """

    error_m: Mapping[str, float] = field(default_factory=dict)
    lost: frozenset[str] = frozenset()
    single: Mapping[str, float] = field(default_factory=dict)
    after: Mapping[str, float] = field(default_factory=dict)
    pixels: Mapping[str, float] = field(default_factory=dict)
    turning: float = 1.0
    bytes_with_relays: Mapping[str, float] = field(default_factory=dict)
    measured: Mapping[str, float] = field(default_factory=dict)
    turning_px: float = 1.0
    cycles: Mapping[str, float] = field(default_factory=dict)
    share: Mapping[str, float] = field(default_factory=dict)


def shipped_studies() -> dict[str, LoadedStudy]:
    """Return the studies as they ship."""
    return {study.name: load_study(ROOT / study.file) for study in STUDIES}


def write_sweeps(folder: Path, studies: Mapping[str, LoadedStudy], plant: Plant | None = None) -> Path:
    """Write the sweeps' folders, complete."""
    for study in STUDIES:
        write_sweep(folder / study.name, studies[study.name], plant or Plant())
    return folder


def write_sweep(folder: Path, loaded: LoadedStudy, plant: Plant) -> None:
    """Write one sweep's folder, complete."""
    folder.mkdir(parents=True)
    rows = [
        CellRow(c.number, c.name, c.scenario, c.factor, c.level, loaded.baseline_of(c).number, c.values)
        for c in loaded.cells
    ]
    runs = [run for run in loaded.runs if run.seed in SEEDS]
    planned = [(run.cell.number, run.seed, run.scenario_sha256) for run in runs]
    with SweepFile(folder / DATABASE, loaded.study.name) as file:
        # made up in a moment: nothing is lost if the machine stops
        file._connection.execute("PRAGMA synchronous = OFF")
        file.plan(loaded.study.name, loaded.text, (), rows, planned)
        facts = {"wsnsim": "0", "python": "3", "libraries": {"numpy": "2"}, "platform": "p", "machine": "m"}
        made = file.provenance(facts)
        for run in runs:
            steps, figures = made_up_run(run, plant)
            kept = (kept_table("steps", steps),) if loaded.study.keep else ()
            file.record(run.scenario_sha256, Result(figures, 1.0, 1.0, kept), 1, made)


def made_up_evidence(studies: Mapping[str, LoadedStudy], plant: Plant) -> Evidence:
    """Return what `read_evidence` would read of `write_sweeps`, without the files."""
    return Evidence(*(_results(study, studies[study.name], plant) for study in STUDIES))


def _results(study: StudyFile, loaded: LoadedStudy, plant: Plant) -> Results:
    cells = pd.DataFrame(
        [(c.number, c.name, c.scenario, c.factor, c.level) for c in loaded.cells],
        columns=["cell", "name", "scenario", "factor", "level"],
    )
    rows, steps = [], {cell.name: [] for cell in loaded.cells}
    for run in (run for run in loaded.runs if run.seed in SEEDS):
        own, figures = made_up_run(run, plant)
        steps[run.cell.name].append(own.assign(seed=run.seed))
        rows.append(
            {
                "cell": run.cell.number,
                "name": run.cell.name,
                "seed": run.seed,
                "status": "complete",
                **figures,
            }
        )
    tables = {name: pd.concat(each, ignore_index=True) for name, each in steps.items()}
    return Results(study, cells, pd.DataFrame(rows), tables, (), pd.DataFrame())


def made_up_run(run: PlannedRun, plant: Plant) -> tuple[pd.DataFrame, dict[str, float]]:
    """Return steps and figures of a run."""
    world = run.cell.scenario or "B"
    steps = made_up_steps(run.cell.name, world, run.seed, plant)
    return steps, _figures(run.cell.name, steps, plant)


def tracker_of(cell: str) -> str:
    """Return ``T2`` of ``B/T2-published``; the factors are of T2."""
    name = cell.rpartition("/")[2].partition("-")[0]
    return name if name in _BYTES else "T2"


def _of(values: Mapping[str, float], cell: str, otherwise: float) -> float:
    """Return what is planted for a cell, in either form, for its tracker, or neither."""
    name = cell.removesuffix("-published")
    return values.get(name, values.get(tracker_of(cell), otherwise))


def made_up_steps(cell: str, world: str, seed: int, plant: Plant) -> pd.DataFrame:
    """Return the steps of a run: the same world for each cell, errors of its own."""
    n = STEPS[world]
    step = np.arange(1, n + 1)
    same = np.random.default_rng([crc32(world.encode()), seed])
    path = np.column_stack([4 + 0.4 * step, 5 + 2 * np.sin(0.25 * step + seed), np.full(n, 1.0)])
    share = same.uniform(0.002, 0.009, n) * plant.share.get(world, 6 if world in ("A", "LCR") else 1)
    cameras = np.full(n, 4)
    if world == "B":
        cameras = np.where((step >= SINGLE[0]) & (step <= SINGLE[1]), 1, same.integers(3, 6, n))
    own = np.random.default_rng([crc32(cell.encode()), seed])
    error = _of(plant.error_m, cell, _ERRORS_M[tracker_of(cell)]) * np.exp(own.normal(0, 0.05, n))
    if world == "B":
        error *= np.where(cameras == 1, _of(plant.single, cell, 1.0), 1.0)
        error *= np.where(step > SINGLE[1], _of(plant.after, cell, 1.0), 1.0)
        error *= np.where(seed >= 10, plant.turning, 1.0)
    error *= (share / share.mean()) ** _of(plant.pixels, cell, 0.0)
    direction = own.normal(size=(n, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    believed = path + error[:, None] * direction
    angle = 0.1 * step if world == "B" and seed >= 10 else 0.0 * step
    kind = np.where(own.uniform(size=n) < plant.measured.get(cell, 1.0), "update", "timed_out")
    if cell.removesuffix("-published") in plant.lost:
        kind[-1] = "lost"
    return pd.DataFrame(
        {
            "time_s": 0.25 * step,
            "step": step,
            **{f"truth_{axis}_m": path[:, at] for at, axis in enumerate("xyz")},
            **{f"estimate_{axis}_m": believed[:, at] for at, axis in enumerate("xyz")},
            "error_m": error,
            "participating": cameras,
            "heard": cameras,
            "pixel_share": share,
            "latency_s": np.full(n, 0.1),
            "kind": kind,
            "truth_qw": np.cos(angle / 2),
            "truth_qx": 0.0,
            "truth_qy": 0.0,
            "truth_qz": np.sin(angle / 2),
        }
    )


def _figures(cell: str, steps: pd.DataFrame, plant: Plant) -> dict[str, float]:
    sent = _of(plant.bytes_with_relays, cell, _BYTES[tracker_of(cell)])
    error = float(steps["error_m"].mean())
    turned = plant.turning_px / plant.turning if steps["truth_qz"].any() else 1.0
    return {
        "position_error_mean_m": error,
        "reprojection_error_mean_px": 20 * error * turned,
        "lost_fraction": float(cell.removesuffix("-published") in plant.lost),
        "app_bytes_per_step": sent / 2,
        "mac_bytes_per_step": sent,
        "base_ingress_bytes_per_step": sent / 3,
        "offered_bps": 32 * sent / 2,
        "cpu_cycles_per_step": _of(plant.cycles, cell, 2e7),
        "energy_per_step_j": 0.4 + 1e-6 * sent,
        "latency_p95_s": 0.2,
        "latency_p99_s": 0.22,
        "heard_ratio": 1.0,
    }
