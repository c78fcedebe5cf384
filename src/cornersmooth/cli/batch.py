"""Several inputs: one after the other or beside one another, counted as they end."""

from __future__ import annotations

import os
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from queue import SimpleQueue

from cornersmooth.cli.ending import Ending
from cornersmooth.cli.job import Job, Outcome, run_job


class Batch:
    """The jobs of one run.

    Parameters
    ----------
    jobs : list of Job
    processes : int
        0 for all cores.
    """

    def __init__(self, jobs: list[Job], processes: int) -> None:
        self.jobs = jobs
        self.done = 0
        self._processes = min(processes or os.cpu_count() or 1, len(jobs))

    def run(self, ending: Ending) -> Iterator[Outcome]:
        """Outcomes in the order of the inputs; a file that fails does not stop the others."""
        ending.say = lambda: f"interrupted: {self.done} of {len(self.jobs)} done; run again to continue"
        outcomes = map(run_job, self.jobs) if self._processes == 1 else self._beside(ending)
        for outcome in outcomes:
            self.done += outcome.exit_code == 0
            yield outcome

    def _beside(self, ending: Ending) -> Iterator[Outcome]:
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
                return worker.run(job)
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
