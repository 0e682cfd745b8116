"""`wsnsim run`: a scenario goes in, a folder of results comes out."""

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from wsnsim.cli.arguments import ScenarioFile
from wsnsim.cli.main import EXPECTATION
from wsnsim.runs.result import Run

if TYPE_CHECKING:
    from wsnsim.scenario.load import LoadedScenario


@click.command("run")
@click.argument("scenario", type=ScenarioFile())
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    help="Folder for the results.  [default: runs/NAME-seedN]",
)
@click.option("--seed", type=click.IntRange(min=0), help="Seed, in place of the scenario's.")
@click.option(
    "--set",
    "overrides",
    metavar="KEY=VALUE",
    multiple=True,
    help="Override a value: --set system.particles=250, --set cameras[c1].focal_px=400. Repeatable.",
)
@click.option("--force", is_flag=True, help="Replace the run that the folder holds.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document on stdout.")
@click.option("--quiet", "-q", is_flag=True, help="No progress and no summary; errors only.")
def command(
    scenario: Path,
    out: Path | None,
    seed: int | None,
    overrides: tuple[str, ...],
    force: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Run SCENARIO, a YAML file, and write its results into a folder.

    The folder holds manifest.json, scenario.yaml (with every default written
    out; it runs again to the same results), results.sqlite, summary.json and
    report.html.
    """
    from wsnsim.cli.progress import progress
    from wsnsim.runs.run import default_folder, run
    from wsnsim.scenario.load import load_scenario

    if out is not None and not str(out).strip("./"):
        raise click.BadParameter("must name a folder of its own, got the current one", param_hint="--out")
    loaded = load_scenario(scenario, overrides, seed)
    folder = out or default_folder(loaded)
    with progress(loaded.scenario.name, quiet) as report:
        result = run(loaded, out=folder, force=force, progress=report)
    if as_json:
        click.echo(json.dumps(_document(result), indent=2, allow_nan=False))
    elif not quiet:
        _print(result)
        _warn(result, loaded)
    for expectation in result.expectations:
        if not expectation.met:
            click.echo(f"expect: {expectation}", err=True)
    if not result.met:
        sys.exit(EXPECTATION)


def _document(result: Run) -> dict[str, object]:
    return {
        "folder": str(result.folder),
        "summary": dict(result.summary),
        "expectations": [
            {"key": e.key, "comparison": e.comparison, "value": e.value, "met": e.met}
            for e in result.expectations
        ],
    }


_SHOWN = (
    ("position_error_mean_m", "mean position error", 1.0, "m"),
    ("position_rmse_m", "root mean square", 1.0, "m"),
    ("reprojection_error_mean_px", "mean reprojection error", 1.0, "px"),
    ("lost_fraction", "targets lost", 100.0, "%"),
    ("unmeasured_steps", "steps without a measurement", 1.0, ""),
    ("offered_bps", "offered load", 1e-3, "kbit/s"),
    ("delivery_ratio", "content that reached the base", 100.0, "%"),
    ("throughput_bps", "throughput at the base", 1e-3, "kbit/s"),
    ("mac_attempts_per_frame", "attempts a frame", 1.0, ""),
    ("heard_ratio", "answers heard of those asked", 100.0, "%"),
    ("latency_mean_s", "mean latency", 1e3, "ms"),
    ("latency_p95_s", "95 % within", 1e3, "ms"),
    ("energy_per_step_j", "energy a step, all motes", 1e3, "mJ"),
)


def _print(result: Run) -> None:
    for key, name, factor, unit in _SHOWN:
        value = result.summary.get(key)
        if value is not None:
            click.echo(f"{name:>30}  {value * factor:.4g} {unit}".rstrip())
    click.echo(f"{'report':>30}  {result.folder}/report.html")


def _warn(result: Run, loaded: "LoadedScenario") -> None:
    """Say on stderr what a reader of the figures must know."""
    from wsnsim.report.heads import overwork
    from wsnsim.runs.report_context import particles_key

    if len(result.steps) and result.summary["unmeasured_steps"] == len(result.steps):
        click.echo("Warning: nothing was measured; the errors are those of a prediction.", err=True)
    for sentence in overwork(result.tables, result.summary["simulated_s"], particles_key(loaded)):
        click.echo(f"Warning: {sentence}".replace("\u202f", " "), err=True)
    dead = list(result.nodes.dropna(subset=["died_at_s"])["node"])
    if dead:
        click.echo(f"Warning: batteries ran empty: {', '.join(dead)}.", err=True)
