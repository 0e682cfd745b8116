"""What can go wrong, each with the place and what to do about it."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Self


class WsnsimError(Exception):
    """Anything wsnsim raises on purpose."""


@dataclass(frozen=True)
class Problem:
    """One fault in a scenario, with the place a person can go to."""

    path: str
    """Where in the scenario: ``cameras[0].focal_px``."""
    message: str
    """What must hold, and what was found."""
    file: Path | None = None
    line: int | None = None
    column: int | None = None
    argument: str | None = None
    """What brought the value in place of the file: ``--set seed=-1``."""

    def __str__(self) -> str:
        place = ""
        if self.argument is not None:
            place = f"{self.argument}: "
        elif self.file is not None:
            marks = [str(mark) for mark in (self.file, self.line, self.column) if mark is not None]
            place = ":".join(marks) + ": "
        return f"{place}{self.path + ': ' if self.path else ''}{self.message}"


class ScenarioError(WsnsimError):
    """A scenario that cannot be run: every problem at once."""

    def __init__(self, problems: Sequence[Problem]) -> None:
        self.problems = tuple(problems)
        super().__init__("\n".join(str(problem) for problem in self.problems))

    def __reduce__(self) -> tuple[type[Self], tuple[tuple[Problem, ...]]]:
        """Let the error come back whole from another process."""
        return type(self), (self.problems,)


class SimulationError(WsnsimError):
    """A run that failed, with the simulated time and the node."""

    def __init__(self, message: str, time_s: float | None = None, node: str | None = None) -> None:
        self.time_s = time_s
        self.node = node
        where = "" if time_s is None else f"t = {time_s:.6f} s: "
        where += "" if node is None else f"node {node!r}: "
        self._message = message
        super().__init__(where + message)

    def __reduce__(self) -> tuple[type[Self], tuple[str, float | None, str | None]]:
        """Let the error come back whole from another process."""
        return type(self), (self._message, self.time_s, self.node)


class OutputError(WsnsimError):
    """Results that cannot be written where they were asked for, or not be read back."""


class OutputFolderError(OutputError):
    """A folder that cannot be taken for a run: it holds another one, or is no folder."""


class DecodeError(WsnsimError, ValueError):
    """Bytes that are no message: wrong tag, wrong length, impossible numbers."""


class EncodeError(WsnsimError, ValueError):
    """A payload that its encoding cannot hold."""
