"""Statements between poses that cut on: corners beside those that move nothing are rounded, the others are counted."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import pytest

from cornersmooth.cl import read
from cornersmooth.report.verdict import other_corners
from cornersmooth.smoothing import smooth
from oracle.command import DONE, run

HEAD = "UNITS/MM\nLOADTL/1\nSPINDL/RPM,1000,CLW\nFEDRAT/500,MMPM\nRAPID\nGOTO/0,0,0,0,0,1\nMULTAX/ON\n"
POSES = ((10, 0), (20, 5), (30, 0), (40, 8), (50, 0))
FORMS = {
    "g1": (),
    "g6.2": ("-f", "g6.2"),
    "long": ("--lines", "long"),
    "bspline": ("--control", "siemens", "-f", "bspline"),
    "heidenhain": ("--control", "heidenhain"),
    "linuxcnc": ("--control", "linuxcnc", "--machine", "xyzac-trt"),
}


def zigzag(*said: str) -> bytes:
    """Feed moves with four corners, and the statements before every move."""
    lines = "".join("".join(f"{one}\n" for one in said) + f"GOTO/{x},{y},0\n" for x, y in POSES)
    return f"{HEAD}{lines}FINI\n".encode()


def smoothed(tmp_path: Path, data: bytes, *options: str) -> tuple[dict, str, str]:
    """The report, the NC program, and what the terminal says."""
    out, report = tmp_path / "out.nc", tmp_path / "report.json"
    done = run("smooth", "-", "-o", out, "--force", "--report", report, *options, data=data)
    assert done.returncode == DONE, done.stderr
    return json.loads(report.read_text()), out.read_text(), done.stderr.decode()


@pytest.mark.parametrize("method", ["proportional", "global"])
@pytest.mark.parametrize("form", FORMS)
def test_words_that_move_nothing_do_not_end_a_run(tmp_path: Path, form: str, method: str) -> None:
    data = zigzag("ISN/7", "UNITS/MM", "TLAXIS/0,0,1", "WHATEVER/1")
    contents, program, told = smoothed(tmp_path, data, "--method", method, *FORMS[form])
    summary = contents["summary"]
    assert (summary["corners"], summary["smoothed"], summary["sharp"]) == (4, 4, 0)
    assert "no corner stays sharp" in told
    assert contents["verification"]["passed"]
    assert program.count("ISN/7") == program.count("WHATEVER/1") == len(POSES)


@pytest.mark.parametrize(
    "word", ["SEQNO/100", "LINTOL/ON", "MULTAX/ON", "CSI_SET_PATH/1", "MODE/MILL", "PPRINT HERE", "TOLER/0.01"]
)
def test_a_comment_is_written_at_its_place(tmp_path: Path, word: str) -> None:
    contents, program, _ = smoothed(tmp_path, zigzag(word))
    assert (contents["summary"]["smoothed"], contents["summary"]["sharp"]) == (4, 0)
    text = word.removeprefix("PPRINT ")
    behind, tip = [], (0.0, 0.0)
    for line in program.splitlines():
        if line == f"({text})":
            behind.append(tip)
        elif found := re.match(r"G[01] X(\S+) Y(\S+)", line):
            tip = float(found[1]), float(found[2])
    behind = behind[-len(POSES) :]  # MULTAX stands in the head, too
    away = [math.dist(*pair) for pair in zip(behind, ((0, 0), *POSES), strict=False)]
    assert max(away) < 0.02  # the middle of a rounded corner
    assert min(away[1:]) > 0.0


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("method", ["proportional", "global"])
def test_corners_at_which_a_statement_acts_stay_sharp_and_are_counted(tmp_path: Path, form: str, method: str) -> None:
    words = ("DELAY/1.5", "SPINDL/RPM,1200,CLW", "COOLNT/ON", "OPSTOP", "AUXFUN/55")
    lines = "".join(f"{word}\nGOTO/{x},{y},0\n" for word, (x, y) in zip(words, POSES, strict=True))
    data = f"{HEAD}{lines}ISN/1\nGOTO/60,8,0\nGOTO/70,0,0\nFINI\n".encode()
    contents, _, told = smoothed(tmp_path, data, "--method", method, *FORMS[form])
    summary = contents["summary"]
    assert (summary["corners"], summary["smoothed"], summary["sharp"]) == (6, 2, 4)
    assert summary["not_smoothed"] == {"statement": 4}
    assert [(corner["line"], corner["status"]) for corner in contents["sharp"]] == [
        (line, "statement") for line in (9, 11, 13, 15)
    ]
    assert "4 corners stay sharp, first :9 statement 27" in told
    assert contents["verification"]["passed"]


@pytest.mark.parametrize("word", ["STOP", "CLAMP/1", "INSERT M55", "LOADTL/2", "CUTCOM/OFF", "AUXFUN/55"])
def test_the_pose_of_a_statement_that_acts_is_passed_exactly(tmp_path: Path, word: str) -> None:
    data = f"{HEAD}GOTO/10,0,0\nGOTO/20,5,0\nGOTO/20,5,0\n{word}\nGOTO/30,0,0\nGOTO/40,8,0\nFINI\n".encode()
    contents, program, _ = smoothed(tmp_path, data)
    assert contents["summary"]["not_smoothed"] == {"statement": 1, "duplicate": 1}
    assert contents["summary"]["smoothed"] == 2
    assert "X20.0000 Y5.0000 Z0.0000" in program


def test_a_statement_on_a_straight_line_leaves_no_corner(tmp_path: Path) -> None:
    data = f"{HEAD}GOTO/10,0,0\nDELAY/1\nGOTO/20,0,0\nFINI\n".encode()
    contents, _, told = smoothed(tmp_path, data)
    assert contents["summary"]["sharp"] == 0
    assert contents["sharp"] == []
    assert "no corner stays sharp" in told


def test_a_rapid_that_leads_nowhere_leaves_a_sharp_corner(tmp_path: Path) -> None:
    cl = "GOTO/10,0,0\nRAPID\nGOTO/10,0,0\nGOTO/10,20,0\nRAPID\nGOTO/10,20,9\nGOTO/10,20,0\nGOTO/0,0,0\nFINI\n"
    contents, _, _ = smoothed(tmp_path, f"{HEAD}{cl}".encode())
    assert contents["summary"]["sharp"] == 1  # the second rapid ends the cut
    assert [(one["line"], one["status"], round(one["turn_deg"])) for one in contents["sharp"]] == [(8, "rapid", 90)]


def test_arcs_that_meet_lines_and_arcs_at_an_angle_are_sharp_corners(tmp_path: Path) -> None:
    # a half circle leaves the line at a right angle, the next arc leaves it at one again, and ends along its line
    cl = (
        f"{HEAD}GOTO/10,0,0\nCIRCLE/20,0,0,0,0,1,10\nGOTO/30,0,0\nGOTO/30,0,0\nCIRCLE/30,10,0,0,0,1,10\nGOTO/40,10,0\n"
        "GOTO/40,20,0\nFINI\n"
    ).encode()
    contents, _, told = smoothed(tmp_path, cl)
    assert contents["summary"]["sharp"] == 2
    assert [(one["line"], one["status"], round(one["turn_deg"], 6)) for one in contents["sharp"]] == [
        (8, "arc", 90.0),
        (10, "arc", 90.0),
    ]
    assert "2 corners stay sharp, first :8 arc 90" in told
    program = read(cl)
    assert other_corners(program, 10.0).pose.tolist() == [1, 2]
    assert len(smooth(program).corners) == 0
