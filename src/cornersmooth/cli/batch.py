"""Several inputs: one after the other, in processes beside one another, or on a cluster; counted as they end.

What became of the files is printed in lines, and as a table for other programs: a row a file.

A cluster is there already: Dask distributed, with the files in folders that all machines share. Each file is a task of
its own. What a worker was at when it was lost the scheduler gives to another, which does it again: files appear under
their names only when they are whole, so nothing is half written.
"""

from __future__ import annotations

import contextlib
import ctypes
import logging
import os
import secrets
import signal
import socket
import sys
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import islice
from multiprocessing import parent_process
from typing import TYPE_CHECKING, Any

from cornersmooth import __version__
from cornersmooth.cli.files import STANDARD, csv_table, write_reports
from cornersmooth.cli.job import STATUSES, Job, Outcome, run_job
from cornersmooth.errors import SettingsError, Verdict, command_text, message
from cornersmooth.system.output import make_folder, remove_leftovers, remove_unfinished, temporary_name
from cornersmooth.system.processes import Helper, first_ready

if TYPE_CHECKING:
    from distributed import Client

    from cornersmooth.cli import Shutdown


#: exit code of a process that SIGKILL has ended
_KILLED = -9

#: parameter of prctl (sys/prctl.h): the signal that a process gets when its parent ends
_PR_SET_PDEATHSIG = 1


def run_batch(
    jobs: list[Job],
    rows: list[dict[str, Any]],
    ending: Shutdown,
    processes: int,
    scheduler: str | None,
    progress: Callable[[str, int, int], None] | None,
) -> Iterator[Outcome]:
    """Do jobs in so many processes, 0 for all cores, or on the cluster of a scheduler; outcomes in order of the inputs.

    A file that fails does not stop the others. `rows` gets that of each as it ends; `progress` is called with the files
    that have ended, and with all.
    """
    processes = min(processes or os.cpu_count() or 1, len(jobs))
    if scheduler:
        ends = run_on_cluster(jobs, scheduler)
    elif processes == 1:
        ends = ((place, run_job(job)) for place, job in enumerate(jobs))
    else:
        ends = _beside(jobs, processes, ending)
    early: dict[int, Outcome] = {}
    turn = 0
    for ended, (place, outcome) in enumerate(ends, 1):
        rows[place], early[place] = row_of(outcome), outcome
        if progress is not None:
            progress("files", ended, len(jobs))
        while turn in early:
            yield early.pop(turn)
            turn += 1


def _beside(jobs: list[Job], processes: int, ending: Shutdown) -> Iterator[tuple[int, Outcome]]:
    """Places and outcomes of jobs, each in a process of its own, as they end."""
    running: dict[Helper, int] = {}
    waiting = iter(enumerate(jobs))

    def clean() -> None:
        for helper, place in running.items():
            helper.kill()
            _remove_unfinished_of(jobs[place], helper)

    ending.clean = clean
    try:
        while True:
            for place, job in islice(waiting, processes - len(running)):
                helper = Helper(_run_with_parent)
                running[helper] = place
                helper.start(job)
            if not running:
                return
            for helper in first_ready(running):
                place = running.pop(helper)
                yield place, _outcome(jobs[place], helper)
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
        how += ", as a system short of memory does" * (code == _KILLED)
        return _failed(job, f"the process working on it was ended ({how}); run it again")
    return outcome


def _remove_unfinished_of(job: Job, helper: Helper) -> None:
    for path in job.outputs:
        remove_leftovers(path, helper.pid)


def line_of(outcome: Outcome) -> str:
    """One line for a file that has a verdict, or was skipped."""
    name, row = outcome.job.source, row_of(outcome)
    head, _, what = outcome.verdict_text.partition(": ")
    if outcome.status == "skipped":
        return f"skipped   {name}: {outcome.skipped}" + (f"; {outcome.verdict_text}" if what else "")
    summary, own_axis = outcome.contents["summary"], outcome.contents["settings"]["axis_tolerance_deg"] is not None
    second = "tool axis {max_orientation_error_deg:.4f}°" if own_axis else "axis point {max_axis_error_mm:.4f} mm"
    return (
        f"{head:<8}  {name}: {what}; {row['smoothed']} of {row['corners']} corners, "
        f"tip {row['max_tip_error_mm']:.4f} mm, {second.format(**summary)}, "
        f"{row['blocks']} blocks, {row['seconds']:.1f} s"
    )


