"""``cornersmooth compare``: every program of a control, as written, and the command of the best."""

from __future__ import annotations

import json
import re
import shlex
from dataclasses import replace
from pathlib import Path

import pytest

from cornersmooth.times.comparing import EQUAL, ROUGH, Row, Table, _leading
from oracle.command import run

#: a winding cut of a tool that turns, from a rapid
CUT = "".join(
    f"GOTO/{2.0 * k},{(k % 2) * 1.5},{0.1 * k},0.0,{0.02 * (k % 3):.6f},{(1.0 - (0.02 * (k % 3)) ** 2) ** 0.5:.9f}\n"
    for k in range(5)
)
PART = f"TOOL PATH/PART,TOOL,T\nFEDRAT/MMPM,1500.0\nRAPID\nGOTO/0.0,0.0,20.0,0.0,0.0,1.0\n{CUT}END-OF-PATH\n"


@pytest.fixture
def part(tmp_path: Path) -> Path:
    path = tmp_path / "part.cls"
    path.write_text(PART)
    return path


def test_every_row_is_a_program_and_the_best_is_marked_with_its_command(part: Path, tmp_path: Path) -> None:
    (tmp_path / "cornersmooth.toml").write_text("[controls.shop]\nlike = 'siemens'\n")
    given = ("compare", part, "-e", "0.0198765432", "--control", "shop", "--limits", "table-ac")
    done = run(*given, "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    rows = found["rows"]
    # g1: vectors and rotary words, two methods, three densities; bspline, poly: vectors and both methods; the paper's
    # method once in each form
    assert len(rows) == 2 * 2 * 3 + 2 + 2 + 3
    assert [row["form"] for row in rows if row["method"] == "zhang2016"] == ["g1", "bspline", "poly"]
    assert {row["verdict"] for row in rows} == {"PASSED"}
    assert all(row["tip"] <= 0.02 and row["axis_point"] <= 0.02 for row in rows)
    assert all(row["seconds"] + row["saved"] == pytest.approx(found["unsmoothed_seconds"]) for row in rows)
    (best,) = (row for row in rows if row["best"])
    assert not best["about"]  # only what cannot be the best keeps the time of a rough plan
    least = min(row["seconds"] for row in rows)
    equal = [row for row in rows if row["seconds"] <= 1.03 * least]
    assert best["bytes"] == min(row["bytes"] for row in equal)

    name, *words = shlex.split(best["command"])
    assert name == "cornersmooth"
    assert words[2:6] == ["--tolerance", "0.0198765432", "--control", "shop"]
    target = tmp_path / words[-1]
    said = run(*words[:-1], target, "--limits", "table-ac")
    assert said.returncode == 0, said.stderr
    assert target.suffix == ".mpf"
    times = re.search(r"time on table-ac (\d+\.\d) s instead of (\d+\.\d) s", said.stderr.decode())
    assert times
    assert float(times[2]) == round(found["unsmoothed_seconds"], 1)
    assert float(times[2]) - float(times[1]) == pytest.approx(best["saved"], abs=0.11)
    blocks = re.search(r", ([\d,]+) blocks from ", said.stderr.decode())
    assert blocks
    assert int(blocks[1].replace(",", "")) == best["blocks"]


def test_linuxcnc_by_its_own_law(part: Path) -> None:
    done = run("compare", part, "--control", "linuxcnc", "--machine", "xyzac-trt", "-v")
    assert done.returncode == 0, done.stderr
    said = done.stdout.decode()
    assert "law of lines: planner linuxcnc-2.9" in said
    assert "unsmoothed lines under G64 P0.01" in said
    (marked,) = (line for line in said.splitlines() if line.startswith("  cornersmooth "))
    assert re.search(r"^best of all: \d+\.\d s$", said, re.MULTILINE)
    assert "best in lines" not in said  # it has nothing else
    assert "--lines long" in marked
    assert "--machine xyzac-trt" in marked


def test_a_share_of_a_long_part_is_stated(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cornersmooth.times.comparing.MOST_POSES", 10)
    part = tmp_path / "long.cls"
    runs = "".join(f"RAPID\nGOTO/0.0,0.0,{20 + k}.0,0.0,0.0,1.0\n{CUT}" for k in range(5))
    part.write_text(PART.replace(CUT, runs))
    given = ("compare", part, "--control", "linuxcnc", "--machine", "xyzac-trt")
    done = run(*given, "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["share_of_poses"] == pytest.approx(6 / 31)  # a rapid and its cut
    assert "from 19 % of the poses" in run(*given).stdout.decode()


def test_limits_of_axes_are_asked_for(part: Path) -> None:
    done = run("compare", part)
    assert done.returncode == 2
    assert b"--limits" in done.stderr


def test_what_gains_nothing_is_left(part: Path) -> None:
    """A straight cut is as fast unsmoothed."""
    straight = "".join(f"GOTO/{2.0 * k},0.0,0.0,0.0,0.0,1.0\n" for k in range(5))
    part.write_text(PART.replace(CUT, straight))
    given = ("--control", "linuxcnc", "--machine", "xyzac-trt")
    done = run("compare", part, *given)
    assert done.returncode == 0, done.stderr
    assert "\nleave it as it is: no program takes less time than the unsmoothed lines\n" in done.stdout.decode()
    done = run("smooth", part, *given, "-o", part.with_suffix(".ngc"))
    assert done.returncode == 0, done.stderr
    assert "no time is gained, leave the program as it was" in done.stderr.decode()


def table(unsmoothed: float, *seconds: float) -> Table:
    row = Row("g1", "vectors", "proportional", "fine", (), "PASSED", 10, 100)
    rows = tuple(replace(row, seconds=one, saved=unsmoothed - one) for one in seconds)
    return Table(unsmoothed, "", 1.0, "", rows)


def test_gains_are_those_that_a_plan_can_tell() -> None:
    assert table(10.0, 12.0, 9.0).gains
    assert not table(10.0, 12.0, 10.04).gains


def test_rows_that_may_be_the_best_are_planned_closely() -> None:
    row = Row("g1", "vectors", "global", "fine", (), "PASSED", seconds=10.0, about=True)
    least, most = 10.0, 10.0 * EQUAL * (1.0 + ROUGH)
    rows = [
        row,
        replace(row, seconds=most),
        replace(row, seconds=most * 1.001),
        replace(row, lines="", seconds=9.0),
        replace(row, verdict="FAILED", seconds=1.0),
        replace(row, seconds=None),
        replace(row, seconds=least, about=False),
    ]
    assert _leading(rows) == [0, 1, 3]
