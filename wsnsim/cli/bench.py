"""`wsnsim bench`: how fast the kernels are beside plain twins and peers, in one run on this machine."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from wsnsim.bench.vision import Measure


@click.group("bench")
def command() -> None:
    """Time parts of the simulator beside plain twins and peers."""


@command.command("vision")
@click.argument("scenarios", nargs=-1, type=click.Path(path_type=Path, exists=True, dir_okay=False))
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document on stdout.")
@click.option("--quick", is_flag=True, help="See that everything runs; the ratios say little.")
def vision(scenarios: tuple[Path, ...], as_json: bool, quick: bool) -> None:
    """Time what a camera mote computes for one frame, and whole runs of SCENARIOS.

    Times are CPU times of one process, taken by turns; a ratio is the median
    of the turns' ratios.
    """
    from wsnsim.bench.vision import bench_run, bench_vision

    def said(text: str) -> None:
        click.echo(text, err=True)

    measures = bench_vision(quick=quick, said=said)
    for scenario in scenarios:
        said(f"{scenario}: a whole run")
        measures.append(bench_run(scenario))
    if as_json:
        click.echo(json.dumps([asdict(measure) for measure in measures], indent=2, allow_nan=False))
    else:
        _print(measures)


@command.command("trackers")
@click.argument("scenario", type=click.Path(path_type=Path, exists=True, dir_okay=False))
@click.option(
    "--set",
    "overrides",
    metavar="KEY=VALUE",
    multiple=True,
    help="Override a value: --set system.variant=T2. Repeatable.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document on stdout.")
@click.option("--quick", is_flag=True, help="See that everything runs; the times say little.")
def trackers(scenario: Path, overrides: tuple[str, ...], as_json: bool, quick: bool) -> None:
    """Time one step of the multi-view tracker of SCENARIO, stage by stage, over all its nodes."""
    from wsnsim.bench.trackers import bench_tracker

    measures = bench_tracker(scenario, overrides, quick=quick)
    if as_json:
        click.echo(json.dumps([asdict(measure) for measure in measures], indent=2, allow_nan=False))
    else:
        _print(measures)


def _print(measures: "list[Measure]") -> None:
    width = max(len(measure.what) for measure in measures)
    for measure in measures:
        line = f"{measure.setup}  {measure.what:<{width}}  {measure.cpu_ms:9.3f} ms"
        if measure.ratio is not None:
            line += f"   {measure.peer}: {measure.peer_cpu_ms:.3f} ms, × {measure.ratio:.1f}"
        if measure.deviation is not None:
            line += f"; within {measure.deviation:.0e} of NumPy's"
        click.echo(line)
        if measure.note is not None:
            click.echo(f"{'':{len(measure.setup) + 4}}{measure.note}")
