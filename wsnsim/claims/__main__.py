"""`python -m wsnsim.claims`: the pages under `reports/`.

Without a further word: the page of the multi-view trackers, of finished sweeps. `scanline`: that of the
scan-line tracker, likewise. `network`: the page of the radio networks, whose runs it makes itself.
"""

import sys
from pathlib import Path

import click

from wsnsim.errors import WsnsimError

_OUT = click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    default=Path("reports"),
    show_default=True,
    help="Folder for the page and what belongs to it.",
)


_RUNS = click.option(
    "--runs",
    type=click.Path(path_type=Path, file_okay=False),
    default=Path("runs"),
    show_default=True,
    help="Folder that holds the sweeps, each in a folder of its study's name.",
)


@click.group(name="python -m wsnsim.claims", invoke_without_command=True)
@_RUNS
@_OUT
@click.pass_context
def command(context: click.Context, runs: Path, out: Path) -> None:
    """Write the pages that hold the papers' claims against what the sweeps show."""
    if context.invoked_subcommand is not None:
        return
    from wsnsim.claims.multiview.page import write_report

    try:
        write_report(runs, out)
    except WsnsimError as error:
        click.echo(f"Error: {error}", err=True)
        sys.exit(1)
    click.echo(out / "multiview.md", err=True)


@command.command("scanline")
@_RUNS
@_OUT
def scanline(runs: Path, out: Path) -> None:
    """Write scanline.md, its figures and its table of all runs."""
    from wsnsim.claims.scanline.page import write_report

    try:
        write_report(runs, out)
    except WsnsimError as error:
        click.echo(f"Error: {error}", err=True)
        sys.exit(1)
    click.echo(out / "scanline.md", err=True)


@command.command("network")
@_OUT
@click.option(
    "--data",
    type=click.Path(path_type=Path, file_okay=False, exists=True),
    help="Folder of the public traces tossim/noise/meyer-heavy.txt and k7/grenoble_sim.k7.gz; "
    "without it their section is left out.",
)
@click.option("--workers", type=click.IntRange(min=1), help="Processes.  [default: one for each CPU]")
def network(out: Path, data: Path | None, workers: int | None) -> None:
    """Run the radio networks beside theory, a Monte Carlo and ns-3, and write network.md and .csv."""
    from wsnsim.claims.network.page import write_report

    try:
        held = write_report(out, data, workers, said=lambda text: click.echo(text, err=True))
    except WsnsimError as error:
        click.echo(f"Error: {error}", err=True)
        sys.exit(1)
    click.echo(out / "network.md", err=True)
    sys.exit(0 if held else 1)


if __name__ == "__main__":
    command()
