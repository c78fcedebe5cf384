"""Several inputs: one after the other or beside one another, counted as they end."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from queue import SimpleQueue

from cornersmooth.cli.job import Job, Outcome, run_job
from cornersmooth.cli.shutdown import Shutdown
from cornersmooth.verdict import Verdict

#: what becomes of a file: a verdict, nothing as before, or none of both
STATUSES = (*map(str, Verdict), "skipped", "error")


class Batch:
    """The jobs of one run.

    Parameters
    ----------
    jobs : list of Job
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
        self.counts: Counter[str] = Counter()
        self._processes = min(processes or os.cpu_count() or 1, len(jobs))

    def run(self, ending: Shutdown) -> Iterator[Outcome]:
        """Outcomes in the order of the inputs; a file that fails does not stop the others."""
        ending.say = self._interrupted
        if self._scheduler:
            yield from self._on_cluster()
        elif self._processes == 1:
            yield from map(self._counted, map(run_job, self.jobs))
        else:
            yield from self._beside(ending)

    def _interrupted(self) -> str:
        ready = self.counts.total() - self.counts["error"] - self.counts[Verdict.FAILED]
        return f"interrupted: {ready} of {len(self.jobs)} done; run again to continue"

    def _counted(self, outcome: Outcome) -> Outcome:
        self.counts[outcome.status] += 1
        if self._progress is not None:
            self._progress("files", self.counts.total(), len(self.jobs))
        return outcome

    def _beside(self, ending: Shutdown) -> Iterator[Outcome]:
        from cornersmooth.cli.worker import Worker

        workers = [Worker() for _ in range(self._processes)]
        free: SimpleQueue[Worker] = SimpleQueue()
        for worker in workers:
            free.put(worker)

        def end() -> None:
            for worker in workers:
                worker.kill()

        def work(job: Job) -> Outcome:
            worker = free.get()
            try:
                return self._counted(worker.run(job))
            finally:
                free.put(worker)

        ending.clean = end
        pool = ThreadPoolExecutor(self._processes)
        try:
            waiting: list[Future[Outcome]] = [pool.submit(work, job) for job in self.jobs]
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
            early[place] = self._counted(outcome)
            while turn in early:
                yield early.pop(turn)
                turn += 1
