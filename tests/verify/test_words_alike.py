"""Words that are taken for others like them, and numbers that stand beside those that are looked at."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from cornersmooth.control.table import CONTROLS, table_of
from oracle.command import DONE, run

FIVE = """LOAD/TOOL,3,ADJUST,3
SPINDL/RPM,3000,CLW
RAPID
GOTO/1,2,70,0.258819,0,0.9659258
FEDRAT/MMPM,700
GOTO/1,2,9
GOTO/13,6,9,0.3420201,0,0.9396926
GOTO/25,1,10,0.258819,0,0.9659258
RAPID
GOTO/25,1,70
FINI
"""
INCH = "UNITS/INCHES\n" + FIVE.replace("MMPM,700", "IPM,25")
#: length and axis tolerance of the control's own smoothing: a tenth of ε, and of ε over H in degrees
EPS, H = 0.02, 10.0
THREE_AXES = Path(__file__).parents[2] / "samples" / "machines" / "three-axis.toml"


def judged(folder: Path, control: str, old: str, new: str, *, cl: str = FIVE, more: tuple[str, ...] = ()) -> str:
    """First line of ``verify`` for a program in which something has been replaced; the right one passes.

    The changed one has no digests of its parts, as other posts and version 0.2.0 have none.
    """
    on: tuple[object, ...] = ("-e", EPS, "-H", H, "--control", control)
    if control in ("linuxcnc", "haas"):
        on += ("--machine", THREE_AXES)
    (folder / "part.cls").write_text(cl)
    made = run("smooth", "part.cls", *on, *more, "-o", "part.nc", "--force", cwd=folder)
    assert made.returncode == DONE, made.stderr
    text = (folder / "part.nc").read_text()
    right = run("verify", "part.cls", "part.nc", *on, cwd=folder)
    assert right.stdout.startswith(b"PASSED"), right.stdout
    changed, count = re.subn(old, new, text, flags=re.MULTILINE)
    assert count
    (folder / "part.nc").write_text(re.sub("(?m)^.*PARTS=.*\n", "", changed))
    return run("verify", "part.cls", "part.nc", *on, cwd=folder).stdout.decode().splitlines()[0]


@pytest.mark.parametrize(
    ("control", "old", "new", "verdict"),
    [
        ("siemens", "ORIWKS", "ORIMKS", "FAILED"),
        ("siemens", "ORIVECT", "ORIAXES", "FAILED"),
        ("siemens", "ORIVECT", "ORIPLANE", "NOT VERIFIED: .*TRAORI ORIWKS ORIPLANE"),
        ("siemens", "^(ORIWKS ORIVECT)", r"; \1", "NOT VERIFIED: .*under TRAORI,"),
        ("siemens", "G710", "G71", "NOT VERIFIED: .*G71"),
        ("heidenhain", "FUNCTION TCPM F.*VECTOR", "M128", "NOT VERIFIED: .*M128"),
        ("heidenhain", r"^(\d+ LN .* F700)$", r"\1\n99 M6", "FAILED: .*M6"),
        ("heidenhain", r"^(\d+ LN .* F700)$", r"\1 M6", "FAILED: .*M6"),
        ("heidenhain", "^(9 M3)$", r"\1\n99 M6", "FAILED: .*M6"),
    ],
)
def test_words_like_the_right_ones_do_not_pass(control: str, old: str, new: str, verdict: str, tmp_path: Path) -> None:
    assert re.match(verdict, judged(tmp_path, control, old, new))


def test_feeds_in_inches_are_said_with_the_units_of_lengths(tmp_path: Path) -> None:
    assert re.match("NOT VERIFIED: .*G70", judged(tmp_path, "siemens", "G700", "G70", cl=INCH))


@pytest.mark.parametrize("control", ["siemens", "heidenhain"])
def test_words_of_rotary_axes_like_the_right_ones_do_not_pass(control: str, tmp_path: Path) -> None:
    swaps = {"siemens": ("ORIMKS", "ORIWKS"), "heidenhain": ("PATHCTRL AXIS", "PATHCTRL VECTOR")}
    found = judged(tmp_path, control, *swaps[control], more=("--machine", "table-ac"))
    assert found.startswith("FAILED")


@pytest.mark.parametrize(
    ("control", "old", "new", "verdict"),
    [
        ("heidenhain", r"(32\.2.*) TA[\d.]+", r"\1 TA45", "FAILED: .*TA45"),
        ("heidenhain", r"(32\.2.*) TA[\d.]+", r"\1 TA0.0116", "FAILED"),
        ("heidenhain", r"(32\.2.*) TA[\d.]+", r"\1 TA0.0114", "PASSED"),
        ("heidenhain", r"32\.1 T[\d.]+", "32.1 T0.0021", "FAILED"),
        ("heidenhain", r"32\.1 T[\d.]+", "32.1 T0.0.1", "FAILED"),
        ("siemens", r"(_ORI_FINISH,)[\d.]+", r"\g<1>45", "FAILED: .*CYCLE832"),
        ("siemens", r"(_ORI_FINISH,)[\d.]+", r"\g<1>0.0114", "PASSED"),
        ("siemens", r"_ORI_FINISH,[\d.]+", "_FINISH,45", "FAILED"),
        ("siemens", r"_ORI_FINISH,[\d.]+", "_FINISH,1", "PASSED"),
        ("siemens", r"CYCLE832\(0\.0[\d.]+", "CYCLE832(0.0.2", "FAILED"),
        ("siemens", r"CYCLE832\(0\.0[\d.]+", "CYCLE832(0.0021", "FAILED"),
    ],
)
def test_second_numbers_of_the_controls_own_smoothing_have_a_share(
    control: str, old: str, new: str, verdict: str, tmp_path: Path
) -> None:
    word = {"heidenhain": "cycle32", "siemens": "cycle832"}[control]
    assert re.match(verdict, judged(tmp_path, control, old, new, more=("--with", word)))


@pytest.mark.parametrize("control", CONTROLS)
def test_each_number_of_a_word_list_is_compared_or_has_a_share_or_a_reason(control: str) -> None:
    table = table_of(control)
    for rule in (*table.listed, *table.blocks):
        text = rule.pattern.pattern
        shares = rule.pattern.groupindex.keys()
        assert shares <= {"length", "angle"}
        assert bool(shares) == (rule.share is not None), text
        rest = re.sub(r"\(\?P<\w+>[^()]*\)", "", text)
        if re.search(r"\\d|\.\*|\[1-9\]", rest):
            assert rule.compared or re.search("measured|compared", rule.says), text


# what the first line says beside ε

PLAIN = """LOAD/TOOL,3,ADJUST,3
SPINDL/RPM,3000,CLW
RAPID
GOTO/1,2,70,0,0,1
FEDRAT/MMPM,700
GOTO/1,2,9
GOTO/13,6,9
GOTO/25,1,10
RAPID
GOTO/25,1,70
FINI
"""


@pytest.mark.parametrize(
    ("old", "new", "total"),
    [
        (r"G64 P[\d.]+ Q0", "G64 P0.005 Q0", "0.025"),
        (r"G64 P[\d.]+ Q0", "G64 P0.02 Q0", "0.04"),
        (r"G64 P[\d.]+ Q0", "G64 P0.005", "0.03"),
    ],
)
def test_blending_of_linuxcnc_is_added_in_the_first_line(old: str, new: str, total: str, tmp_path: Path) -> None:
    found = judged(tmp_path, "linuxcnc", old, new, cl=PLAIN)
    assert found == f"PASSED: within 0.02 mm everywhere, {total} mm with what the control rounds itself"


def test_blending_in_inches_is_added_in_millimetres(tmp_path: Path) -> None:
    inch = (
        "UNITS/INCHES\nLOAD/TOOL,3,ADJUST,3\nSPINDL/RPM,3000,CLW\nRAPID\nGOTO/1,2,2,0,0,1\nFEDRAT/IPM,25\nGOTO/1,2,1\n"
        "GOTO/1,3,1\nGOTO/2,1,1\nRAPID\nGOTO/2,1,2\nFINI\n"
    )
    found = judged(tmp_path, "linuxcnc", r"G64 P[\d.]+ Q0", "G64 P0.0005 Q0", cl=inch)
    assert "0.0327 mm with what" in found


def test_what_the_control_rounds_is_added_when_it_is_written(tmp_path: Path) -> None:
    (tmp_path / "part.cls").write_text(FIVE)
    made = run(
        "smooth", "part.cls", "-e", EPS, "--control", "siemens", "--with", "cycle832", "-o", "a.mpf", cwd=tmp_path
    )
    assert b"within 0.02 mm everywhere, 0.022 mm with what the control rounds itself" in made.stderr


@pytest.mark.parametrize(
    ("control", "old", "new"),
    [
        ("fanuc", r"^(G43\.5 .*)$", r"G5.1 Q1\n\1"),
        ("mitsubishi", r"^(G43\.5 .*)$", r"G5 P10000\n\1"),
        ("haas", r"^(G54)$", r"\1\nG187 P3 E0.001"),
        ("siemens", "^TRAORI$", "CYCLE832(0.001,_FINISH,1)\nTRAORI"),
        ("heidenhain", "^(10 FUNCTION.*)$", r"8 CYCL DEF 32.0 TOLERANCE\n8 CYCL DEF 32.1 T0.001\n\1"),
    ],
)
def test_functions_that_nobody_asked_for_are_to_check(control: str, old: str, new: str, tmp_path: Path) -> None:
    ends = {"fanuc": "G5.1 Q0", "mitsubishi": "G5 P0", "haas": "G187", "siemens": "CYCLE832(0,_OFF,1)"}
    end = ends.get(control, "CYCL DEF 32.0 TOLERANCE\n98 CYCL DEF 32.1")
    numbered = "97 " if control == "heidenhain" else ""
    cl = PLAIN if control == "haas" else FIVE
    both = rf"{old}((?:.|\n)*?)(^(?:\d+ )?M30)"
    groups = re.compile(old).groups
    found = judged(tmp_path, control, both, rf"{new}\g<{groups + 1}>{numbered}{end}\n\g<{groups + 2}>", cl=cl)
    assert found.startswith("PASSED, 1 to check"), found


@pytest.mark.parametrize(("control", "name"), [("fanuc", "aicc"), ("siemens", "cycle832"), ("heidenhain", "cycle32")])
def test_functions_that_were_asked_for_are_not(control: str, name: str, tmp_path: Path) -> None:
    assert judged(tmp_path, control, "SHA256", "SHA256", cl=FIVE, more=("--with", name)).startswith("PASSED:")


def test_smoothness_of_haas_without_a_number_is_to_check(tmp_path: Path) -> None:
    asked = ("--with", "g187")
    assert judged(tmp_path, "haas", "SHA256", "SHA256", cl=PLAIN, more=asked).startswith("PASSED:")
    found = judged(tmp_path, "haas", r"G187 P3 E[\d.]+", "G187 P1", cl=PLAIN, more=asked)
    assert found.startswith("PASSED, 1 to check")
    assert judged(tmp_path, "haas", r"E[\d.]+$", "E0.3", cl=PLAIN, more=asked).startswith("FAILED")


@pytest.mark.parametrize(
    ("control", "offset", "other"),
    [("fanuc", "G54", "G55"), ("linuxcnc", "G54", "G59.1"), ("siemens", "G54", "G505"), ("haas", "G54", "G154 P3")],
)
def test_an_offset_that_was_not_compared_is_said(control: str, offset: str, other: str, tmp_path: Path) -> None:
    # comments taken out, as on the way to the machine
    without = rf"^[(;].*CORNERSMOOTH.*\n((?:.|\n)*?)^{re.escape(offset)}$"
    found = judged(tmp_path, control, without, rf"\1{other}", cl=PLAIN)
    assert found.startswith("PASSED")
    assert found.endswith(f"offset {other}, not compared")
    assert judged(tmp_path, control, f"^{re.escape(offset)}$", other, cl=PLAIN).startswith("FAILED")


@pytest.mark.parametrize(
    ("control", "block"),
    [
        ("fanuc", "G53 G0 X1. Z2."),
        ("fanuc", "G53 G0 Z-50."),
        ("fanuc", "G91 G28 X0. Z0."),
        ("siemens", "SUPA G0 Z50"),
        ("heidenhain", "L X+5 Z+5 R0 FMAX M91"),
    ],
)
def test_z_goes_to_a_position_of_the_machine_in_retracts_alone(control: str, block: str) -> None:
    """To any other height of the machine only where its file says so."""
    table = table_of(control)
    assert not any(rule.pattern.fullmatch(block) for rule in table.blocks)
