"""A batch on a real cluster of two processes, one of which is killed."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from cornersmooth.cli.cluster import do
from cornersmooth.cli.job import Job
from interruptions import cl_text
from oracle.command import USAGE, command, environment, run

FILES = 5


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0", silence_logs=50
    ) as made:
        yield made


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    folder = tmp_path / "cl"
    (folder / "deep").mkdir(parents=True)
    for number in range(FILES):
        (folder / ("deep" if number % 2 else ".") / f"part{number}.cls").write_text(cl_text(600, number))
    return folder


def files_in(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def test_a_lost_worker_loses_no_file(cluster: Any, folder: Path, tmp_path: Path) -> None:
    (folder / "bad.cls").write_text("GOTO/nan\n")
    here, there = tmp_path / "here", tmp_path / "there"
    plain = run("smooth", "cl", "-d", "here", cwd=tmp_path)
    words = command("smooth", "cl", "-d", "there", "--scheduler", cluster.scheduler_address)
    process = subprocess.Popen(words, stderr=subprocess.PIPE, env=environment(), cwd=tmp_path)
    while not list(there.rglob(".part*.part")):  # a worker is at one
        assert process.poll() is None
        time.sleep(0.005)
    writing = next(path.name.split(".")[-2] for path in there.rglob(".part*.part"))
    os.kill(int(writing.split("-")[0]), signal.SIGKILL)
    _, said = process.communicate()
    assert process.returncode == plain.returncode, said.decode()
    assert files_in(there) == files_in(here)
    # each line but for its seconds
    lines, others = (text.decode().splitlines() for text in (said, plain.stderr))
    assert [line.rpartition(",")[0] for line in lines[:-1]] == [line.rpartition(",")[0] for line in others[:-1]]
    assert lines[-1] == others[-1] == f"{FILES + 1} files: {FILES} done, 1 failed"
    again = run("smooth", "cl", "-d", "there", "--scheduler", cluster.scheduler_address, cwd=tmp_path)
    assert again.stderr.decode().splitlines()[-1] == f"{FILES + 1} files: {FILES} skipped, 1 failed"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("-d", "out", "--scheduler", "nonsense://nowhere"), "no scheduler answers at nonsense://nowhere; give tcp://"),
        (("--scheduler", "tcp://localhost:1"), "--scheduler is for batches, which need -d FOLDER"),
    ],
)
def test_what_cannot_work_is_refused(folder: Path, tmp_path: Path, words: tuple[str, ...], said: str) -> None:
    pytest.importorskip("distributed")
    result = run("smooth", folder / "part0.cls", *words, cwd=tmp_path)
    assert (result.returncode, len(result.stderr.splitlines())) == (USAGE, 1)
    assert said in result.stderr.decode()


def test_workers_that_do_not_fit_say_so(tmp_path: Path) -> None:
    from cornersmooth import Settings, __version__, choose_form
    from cornersmooth.nc import Frame

    job = Job("a.cls", "out/a.nc", (), {}, Settings(), choose_form(), Frame(), None, force=False, batch=True)
    assert "does not see out; let it stand in a folder that all share" in do(job, "/", "out/none", __version__).message
    found = do(job, "/", "", "0.0")
    assert (found.status, found.message.startswith("a.cls: error: ")) == ("failed", True)
    assert f"has cornersmooth {__version__}, not 0.0; install the same" in found.message
