"""`wsnsim validate`: every problem of a scenario at once, without running it."""

import json
import sys
from pathlib import Path

import click

from wsnsim.cli.main import USAGE
from wsnsim.errors import Problem, ScenarioError


@click.command("validate")
@click.argument("scenario", type=click.Path(path_type=Path))
@click.option("--set", "overrides", metavar="KEY=VALUE", multiple=True, help="Override a value. Repeatable.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document on stdout.")
@click.option("--quiet", "-q", is_flag=True, help="Errors only.")
def command(scenario: Path, overrides: tuple[str, ...], as_json: bool, quiet: bool) -> None:
    """Check SCENARIO: its keys and values, the files it names, its network's way to the base station."""
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
    if as_json:
        click.echo(json.dumps({"valid": True, "problems": []}, indent=2))
    elif not quiet:
        depth = max(simulation.tree.depth.values())
        click.echo(
            f"{scenario}: fine. {len(simulation.cameras)} cameras, {len(simulation.nodes)} nodes, "
            f"{depth} hop{'s' if depth > 1 else ''} to the base station at most, "
            f"{simulation.schedule.steps} tracking steps."
        )


def _document(problem: Problem) -> dict[str, object]:
    return {
        "file": None if problem.file is None else str(problem.file),
        "line": problem.line,
        "column": problem.column,
        "argument": problem.argument,
        "path": problem.path,
        "message": problem.message,
    }
