"""Keeps a number of worker processes at work and survives the death of any of them.

A run whose worker dies is tried once more, in a new worker, and given up then.
"""

import json
import os
import signal
import socket
import subprocess
import sys
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

from wsnsim.errors import WsnsimError
from wsnsim.store.sweeps import Result
from wsnsim.sweeps.worker import READY, Task

ATTEMPTS = 2
"""So often a run is begun whose worker dies."""

_START_FAILURES = 3
_POLL_S = 0.1
_START = (
    "import json, sys; sys.path[:] = json.loads(sys.argv[1]); "
    "from wsnsim.sweeps.worker import main; main(int(sys.argv[2]), sys.argv[3])"
)
_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
"""Each worker has one processor: libraries with threads of their own would only be in each other's way."""


@dataclass(frozen=True)
class Outcome:
    """The result of one task, and how often it was begun."""

    task: int
    result: Result
    attempts: int


@dataclass(eq=False)
class _Worker:
    process: "subprocess.Popen[bytes]"
    connection: Connection
    log: Path
    ready: bool = False
    task: int | None = None


@dataclass
class Supervisor:
    """Runs tasks in worker processes.

    Parameters
    ----------
    tasks : what to run, by number
    workers : processes at work at a time
    scratch : an existing folder for what runs need on disk
    on_done : called with each outcome, in the order in which they come
    check : called again and again; raises to stop
    """

    tasks: Sequence[Callable[[], Task]]
    workers: int
    scratch: Path
    on_done: Callable[[Outcome], None]
    check: Callable[[], None]
    _waiting: deque[int] = field(default_factory=deque)
    _attempts: list[int] = field(default_factory=list)
    _live: list[_Worker] = field(default_factory=list)
    _started: int = 0
    _start_failures: int = 0

    def run(self) -> None:
        """Run all tasks; whatever happens, no worker is left behind.

        Raises
        ------
        WsnsimError : workers do not even start
        """
        self._waiting = deque(range(len(self.tasks)))
        self._attempts = [0] * len(self.tasks)
        try:
            while self._waiting or any(worker.task is not None for worker in self._live):
                self.check()
                self._fill()
                by_connection = {worker.connection: worker for worker in self._live}
                for connection in wait([*by_connection], timeout=_POLL_S):
                    self._hear(by_connection[connection])  # type: ignore[index]
        finally:
            for worker in self._live:
                worker.process.kill()
            for worker in self._live:
                worker.connection.close()
                worker.process.wait()

    def _fill(self) -> None:
        """Start workers that are missing and give tasks to those that have none."""
        busy = sum(worker.task is not None for worker in self._live)
        while len(self._live) < min(self.workers, busy + len(self._waiting)):
            self._live.append(self._start())
        for worker in self._live:
            if worker.ready and worker.task is None and self._waiting:
                number = self._waiting.popleft()
                # one that is dead is heard of by its connection
                with suppress(OSError):
                    worker.connection.send(self.tasks[number]())
                worker.task = number
                self._attempts[number] += 1

    def _start(self) -> _Worker:
        ours, theirs = socket.socketpair()
        log = self.scratch / f"worker{self._started}.log"
        self._started += 1
        paths = json.dumps([path for path in sys.path if isinstance(path, str)])
        command = [sys.executable, "-X", "faulthandler", "-c", _START, paths, str(theirs.fileno())]
        with theirs, log.open("wb") as said:
            process = subprocess.Popen(
                [*command, str(self.scratch)],
                pass_fds=(theirs.fileno(),),
                stdin=subprocess.DEVNULL,
                stdout=said,
                stderr=said,
                env={**dict.fromkeys(_ONE_THREAD, "1"), **os.environ},
            )
        return _Worker(process, Connection(ours.detach()), log)

    def _hear(self, worker: _Worker) -> None:
        """Take what a worker says: that it is ready, an outcome, or that it is no more."""
        try:
            message: Any = worker.connection.recv()
        except (EOFError, OSError):
            self._bury(worker)
            return
        if message == READY:
            worker.ready = True
            self._start_failures = 0
            return
        number = worker.task
        worker.task = None
        if number is not None:
            self.on_done(Outcome(number, message, self._attempts[number]))

    def _bury(self, worker: _Worker) -> None:
        self._live.remove(worker)
        worker.connection.close()
        reason = _reason(_exit_code(worker.process), worker.log)
        number = worker.task
        if number is None:
            self._start_failures += not worker.ready
            if self._start_failures >= _START_FAILURES:
                raise WsnsimError(f"worker processes must start, but they end at once: {reason}")
        elif self._attempts[number] < ATTEMPTS:
            self._waiting.appendleft(number)
        else:
            error = f"its worker process died, {ATTEMPTS} times: {reason}"
            self.on_done(Outcome(number, Result({}, None, None, error=error), ATTEMPTS))


def _exit_code(process: "subprocess.Popen[bytes]") -> int:
    """Return what a process left with whose connection is closed: it is ending, or is made to."""
    try:
        return process.wait(timeout=5.0)
    except subprocess.TimeoutExpired:
        process.kill()
        return process.wait()


def _reason(code: int, log: Path) -> str:
    """Say why a process ended: by which signal, or with which last words."""
    if code == -signal.SIGKILL:
        return "killed by SIGKILL, as a system does that runs out of memory"
    if code < 0:
        return f"killed by {signal.Signals(-code).name}"
    lines = log.read_text("utf-8", "replace").strip().splitlines()
    return f"it left with exit code {code}" + (f" ({lines[-1]})" if lines else "")
