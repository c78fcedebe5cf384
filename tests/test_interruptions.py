"""Interruptions at random moments; `python tests/interruptions.py 100` makes more of them."""

from __future__ import annotations

import signal
import time
from pathlib import Path

import pytest

from interruptions import HOW, LEFT, OLD, Bench, Try, cl_text, members, tries
from oracle.command import PATIENCE, run, started, wait_for
from oracle.share import THOROUGH, how_many


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


LINUXCNC = ("--control", "linuxcnc", "--machine", "xyzac-trt")
SIGNALS = (signal.SIGTERM, signal.SIGINT)
LONG = (
    "verify large.cls a.ngc --report out.json",
    f"filter a.ngc {' '.join(LINUXCNC)} -o out.nc --force",
    "smooth in -d out -j 2",
    "smooth large.cls -o out.nc --force",
    "smooth line.cls -o out.nc --force",
    "info large.cls",
)


@pytest.fixture(scope="module")
def long_work(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with inputs that every command is busy with for longer than the test waits."""
    folder = tmp_path_factory.mktemp("long")
    wavy = cl_text(20_000, 0)
    (folder / "a.cls").write_text(wavy)
    run("smooth", "a.cls", "-q", "-o", "a.ngc", *LINUXCNC, "--no-verify", cwd=folder)
    poses = wavy.splitlines(keepends=True)[3:-1]
    (folder / "large.cls").write_text("UNITS/MM\n" + "".join(poses) * 25 + "FINI\n")
    (folder / "line.cls").write_text("UNITS/MM\nPPRINT " + "A" * 100_000_000 + "\nGOTO/0,0,0\nGOTO/1,0,0\nFINI\n")
    (folder / "in").mkdir()
    for number in range(4):
        (folder / "in" / f"p{number}.cls").write_text(cl_text(15_000, number))
    return folder


@pytest.mark.parametrize(
    ("words", "number"),
    [(words, SIGNALS[(k + more) % 2]) for k, words in enumerate(LONG) for more in range(how_many(1, 2))],
)
def test_every_command_ends_within_two_seconds(words: str, number: signal.Signals, long_work: Path) -> None:
    old = long_work / "out.nc"
    old.write_bytes(OLD)
    before = set(long_work.glob("*"))
    with started(*words.split(), session=True, cwd=long_work) as process:
        time.sleep(0.5)
        begin = time.monotonic()
        process.send_signal(number)
        _, complaint = process.communicate(timeout=PATIENCE)
        assert time.monotonic() - begin < LEFT
    assert process.returncode == 128 + number, complaint.decode()
    assert old.read_bytes() == OLD
    assert set(long_work.glob("*")) - before <= {long_work / "out"}
    assert not list(long_work.rglob(".*.part"))
    wait_for(lambda: not members(process.pid))
    assert time.monotonic() - begin < LEFT
