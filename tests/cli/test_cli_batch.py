"""Batches: folders and their trees, what a run again leaves as it is, counts, summaries, ends in the middle."""

from __future__ import annotations

import csv
import json
import os
import re
import shutil
import signal
import subprocess
import time
from pathlib import Path

import pytest

from interruptions import FILES, Bench
from oracle.chains import cl_text, random_chains
from oracle.command import BAD_INPUT, BAD_OUTPUT, DONE, SMALL, USAGE, forked, run, started
from oracle.messages import one_line
from oracle.share import share


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """Three files in folders below one another, one of which is no CL file by its name."""
    folder = tmp_path / "cl"
    (folder / "a" / "deep").mkdir(parents=True)
    for index, name in enumerate(("one.cls", "a/two.NCL", "a/deep/three.aptsource")):
        (folder / name).write_bytes(cl_text(random_chains(index, 6, tame=True))[0])
    (folder / "a" / "notes.txt").write_text("not a path")
    return folder


def files_in(folder: Path) -> dict[str, bytes]:
    """Contents by name, but for the marks beside outputs."""
    found = {str(path.relative_to(folder)): path for path in sorted(folder.rglob("*")) if path.is_file()}
    return {name: path.read_bytes() for name, path in found.items() if ".cornersmooth" not in name}


def lines(*args: object, code: int = DONE) -> list[str]:
    result = run("smooth", *args)
    assert result.returncode == code, result.stderr.decode()
    return one_line(result.stderr).splitlines()


def statuses(said: list[str]) -> list[str]:
    return [line.split()[0].strip(",") for line in said if line.startswith(("PASSED", "skipped "))]


def test_folders_are_mirrored(tree: Path, tmp_path: Path) -> None:
    said = lines(tree, "-d", tmp_path / "nc", "--report", tmp_path / "rep" / "{stem}.json")
    assert list(files_in(tmp_path / "nc")) == ["a/deep/three.nc", "a/two.nc", "one.nc"]
    assert list(files_in(tmp_path / "rep")) == ["a/deep/three.json", "a/two.json", "one.json"]
    assert said[-1] == "3 files: 3 PASSED (3 to check)"
    assert run("smooth", tree / "one.cls").stdout == files_in(tmp_path / "nc")["one.nc"]
    beside = lines(tree, "-d", tmp_path / "again", "-j", "2")
    assert [line.split(" s")[0].rsplit(",", 1)[0] for line in beside] == [
        line.split(" s")[0].rsplit(",", 1)[0] for line in said
    ]
    assert files_in(tmp_path / "again") == files_in(tmp_path / "nc")


def test_patterns_choose_files(tree: Path, tmp_path: Path) -> None:
    lines(tree, "-d", tmp_path / "nc", "--glob", "t*.ncl", "--glob", "one*")
    assert list(files_in(tmp_path / "nc")) == ["a/two.nc", "one.nc"]
    assert "no file in" in lines(tree, "-d", tmp_path / "none", "--glob", "*.xyz", code=USAGE)[0]
    assert run("smooth", tree / "one.cls", "--glob", "*").returncode == USAGE


def test_names_end_as_the_control_wants(tree: Path, tmp_path: Path) -> None:
    (tree / "one.cls").write_bytes(SMALL)
    for control, suffix in (("siemens", ".mpf"), ("heidenhain", ".h"), ("linuxcnc", ".ngc"), ("fanuc", ".nc")):
        options = ["--machine", "xyzac-trt"] if control == "linuxcnc" else []
        lines(tree / "one.cls", "-d", tmp_path / control, "--control", control, *options)
        assert list(files_in(tmp_path / control)) == [f"one{suffix}"]


def test_a_run_again_continues(tree: Path, tmp_path: Path) -> None:
    out = tmp_path / "nc"
    assert statuses(lines(tree, "-d", out)) == ["PASSED"] * 3
    before = files_in(out)
    (out / "one.nc").unlink()
    assert sorted(statuses(lines(tree, "-d", out))) == ["PASSED", "skipped", "skipped"]
    assert files_in(out) == before
    assert statuses(lines(tree, "-d", out, "--force")) == ["PASSED"] * 3


