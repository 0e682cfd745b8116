"""`wsnsim init`: a folder with a scenario to begin with, and what an editor needs to help with it."""

import json
import re
from importlib.resources import files
from pathlib import Path

import click

from wsnsim.errors import OutputFolderError

SCENARIO, SCHEMA = "scenario.yaml", "wsnsim.schema.json"
_STARTERS = {"cameras": "scenario.yaml", "scanline": "scanline.yaml", "traffic": "traffic.yaml"}
"""Files among the assets, by the name of the template."""
_NAMED = "name: starter\n"
_NAME = re.compile(r"\w[\w.-]*")
_PLAIN = re.compile(r"[^\W\d][\w-]*")


@click.command("init")
@click.argument("folder", type=click.Path(path_type=Path, file_okay=False))
@click.option(
    "--template",
    type=click.Choice(list(_STARTERS)),
    default="cameras",
    show_default=True,
    help="cameras: four that follow a target; scanline: six that follow one among people who hide it; "
    "traffic: a network without cameras.",
)
def command(folder: Path, template: str) -> None:
    """Make FOLDER with a commented scenario that runs, and its schema for editors.

    The scenario takes the folder's name. Files that are there already stay as
    they are: then nothing is written.
    """
    from wsnsim.cli.schema import schema_text
    from wsnsim.store.folder import write_text
    from wsnsim.store.writer import cannot_write

    name = folder.absolute().name
    if not _NAME.fullmatch(name):
        raise click.BadParameter(
            f"the last part must be a scenario's name, of letters, digits, _ . and -, got {name!r}",
            param_hint="FOLDER",
        )
    taken = [str(file) for file in (folder / SCENARIO, folder / SCHEMA) if file.exists() or file.is_symlink()]
    if taken:
        raise OutputFolderError(f"{' and '.join(taken)}: must not exist yet; choose another folder")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise cannot_write(folder, error) from error
    write_text(folder / SCHEMA, schema_text())
    write_text(folder / SCENARIO, _starter(name, _STARTERS[template]))
    place = "" if folder.absolute() == Path.cwd() else f"cd {_quoted(folder)} && "
    click.echo(f"{folder / SCENARIO}: a scenario to change and run")
    click.echo(f"{folder / SCHEMA}: its schema; editors complete keys by it")
    click.echo(f"Next: {place}wsnsim run {SCENARIO}")


def _starter(name: str, asset: str) -> str:
    """Return a starter under another name."""
    text = (files("wsnsim.cli") / "assets" / asset).read_text("utf-8")
    # names such as 12, null or 1.5 are text only in quotes
    plain = _PLAIN.fullmatch(name) and name.lower() not in ("null", "true", "false")
    return text.replace(_NAMED, f"name: {name if plain else json.dumps(name, ensure_ascii=False)}\n")


def _quoted(path: Path) -> str:
    from shlex import quote

    return quote(str(path))
