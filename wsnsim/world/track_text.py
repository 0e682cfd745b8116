"""Text files of numbers, read row by row, with the line and column of whatever is wrong."""

import re
from collections.abc import Iterator
from math import isfinite, nan
from pathlib import Path
from typing import NamedTuple, NoReturn

from wsnsim.errors import Problem, ScenarioError

_SHOWN_PROBLEMS = 10
_LARGEST = 1e9


class Row(NamedTuple):
    """The fields of one line, without blanks, and where they begin, from 1."""

    line: int
    fields: tuple[str, ...]
    columns: tuple[int, ...]
    end: int

    def column(self, index: int) -> int:
        """Return where a field begins in the line; the end of the line if it is missing."""
        return self.columns[index] if index < len(self.columns) else self.end

    def number(self, name: str, index: int, file: Path, problems: list[Problem]) -> float:
        """Return a field as a number, or NaN and one more problem."""
        text = self.fields[index] if index < len(self.fields) else ""
        try:
            value = float(text)
        except ValueError:
            value = nan
        if isfinite(value) and abs(value) <= _LARGEST:
            return value
        must = "a finite number" if not isfinite(value) else f"a number of size {_LARGEST:g} or less"
        message = f"{name}: must be {must}, got {text!r}"
        problems.append(Problem("", message, file, self.line, self.column(index)))
        return nan


def content_rows(file: Path, *, commas: bool = True) -> Iterator[Row]:
    """Yield the lines that hold something; blank ones and what follows a `#` are left out.

    Parameters
    ----------
    file : of text
    commas : fields are separated by commas, else by blanks

    Raises
    ------
    ScenarioError : the file cannot be read
    """
    for number, line in enumerate(_read_text(file).splitlines(), start=1):
        content = line.split("#", 1)[0]
        if content.strip():
            fields = _between_commas(content) if commas else _between_blanks(content)
            texts, columns = zip(*fields, strict=True)
            yield Row(number, texts, columns, len(content) + 1)


def fail(problems: list[Problem]) -> NoReturn:
    """Raise the first few problems and say how many more there are."""
    shown = problems[:_SHOWN_PROBLEMS]
    if len(problems) > len(shown):
        more = f"{len(problems) - len(shown)} more problems like these"
        shown = [*shown, Problem("", more, shown[0].file)]
    raise ScenarioError(shown)


def _read_text(file: Path) -> str:
    try:
        return file.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        fail([Problem("", "must be a file that exists; check the name and the folder", file)])
    except (OSError, UnicodeDecodeError) as error:
        fail([Problem("", f"must be a readable text file, got: {error}", file)])


def _between_commas(content: str) -> Iterator[tuple[str, int]]:
    begin = 1
    for piece in content.split(","):
        yield piece.strip(), begin + len(piece) - len(piece.lstrip())
        begin += len(piece) + 1


def _between_blanks(content: str) -> Iterator[tuple[str, int]]:
    for match in re.finditer(r"\S+", content):
        yield match.group(), match.start() + 1
