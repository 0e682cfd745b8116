"""A page's files: its text, its table of all runs, its figures."""

from collections.abc import Mapping
from pathlib import Path

from wsnsim.store.folder import write_text
from wsnsim.store.writer import cannot_write


def write_page(out: Path, name: str, text: str, record: str, figures: Mapping[str, str]) -> None:
    """Write `name.md`, `name.csv` and `name/FIGURE.svg`; the text last, as it names the others.

    Parameters
    ----------
    out : folder for the page
    name : of the page
    text, record : of the page and of its table
    figures : SVG by name

    Raises
    ------
    OutputError : a file cannot be written
    """
    folder = out / name if figures else out
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise cannot_write(out, error) from error
    for figure, svg in figures.items():
        write_text(folder / f"{figure}.svg", svg)
    write_text(out / f"{name}.csv", record)
    write_text(out / f"{name}.md", text)