def test_what_has_changed_is_not_skipped(tree: Path, tmp_path: Path) -> None:
    out = tmp_path / "nc"
    lines(tree, "-d", out)
    before = files_in(out)
    (tree / "one.cls").write_bytes(SMALL)
    (out / "a" / "two.nc").write_bytes(b"edited by hand")
    said = lines(tree, "-d", out, code=BAD_OUTPUT)
    assert [line for line in said if "exists already" in line and not line.startswith("error ")] == [
        f"{out / name}: error: exists already; use --force to replace it" for name in ("one.nc", "a/two.nc")
    ]
    assert said[-1] == "3 files: 1 skipped, 2 errors"
    assert files_in(out) == before | {"a/two.nc": b"edited by hand"}
    for options in (
        ["-e", "0.02"],
        ["--no-verify"],
        ["-f", "g6.2"],
        ["--feed", "900"],
    ):
        assert lines(tree, "-d", out, *options, code=BAD_OUTPUT)[-1] == "3 files: 3 errors"


def test_a_report_that_is_missing_is_made(tree: Path, tmp_path: Path) -> None:
    out, reports = tmp_path / "nc", tmp_path / "{stem}.csv"
    lines(tree, "-d", out)
    before = files_in(out)
    assert statuses(lines(tree, "-d", out, "--report", reports)) == ["PASSED"] * 3
    assert (tmp_path / "a" / "two.csv").exists()
    assert statuses(lines(tree, "-d", out, "--report", reports)) == ["skipped"] * 3
    assert files_in(out) == before


def test_without_marks_what_is_made_is_compared(tree: Path, tmp_path: Path) -> None:
    out = tmp_path / "nc"
    lines(tree, "-d", out)
    (out / "one.nc").write_bytes(b"edited by hand")
    for marks in out.rglob(".cornersmooth"):
        shutil.rmtree(marks)
    before = files_in(out)
    said = lines(tree, "-d", out, code=BAD_OUTPUT)
    assert said[-1] == "3 files: 2 PASSED (2 to check), 1 error"
    assert files_in(out) == before


def test_summaries_have_a_row_for_each_file(tree: Path, tmp_path: Path) -> None:
    (tree / "bad.cls").write_bytes(SMALL.replace(b"GOTO/10,10,0,0,0.1,1", b"GOTO/10,nan,0,0,0.1,1"))
    out, text, table = tmp_path / "nc", tmp_path / "s.json", tmp_path / "s.csv"
    lines(tree, "-d", out, "--summary", text, code=BAD_INPUT)
    found = json.loads(text.read_text())
    none = dict.fromkeys(("INCOMPLETE", "NOT VERIFIED", "NOT SMOOTHED", "FAILED", "skipped", "not done"), 0)
    assert found["counts"] == {"PASSED": 3, "error": 1} | none
    failed, first = found["files"][:2]
    assert (failed["status"], failed["exit_code"], failed["corners"]) == ("error", BAD_INPUT, None)
    assert "bad.cls:9: error" in failed["reason"]
    assert first["output"] == str(out / "one.nc")
    assert first["blocks"] > first["corners"] >= first["smoothed"] > 0
    lines(tree, "-d", out, "--summary", table, code=BAD_INPUT)
    rows = list(csv.DictReader(table.read_text().splitlines()))
    assert [row["status"] for row in rows] == ["error", "skipped", "skipped", "skipped"]
    assert rows[1]["reason"] == "nothing has changed"
    for wrong in (["--summary", tmp_path / "s.txt", "-d", out], ["--summary", text]):
        assert run("smooth", tree / "one.cls", *wrong).returncode == USAGE


