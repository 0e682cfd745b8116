"""What commands share of their arguments: scenario files, offered by the shell as one types."""

from pathlib import Path

import click
from click.shell_completion import CompletionItem

_DEEPEST, _MOST = 3, 200
"""Folders below the one that is typed, and files, that are looked through at most."""


class ScenarioFile(click.Path):
    """The path of a scenario; a shell offers YAML files, those in folders too."""

    def __init__(self) -> None:
        super().__init__(path_type=Path)

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """Return the YAML files whose path begins as typed."""
        folder, _, start = incomplete.rpartition("/")
        top = Path(folder or ("/" if incomplete.startswith("/") else "."))
        found = sorted(_scenarios(top, start, _DEEPEST))[:_MOST]
        return [CompletionItem(path) for path in found]


def _scenarios(folder: Path, start: str, depth: int) -> list[str]:
    """Return the YAML files of a folder whose names begin so, and those in its folders of such names."""
    found: list[str] = []
    try:
        entries = list(folder.iterdir())
    except OSError:
        return found
    for entry in entries:
        if not entry.name.startswith(start) or entry.name.startswith("."):
            continue
        if entry.suffix in (".yaml", ".yml"):
            found.append(entry.as_posix())
        elif depth and entry.is_dir():
            found += _scenarios(entry, "", depth - 1)
    return found
