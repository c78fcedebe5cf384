"""Several inputs: one after the other or beside one another, counted as they end."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from queue import SimpleQueue
from typing import Any

from cornersmooth.cli.job import Job, Outcome, run_job
from cornersmooth.cli.shutdown import Shutdown
from cornersmooth.cli.summary import row_of


class Batch:
    """The jobs of one run.

    Parameters
    ----------
    processes : int
        0 for all cores.
    scheduler : str
        Of a cluster that does the work instead: its address or file; empty for none.
    progress : callable, optional
        Called with the files that have ended, and with all.
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
        self._ended = 0
        self._at_end: list[dict[str, Any]] | None = None
        self._processes = min(processes or os.cpu_count() or 1, len(jobs))

    def run(self, ending: Shutdown) -> Iterator[Outcome]:
        """Outcomes in the order of the inputs; a file that fails does not stop the others."""
        if self._scheduler:
            yield from self._on_cluster()
        elif self._processes == 1:
            for place, job in enumerate(self.jobs):
                yield self._counted(place, run_job(job))
        else:
            yield from self._beside(ending)

    def rows(self) -> list[dict[str, Any]]:
        """A row for each file, as `row_of` gives them; also for those that nothing was done with yet."""
        if self._at_end is not None:
            return self._at_end
        return [row or row_of(Outcome(job, unfinished=True)) for job, row in zip(self.jobs, self._rows, strict=True)]

    def _counted(self, place: int, outcome: Outcome) -> Outcome:
        self._rows[place] = row_of(outcome)
        self._ended += 1
        if self._progress is not None:
            self._progress("files", self._ended, len(self.jobs))
        return outcome

    def _beside(self, ending: Shutdown) -> Iterator[Outcome]:
        from cornersmooth.cli.worker import Worker

        workers = [Worker() for _ in range(self._processes)]
        free: SimpleQueue[Worker] = SimpleQueue()
        for worker in workers:
            free.put(worker)

        def end() -> None:
            self._at_end = self.rows()  # files whose worker is killed are not done, and no errors
            for worker in workers:
                worker.kill()

        def work(place: int) -> Outcome:
            worker = free.get()
            try:
                return self._counted(place, worker.run(self.jobs[place]))
            finally:
                free.put(worker)

        ending.clean = end
        pool = ThreadPoolExecutor(self._processes)
        try:
            waiting: list[Future[Outcome]] = [pool.submit(work, place) for place in range(len(self.jobs))]
            for future in waiting:
                yield future.result()
        finally:
            pool.shutdown(wait=False, cancel_futures=True)
            for worker in workers:
                worker.end()

    def _on_cluster(self) -> Iterator[Outcome]:
        from cornersmooth.cli.cluster import run_on_cluster

        early: dict[int, Outcome] = {}
        turn = 0
        for place, outcome in run_on_cluster(self.jobs, self._scheduler):
            early[place] = self._counted(place, outcome)
            while turn in early:
                yield early.pop(turn)
                turn += 1
