"""`wsnsim validate`: every problem of a scenario at once, without running it."""

import json
import sys
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

import click

from wsnsim.cli.arguments import ScenarioFile
from wsnsim.cli.main import USAGE
from wsnsim.errors import Problem, ScenarioError

if TYPE_CHECKING:
    from wsnsim.scenario.load import LoadedScenario
    from wsnsim.sim.engine import Simulation


@click.command("validate")
@click.argument("scenario", type=ScenarioFile())
@click.option("--set", "overrides", metavar="KEY=VALUE", multiple=True, help="Override a value. Repeatable.")
@click.option(
    "--maps", is_flag=True, help="Write a page of maps: what the cameras see, how good the links are."
)
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    help="The page that --maps writes, a file whose name ends in .html.  [default: NAME-maps.html]",
)
@click.option(
    "--height",
    "height_m",
    type=float,
    metavar="METRES",
    help="Height at which --maps looks.  [default: the mean height at which targets start]",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document on stdout.")
@click.option("--quiet", "-q", is_flag=True, help="Errors only.")
def command(
    scenario: Path,
    overrides: tuple[str, ...],
    maps: bool,
    out: Path | None,
    height_m: float | None,
    as_json: bool,
    quiet: bool,
) -> None:
    """Check SCENARIO: its keys and values, the files it names, its network's way to the base station.

    With --maps, also draw what it would be like: how many cameras see each
    place of the floor and how large a target would be there, and the margins of
    all radio links.
    """
    _check_options(maps, out, height_m)
    from wsnsim.runs.expectations import check_keys
    from wsnsim.scenario.load import load_scenario
    from wsnsim.sim.build import build

    try:
        loaded = load_scenario(scenario, overrides)
        check_keys(loaded)
        simulation = build(loaded)
    except ScenarioError as error:
        if not as_json:
            raise
        problems = [_document(problem) for problem in error.problems]
        click.echo(json.dumps({"valid": False, "problems": problems}, indent=2))
        sys.exit(USAGE)
    page, figures, words = None, None, ""
    if maps and not simulation.cameras:
        raise click.UsageError("--maps needs cameras: it draws what they see; this scenario has none")
    if maps:
        page = out or Path(f"{loaded.scenario.name}-maps.html")
        figures, words = _draw(loaded, simulation, page, height_m)
    if as_json:
        document: dict[str, object] = {"valid": True, "problems": []}
        if maps:
            document["maps"] = {"file": str(page), **(figures or {})}
        click.echo(json.dumps(document, indent=2, allow_nan=False))
    elif not quiet:
        depth = max(simulation.tree.depth.values())
        seen = len(simulation.cameras)
        cameras = f"{seen} cameras, " if seen else ""
        length = (
            f"{simulation.schedule.steps} tracking steps" if seen else f"{loaded.scenario.duration_s:g} s"
        )
        click.echo(
            f"{scenario}: fine. {cameras}{len(simulation.nodes)} nodes, "
            f"{depth} hop{'s' if depth > 1 else ''} to the base station at most, {length}."
        )
        if maps:
            click.echo(f"{words}\nMaps: {page}")


def _check_options(maps: bool, out: Path | None, height_m: float | None) -> None:
    """Refuse a page that cannot be written before anything is computed for it."""
    for given, name in ((out, "--out"), (height_m, "--height")):
        if given is not None and not maps:
            raise click.UsageError(f"{name} needs --maps: without it no page is written")
    if height_m is not None and not isfinite(height_m):
        raise click.BadParameter(f"must be a finite number, got {height_m}", param_hint="--height")
    if out is None:
        return
    what = None
    if out.is_dir():
        what = "a folder"
    elif out.suffix.lower() not in (".html", ".htm"):
        what = f"{out.name!r}"
    if what is not None:
        raise click.BadParameter(f"must be a file whose name ends in .html, got {what}", param_hint="--out")
    if not out.absolute().parent.is_dir():
        raise click.BadParameter(f"must be in a folder that exists, got {str(out)!r}", param_hint="--out")


def _draw(
    loaded: "LoadedScenario", simulation: "Simulation", page: Path, height_m: float | None
) -> tuple[dict[str, object], str]:
    """Write the page of maps; return its figures, and the most telling of them in words."""
    from wsnsim.report.maps import MapsContext, map_figures, seen_words, write_maps
    from wsnsim.sim.maps import scenario_maps

    scenario = loaded.scenario
    drawn = scenario_maps(scenario, simulation, height_m)
    context = MapsContext(
        name=scenario.name,
        seed=scenario.seed,
        ideal=scenario.network.standard == "ideal",
        world=simulation.world,
        cameras={camera.node.id: camera.renderer.camera for camera in simulation.cameras},
        maps=drawn,
    )
    write_maps(page, context)
    return map_figures(drawn), seen_words(drawn.coverage)


def _document(problem: Problem) -> dict[str, object]:
    return {
        "file": None if problem.file is None else str(problem.file),
        "line": problem.line,
        "column": problem.column,
        "argument": problem.argument,
        "path": problem.path,
        "message": problem.message,
    }
