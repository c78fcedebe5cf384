"""A program that FAILED never takes the place of the output; each verdict is told in the first line.

The paper's method is bound by its equation (10), not by the motion that a control executes: on a path whose axis turns
fast at a nearly straight tip it leaves ε. It measures that and leaves such corners sharp; here it does not, and
verification finds it.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from careless import look_away
from cornersmooth.cli import run
from oracle.files import sample
from oracle.messages import one_line

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


@pytest.fixture
def careless(monkeypatch: pytest.MonkeyPatch) -> None:
    """The paper's method without a look at what it makes."""
    look_away(monkeypatch)


@pytest.fixture
def part(tmp_path: Path) -> Path:
    path = tmp_path / "part.cls"
    path.write_text(CL)
    return path


@pytest.mark.usefixtures("careless")
def test_a_failed_program_leaves_the_old_file_and_says_where(part, tmp_path, capsys):
    out, story = tmp_path / "o.nc", tmp_path / "r.json"
    out.write_text("old")
    arguments = ["smooth", str(part), "-e", "0.01", "--method", "zhang2016", "-o", str(out), "--force"]
    assert run([*arguments, "--report", str(story)]) == 1
    assert out.read_text() == "old"
    failed = tmp_path / "o.nc.failed"
    assert failed.read_text().endswith("M30\n%\n")
    said = one_line(capsys.readouterr().err)
    assert said.startswith("FAILED  ")
    assert f"{part}:9: error: " in said
    assert "the verdict is FAILED; the program is in" in said
    contents = json.loads(story.read_text())
    verification = contents["verification"]
    assert contents["verdict"] == verification["verdict"] == "FAILED"
    verdict, what = said.splitlines()[:2]
    assert contents["verdict_text"] == f"{verdict.partition('  ')[0]}: {what.strip()}"
    assert verification["max_axis_point_deviation_mm"] > 0.01
    assert sorted(path.name for path in tmp_path.iterdir()) == ["o.nc", "o.nc.failed", "part.cls", "r.json"]


@pytest.mark.usefixtures("careless")
def test_nothing_of_it_reaches_standard_output(part, capfdbinary):
    assert run(["smooth", str(part), "-e", "0.01", "--method", "zhang2016"]) == 1
    assert capfdbinary.readouterr().out == b""


@pytest.mark.usefixtures("careless")
def test_no_verify_writes_what_was_asked_for(part, tmp_path):
    out = tmp_path / "o.nc"
    arguments = ["smooth", str(part), "-e", "0.01", "--method", "zhang2016", "-o", str(out), "-q", "--no-verify"]
    assert run(arguments) == 0
    assert out.exists()


def test_the_default_method_keeps_the_tolerance_on_the_same_path(part, tmp_path):
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
    assert re.search(
        rf"^({part}: )?NOT VERIFIED, \d to check(: |  .*\n +)DIAMON, NC line {last}(; |\n +)the rest within 0.01 mm",
        said,
    )
    assert "PASSED" not in said
    assert run(["smooth", str(part), "-o", str(out), "--force", "--no-verify", *["-q"] * quiet]) == 0
    assert "NOT VERIFIED" in capsys.readouterr().err


def test_a_batch_counts_what_is_not_verified(part, own, tmp_path, capsys):
    twin = tmp_path / "twin.cls"
    twin.write_text(CL)
    assert run(["smooth", str(part), str(twin), "--control", own, "-d", str(tmp_path / "out")]) == 0
    said = capsys.readouterr().err
    assert [
        line.split(",")[0] for line in said.splitlines() if " DIAMON, NC line" in line and "warning" not in line
    ] == ["NOT VERIFIED"] * 2
    assert said.endswith("2 files: 2 NOT VERIFIED (2 to check)\n")
    assert run(["smooth", str(part), str(twin), "--control", own, "-d", str(tmp_path / "out")]) == 0
    said = capsys.readouterr().err
    assert said.count("nothing has changed; NOT VERIFIED, ") == 2
    assert said.endswith("2 files: 2 skipped (2 NOT VERIFIED)\n")


def test_strict_takes_passed_alone(part, own, tmp_path, capsys):
    out = tmp_path / "o.mpf"
    out.write_text("old")
    arguments = ["smooth", str(part), "-o", str(out), "--force", "--strict"]
    assert run([*arguments, "--control", own]) == 1
    assert "error: the verdict is NOT VERIFIED; the program is in" in one_line(capsys.readouterr().err)
    assert out.read_text() == "old"
    assert (tmp_path / "o.mpf.failed").exists()
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
    check = rf"^CHECK   (?:CL line \d+: )?{re.escape(warning)}"
    assert len(re.findall(check, capsys.readouterr().err, re.MULTILINE)) == 1


def test_nothing_is_strange_about_a_usual_file(part, tmp_path, capsys):
    assert run(["smooth", str(part), "-o", str(tmp_path / "o.nc")]) == 0
    assert "warning" not in capsys.readouterr().err


def first_lines(capsys: pytest.CaptureFixture[str], *words: object) -> tuple[int, str]:
    code = run([str(word) for word in words])
    told = capsys.readouterr()
    return code, " ".join((told.out + told.err).splitlines()[:2])