def end_lines(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Say at the end of a batch what is to be looked at: each failure, the warnings by code, the counts."""
    for row in rows:
        if row["exit_code"]:
            what = row["verdict_text"].partition(": ")[2] if row["verdict"] else row["reason"].splitlines()[0]
            name = "" if what.startswith(row["source"]) else f"{row['source']}: "
            yield f"{row['status']:<8}  {name}{what}"
    for code, found in warnings_of(rows).items():
        files = f"{found['files']} file{'s' * (found['files'] != 1)}"
        times = f", {found['count']} times" if found["count"] > found["files"] else ""
        yield f"warning   {code} in {files}{times}, as in {found['first']}: {found['text'].partition('; ')[0]}"
    yield counts_line(rows)


def interrupted_line(rows: Sequence[Mapping[str, Any]]) -> str:
    """Say how far an interrupted batch came."""
    ready = sum(row["status"] not in ("error", "not done", Verdict.FAILED) for row in rows)
    return f"interrupted: {ready} of {len(rows)} done; run again to continue"


def warnings_of(rows: Sequence[Mapping[str, Any]]) -> dict[str, dict[str, Any]]:
    """Count the warnings of all files by their codes, those in the most files first."""
    found: dict[str, dict[str, Any]] = {}
    for row in rows:
        for code, (count, text) in row["warnings"].items():
            own = found.setdefault(code, {"files": 0, "count": 0, "first": row["source"], "text": text})
            own["files"] += 1
            own["count"] += count
    return dict(sorted(found.items(), key=lambda item: (-item[1]["files"], item[0])))


def counts_line(rows: Sequence[Mapping[str, Any]]) -> str:
    """How many files there were of each status, and what is to be looked at among them."""
    parts = []
    for status in STATUSES:
        same = [row for row in rows if row["status"] == status]
        checks = sum(bool(row["to_check"]) for row in same)
        within = [f"{checks} to check"] if checks else []
        if status == "skipped":  # with the verdicts of the run before
            words = Counter(row["verdict"] for row in same)
            within = [f"{words[word]} {word}" for word in list(Verdict)[1:] if words[word]]
        name = "errors" if status == "error" and len(same) != 1 else status
        parts += [f"{len(same)} {name}" + (f" ({', '.join(within)})" if within else "")] if same else []
    return f"{len(rows)} file{'s' * (len(rows) != 1)}: {', '.join(parts)}"


def row_of(outcome: Outcome) -> dict[str, Any]:
    """Everything that a summary has of a file; None where there is nothing."""
    contents = outcome.contents
    summary = contents.get("summary", {})
    return {
        "source": outcome.job.source,
        "output": outcome.job.target,
        "status": outcome.status,
        "exit_code": outcome.exit_code,
        "reason": outcome.message or outcome.skipped,
        "verdict": outcome.verdict,
        "verdict_text": outcome.verdict_text,
        **{name: contents.get(name) for name in ("to_check", "left_out", "not_verified")},
        "poses": contents.get("input", {}).get("poses"),
        **{name: summary.get(name) for name in ("corners", "smoothed", "max_tip_error_mm", "max_axis_error_mm")},
        "blocks": summary.get("blocks_out"),
        "findings": len(contents["findings"]) if contents else None,
        "warnings": _warnings(contents.get("findings", ())),
        "seconds": round(sum(outcome.seconds.values()), 6) if outcome.seconds else None,
    }


def _warnings(findings: Iterable[Mapping[str, Any]]) -> dict[str, tuple[int, str]]:
    """How often each warning was met, and the first text that it has."""
    found: dict[str, tuple[int, str]] = {}
    for finding in findings:
        if finding["severity"] == "warning":
            count, text = found.get(finding["code"], (0, finding["text"]))
            found[finding["code"]] = (count + finding["count"], text)
    return dict(sorted(found.items()))


def batch_report(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """What became of a batch: counts, warnings by code, a row for each file."""
    counted = ({code: count for code, (count, _) in row["warnings"].items()} for row in rows)
    return {
        "schema": "cornersmooth-batch/2",
        "counts": {status: sum(row["status"] == status for row in rows) for status in STATUSES},
        "warnings": warnings_of(rows),
        "files": [{**row, "warnings": warnings} for row, warnings in zip(rows, counted, strict=True)],
    }


def write_summary(path: str, rows: Sequence[Mapping[str, Any]]) -> None:
    """Write a row for each file, as `row_of` gives them; as JSON, with the counts."""
    report = batch_report(rows)

    def table() -> list[str]:
        words = ("; ".join(f"{code} {count}" for code, count in row["warnings"].items()) for row in report["files"])
        return [csv_table([{**row, "warnings": text} for row, text in zip(report["files"], words, strict=True)])]

    write_reports({path: True}, report, table=table)


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
            for place, job in islice(waiting, many):
                task = client.submit(do, replace(job, run=run), here, proof, __version__, key=f"{run}-{place}")
                places[task.key] = place
                yield task

        ending = as_completed(submit(sum(client.nthreads().values()) + _AHEAD))
        for task in ending:
            place = places.pop(task.key)
            try:
                outcome: Outcome = task.result()
            except Exception as failure:
                what = (str(failure).strip().splitlines() or ["lost"])[0]
                what = f"the cluster gave it up: {type(failure).__name__}, {what}; run it again"
                outcome = _failed(jobs[place], what)
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


def _failed(job: Job, what: str) -> Outcome:
    return Outcome(job, 3, message("error", what, place=job.source))
