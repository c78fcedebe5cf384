"""Processes that work on files beside one another, and what becomes of a file whose process is killed.

A process of its own for each worker, fed through pipes; no semaphores, so that a system without /dev/shm will do. It
ends as soon as its pipe does: whatever ends the parent ends the workers.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import queue
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from typing import BinaryIO, NoReturn

from cornersmooth.cli.job import Job, Outcome, run_job
from cornersmooth.cli.shutdown import SIGNALS
from cornersmooth.errors import message
from cornersmooth.output import ClosedPipe, remove_leftovers, remove_unfinished

_COMMAND = "from cornersmooth.cli.worker import serve; serve()"


class Worker:
    """A process that works on one job at a time."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._job: Job | None = None

    def run(self, job: Job) -> Outcome:
        """Have a job done; where the process is killed meanwhile, the outcome says so."""
        if self._process is None:
            self._process = _start()
        process, self._job = self._process, job
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            pickle.dump(job, process.stdin)
            process.stdin.flush()
            outcome: Outcome = pickle.load(process.stdout)
        except (OSError, EOFError, pickle.UnpicklingError):
            self.kill()
            _close(process)
            what = f"the process working on it was ended ({_how(process.returncode)}); run it again"
            return Outcome(job, 3, message("error", what, place=job.source))
        self._job = None
        return outcome

    def end(self) -> None:
        """End the process, which has nothing to do any more."""
        process = self._process
        self.kill()
        if process is not None:
            _close(process)

    def kill(self) -> None:
        """End the process, and remove what it has left half written; for signal handlers, too."""
        process, job = self._process, self._job
        self._process = self._job = None
        if process is None:
            return
        process.kill()
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(1.0)  # unlike without a limit, safe in a signal handler
        for path in job.outputs if job is not None else ():
            remove_leftovers(path, process.pid)


def _start() -> subprocess.Popen[bytes]:
    with _withheld():
        # -P: a file of the current folder must not pass for one of Python's
        return subprocess.Popen([sys.executable, "-P", "-c", _COMMAND], stdin=subprocess.PIPE, stdout=subprocess.PIPE)


@contextlib.contextmanager
def _withheld() -> Iterator[None]:
    """Withhold the signals while a process is started: it inherits that, and never sees a Ctrl-C."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _close(process: subprocess.Popen[bytes]) -> None:
    for stream in (process.stdin, process.stdout):
        with contextlib.suppress(OSError):
            if stream is not None:
                stream.close()


def _how(code: int | None) -> str:
    if code is not None and code < 0:
        return f"signal {-code}" + (", as a system short of memory does" if code == -9 else "")
    return f"exit code {code}"


def serve() -> None:
    """Work on the jobs that come through standard input until it ends; the life of a worker."""
    jobs, answers = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # nothing but answers goes to the parent
    coming: queue.SimpleQueue[Job] = queue.SimpleQueue()
    threading.Thread(target=_receive, args=(jobs, coming), daemon=True).start()
    while True:
        job = coming.get()
        try:
            outcome = run_job(job)
        except ClosedPipe:
            outcome = Outcome(
                job, 4, message("error", "the reader of an output has gone; run it again", place=job.source)
            )
        try:
            pickle.dump(outcome, answers)
            answers.flush()
        except OSError:
            _leave()


def _leave() -> NoReturn:
    """End where the parent has gone, whatever the other thread is at."""
    remove_unfinished()
    os._exit(0)


def _receive(jobs: BinaryIO, coming: queue.SimpleQueue[Job]) -> None:
    """Hand the jobs on until the parent has gone."""
    try:
        while True:
            coming.put(pickle.load(jobs))
    finally:
        _leave()
