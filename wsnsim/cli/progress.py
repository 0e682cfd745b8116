"""Progress and time left on stderr: a bar on a terminal, a line now and then elsewhere."""

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

import click

from wsnsim.sim.engine import Progress

_QUIET_S = 5.0
"""Seconds between lines where stderr is no terminal."""


@contextmanager
def progress(title: str, quiet: bool) -> Iterator[Progress | None]:
    """Give a function to report steps to; None when nothing is to be shown."""
    if quiet or sys.stderr is None:
        yield None
    elif sys.stderr.isatty():
        with _bar(title) as report:
            yield report
    else:
        yield _Lines(title)


@contextmanager
def _bar(title: str) -> Iterator[Progress]:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
    from rich.progress import Progress as RichProgress

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("steps, time left"),
        TimeRemainingColumn(),
    )
    with RichProgress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(title, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


class _Lines:
    """Says how far a run is every few seconds.

    The time left is judged from the second step on: the first one may compile kernels.
    """

    def __init__(self, title: str) -> None:
        self._title = title
        self._said = time.monotonic()
        self._second: float | None = None

    def __call__(self, done: int, total: int) -> None:
        now = time.monotonic()
        if done < 2:
            return
        if self._second is None:
            self._second = now
        if done > 2 and now - self._said >= _QUIET_S:
            self._said = now
            left = (now - self._second) * (total - done) / (done - 2)
            click.echo(f"{self._title}: step {done} of {total}, about {left:.0f} s left", err=True)
