"""`wsnsim bench`: how fast the kernels are beside plain twins and peers, in one run on this machine."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from wsnsim.bench.network import Cost
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


@command.command("network")
@click.argument("layouts", nargs=-1, type=click.Path(path_type=Path, exists=True, dir_okay=False))
@click.option(
    "--period-s",
    type=click.FloatRange(min=0.0, min_open=True),
    default=1.0,
    show_default=True,
    help="Period of each mote's packets on LAYOUTS [s].",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document on stdout.")
@click.option("--profile", is_flag=True, help="Print where the time goes instead, function by function.")
@click.option("--quick", is_flag=True, help="See that everything runs; the times say little.")
def network(layouts: tuple[Path, ...], period_s: float, as_json: bool, profile: bool, quick: bool) -> None:
    """Time the 802.15.4 network, beside ns-3 where that can be compiled, and as it grows.

    LAYOUTS are JSON files with the motes' positions and tree, in place of the
    50 and 200 motes that come with wsnsim. Times are CPU times of the event
    loop; ours and ns-3 run by turns; a ratio is the median of the turns'.
    """
    from wsnsim.bench.network import Load, bench_network, profile_network, usual_loads
    from wsnsim.claims.network.layouts import read_layout
    from wsnsim.errors import WsnsimError

    try:
        loads = [Load(read_layout(path), period_s) for path in layouts] or usual_loads()
    except WsnsimError as error:
        raise click.UsageError(str(error)) from error
    if profile:
        for load in loads:
            click.echo(f"{load.layout.name}, T = {load.period_s:g} s")
            click.echo(profile_network(load, 3.0 if quick else 30.0))
        return
    costs = bench_network(loads, quick=quick, said=lambda text: click.echo(text, err=True))
    if as_json:
        click.echo(json.dumps([asdict(cost) for cost in costs], indent=2, allow_nan=False))
    else:
        _print_costs(costs)


@command.command("scanline")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document on stdout.")
@click.option("--quick", is_flag=True, help="See that everything runs; the ratios say little.")
def scanline(as_json: bool, quick: bool) -> None:
    """Time one step of the scan-line tracker with 2, 4 and 8 cameras, and its parts.

    Times are CPU times of one process, taken by turns; a ratio is the median
    of the turns' ratios. The twin does the same in plain Python.
    """
    from wsnsim.bench.scanline import bench_scanline

    measures = bench_scanline(quick=quick, said=lambda text: click.echo(text, err=True))
    if as_json:
        click.echo(json.dumps([asdict(measure) for measure in measures], indent=2, allow_nan=False))
    else:
        _print(measures)


def _print_costs(costs: "list[Cost]") -> None:
    width = max(len(cost.what) for cost in costs)
    click.echo(
        f"{'':6}  {'':{width}}  {'motes':>6}  {'start-up':>9}  {'loop':>9}  {'frames':>7}  {'PDR':>5}  "
        f"{'a frame':>9}  {'a packet':>10}"
    )
    for cost in costs:
        line = (
            f"{cost.who:6}  {cost.what:<{width}}  {cost.motes:6}  {cost.startup_s:7.2f} s  "
            f"{cost.loop_s:7.2f} s  {cost.frames:7.0f}  {cost.delivery_ratio:5.3f}  "
            f"{cost.us_per_frame:6.1f} µs  {cost.us_per_delivered:7.0f} µs"
        )
        if cost.ratio is not None:
            line += f"   × {cost.ratio:.3f} of ns-3"
        if cost.growth is not None:
            line += f"   × {cost.growth:.2f} a frame"
        if cost.peak_memory_mb is not None:
            line += f"   peak {cost.peak_memory_mb:.0f} MB"
        click.echo(line)


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
