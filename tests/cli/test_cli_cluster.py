"""A batch on a real cluster of two processes, one of which is killed; it is started as docs/batch.md says."""

from __future__ import annotations

import contextlib
import json
import os
import re
import shlex
import shutil
import signal
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from cornersmooth import Settings, __version__, choose_form
from cornersmooth.cli.job import Job
from cornersmooth.cli.options import Options
from cornersmooth.nc import Frame
from interruptions import cl_text
from oracle.command import DONE, SCRIPT, USAGE, command, environment, run, wait_for
from oracle.messages import one_line

FILES = 5


PAGE = Path(__file__).resolve().parents[2] / "docs" / "batch.md"


def shown(start: str) -> list[str]:
    """Words of the one line of the page that begins so, without its remark."""
    (line,) = re.findall(rf"^    ({start}.*)", PAGE.read_text(), re.MULTILINE)
    return shlex.split(line.replace(" &", ""), comments=True)


@contextlib.contextmanager
def cluster(shared: Path) -> Iterator[Path]:
    """The scheduler file of a cluster of two processes, started by the lines of the page but for ports and number."""
    pytest.importorskip("distributed")
    changed = {"/shared/scheduler.json": str(shared / "scheduler.json"), "16": "2"}
    with contextlib.ExitStack() as stack:
        for words, ports in ((shown("dask scheduler"), ["--port", "0"]), (shown("dask worker"), [])):
            process = subprocess.Popen(
                [SCRIPT.parent / words[0], *(changed.get(word, word) for word in words[1:]), *ports, "--no-dashboard"],
                cwd=shared,
                env=environment(),
                stderr=subprocess.DEVNULL,
            )
            stack.enter_context(process)
            stack.callback(process.terminate)
        file = shared / "scheduler.json"
        wait_for(lambda: file.exists() and file.read_text().rstrip().endswith("}"))  # it is written whole
        yield shared / "scheduler.json"


@pytest.fixture(scope="module")
def scheduler(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    with cluster(tmp_path_factory.mktemp("shared")) as file:
        yield file


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    folder = tmp_path / "cl"
    (folder / "deep").mkdir(parents=True)
    for number in range(FILES):
        (folder / ("deep" if number % 2 else ".") / f"part{number}.cls").write_text(cl_text(600, number))
    return folder


def files_in(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("[!.]*.nc"))}


def test_a_lost_worker_loses_no_file(scheduler: Path, folder: Path, tmp_path: Path) -> None:
    (folder / "bad.cls").write_text("GOTO/nan\n")
    here, there = tmp_path / "here", tmp_path / "there"
    plain = run("smooth", "cl", "-d", "here", cwd=tmp_path)
    words, around = command("smooth", "cl", "-d", "there"), environment(CORNERSMOOTH_SCHEDULER=str(scheduler))
    process = subprocess.Popen(words, stderr=subprocess.PIPE, env=around, cwd=tmp_path)
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
    assert lines[-1] == others[-1] == f"{FILES + 1} files: {FILES} PASSED ({FILES} to check), 1 error"
    address = json.loads(scheduler.read_text())["address"]
    again = run("smooth", "cl", "-d", "there", f"CORNERSMOOTH_SCHEDULER={address}", cwd=tmp_path)
    assert again.stderr.decode().splitlines()[-1] == f"{FILES + 1} files: {FILES} skipped, 1 error"


def test_the_commands_of_the_page_work(scheduler: Path, folder: Path, tmp_path: Path) -> None:
    lines = [line for line in PAGE.read_text().splitlines() if "CORNERSMOOTH_SCHEDULER=" in line]
    address = json.loads(scheduler.read_text())["address"]
    assert len(lines) == 2
    for line in lines:
        there = line.replace("/shared/scheduler.json", str(scheduler)).replace("tcp://host:8786", address)
        result = run(*(word for word in shlex.split(there) if word != "cornersmooth"), cwd=tmp_path)
        assert result.returncode == DONE, result.stderr.decode()
    assert result.stderr.decode().splitlines()[-1] == f"{FILES} files: {FILES} skipped"
    assert len(files_in(tmp_path / "nc")) == FILES
    assert len((tmp_path / "made.csv").read_text().splitlines()) == FILES + 1


def certificate(folder: Path) -> dict[str, str | bool]:
    """Make a certificate that is its own authority; return the settings of Dask that take it."""
    if not (openssl := shutil.which("openssl")):
        pytest.skip("openssl, which makes the certificate, is not installed")
    folder.mkdir()
    key, signed = str(folder / "key.pem"), str(folder / "certificate.pem")
    words = "req -x509 -newkey rsa:2048 -nodes -days 1 -subj /CN=cluster -keyout".split()
    subprocess.run([openssl, *words, key, "-out", signed], check=True, capture_output=True)
    comm = "distributed.comm."
    found: dict[str, str | bool] = {f"{comm}require-encryption": True, f"{comm}tls.ca-file": signed}
    for who in ("scheduler", "worker", "client"):
        found |= {f"{comm}tls.{who}.{one}": file for one, file in (("key", key), ("cert", signed))}
    return found


def test_a_scheduler_with_tls_takes_those_with_its_certificate(folder: Path, tmp_path: Path) -> None:
    distributed, config = pytest.importorskip("distributed"), pytest.importorskip("dask.config")
    ours, strange = certificate(tmp_path / "ours"), certificate(tmp_path / "strange")
    with contextlib.ExitStack() as stack:
        with config.set(ours):
            security = distributed.Security()
            here = {"n_workers": 1, "threads_per_worker": 1, "processes": False, "dashboard_address": ":0"}
            cluster = stack.enter_context(distributed.LocalCluster(protocol="tls", security=security, **here))
        address = cluster.scheduler_address
        assert address.startswith("tls://")
        for settings, code in ((strange, USAGE), ({}, USAGE), (ours, DONE)):
            with config.set(settings):
                found = run("smooth", folder, "-d", tmp_path / "nc", f"CORNERSMOOTH_SCHEDULER={address}", cwd=tmp_path)
            said = found.stderr.decode().splitlines()
            assert found.returncode == code, said
            if code == USAGE:
                assert f"no scheduler answers at {address}" in "\n".join(said)
                assert not list(tmp_path.rglob("*.nc"))
    assert said[-1].startswith(f"{FILES} files: {FILES} PASSED")
    assert len(files_in(tmp_path / "nc")) == FILES


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            ("-d", "out", "CORNERSMOOTH_SCHEDULER=nonsense://nowhere"),
            "no scheduler answers at nonsense://nowhere; give tcp://",
        ),
    ],
)
def test_what_cannot_work_is_refused(folder: Path, tmp_path: Path, words: tuple[str, ...], said: str) -> None:
    pytest.importorskip("distributed")
    result = run("smooth", folder / "part0.cls", *words, cwd=tmp_path)
    assert (result.returncode, one_line(result.stderr).count("\n")) == (USAGE, 1)
    assert said in one_line(result.stderr)


def test_workers_that_do_not_fit_say_so(tmp_path: Path) -> None:
    job = Job("a.cls", "out/a.nc", (), "a", Options(directory="out"), Settings(), choose_form(), Frame())
    do = pytest.importorskip("cornersmooth.cli.batch", reason="distributed is not installed").do
    assert "does not see out" in do(job, "/", "out/none", __version__).message
    found = do(job, "/", "", "0.0")
    assert (found.status, found.message.startswith("a.cls: error: ")) == ("error", True)
    assert f"has cornersmooth {__version__}, not 0.0\nhint: install" in found.message
