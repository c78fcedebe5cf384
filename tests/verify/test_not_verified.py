"""What is not looked at is said, and so is what cannot be measured."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cornersmooth.cli import run
from cornersmooth.model import Program
from cornersmooth.nc_reader import read_nc
from cornersmooth.verify import verify

from .writing import encode, job, simple_text


def test_words_of_a_text_that_is_read_already_are_not_verified() -> None:
    program, lines = job("g1")
    data = encode(lines)
    found = verify(program, read_nc(data), tolerance=0.02, axis_length=10.0)
    assert found.unverified.startswith("the words of the text")
    assert found.to_dict()["not_verified"] == found.unverified
    assert verify(program, data, tolerance=0.02, axis_length=10.0).unverified == ""


def test_half_turns_are_named_whatever_the_text_says() -> None:
    tip = np.array([[0.0, 0, 0], [10, 0, 0], [20, 0, 0], [30, 0, 0]])
    axis = np.array([[0.0, 0, 1], [0, 0, 1], [0.01, 0, -1], [0, 0, -1]])
    program = Program.from_poses(tip, axis, feed=250.0, line=np.arange(5, 9))
    text = simple_text(tip, axis / np.linalg.norm(axis, axis=1)[:, None], 0.02, 10.0, "g1")
    found = verify(program, text, tolerance=0.02, axis_length=10.0)
    assert [(problem.code, problem.cl_line) for problem in found.problems if problem.code == "CS526"] == [("CS526", 7)]
    assert not found.passed


def test_the_command_says_so_even_if_quiet(tmp_path: Path, capsys) -> None:
    part, own, text = tmp_path / "part.cls", tmp_path / "own.toml", tmp_path / "part.nc"
    part.write_text(
        "LOADTL/1\nSPINDL/RPM,900,CLW\nFEDRAT/MMPM,500\nRAPID\nGOTO/0,0,9,0,0,1\nGOTO/0,0,0\nGOTO/10,0,0\nFINI\n"
    )
    own.write_text('name = "own"\nlike = "fanuc"\n[words]\nspindle_off = ["M50"]\n')
    assert run(["smooth", str(part), "-o", str(text), "--control", str(own), "-q"]) == 0
    capsys.readouterr()
    assert run(["verify", str(part), str(text), "--control", str(own), "-q"]) == 1
    assert capsys.readouterr().err.startswith(f"{text}: NOT VERIFIED, 3 to check: M50, NC line ")


def test_a_program_without_any_feed_is_not_passed(tmp_path: Path, capsys) -> None:
    part, text = tmp_path / "part.cls", tmp_path / "part.nc"
    part.write_text("LOADTL/1\nSPINDL/RPM,900,CLW\nRAPID\nGOTO/0,0,9,0,0,1\nGOTO/0,0,0\nGOTO/10,0,0\nFINI\n")
    for control in ("fanuc", "siemens", "heidenhain"):
        assert run(["smooth", str(part), "-o", str(text), "--control", control, "-q", "--force"]) == 0
        assert "NOT VERIFIED" in capsys.readouterr().err
        assert run(["verify", str(part), str(text)]) == 1
        assert "no F before the first feed move" in capsys.readouterr().out
    assert run(["smooth", str(part), "-o", str(text), "-q", "--force", "--feed", "500"]) == 0
    assert run(["verify", str(part), str(text), "-q"]) == 0
    with_feed = part.read_text().replace("RAPID", "FEDRAT/500,MMPM\nRAPID")
    part.write_text(with_feed)
    assert run(["smooth", str(part), "-o", str(text), "-q", "--force"]) == 0
    assert run(["verify", str(part), str(text), "-q"]) == 0