def test_a_hole_that_is_left_out_makes_the_program_incomplete(tmp_path, capsys):
    source, out, story, table = (tmp_path / name for name in ("hole.cls", "hole.nc", "hole.json", "hole.csv"))
    tap = "CYCLE/TAP,3.0,IPR,1.0,CLEAR,2.0\nGOTO/10,0,0\nGOTO/20,0,0\nCYCLE/OFF\n"
    source.write_text(
        f"UNITS/MM\nLOADTL/1\nSPINDL/RPM,900,CLW\nRAPID\nGOTO/5,0,10\nFEDRAT/100,MMPM\n{tap}RAPID\nGOTO/0,0,50\nFINI\n"
    )
    options = ("-o", out, "--report", story, "--skip-cycles")
    code, line = first_lines(capsys, "smooth", source, *options)
    assert code == 0
    assert line.startswith("INCOMPLETE  ")
    contents = json.loads(story.read_text())
    what = "2 holes not drilled, first CL line 8; the rest within 0.01 mm everywhere"
    assert contents["verdict_text"] == f"INCOMPLETE: {what}"
    assert what.partition(";")[0] in line
    assert (contents["verdict"], contents["left_out"]) == ("INCOMPLETE", 2)
    for strict in ((), ("--strict",)):
        code, line = first_lines(capsys, "verify", source, out, "--skip-cycles", *strict)
        assert (code, line.split(":")[0]) == (len(strict), "INCOMPLETE")
    assert first_lines(capsys, "verify", source, out)[0] == 1  # FAILED: nobody asked for it
    code, line = first_lines(capsys, "smooth", source, *options, "--force", "-q")
    assert line.startswith(f"{source}: INCOMPLETE")
    assert first_lines(capsys, "smooth", source, *options, "--force", "--strict")[0] == 1
    assert (tmp_path / "hole.nc.failed").exists()
    assert first_lines(capsys, "smooth", source, "-d", tmp_path / "out", "--summary", table, "--skip-cycles")[
        1
    ].startswith("INCOMPLETE")
    assert ",INCOMPLETE," in table.read_text()


def test_what_bears_on_the_metal_is_counted_with_the_verdict(tmp_path, capsys):
    source = tmp_path / "bare.cls"
    motion = "UNITS/MM\nGOTO/0 0 9\nRAPID\nGOTO/1,0,9\nGOTO/1,0,0\nGOTO/9,0,0\nFINI\n"
    source.write_text(motion)
    story = tmp_path / "bare.json"
    line = first_lines(capsys, "smooth", source, "-o", tmp_path / "bare.nc", "--report", story)[1]
    told = json.loads(story.read_text())["findings"]
    # no tool, no spindle, no feed, a first motion at feed; not that its numbers have blanks between them
    assert {one["code"] for one in told if one["to_check"]} == {"CS311", "CS333", "CS334", "CS335"}
    assert "CS134" in {one["code"] for one in told}
    assert line.startswith("NOT VERIFIED, 4 to check  ")  # no F: the control stops
    strict = ("smooth", source, "-o", tmp_path / "bare.nc", "--force", "--strict")
    assert first_lines(capsys, *strict)[0] == 1
    code, line = first_lines(capsys, *strict, "--feed", "500")
    assert (code, line.partition("  ")[0]) == (0, "PASSED, 3 to check")


def test_an_own_tool_change_of_known_words_passes(part, tmp_path, capsys):
    own = tmp_path / "shop.toml"
    own.write_text('like = "siemens"\n[words]\ntool_change = ["T{tool}", "M6", "D1"]\n')
    words = ("smooth", part, "-o", tmp_path / "o.mpf", "--strict", "--control")
    assert first_lines(capsys, *words, own)[1].startswith("PASSED, 1 to check  ")
    # a word that nobody knows may move the tool
    own.write_text('like = "siemens"\n[words]\ntool_change = ["T{tool}", "M6", "ROT"]\n')
    code, line = first_lines(capsys, *words, own, "--force")
    assert (code, line.partition(" poses ")[2].split(",")[0].strip()) == (1, "ROT")
    assert line.startswith("NOT VERIFIED")


WAYS = [(), ("-f", "g6.2"), ("--control", "siemens", "--machine", "table-ac", "--digits", "3")]
OWN = ["impeller.cls", "paper_table1.csv"]
REAL = ["hust_5x_impeller_yelun.cls", "shenmuxin_5x_path.csv", "cnclite_iso_S_test.apt"]


@pytest.mark.parametrize(("name", "options"), [(name, WAYS[k % 3]) for k, name in enumerate(OWN + REAL)], ids=str)
def test_the_papers_method_has_no_tolerance_of_its_own(name, options, request, tmp_path, capsys):
    """Fast turns at a nearly straight tip are where its motion leaves ε; both commands agree, digits included."""
    source, out = tmp_path / name, tmp_path / "o.nc"
    source.write_bytes(sample(name) if name in OWN else (request.getfixturevalue("corpus") / name).read_bytes())
    words = ("smooth", source, "-q", "-o", out, "--method", "zhang2016", "--feed", "900", "-H", "20", *options)
    assert first_lines(capsys, *words) == (0, "")  # it passes: anything else is said
    code, line = first_lines(capsys, "verify", source, out)
    assert (code, line.split(":")[0].split(",")[0]) == (0, "PASSED")
