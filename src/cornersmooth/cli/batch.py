"""Several inputs: one after the other, in processes beside one another, or on a cluster; counted as they end."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
from collections.abc import Callable, Iterator
from functools import partial
from itertools import islice
from multiprocessing import parent_process
from typing import Any

from cornersmooth.cli.job import Job, Outcome, run_job
from cornersmooth.cli.shutdown import Shutdown
from cornersmooth.cli.summary import row_of
from cornersmooth.errors import message
from cornersmooth.output import remove_leftovers, remove_unfinished
from cornersmooth.processes import Helper, first_ready

#: parameter of prctl (sys/prctl.h): the signal that a process gets when its parent ends
_PR_SET_PDEATHSIG = 1


class Batch:
    """The jobs of one run: in so many processes, 0 for all cores, or on the cluster of a scheduler, where one is named.

    `progress` is called with the files that have ended, and with all.
    """

    def __init__(
        self,
        jobs: list[Job],
        processes: int,
        progress: Callable[[str, int, int], None] | None = None,
        *,
        scheduler: str = "",
    ) -> None:
        self.jobs, self._progress, self._scheduler = jobs, progress, scheduler
        self._rows: list[dict[str, Any] | None] = [None] * len(jobs)
        self._processes = min(processes or os.cpu_count() or 1, len(jobs))

    def run(self, ending: Shutdown) -> Iterator[Outcome]:
        """Outcomes in the order of the inputs; a file that fails does not stop the others."""
        if self._scheduler:
            from cornersmooth.cli.cluster import run_on_cluster

            ends = run_on_cluster(self.jobs, self._scheduler)
        elif self._processes == 1:
            ends = ((place, run_job(job)) for place, job in enumerate(self.jobs))
        else:
            ends = self._beside(ending)
        early: dict[int, Outcome] = {}
        turn = 0
        for ended, (place, outcome) in enumerate(ends, 1):
            self._rows[place], early[place] = row_of(outcome), outcome
            if self._progress is not None:
                self._progress("files", ended, len(self.jobs))
            while turn in early:
                yield early.pop(turn)
                turn += 1

    def rows(self) -> list[dict[str, Any]]:
        """A row for each file, as `row_of` gives them; also for those that nothing was done with yet."""
        return [row or row_of(Outcome(job, unfinished=True)) for job, row in zip(self.jobs, self._rows, strict=True)]

    def _beside(self, ending: Shutdown) -> Iterator[tuple[int, Outcome]]:
        """Places and outcomes of jobs, each in a process of its own, as they end."""
        running: dict[Helper, int] = {}
        waiting = iter(enumerate(self.jobs))

        def clean() -> None:
            for helper, place in running.items():
                helper.kill()
                _remove_unfinished_of(self.jobs[place], helper)

        ending.clean = clean
        try:
            while True:
                for place, job in islice(waiting, self._processes - len(running)):
                    running[Helper(partial(_run_with_parent, job))] = place
                if not running:
                    return
                for helper in first_ready(running):
                    place = running.pop(helper)
                    yield place, _outcome(self.jobs[place], helper)
        finally:
            for helper in running:
                helper.end()


def _run_with_parent(job: Job) -> Outcome:
    """Do a job in a process that ends with its parent, and then leaves nothing half written."""

    def leave(*_: object) -> None:
        remove_unfinished()
        os._exit(1)

    signal.signal(signal.SIGTERM, leave)
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
    parent = parent_process()
    if parent is not None and os.getppid() != parent.pid:  # it has ended meanwhile
        leave()
    try:
        return run_job(job)
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)


def _outcome(job: Job, helper: Helper) -> Outcome:
    """Outcome of a job, also where its process was killed."""
    try:
        outcome: Outcome = helper.result()
        helper.end()
    except MemoryError:
        code = helper.end()
        _remove_unfinished_of(job, helper)
        how = f"exit code {code}" if code >= 0 else f"signal {-code}"
        how += ", as a system short of memory does" * (code == -signal.SIGKILL)
        what = f"the process working on it was ended ({how}); run it again"
        return Outcome(job, 3, message("error", what, place=job.source))
    return outcome


def _remove_unfinished_of(job: Job, helper: Helper) -> None:
    for path in job.outputs:
        remove_leftovers(path, helper.pid)