def test_a_batch_that_was_interrupted_goes_on_where_it_was(tmp_path: Path) -> None:
    """Whatever the moment, a run again makes what is missing and leaves the rest as it is."""
    bench = Bench(tmp_path, single=0, several=60)
    out = tmp_path / "out"
    words = [word for word in bench.words(True, out) if word != "--force"]
    for moment in share((0.5, 0.7), 2):
        process = forked(*words, stderr=subprocess.PIPE, start_new_session=True)
        try:
            process.wait(moment * bench.seconds[True])
        except subprocess.TimeoutExpired:
            process.send_signal(signal.SIGTERM)
        _, said = process.communicate()
        # -15: before Python took over the signal, or after it gave it back
        assert process.returncode in (0, 143, -signal.SIGTERM), said.decode()
    result = run(*words)
    counts = result.stderr.decode().splitlines()[-1]
    assert counts.startswith(f"{FILES} files: ")
    assert files_in(out) == bench.whole


def test_failures_and_warnings_are_told_once_more_at_the_end(tree: Path, tmp_path: Path) -> None:
    """Of three files with a warning each, and one that cannot be read."""
    (tree / "bad.cls").write_bytes(SMALL.replace(b"GOTO/10,10,0,0,0.1,1", b"GOTO/10,nan,0,0,0.1,1"))
    for name in ("one.cls", "a/two.NCL"):
        (tree / name).write_bytes(b"BREAKCHIPS/7\nBREAKCHIPS/7\n" + (tree / name).read_bytes())
    text, table = tmp_path / "s.json", tmp_path / "s.csv"
    said = lines(tree, "-d", tmp_path / "nc", "--summary", text, code=BAD_INPUT)
    failed = [line for line in said if line.startswith("error ")]
    assert len(failed) == 1
    assert re.fullmatch(r"error +.*bad\.cls:9: error: .*", failed[0])
    found = json.loads(text.read_text())
    counted = {line.split()[1] for line in said if line.startswith("warning   CS")}
    assert counted == set(found["warnings"])
    # each warning of a file is in its row, and the sum over the rows is that of the code
    for code, all_of_them in found["warnings"].items():
        counts = [row["warnings"][code] for row in found["files"] if code in row["warnings"]]
        assert (all_of_them["files"], all_of_them["count"]) == (len(counts), sum(counts))
    (own,) = [each for each in found["warnings"].values() if each["text"].startswith("unknown statement BREAKCHIPS")]
    assert (own["files"], own["count"]) == (2, 4)
    assert said.index(failed[0]) == len(said) - 2 - len(counted)
    assert said[-1].startswith("4 files: ")
    lines(tree, "-d", tmp_path / "nc", "--summary", table, "--force", code=BAD_INPUT)
    rows = {Path(row["source"]).name: row for row in csv.DictReader(table.read_text().splitlines())}
    assert re.search(r"\bCS\d+ 2\b", rows["one.cls"]["warnings"])
    assert rows["bad.cls"]["warnings"] == ""
    quiet = run("smooth", tree, "-d", tmp_path / "nc", "--force", "-q").stderr.decode()
    assert quiet.count("bad.cls") == 1


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_an_interrupted_batch_leaves_its_summary(jobs: str, tmp_path: Path) -> None:
    """The second of three files never ends, being a pipe that nobody writes to."""
    for name in ("a.cls", "c.cls"):
        (tmp_path / name).write_bytes(SMALL)
    os.mkfifo(tmp_path / "b.cls")
    sources = [tmp_path / f"{name}.cls" for name in "abc"]
    words = ["-d", tmp_path / "nc", "-j", jobs, "--summary", tmp_path / "s.json"]
    with started("smooth", *sources, *words) as process:
        done = [tmp_path / "nc" / f"{name}.nc" for name in ("a" if jobs == "1" else "ac")]
        deadline = time.monotonic() + 60
        while not all(path.exists() for path in done) and time.monotonic() < deadline:
            time.sleep(0.05)
        time.sleep(0.5)  # the row of a file follows the file
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=60)
    assert process.returncode == 130
    found = json.loads((tmp_path / "s.json").read_text())
    assert [row["status"] for row in found["files"]] == ["PASSED", "not done", ["not done", "PASSED"][jobs == "2"]]
    ended = said.decode().splitlines()
    assert ended[-1] == f"interrupted: {jobs} of 3 done; run again to continue"
    assert ended[-2].startswith(f"3 files: {jobs} PASSED")
    assert f"{3 - int(jobs)} not done" in ended[-2]
