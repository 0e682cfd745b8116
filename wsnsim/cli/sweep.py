"""`wsnsim sweep`: a study goes in, many runs are made, one file and one page come out."""

import json
import math
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from wsnsim.cli.arguments import ScenarioFile
from wsnsim.cli.main import FAILED

if TYPE_CHECKING:
    from wsnsim.sweeps.study import LoadedStudy
    from wsnsim.sweeps.sweep import RunsProgress, Sweep

_QUIET_S = 5.0
"""Seconds between lines where stderr is no terminal."""


@click.command("sweep")
@click.argument("study", type=ScenarioFile())
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    help="Folder for the results.  [default: runs/NAME]",
)
@click.option(
    "--workers",
    type=click.IntRange(1, 1024),
    help="Processes at a time.  [default: one for each processor]",
)
@click.option(
    "--set",
    "overrides",
    metavar="KEY=VALUE",
    multiple=True,
    help="Override a value in every run: --set system.particles=250. Repeatable.",
)
@click.option("--only", metavar="CELL", multiple=True, help="Run this cell, or B/* for a group. Repeatable.")
@click.option("--limit", type=click.IntRange(min=0), help="Make so many runs at most now.")
@click.option("--fresh", is_flag=True, help="Delete what the folder has of a study and start anew.")
@click.option("--dry-run", is_flag=True, help="Check the study and show its cells; run nothing.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document on stdout.")
@click.option("--quiet", "-q", is_flag=True, help="No progress and no summary; errors only.")
def command(
    study: Path,
    out: Path | None,
    workers: int | None,
    overrides: tuple[str, ...],
    only: tuple[str, ...],
    limit: int | None,
    fresh: bool,
    dry_run: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Run STUDY, a YAML file that names scenarios, what is varied, and seeds.

    The folder holds sweep.sqlite (tables runs and cells), summary.csv and
    report.html. What it has is not run again: the same command goes on where
    an interrupted one stopped, and a changed study runs only what changed.
    """
    from wsnsim.sweeps.study import load_study
    from wsnsim.sweeps.sweep import default_folder, sweep

    if out is not None and not str(out).strip("./"):
        raise click.BadParameter("must name a folder of its own, got the current one", param_hint="--out")
    loaded = load_study(study, overrides)
    folder = out or default_folder(loaded)
    if dry_run:
        _show_plan(loaded, folder, only, fresh, as_json)
        return
    try:
        with _progress(loaded.study.name, quiet) as report:
            result = sweep(
                loaded, out=folder, workers=workers, only=only, limit=limit, fresh=fresh, progress=report
            )
    except KeyboardInterrupt:
        click.echo("What was done is kept; the same command goes on with the rest.", err=True)
        raise
    if as_json:
        click.echo(json.dumps(_document(loaded, result), indent=2, allow_nan=False))
    elif not quiet:
        _print(result)
    _warn(result)
    if result.failed:
        sys.exit(FAILED)


def _show_plan(
    loaded: "LoadedStudy", folder: Path, only: tuple[str, ...], fresh: bool, as_json: bool
) -> None:
    """Say what would be run."""
    from wsnsim.sweeps.sweep import missing_runs

    missing = missing_runs(loaded, folder, only, fresh)
    cells = [
        {
            "cell": cell.name,
            "runs": sum(run.cell == cell for run in loaded.runs),
            "to_run": sum(run.cell == cell for run in missing),
            "settings": cell.values,
        }
        for cell in loaded.cells
    ]
    if as_json:
        document = {"study": loaded.study.name, "folder": str(folder), "to_run": len(missing), "cells": cells}
        click.echo(json.dumps(document, indent=2, ensure_ascii=False))
        return
    width = max(len(str(cell["cell"])) for cell in cells)
    for cell in cells:
        settings = json.dumps(cell["settings"], ensure_ascii=False)
        click.echo(f"{cell['cell']:<{width}}  {cell['to_run']:>4} of {cell['runs']} to run  {settings}")
    click.echo(
        f"{len(loaded.cells)} cells, {len(loaded.runs)} runs, {len(missing)} to run (a run that several "
        "cells share is made once)"
    )


def _document(loaded: "LoadedStudy", result: "Sweep") -> dict[str, object]:
    status = result.runs["status"].value_counts().to_dict()
    cells = result.cells.to_dict("records")
    return {
        "study": loaded.study.name,
        "folder": str(result.folder),
        "runs": {"total": len(result.runs), "made_now": result.done, **status},
        "failed": [
            {"cell": each.cell, "seed": each.seed, "error": each.error, "command": each.command}
            for each in result.failed
        ],
        "cells": [{str(key): _plain(value) for key, value in cell.items()} for cell in cells],
    }


def _plain(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value


_SHOWN = (
    ("position_error_mean_m", "error [m]"),
    ("mac_bytes_per_step", "B a step"),
    ("energy_per_step_j", "J a step"),
)
_OF_NETWORKS = (
    ("delivery_ratio", "delivered"),
    ("latency_mean_s", "delay [s]"),
    ("energy_total_j", "J"),
)
"""What is shown where no cell tracks anything."""


def _print(result: "Sweep") -> None:
    """Show one line for each cell."""
    names = [str(name) for name in result.cells["name"]]
    width = max(len("cell"), *(len(name) for name in names))
    shown = _OF_NETWORKS if result.cells["position_error_mean_m"].isna().all() else _SHOWN
    heads = "".join(f"{head:>24}" for _, head in shown)
    click.echo(f"{'cell':<{width}}  {'runs':>5}  {'lost':>5}{heads}")
    for name, cell in zip(names, result.cells.to_dict("records"), strict=True):
        figures = "".join(f"{_interval(cell, key):>24}" for key, _ in shown)
        click.echo(f"{name:<{width}}  {cell['runs']:>5}  {cell['lost_runs']:>5}{figures}")
    click.echo(f"report: {result.folder}/report.html")


def _interval(cell: dict[Any, Any], key: str) -> str:
    mean, low = cell[key], cell[f"{key}_low"]
    if math.isnan(mean):
        return "–"
    return f"{mean:.4g}" if math.isnan(low) else f"{mean:.4g} ± {mean - low:.2g}"


def _warn(result: "Sweep") -> None:
    """Say on stderr what a reader of the figures must know."""
    for each in result.failed:
        click.echo(f"Failed: cell {each.cell}, seed {each.seed}: {each.error}\n  {each.command}", err=True)
    if result.other_versions:
        click.echo(
            f"Warning: {result.other_versions} of the runs are of other versions; --fresh makes all anew.",
            err=True,
        )
    if result.failed:
        click.echo(f"{len(result.failed)} of {result.done} runs failed.", err=True)


@contextmanager
def _progress(title: str, quiet: bool) -> "Iterator[RunsProgress | None]":
    """Give a function to report runs to; None when nothing is to be shown."""
    if quiet or sys.stderr is None:
        yield None
    elif sys.stderr.isatty():
        with _bar(title) as report:
            yield report
    else:
        yield _Lines(title)


@contextmanager
def _bar(title: str) -> "Iterator[RunsProgress]":
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("runs{task.fields[left]}"),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(title, total=None, left="")
        clock = _Clock()

        def report(done: int, total: int, failed: int) -> None:
            bar.update(task, completed=done, total=total, left=_words(clock.left_s(done, total), failed))

        yield report


class _Clock:
    """Judges the time left from the runs after the first one, which waits for workers to start."""

    def __init__(self) -> None:
        self._there: int | None = None
        self._first: tuple[float, int] | None = None

    def left_s(self, done: int, total: int) -> float | None:
        """Return the time left [s]; None before the second run of this call is done."""
        now = time.monotonic()
        if self._there is None:
            self._there = done
        if self._first is None and done > self._there:
            self._first = (now, done)
        began, first = self._first or (now, done)
        return (now - began) * (total - done) / (done - first) if done > first else None


class _Lines:
    """Says how far a sweep is, every few seconds."""

    def __init__(self, title: str) -> None:
        self._title = title
        self._said = -math.inf
        self._clock = _Clock()

    def __call__(self, done: int, total: int, failed: int) -> None:
        left_s, now = self._clock.left_s(done, total), time.monotonic()
        if done == total or (left_s is not None and now - self._said >= _QUIET_S):
            self._said = now
            left = _words(None if done == total else left_s, failed)
            click.echo(f"{self._title}: run {done} of {total}{left}", err=True)


def _words(left_s: float | None, failed: int) -> str:
    left = "" if left_s is None else f", about {_time(left_s)} left"
    return f"{left}, {failed} failed" if failed else left


def _time(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 120 else f"{seconds / 60:.0f} min"
