"""Processes of their own: how many, how they begin and how they end.

Between small arrays the interpreter is the bottleneck, and threads only wait for one another. A forked process has all
data of its parent without copying it.
"""

from __future__ import annotations

import os
import signal
import sys
import warnings
from collections.abc import Callable
from multiprocessing import get_context
from multiprocessing.process import BaseProcess
from typing import Any, Final

#: more find too little to do
MOST_PROCESSES: Final = 4

#: only used where the system can fork
CONTEXT: Final = get_context("fork" if sys.platform == "linux" else None)


def useful_processes() -> int:
    """Processes that this computer has room for."""
    allowed = len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1
    return max(1, min(MOST_PROCESSES, allowed))


def can_fork() -> bool:
    """Whether the system can fork a process with numpy in it safely."""
    return sys.platform == "linux"


def forked(target: Callable[..., None], *args: Any) -> BaseProcess:
    """Start a process that calls `target`; it has all that this one has."""
    with warnings.catch_warnings():  # newer Pythons warn of threads, of which only numpy's idle ones are left
        warnings.simplefilter("ignore", DeprecationWarning)
        process: BaseProcess = CONTEXT.Process(target=_obeying, args=(target, args), daemon=True)
        process.start()
    return process


def end_all(processes: list[BaseProcess]) -> None:
    """Let processes go home; who is still at work is sent away."""
    for process in processes:
        process.terminate()
    for process in processes:
        process.join()
        process.close()


def _obeying(target: Callable[..., None], args: tuple[Any, ...]) -> None:
    """Work so that the parent can end this process, and an interruption ends the parent only, which does so."""
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    target(*args)
