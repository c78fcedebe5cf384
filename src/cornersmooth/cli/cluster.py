"""A batch on a cluster that is there already: Dask distributed, with the files in folders that all machines share.

Each file is a task of its own. What a worker was at when it was lost the scheduler gives to another, which does it
again: files appear under their names only when they are whole, so nothing is half written.
"""

from __future__ import annotations

import contextlib
import logging
import os
import secrets
import socket
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from cornersmooth import __version__
from cornersmooth.cli.files import STANDARD
from cornersmooth.cli.job import Job, Outcome, run_job
from cornersmooth.errors import SettingsError, command_text, message
from cornersmooth.system.output import make_folder, remove_leftovers, temporary_name

if TYPE_CHECKING:
    from distributed import Client

#: seconds to wait for the scheduler to answer
_PATIENCE = 15

#: tasks that are handed over beyond those that can run at once: enough to keep all workers busy
_AHEAD = 64


def run_on_cluster(jobs: list[Job], scheduler: str) -> Iterator[tuple[int, Outcome]]:
    """Have jobs of one batch done by a cluster; places in the list and outcomes, as they end.

    The scheduler is an address such as ``tcp://host:8786``, or a file. Raises SettingsError CS243: distributed is not
    installed; CS244: the scheduler does not answer.
    """
    client, as_completed = _connect(scheduler)
    here, run = os.getcwd(), secrets.token_hex(8)
    with contextlib.closing(client), _proof_of_sharing(jobs) as proof:
        waiting = iter(enumerate(jobs))
        places: dict[Any, int] = {}

        def submit(many: int) -> Iterator[Any]:
            for place, job in (pair for _, pair in zip(range(many), waiting, strict=False)):
                task = client.submit(do, replace(job, run=run), here, proof, __version__, key=f"{run}-{place}")
                places[task.key] = place
                yield task

        ending = as_completed(submit(sum(client.nthreads().values()) + _AHEAD))
        for task in ending:
            place = places.pop(task.key)
            outcome = _outcome(jobs[place], task)
            for path in jobs[place].outputs:
                remove_leftovers(path)  # of a worker that was lost
            yield place, outcome
            task.release()
            ending.update(list(submit(1)))


def do(job: Job, folder: str, proof: str, version: str) -> Outcome:
    """Do a job in a process of the cluster; the outcome tells paths as they were named.

    Relative paths begin in the folder. The proof is a file that is there where the folders are shared; the version is
    that of the program that asks.
    """
    host = socket.gethostname()
    if version != __version__:
        return _failed(job, f"{host} has cornersmooth {__version__}, not {version}; install the same everywhere")
    if not os.path.exists(os.path.join(folder, proof)):
        return _failed(job, f"{host} does not see {os.path.dirname(proof)}; let it stand in a folder that all share")
    named = {path: os.path.join(folder, path) for path in (job.source, *job.outputs) if path != STANDARD}
    there = replace(
        job,
        source=named[job.source],
        target=named[job.target],
        reports=tuple(named[path] for path in job.reports),
    )
    outcome = run_job(there)
    for path, place in named.items():
        outcome.message = outcome.message.replace(place, path)
    outcome.job = job
    return outcome


def _connect(scheduler: str) -> tuple[Client, Any]:
    try:
        from distributed import Client, as_completed
    except ImportError as missing:
        hint = f"install it with: {command_text(['pip', 'install', 'cornersmooth[cluster]'])}"
        raise SettingsError("CS243", "a scheduler needs Dask distributed", hint) from missing
    for name in ("distributed", "distributed.client"):  # what matters is in the message of the file
        logging.getLogger(name).setLevel(logging.CRITICAL)
    given: dict[str, Any] = {"scheduler_file": scheduler} if os.path.isfile(scheduler) else {"address": scheduler}
    try:
        client = Client(**given, timeout=_PATIENCE)
    except (OSError, ValueError, TypeError) as failure:
        what = f"no scheduler answers at {scheduler}"
        raise SettingsError("CS244", what, "give tcp://HOST:PORT or the scheduler's file") from failure
    return client, as_completed


@contextlib.contextmanager
def _proof_of_sharing(jobs: list[Job]) -> Iterator[str]:
    """Yield a file among the outputs that exists as long as the batch runs."""
    folder = os.path.dirname(jobs[0].target)
    make_folder(folder)
    with temporary_name(folder, f"cluster-{socket.gethostname()}") as path:
        with open(path, "xb"):
            pass
        yield path


def _outcome(job: Job, task: Any) -> Outcome:
    """Outcome of a task, also where the cluster gave it up."""
    try:
        outcome: Outcome = task.result()
    except Exception as failure:
        what = str(failure).strip().splitlines()
        return _failed(
            job, f"the cluster gave it up: {type(failure).__name__}, {what[0] if what else 'lost'}; run it again"
        )
    return outcome


def _failed(job: Job, what: str) -> Outcome:
    return Outcome(job, 3, message("error", what, place=job.source))
