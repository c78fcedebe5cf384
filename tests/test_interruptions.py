"""Interruptions at random moments; `python tests/interruptions.py 100` makes more of them."""

from __future__ import annotations

import pickle
import subprocess
import sys
from pathlib import Path

import pytest

from cornersmooth import Settings, choose_form
from cornersmooth.cli import worker
from cornersmooth.cli.job import Job
from cornersmooth.nc import Frame
from interruptions import HOW, Bench, Try, tries
from oracle.share import THOROUGH


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    return Bench(tmp_path_factory.mktemp("bench"), single=31_000, several=500)


#: each way to interrupt, of single files and of batches in turn
USUAL = [one for one in tries(8, seed=7) if THOROUGH or one.batch == HOW.index(one.how) % 2]


@pytest.mark.parametrize("one", USUAL, ids=lambda one: f"{'batch' if one.batch else 'single'}-{one.how}")
def test_nothing_is_left_of_an_interrupted_run(bench: Bench, one: Try) -> None:
    found = bench.interrupt(one)
    assert found.wrong == [], found.said


def test_signals_that_a_run_was_started_to_ignore_stay_ignored(bench: Bench) -> None:
    found = bench.interrupt(Try(batch=True, how="nohup", moment=0.5, old=False))
    assert (found.code, found.wrong) == (0, [])


def test_a_batch_whose_parent_is_killed_leaves_no_process(bench: Bench) -> None:
    found = bench.interrupt(Try(batch=True, how="parent", moment=0.5, old=True))
    assert found.wrong == [], found.said


def test_a_worker_that_nobody_listens_to_ends_in_silence(tmp_path: Path) -> None:
    """Its parent was killed between two jobs, and it has not yet seen that no job will come."""
    job = Job("none.cls", "none.nc", (), {}, Settings(), choose_form(), Frame(), None, force=False, batch=True)
    command = [sys.executable, "-P", "-c", worker._COMMAND]
    with subprocess.Popen(
        command, cwd=tmp_path, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as process:
        assert process.stdin
        assert process.stdout
        assert process.stderr
        process.stdout.close()
        pickle.dump(job, process.stdin)
        process.stdin.flush()
        assert (process.wait(60), process.stderr.read()) == (0, b"")
