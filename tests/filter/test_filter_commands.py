"""Finished programs in `time`, `compare`, `verify` and on the page."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

import cornersmooth as cs
from cornersmooth.errors import Verdict
from cornersmooth.filter import filter_program
from filter.programs import PROGRAMS
from oracle.command import BAD_INPUT, DONE, USAGE, run
from page.making import values_of

LINUXCNC = ("--control", "linuxcnc", "--machine", "xyzac-trt")
FANUC = ("--control", "fanuc", "--machine", "table-ac")
EPS = ("-e", "0.02")


def written(folder: Path, name: str) -> Path:
    path = folder / "part.nc"
    lines = PROGRAMS[name][2].splitlines(keepends=True)
    if PROGRAMS[name][0] == "linuxcnc":  # the law of its planner is known for lines only
        lines = [line for line in lines if not line.startswith("G2 ")]
    path.write_text("".join(lines), newline="")
    return path


def name_of(control: str, machine: str) -> str:
    return next(name for name, one in PROGRAMS.items() if one[:2] == (control, machine))


@pytest.mark.parametrize("how", [FANUC, LINUXCNC])
def test_time_of_a_program_as_it_is_and_smoothed(how: tuple[str, ...], tmp_path: Path) -> None:
    part, new = written(tmp_path, name_of(how[1], how[3])), tmp_path / "new.nc"
    told = run("time", part, *how, *EPS, "--json")
    assert told.returncode == DONE, told.stderr
    times = json.loads(told.stdout)
    seconds = times["seconds"]
    assert times["cuts"] > 20
    assert seconds["as_written"] > 0.0
    # 24 turns to and fro: who need not brake at them is faster; LinuxCNC blends lines itself
    assert times["smoothed"] == (0 if how is LINUXCNC else times["cuts"])
    assert seconds["as_written"] <= (1.0 if how is LINUXCNC else 0.95) * seconds["unsmoothed"]
    assert run("filter", part, *how, *EPS, "--limits", how[3], "-o", new).returncode == DONE
    beside = json.loads(run("time", part, "--text", new, *how, *EPS, "--json").stdout)
    assert beside["seconds"] == pytest.approx(seconds)
    assert b"as it is" in run("time", part, *how, *EPS).stdout


def test_time_beside_a_program_of_another_tolerance_says_what_to_give(tmp_path: Path) -> None:
    part = written(tmp_path, "linuxcnc, G91")
    on = ("--lines", "dense", "-e", "0.05", "-o", "new.nc")
    assert run("filter", part, *LINUXCNC, *on, cwd=tmp_path).returncode == DONE
    told = run("time", part, "--text", "new.nc", *LINUXCNC, "-e", "0.005", cwd=tmp_path)
    assert told.returncode == 1
    assert b"CS521" in told.stderr
    assert b"hint: no time is given: give -e and -H as the second program was made" in told.stderr
    told = run("time", part, "--text", "new.nc", *LINUXCNC, "-e", "0.05", cwd=tmp_path)
    assert told.returncode == DONE, told.stderr


def test_time_beside_a_program_that_is_another_one(tmp_path: Path) -> None:
    part, new = written(tmp_path, "fanuc words"), tmp_path / "new.nc"
    new.write_bytes(part.read_bytes().replace(b"T1 M6", b"T2 M6"))
    told = run("time", part, "--text", new, *FANUC)
    assert told.returncode == 1
    assert b"CS591" in told.stderr
    assert b"hint: no time is given" not in told.stderr
    arc = tmp_path / "arc.nc"
    arc.write_text(PROGRAMS["linuxcnc, G64, an arc inside"][2].replace("G2 X60 Y5 I5 J0", "G33 X60 K1"))
    told = run("time", arc, *LINUXCNC)
    assert told.returncode == BAD_INPUT
    assert f"{arc}:16: error[CS264]".encode() in told.stderr


@pytest.mark.parametrize("how", [FANUC, LINUXCNC])
def test_compare_tries_every_way(how: tuple[str, ...], tmp_path: Path) -> None:
    part = written(tmp_path, name_of(how[1], how[3]))
    lines = part.read_text().splitlines(keepends=True)
    cuts = [k for k, line in enumerate(lines) if line.upper().startswith("G1 ")]
    part.write_text("".join(lines[: cuts[8]] + lines[cuts[-1] + 1 :]))
    table = json.loads(run("compare", part, *how, *EPS, "--json").stdout)
    rows = table["rows"]
    assert table["unsmoothed"] == "the program as it is"
    assert table["share_of_poses"] == 1.0
    assert {row["method"] for row in rows} == {"proportional", "global"}
    assert {row["words"] for row in rows} == {f"rotary words of {how[3]}"}
    assert {row["verdict"] for row in rows if row["seconds"] is not None} == {"PASSED"}
    best = next(row for row in rows if row["best"])
    assert best["saved"] == pytest.approx(table["unsmoothed_seconds"] - best["seconds"])
    words = best["command"].split()
    assert words[:2] == ["cornersmooth", "filter"]
    words[words.index("-o") + 1] = str(tmp_path / "best.nc")
    assert run(*words[1:]).returncode == DONE
    assert len((tmp_path / "best.nc").read_bytes()) == best["bytes"]


def test_time_of_a_program_in_which_nothing_can_be_smoothed(tmp_path: Path) -> None:
    part = tmp_path / "part.nc"
    part.write_text(written(tmp_path, "fanuc words").read_text().replace("G43.4", "G43"))
    for command in ("time", "compare"):
        told = run(command, part, *FANUC)
        assert told.returncode == USAGE
        assert f"{part}: error[CS266]".encode() in told.stderr
    text = "G21 G90 G94\nM428\nG0 X0 Y0 Z9 A0 C0\nG1 X60 F600\nM429\nM30\n"  # 60 mm at 10 mm/s, and ramps
    part.write_text(text)
    seconds = json.loads(run("time", part, *LINUXCNC, "--json").stdout)["seconds"]
    assert seconds["unsmoothed"] == seconds["as_written"] == pytest.approx(6.0, abs=0.1)


@pytest.mark.parametrize(
    ("old", "new_words"), [("G2 X60 Y5 I5 J0", "G33 X60 K1"), ("G2 X60", "G81 R2 Z-1\nG80\nG2 X60")]
)
def test_a_program_without_a_time_gets_the_fewest_blocks(old: str, new_words: str, tmp_path: Path) -> None:
    arc, new = tmp_path / "arc.nc", tmp_path / "new.nc"
    arc.write_text(PROGRAMS["linuxcnc, G64, an arc inside"][2].replace(old, new_words))
    limited = run("filter", arc, *LINUXCNC, "--limits", "xyzac-trt", "-o", new)
    plain = run("filter", arc, *LINUXCNC, "-o", tmp_path / "plain.nc")
    assert limited.returncode == plain.returncode == DONE
    assert f"{arc}:16: warning: {new_words[:3]}: the law of LinuxCNC".encode() in limited.stderr
    assert new.read_bytes() == (tmp_path / "plain.nc").read_bytes()


def test_compare_looks_at_a_part_of_a_long_program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cornersmooth.filter.program.MOST_POSES", 30)
    monkeypatch.setattr("cornersmooth.filter.program._BY_LAW", 1)
    part = written(tmp_path, name_of(LINUXCNC[1], LINUXCNC[3]))
    head, _, rest = part.read_text().partition("G0 X0")
    cuts, _, tail = ("G0 X0" + rest).partition("G0 Z50")
    part.write_text(head + "".join(f"{cuts}G0 Z20\n" for _ in range(5)) + "G0 Z50" + tail)
    table = json.loads(run("compare", part, *LINUXCNC, "--json").stdout)
    assert table["share_of_poses"] == pytest.approx(0.2)


def test_page_shows_runs_before_and_after(tmp_path: Path) -> None:
    part, new, page = written(tmp_path, "fanuc words"), tmp_path / "new.nc", tmp_path / "page.html"
    for command in (("filter", part, *DENSE, "-o", new), ("verify", part, new)):
        assert run(*command, *FANUC, *EPS, "--report", page, "--force").returncode == DONE
        text = page.read_text()
        assert '"origin": "old"' in text
        assert "old program" in text
        assert "PASSED" in text
        meta = values_of(text)[0]
        assert meta["corners"] is None
        assert [one["first"] for one in meta["runs"]] == sorted(one["first"] for one in meta["runs"])
        assert meta["runs"]


def test_options_of_cl_files_are_refused(tmp_path: Path) -> None:
    part, cl = written(tmp_path, "fanuc words"), tmp_path / "part.cls"
    cl.write_text("GOTO/0,0,0,0,0,1\nGOTO/10,0,0,0,0,1\nFINI\n")
    for command in ("time", "compare"):
        told = run(command, part, *FANUC, "--lenient")
        assert told.returncode == USAGE
        assert b"--lenient is for CL files" in told.stderr
        told = run(command, cl, *FANUC, "--tip-control")
        assert told.returncode == USAGE
        assert b"--tip-control is for NC programs" in told.stderr
    assert run("time", part, *FANUC, "--csv", tmp_path / "t.csv").returncode == USAGE
    told = run("time", part, "--control", "fanuc")
    assert told.returncode == USAGE
    assert b"--limits" in told.stderr


DENSE = ("--lines", "dense")
PLAIN = "G21 G90 G94 G17\nG0 X0. Y0. Z5.\nG1 Z-1. F200.\n{}G0 Z5.\nM30\n"
CUTS = "X10. Y0.\nX20. Y5.\nX30. Y0.\n"
THREE_AXES = Path(__file__).parents[2] / "samples" / "machines" / "three-axis.toml"


@pytest.mark.parametrize("more", [(), ("--no-verify",)])
def test_nothing_smoothed_is_a_verdict_of_its_own(more: tuple[str, ...], tmp_path: Path) -> None:
    (tmp_path / "part.nc").write_text(PLAIN.format("G2 X10. R9.\nG95\n" + CUTS))
    on = ("part.nc", "--machine", THREE_AXES, "-e", 0.01, "-o", "new.nc", *more)
    made = run("filter", *on, cwd=tmp_path)
    assert made.returncode == DONE
    assert made.stderr.decode().startswith("NOT SMOOTHED  new.nc")
    assert (tmp_path / "new.nc").read_bytes() == (tmp_path / "part.nc").read_bytes()
    report = json.loads(run("filter", *on, "--force", "--json", cwd=tmp_path).stdout)
    assert report["verdict"] == "NOT SMOOTHED"
    assert report["verdict_text"].startswith("NOT SMOOTHED: 0 of 5 cuts smoothed")
    if more:
        return
    strict = run("filter", *on, "--force", "--strict", cwd=tmp_path)
    assert strict.returncode == 1
    assert (tmp_path / "new.nc.failed").exists()
    same = run("verify", "part.nc", "new.nc.failed", "--machine", THREE_AXES, cwd=tmp_path)
    assert same.returncode == DONE
    assert same.stdout.startswith(b"PASSED")


def test_a_batch_counts_what_became_of_its_programs(tmp_path: Path) -> None:
    (tmp_path / "arc.nc").write_text(PLAIN.format("G2 X10. R9.\n"))
    (tmp_path / "cuts.nc").write_text(PLAIN.format(CUTS))
    (tmp_path / "part.cls").write_text("PARTNO A\nUNITS/MM\nGOTO/0,0,0\nGOTO/1,0,0\nFINI\n")
    made = run("filter", "arc.nc", "cuts.nc", "part.cls", "--machine", THREE_AXES, *DENSE, "-d", "out", cwd=tmp_path)
    assert made.returncode == BAD_INPUT
    assert made.stderr.decode().splitlines()[-1] == "3 programs: 1 NOT SMOOTHED, 1 PASSED, 1 error"


@pytest.mark.parametrize(
    "text",
    [
        "PARTNO A\nUNITS/MM\nFEDRAT/500,MMPM\nGOTO/0,0,0\nGOTO/1,0,0\nFINI\n",
        "TOOL PATH/A,TOOL,B\nGOTO/0,0,0,0,0,1\n",
        "$$ a comment\nGOTO / 0.0, 0.0, 0.0\n",
        "x,y,z,i,j,k\n0,0,0,0,0,1\n1,0,0,0,0,1\n",
        "# points\n0.0 0.0 0.0\n1.0 0.0 0.5\n",
        "0;0;0\n1;0;0.5\n",
    ],
)
def test_a_cl_file_is_no_program_to_filter(text: str, tmp_path: Path) -> None:
    (tmp_path / "part.txt").write_text(text)
    refused = run("filter", "part.txt", "-o", "new.nc", cwd=tmp_path)
    assert refused.returncode == BAD_INPUT
    assert b"this is a CL file, not an NC program" in refused.stderr
    assert b"cornersmooth smooth" in refused.stderr
    assert not (tmp_path / "new.nc").exists()


def test_jumps_of_programs_are_no_statements_of_cl_files(tmp_path: Path) -> None:
    """GOTO of FANUC's macros, and RAPID as the name of a subprogram."""
    (tmp_path / "part.nc").write_text(PLAIN.format(CUTS + "GOTO 5\nN5 G0 Z5.\n") + "RAPID\n")
    made = run("filter", "part.nc", "--machine", THREE_AXES, *DENSE, "-o", "new.nc", cwd=tmp_path)
    assert made.returncode == DONE
    assert made.stderr.startswith(b"PASSED")
    assert b"an NC program" in run("info", "part.nc", cwd=tmp_path).stdout


