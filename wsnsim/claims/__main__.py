"""`python -m wsnsim.claims`: finished sweeps in, the pages under `reports/` out."""

import sys
from pathlib import Path

import click

from wsnsim.claims.multiview.page import write_report
from wsnsim.errors import WsnsimError


@click.command(name="python -m wsnsim.claims")
@click.option(
    "--runs",
    type=click.Path(path_type=Path, file_okay=False),
    default=Path("runs"),
    show_default=True,
    help="Folder that holds the sweeps, each in a folder of its study's name.",
)
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    default=Path("reports"),
    show_default=True,
    help="Folder for multiview.md, multiview.csv and the figures.",
)
def command(runs: Path, out: Path) -> None:
    """Write the pages that hold the papers' claims against what the sweeps show."""
    try:
        write_report(runs, out)
    except WsnsimError as error:
        click.echo(f"Error: {error}", err=True)
        sys.exit(1)
    click.echo(out / "multiview.md", err=True)


if __name__ == "__main__":
    command()
