"""A text that breaks its promise never takes the place of the output.

The paper's method is bound by its equation (10), not by the motion that a control executes: on a path whose axis turns
fast at a nearly straight tip it leaves ε, and verification finds it.
"""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from cornersmooth.cli import run

CL = """\
TOOL PATH/A,TOOL,B
LOAD/TOOL,1
RAPID
GOTO/0.,0.,50.,0.,0.,1.
FEDRAT/MMPM,1000.
GOTO/0.,0.,0.,0.,0.,1.
GOTO/10.,0.,0.,0.,0.5,0.8660254
GOTO/20.,0.1,0.,0.5,0.,0.8660254
GOTO/30.,0.,0.,0.,0.,1.
END-OF-PATH
"""


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
    assert f"{part}:8: error: " in said
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