@pytest.mark.parametrize(
    ("word", "total"),
    [
        ("G64 P0.02 Q0.01", "0.04 mm {} (0.01 + 0.02 at corners + 0.01 where lines are merged)"),
        ("G64 P0.02", "0.05 mm {} (0.01 + 0.02 at corners + 0.02 where lines are merged)"),
        ("G64 P0.02 Q0", "0.03 mm {} (0.01 + 0.02 at corners)"),
        ("G61", ""),
    ],
)
def test_blending_of_the_program_is_added_in_the_first_line(word: str, total: str, tmp_path: Path) -> None:
    (tmp_path / "part.ngc").write_text(f"{word}\n" + PLAIN.format(CUTS))
    on = ("--control", "linuxcnc", "--machine", THREE_AXES, "-e", 0.01)
    report = json.loads(run("filter", "part.ngc", *on, *DENSE, "-o", "new.ngc", "--json", cwd=tmp_path).stdout)
    more = f"; {total.format('with the tolerance of the program itself')}" * bool(total)
    assert report["verdict"] == "PASSED"
    assert re.search(r"tip [\d.e-]+ mm, axis point [\d.e-]+ mm(.*)$", report["verdict_text"])[1] == more


@pytest.mark.parametrize(
    ("control", "before", "total"),
    [
        ("siemens", "CYCLE832(0.01,_FINISH,1)", "0.02"),
        ("siemens", "CTOL=0.03", "0.04"),
        ("heidenhain", "CYCL DEF 32.0 TOLERANCE\nCYCL DEF 32.1 T0.05", "0.06"),
        ("haas", "G187 P3 E0.025", "0.035"),
    ],
)
def test_the_tolerance_of_the_program_is_added(control: str, before: str, total: str) -> None:
    form = cs.choose_form(control, "g1", machine=cs.load_machine(THREE_AXES))
    text = PLAIN.format(CUTS).replace("G21", "G710" if control == "siemens" else "G21")
    lines = [line for line in text.splitlines() if "%" not in line]
    if control == "heidenhain":
        axes = [
            re.sub(r"([XYZ])(?=\d)", r"\1+", re.findall(r"^(?:G1 )?([XYZ].*)", line)[0]) for line in CUTS.splitlines()
        ]
        lines = [
            "BEGIN PGM A MM",
            "TOOL CALL 1 Z S900",
            "L X+0 Y+0 Z+5 FMAX",
            "L Z+0 F300",
            *(f"L {one}" for one in axes),
        ]
    found = filter_program("\n".join((before, *lines, "")).encode(), form, cs.Settings(tolerance=0.01, lines="dense"))
    assert found.verdict is Verdict.PASSED
    assert 0.01 + found.rounding == pytest.approx(float(total))


