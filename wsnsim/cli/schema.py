"""`wsnsim schema`: the JSON Schema of a scenario, for editors."""

import json
from pathlib import Path

import click


@click.command("schema")
@click.option(
    "--out", type=click.Path(path_type=Path, dir_okay=False), help="File to write.  [default: stdout]"
)
def command(out: Path | None) -> None:
    """Write the JSON Schema (draft 2020-12) of scenarios.

    With this line at the top of a scenario, editors complete its keys and mark
    its mistakes: # yaml-language-server: $schema=wsnsim.schema.json
    """
    text = schema_text()
    if out is None:
        click.echo(text, nl=False)
        return
    from wsnsim.store.folder import write_text

    write_text(out, text)
    click.echo(f"{out}: written", err=True)


def schema_text() -> str:
    """Return the schema as it stands in its file."""
    from wsnsim.runs.json_schema import scenario_json_schema

    return json.dumps(scenario_json_schema(), indent=1, ensure_ascii=False) + "\n"
