"""A text that breaks its promise never takes the place of the output, and one that is not verified says so.

The paper's method is bound by its equation (10), not by the motion that a control executes: on a path whose axis turns
fast at a nearly straight tip it leaves ε. It measures that and leaves such corners sharp; here it does not, and
verification finds it.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from cornersmooth.cli import run

CL = """\
TOOL PATH/A,TOOL,B
LOAD/TOOL,1
SPINDL/RPM,1000,CLW
RAPID
GOTO/0.,0.,50.,0.,0.,1.
FEDRAT/MMPM,1000.
GOTO/0.,0.,0.,0.,0.,1.
GOTO/10.,0.,0.,0.,0.5,0.8660254
GOTO/20.,0.1,0.,0.5,0.,0.8660254
GOTO/30.,0.,0.,0.,0.,1.
END-OF-PATH
"""


@pytest.fixture(autouse=True)
def careless(monkeypatch: pytest.MonkeyPatch) -> None:
    """The paper's method without a look at what it makes."""
    nothing = lambda smoothed: np.zeros(0, np.int64)  # noqa: E731
    monkeypatch.setattr("cornersmooth.smoothing.zhang2016._straying_transitions", nothing)
    monkeypatch.setattr("cornersmooth.smoothing.zhang2016._straying_remainders", nothing)


@pytest.fixture
def part(tmp_path: Path) -> Path:
    path = tmp_path / "part.cls"
    path.write_text(CL)
    return path


def test_broken_promise_leaves_the_old_file_and_says_where(part, tmp_path, capsys):
    out, story = tmp_path / "o.nc", tmp_path / "r.json"
    out.write_text("old")
    arguments = ["smooth", str(part), "-e", "0.01", "--method", "zhang2016", "-o", str(out), "--force"]
    assert run([*arguments, "--report", str(story)]) == 1
    assert out.read_text() == "old"
    rejected = tmp_path / "o.nc.rejected"
    assert rejected.read_text().endswith("M30\n%\n")
    said = capsys.readouterr().err
    assert f"{part}:9: error: " in said
    assert "the written text breaks its promise; the text is in" in said
    verification = json.loads(story.read_text())["verification"]
    assert not verification["passed"]
    assert verification["max_axis_point_deviation_mm"] > 0.01
    assert sorted(path.name for path in tmp_path.iterdir()) == ["o.nc", "o.nc.rejected", "part.cls", "r.json"]


def test_nothing_of_it_reaches_standard_output(part, capfdbinary):
    assert run(["smooth", str(part), "-e", "0.01", "--method", "zhang2016"]) == 1
    assert capfdbinary.readouterr().out == b""


def test_no_verify_writes_what_was_asked_for(part, tmp_path):
    out = tmp_path / "o.nc"
    arguments = ["smooth", str(part), "-e", "0.01", "--method", "zhang2016", "-o", str(out), "-q", "--no-verify"]
    assert run(arguments) == 0
    assert out.exists()


def test_the_default_method_keeps_the_promise_on_the_same_path(part, tmp_path):
    out = tmp_path / "o.nc"
    assert run(["smooth", str(part), "-e", "0.01", "-o", str(out), "-q"]) == 0
    assert out.exists()


@pytest.fixture
def own(tmp_path: Path) -> str:
    """A control whose last words nobody knows."""
    path = tmp_path / "own.toml"
    path.write_text('like = "siemens"\n[program]\nend = ["DIAMON", "M30"]\n')
    return str(path)


@pytest.mark.parametrize("quiet", [True, False])
def test_what_is_not_verified_is_never_silent(part, own, tmp_path, capsys, quiet):
    out = tmp_path / "o.mpf"
    lines = run(["smooth", str(part), "--control", own, "-o", str(out), *["-q"] * quiet])
    assert lines == 0
    last = len(out.read_text().splitlines()) - 1
    said = capsys.readouterr().err
    assert re.search(rf"NOT VERIFIED:? +DIAMON, NC line {last}; what your own table says of end", said)
    assert "verified    passed" not in said
    assert run(["smooth", str(part), "-o", str(out), "--force", "--no-verify", *["-q"] * quiet]) == 0
    assert "NOT VERIFIED" in capsys.readouterr().err


def test_a_batch_counts_what_is_not_verified(part, own, tmp_path, capsys):
    twin = tmp_path / "twin.cls"
    twin.write_text(CL)
    assert run(["smooth", str(part), str(twin), "--control", own, "-d", str(tmp_path / "out")]) == 0
    said = capsys.readouterr().err
    assert said.count("NOT VERIFIED: DIAMON, NC line") == 2
    assert said.endswith("2 files: 2 done, 2 NOT VERIFIED\n")


def test_verification_may_be_required(part, own, tmp_path, capsys):
    out = tmp_path / "o.mpf"
    out.write_text("old")
    arguments = ["smooth", str(part), "-o", str(out), "--force", "--require-verify"]
    assert run([*arguments, "--control", own]) == 1
    assert "error: the written text is not verified; the text is in" in capsys.readouterr().err
    assert out.read_text() == "old"
    assert (tmp_path / "o.mpf.rejected").exists()
    assert run([*arguments, "--no-verify"]) == 2
    assert run(arguments) == 0
    assert out.read_text() != "old"


@pytest.mark.parametrize(
    ("text", "options", "warning"),
    [
        ("UNITS/MM\nGOTO/1,2,3\nFINI\n", [], "there is no feed move from one pose to another: nothing is cut"),
        (
            "UNITS/MM\nRAPID\nGOTO/1,2,3\nRAPID\nGOTO/5,2,3\nFINI\n",
            [],
            "there is no feed move from one pose to another",
        ),
        (
            "FEDRAT/800,MMPM\nGOTO/1,2,3\nGOTO/1,3,3\nFINI\n",
            ["--units", "inch"],
            "the feeds are in mm per minute, the positions",
        ),
        (
            "UNITS/MM\nFEDRAT/800,MMPM\nGOTO/1,2,3\nGOTO/1,3,3\nGOTO/2,3,3\nFINI\n",
            ["-e", "9"],
            "the tolerance 9 mm is larger than the whole path",
        ),
    ],
)
def test_strange_requests_are_warned_of(text, options, warning, tmp_path, capsys):
    odd = tmp_path / "odd.cls"
    odd.write_text(text)
    run(["smooth", str(odd), "-o", str(tmp_path / "odd.nc"), *options])
    assert capsys.readouterr().err.count(f"odd.cls: warning: {warning}") == 1


def test_nothing_is_strange_about_a_usual_file(part, tmp_path, capsys):
    assert run(["smooth", str(part), "-o", str(tmp_path / "o.nc")]) == 0
    assert "warning" not in capsys.readouterr().err