def test_blocks_that_come_too_late_are_to_check(tmp_path: Path) -> None:
    """0.03 mm at 6 m/min are 0.3 ms, and Haas takes a block in 1 ms."""
    x = [0.03 * k for k in range(1, 81)]
    cuts = "".join(f"X{a:.3f} Y{0.03 * (k % 2):.3f}\n" for k, a in enumerate(x))
    for feed, checks in ((6000, b"PASSED, 1 to check"), (60, b"PASSED  ")):
        (tmp_path / "part.nc").write_text(PLAIN.format(f"F{feed}.\n{cuts}"))
        made = run(
            "filter", "part.nc", "--control", "haas", *DENSE, "-e", 0.005, "-o", "new.nc", "--force", cwd=tmp_path
        )
        assert made.stderr.startswith(checks)
        assert (b"blocks come faster than one in 1 ms" in made.stderr) is (feed == 6000)


def test_what_smooth_wrote_has_no_more_lines(tmp_path: Path) -> None:
    sample = Path(__file__).parents[2] / "samples" / "impeller.cls"
    assert run("smooth", sample, *LINUXCNC, *EPS, "-o", "part.ngc", cwd=tmp_path).returncode == DONE
    assert run("filter", "part.ngc", *LINUXCNC, *EPS, "-o", "new.ngc", cwd=tmp_path).returncode == DONE
    before, after = ((tmp_path / name).read_bytes().count(b"\n") for name in ("part.ngc", "new.ngc"))
    assert after <= before


def test_a_control_and_a_machine_of_the_shop_settings_are_taken(tmp_path: Path) -> None:
    written(tmp_path, name_of(FANUC[1], FANUC[3]))
    (tmp_path / "cornersmooth.toml").write_text(
        "[smooth]\ncontrol = 'shop'\nmachine = 'mill'\n"
        f"[controls.shop]\nlike = 'fanuc'\n[machines.mill]\nlike = '{FANUC[3]}'\n"
    )
    own = run("filter", "part.nc", *EPS, "-o", "own.nc", cwd=tmp_path)
    assert own.returncode == DONE, own.stderr
    assert b"own.nc  shop g1, mill" in own.stderr
    assert run("filter", "part.nc", *FANUC, *EPS, "-o", "new.nc", cwd=tmp_path).returncode == DONE
    assert (tmp_path / "own.nc").read_bytes() == (tmp_path / "new.nc").read_bytes()
