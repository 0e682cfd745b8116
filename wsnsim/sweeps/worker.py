"""A worker process: takes one run after the other, gives back what became of each.

A process of its own, not a fork: a run that crashes or is killed takes nothing
with it, and a script that calls `wsnsim.sweep` is not run again by its workers.
The main thread listens, so that the process ends with its parent even in the
middle of a run; another one runs.
"""

import os
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from multiprocessing.connection import Connection
from queue import SimpleQueue
from typing import Any

from wsnsim.errors import WsnsimError

READY = "ready"
"""What a worker says first."""


@dataclass(frozen=True)
class Task:
    """A run in plain data.

    Parameters
    ----------
    scenario : as a YAML file would hold it
    base_dir : folder from which the files it names are found
    keep : tables to give back
    """

    scenario: Mapping[str, Any]
    base_dir: str
    keep: tuple[str, ...]


def main(descriptor: int, scratch: str) -> None:
    """Work until the connection is closed.

    Parameters
    ----------
    descriptor : of the socket to the parent
    scratch : folder for what a run needs on disk while it goes on
    """
    # Ctrl-C goes to all processes of a terminal; what it means here is the parent's to say
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    tempfile.tempdir = scratch
    connection = Connection(descriptor)
    tasks: SimpleQueue[Task] = SimpleQueue()
    threading.Thread(target=_work, args=(connection, tasks), daemon=True).start()
    while True:
        try:
            tasks.put(connection.recv())
        except (EOFError, OSError):
            os._exit(0)


def _work(connection: Connection, tasks: "SimpleQueue[Task]") -> None:
    try:
        # takes a second, and what does not import is told apart from a run that fails
        for module in ("wsnsim.runs.run", "wsnsim.store.sweeps"):
            import_module(module)
        connection.send(READY)
        while True:
            connection.send(_outcome(tasks.get()))
    except BaseException:
        # without its working thread a worker is of no use: end, and let the parent read why
        sys.excepthook(*sys.exc_info())
        sys.stderr.flush()
        os._exit(1)


def _outcome(task: Task) -> Any:
    """Run a task and return its `Result`, that of a failure included."""
    from wsnsim.runs.run import run
    from wsnsim.scenario.load import scenario_from_dict
    from wsnsim.store.sweeps import Result, kept_table

    began, cpu_began = time.monotonic(), time.process_time()

    def taken() -> tuple[float, float]:
        return round(time.monotonic() - began, 3), round(time.process_time() - cpu_began, 3)

    try:
        done = run(scenario_from_dict(task.scenario, task.base_dir))
        tables = tuple(kept_table(name, done.tables[name]) for name in task.keep)
        return Result(dict(done.summary), *taken(), tables)
    except WsnsimError as error:
        return Result({}, *taken(), error=str(error))
    except BaseException as error:  # a user's program may raise anything, SystemExit too
        return Result({}, *taken(), error=f"{type(error).__name__}: {error}")
