"""What a shop changes in a right program without harm, and what is like it and wrong."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest

from oracle.command import DONE, run

CL = """LOAD/TOOL,4,ADJUST,4
SPINDL/RPM,3000,CLW
COOLNT/FLOOD
RAPID
GOTO/0,0,50,0,0,1
FEDRAT/MMPM,900
GOTO/0,0,-3
GOTO/20,0,-3
GOTO/20,20,-3
RAPID
GOTO/20,20,50
LOAD/TOOL,7,ADJUST,7
SPINDL/RPM,2000,CLW
RAPID
GOTO/5,5,50
GOTO/5,5,2
FEDRAT/MMPM,300
GOTO/5,5,-1
DELAY/0.5
GOTO/25,8,-1
RAPID
GOTO/25,8,50
FINI
"""
ALL = ("fanuc", "haas", "mitsubishi", "siemens", "heidenhain", "linuxcnc")
ISO = ("fanuc", "haas", "mitsubishi")
THREE_AXES = Path(__file__).parents[2] / "samples" / "machines" / "three-axis.toml"


def options(control: str) -> tuple[str | Path, ...]:
    """What the command is given."""
    on = ("-e", "0.02", "--control", control)
    return (*on, "--machine", THREE_AXES) if control in ("linuxcnc", "haas") else on


@cache
def right(control: str) -> str:
    """The right program."""
    made = run("smooth", "-", *options(control), data=CL.encode())
    assert made.returncode == DONE, made.stderr
    return made.stdout.decode()


def judged(folder: Path, control: str, *edits: tuple[str, str]) -> str:
    """First line of ``verify`` for a program in which each of some patterns is replaced where it is found first."""
    (folder / "part.cls").write_text(CL)
    text = right(control)
    for old, new in edits:
        text, count = re.subn(old, new, text, count=1, flags=re.MULTILINE)
        assert count
    (folder / "part.nc").write_text(text)
    return run("verify", "part.cls", "part.nc", *options(control), cwd=folder).stdout.decode().splitlines()[0]


@pytest.mark.parametrize("control", ["fanuc", "haas", "mitsubishi", "linuxcnc"])
def test_the_tool_may_stand_behind_its_change(control: str, tmp_path: Path) -> None:
    assert judged(tmp_path, control, ("^T4 M6$", "M6 T4"), ("^T7 M6$", "M6 T7")).startswith("PASSED")
    assert judged(tmp_path, control, ("^T7 M6$", "M6 T4")).startswith("FAILED")
    assert judged(tmp_path, control, ("^T7 M6$", "M6")).startswith("FAILED")


@pytest.mark.parametrize("control", ["fanuc", "haas", "mitsubishi", "linuxcnc"])
def test_the_next_tool_may_wait(control: str, tmp_path: Path) -> None:
    assert judged(tmp_path, control, ("^T4 M6$", "T4 M6\nT7")).startswith("PASSED")
    assert judged(tmp_path, control, ("^T4 M6$", "T4 M6\nT7"), ("^T7 M6$", "M6")).startswith("PASSED")
    assert judged(tmp_path, control, ("^T4 M6$", "T4 M6\nT9")).startswith("PASSED")
    assert judged(tmp_path, control, ("^T4 M6$", "T4 M6\nT9"), ("^T7 M6$", "M6")).startswith("FAILED")
    assert judged(tmp_path, control, ("^T7 M6$", "T7")).startswith("FAILED")


def test_the_next_tool_of_klartext_and_siemens_may_wait(tmp_path: Path) -> None:
    assert judged(tmp_path, "siemens", ("^M6$", "M6\nT7")).startswith("PASSED")
    old = r"^(\d+ TOOL CALL 4 Z.*)$"
    assert judged(tmp_path, "heidenhain", (old, r"\1\n9 TOOL DEF 7")).startswith("PASSED")


@pytest.mark.parametrize(("control", "verdict"), [("fanuc", "PASSED"), ("mitsubishi", "PASSED"), ("haas", "FAILED")])
def test_a_feed_may_lack_its_point_where_it_counts_in_full(control: str, verdict: str, tmp_path: Path) -> None:
    """Of Haas setting 77 says what F900 is worth."""
    assert judged(tmp_path, control, (r"F900\.$", "F900")).startswith(verdict)
    assert judged(tmp_path, control, (r"F900\.$", "F90")).startswith("FAILED")
    assert judged(tmp_path, control, (r" Z-3\.0*(?= |$)", " Z-3")).startswith("FAILED")


def test_a_feed_per_revolution_or_in_inches_needs_its_point(tmp_path: Path) -> None:
    (tmp_path / "part.cls").write_text("UNITS/INCHES\n" + CL.replace("MMPM,900", "IPM,90"))
    on = ("--control", "fanuc", "-e", 0.02)
    assert run("smooth", "part.cls", *on, "-o", "part.nc", cwd=tmp_path).returncode == DONE
    text = (tmp_path / "part.nc").read_text()
    assert "F90.\n" in text
    (tmp_path / "part.nc").write_text(text.replace("F90.\n", "F90\n"))
    assert run("verify", "part.cls", "part.nc", *on, cwd=tmp_path).stdout.startswith(b"FAILED")


@pytest.mark.parametrize("control", ISO)
def test_marks_of_the_transfer_may_be_gone(control: str, tmp_path: Path) -> None:
    assert judged(tmp_path, control, (r"\A%\n", "")).startswith("PASSED")
    assert judged(tmp_path, control, (r"\n%\n\Z", "\n")).startswith("PASSED")
    assert judged(tmp_path, control, (r"\A%\n", ""), (r"\n%\n\Z", "\n")).startswith("PASSED")
    assert judged(tmp_path, control, (r"\A%\nO.*\n", "")).startswith("FAILED")
    assert judged(tmp_path, control, (r"^M30\n%\n\Z", "%\nM30\n")).startswith("FAILED")
    assert judged(tmp_path, control, (r"^M30\n%\n\Z", "%\n")).startswith("FAILED")
    assert judged(tmp_path, control, (r"^T7 M6$", "%\nT7 M6")).startswith("FAILED")


DWELLS = {
    "fanuc": "G4 P2000",
    "mitsubishi": "G4 P2000",
    "haas": "G4 P2.",
    "linuxcnc": "G4 P2",
    "siemens": "G4 F2",
    "heidenhain": "9 CYCL DEF 9.0 DWELL TIME\n9 CYCL DEF 9.1 DWELL 2",
}


@pytest.mark.parametrize("control", ALL)
def test_time_may_pass(control: str, tmp_path: Path) -> None:
    dwell = DWELLS[control]
    assert judged(tmp_path, control, (r"^((\d+ )?(S3000 )?M3( M8)?)$", rf"\1\n{dwell}")).startswith("PASSED")
    own = {"haas": r"G4 P0\.5", "linuxcnc": r"G4 P0\.5", "siemens": r"G4 F0\.5", "heidenhain": r"DWELL 0\.5"}
    old = own.get(control, "G4 P500")
    assert judged(tmp_path, control, (old, old.replace("500", "5").replace("\\.5", ".01"))).startswith("FAILED")


@pytest.mark.parametrize("control", [one for one in ALL if one != "heidenhain"])
def test_the_spindle_may_be_turned_for_another_tool(control: str, tmp_path: Path) -> None:
    orient = "M19 R0" if control == "linuxcnc" else "M19"
    assert judged(tmp_path, control, ("^T7", f"{orient}\nT7")).startswith("PASSED")
    assert judged(tmp_path, control, (r"^(G1 .*X20\..* Y0\..*)$", rf"{orient}\n\1")).startswith("FAILED")


@pytest.mark.parametrize(
    ("control", "zeros"),
    [("siemens", ("^(SUPA G0 Z0 D)0$", r"\g<1>00")), ("siemens", ("^D1$", "D01")), ("mitsubishi", ("H4$", "H004"))],
)
def test_whole_numbers_may_have_zeros_before_them(control: str, zeros: tuple[str, str], tmp_path: Path) -> None:
    assert judged(tmp_path, control, zeros).startswith("PASSED")


def test_the_state_that_curves_need_may_have_zeros_before_its_number(tmp_path: Path) -> None:
    (tmp_path / "part.cls").write_text(CL)
    text = _curves("mitsubishi", "g6.2")
    assert "G5 P10000" in text
    (tmp_path / "part.nc").write_text(text.replace("G5 P10000", "G5 P010000"))
    found = run("verify", "part.cls", "part.nc", "-e", "0.02", "--control", "mitsubishi", cwd=tmp_path)
    assert found.stdout.startswith(b"PASSED"), found.stdout


@pytest.mark.parametrize("control", ["fanuc", "siemens", "linuxcnc"])
def test_codes_may_have_zeros_before_them(control: str, tmp_path: Path) -> None:
    edits = [("^M8$", "M08"), (r" M3$", " M03"), ("^M5$", "M05")]
    assert judged(tmp_path, control, *edits).startswith("PASSED")


def test_a_block_with_a_vector_may_say_again_what_holds(tmp_path: Path) -> None:
    """As posts of others write it, without digests in the head, and as a user does with ours."""
    others = (r"^; PARTS=.*\n", "")
    for word in ("G90", "G17"):
        again = (r"^(G1 .*X20\..* Y20\..*)$", rf"{word} \1\n{word}")
        assert judged(tmp_path, "siemens", others, again).startswith("PASSED")
        assert judged(tmp_path, "siemens", again).startswith("PASSED")
    turned = (r"^(G1 .*X20\..* Y20\..*C3=)1", r"G90 \1-1")
    assert judged(tmp_path, "siemens", others, turned).startswith("FAILED")


def test_a_mark_of_the_coding_is_no_word(tmp_path: Path) -> None:
    for control in ALL:
        assert judged(tmp_path, control, (r"\A", "\N{ZERO WIDTH NO-BREAK SPACE}")).startswith("PASSED")


@pytest.mark.parametrize("control", ISO)
def test_numbers_of_retracts_may_be_spelt_otherwise(control: str, tmp_path: Path) -> None:
    for zero in ("Z0.000", "Z-0.", "Z+00."):
        assert judged(tmp_path, control, (r"\bZ0\.$", zero)).startswith("PASSED")


CURVES = {"fanuc": "g6.2", "mitsubishi": "g6.2", "siemens": "bspline", "heidenhain": "spl", "generic": "g6.2"}
CURVES_ALSO = {"siemens": "poly"}


def _each(pattern: str, new: str) -> Callable[[str], str]:
    return lambda text: re.sub(pattern, new, text, flags=re.MULTILINE)


@cache
def _curves(control: str, form: str) -> str:
    made = run("smooth", "-", "-e", "0.02", "--control", control, "--form", form, data=CL.encode())
    assert made.returncode == DONE, made.stderr
    return made.stdout.decode()


@pytest.mark.parametrize(("control", "form"), [*CURVES.items(), *CURVES_ALSO.items()])
@pytest.mark.parametrize(
    "rewrite",
    [
        "comments between",
        "comments behind",
        "empty lines",
        "blanks at the end",
        "CR LF",
        "coding",
        "lower case",
        "numbers",
    ],
)
def test_curves_in_another_spelling_pass(control: str, form: str, rewrite: str, tmp_path: Path) -> None:
    """With the digests of the head."""
    comment = {"siemens": "; CUT", "heidenhain": "; CUT"}.get(control, "(CUT)")
    block = r"^((?:\d+ )?[GXKLSMB](?!EGIN).*[\d)X])$"
    changes: dict[str, Callable[[str], str]] = {
        "comments between": _each(block, rf"\1\n{'9 ' if control == 'heidenhain' else ''}{comment}"),
        "comments behind": _each(block, rf"\1 {comment}"),
        "empty lines": _each(block, r"\1\n\n"),
        "blanks at the end": _each(block, r"\1  "),
        "CR LF": _each("$", "\r"),
        "coding": _each(r"\A", "\N{ZERO WIDTH NO-BREAK SPACE}"),
        "lower case": lambda text: re.sub(block, lambda match: match[1].lower(), text, flags=re.MULTILINE),
        "numbers": _each(r"^\d+", "7") if control == "heidenhain" else _each(block, r"N7 \1"),
    }
    text = changes[rewrite](_curves(control, form))
    assert text != _curves(control, form)
    (tmp_path / "part.cls").write_text(CL)
    (tmp_path / "part.nc").write_bytes(text.encode())
    found = run("verify", "part.cls", "part.nc", "-e", "0.02", "--control", control, cwd=tmp_path)
    assert found.stdout.startswith(b"PASSED"), found.stdout + found.stderr


OTHER_SPELLINGS = [
    ("siemens", (r"^G4 F0\.5$", "G4 F+0.5")),
    ("siemens", ("^T4$", "T=4")),
    ("siemens", (r"^T4$", 'MSG("TOOL 4")\nT4')),
    ("siemens", (r"\A", "%_N_PART_MPF\n")),
    ("fanuc", ("S3000 M3", "S+3000 M3")),
    ("heidenhain", (r"TOOL CALL 4 Z(.*)$", r"TOOL CALL 04 Z\1")),
    ("heidenhain", (r"\A(.*)$", r"\1\n1 BLK FORM 0.1 Z X-9 Y-9 Z-9\n2 BLK FORM 0.2 X+9 Y+9 Z+0")),
    ("linuxcnc", (r"\A((?:.*\n)+)\Z", r"%\n\1%\n")),
    ("linuxcnc", (r"\A", "\n%\n")),
]


@pytest.mark.parametrize(("control", "edit"), OTHER_SPELLINGS)
def test_other_spellings_pass(control: str, edit: tuple[str, str], tmp_path: Path) -> None:
    """With the digests of the head."""
    assert judged(tmp_path, control, edit).startswith("PASSED")


@pytest.mark.parametrize("control", ["fanuc", "haas", "mitsubishi", "siemens", "linuxcnc"])
def test_what_holds_may_be_said_in_each_cut(control: str, tmp_path: Path) -> None:
    """The blocks are read one by one then."""
    (tmp_path / "part.cls").write_text(CL)
    (tmp_path / "part.nc").write_text(re.sub("^G1 ", "G1 G90 ", right(control), flags=re.MULTILINE))
    found = run("verify", "part.cls", "part.nc", *options(control), cwd=tmp_path)
    assert found.stdout.startswith(b"PASSED"), found.stdout


def test_linuxcnc_wants_its_mark_in_the_first_line(tmp_path: Path) -> None:
    """It stops at one behind a comment ("Bad character '%' used")."""
    assert judged(tmp_path, "linuxcnc", (r"\A\(", "%\n(")).startswith("PASSED")
    assert judged(tmp_path, "linuxcnc", (r"\A(\(.*\n)", r"\1%\n")).startswith("FAILED")


@pytest.mark.parametrize("control", ["fanuc", "haas", "mitsubishi", "siemens", "linuxcnc"])
def test_an_arc_without_words_is_refused(control: str, tmp_path: Path) -> None:
    """LinuxCNC stops there, and no program needs it."""
    for code in ("G2", "G3 F900."):
        assert judged(tmp_path, control, (r"^(G1 .*X20\..*)$", rf"\1\n{code}\nG1")).startswith("FAILED")


DWELL = CL.replace("GOTO/20,20,-3\n", "GOTO/20,20,-3\nDELAY/1\nGOTO/0,20,-3\n")
TILTED = CL.replace("20,20,-3", "20,20,-3,0.0995037,0,0.9950372")
RIGID = """LOAD/TOOL,9,ADJUST,9
SPINDL/RPM,500,CLW
RAPID
GOTO/5,5,25,0,0,1
CYCLE/TAP,FEDTO,8,MMPR,1.25,RAPTO,3,RTRCTO,25
GOTO/5,5,0
CYCLE/OFF
FINI
"""
PLANE = """LOAD/TOOL,3,ADJUST,3
SPINDL/RPM,8000,CLW
RAPID
GOTO/10,0,60,0.5,0,0.8660254
FEDRAT/MMPM,800
GOTO/10,0,10
GOTO/10,25,10
RAPID
GOTO/40,25,61.961524
FINI
"""


def edited(folder: Path, cl: str, how: tuple[str, ...], *edits: tuple[str, str]) -> str:
    """As `judged`, of a program that is written with options of its own."""
    on = ("-e", "0.02", *how)
    (folder / "part.cls").write_text(cl)
    made = run("smooth", "part.cls", *on, "-o", "part.nc", "--force", cwd=folder)
    assert made.returncode == DONE, made.stderr
    text = (folder / "part.nc").read_text()
    for old, new in edits:
        text, count = re.subn(old, new, text, count=1, flags=re.MULTILINE)
        assert count
    (folder / "part.nc").write_text(text)
    return (
        run("verify", "part.cls", "part.nc", *on[: 6 if "--machine" in how else 4], cwd=folder)
        .stdout.decode()
        .splitlines()[0]
    )


def test_words_of_a_tap_may_be_spelt_otherwise(tmp_path: Path) -> None:
    how = ("--control", "fanuc", "--cycles", "native")
    assert edited(tmp_path, RIGID, how, ("^M29 S500$", "M29 S500.0")).startswith("PASSED")
    assert edited(tmp_path, RIGID, how, ("^(G98 G84 .*) (F.*)$", r"\2 \1")).startswith("PASSED")
    assert edited(tmp_path, RIGID, how, ("^G98 G84 ", "G98 G81 ")).startswith("FAILED")


def test_numbers_of_a_tilted_plane_may_be_spelt_otherwise(tmp_path: Path) -> None:
    how = ("--control", "fanuc", "--planes", "tilted")
    assert edited(tmp_path, PLANE, how, (r"J30\.0000", "J030.")).startswith("PASSED")
    assert edited(tmp_path, PLANE, how, (r"^G68\.2 X0\. ", "G68.2 X-0.0 ")).startswith("PASSED")
    assert edited(tmp_path, PLANE, how, (r"^G68\.2 X0\. ", "G68.2 X0.1 ")).startswith("FAILED")


@pytest.mark.parametrize(
    ("control", "form", "word"),
    [("siemens", "bspline", r" XH=\S+"), ("siemens", "poly", r" YH=\S+"), ("generic", "g6.2", r" U\S+")],
)
def test_a_second_point_without_all_its_words_is_not_verified(
    control: str, form: str, word: str, tmp_path: Path
) -> None:
    """Where the others are left out, manuals do not say what holds."""
    how = ("--control", control, "-f", form)
    assert edited(tmp_path, TILTED, how).startswith("PASSED")
    found = edited(tmp_path, TILTED, how, (rf"^(G0 X20.*?){word}", r"\1"))
    assert "a second point without all its words" in found, found


@pytest.mark.parametrize(
    ("control", "down"), [("fanuc", "G0 Z-50."), ("siemens", "G0 Z-50"), ("heidenhain", "9 L Z-50 FMAX")]
)
def test_no_rapid_comes_down_from_a_retract_before_a_tilted_plane(control: str, down: str, tmp_path: Path) -> None:
    """Nothing says over what: it passed where the head has no digests."""
    others = (r"^(\d+ )?[(;] ?PARTS=.*\n", "")
    how = ("--control", control, "--machine", "table-ac", "--planes", "tilted")
    assert edited(tmp_path, PLANE, how, others).startswith("PASSED")
    assert edited(
        tmp_path, PLANE, how, others, (r"^(\S*( PLANE SP|G68\.2|CYCLE800\(0).*)$", rf"{down}\n\1")
    ).startswith("FAILED")


def test_a_cutting_edge_comes_after_the_retract_without_one(tmp_path: Path) -> None:
    """D0 of the retract holds on where machine data do not choose D1 with the tool."""
    others, how = (r"^; PARTS=.*\n", ""), ("--control", "siemens", "--cycles", "native")
    assert edited(tmp_path, RIGID, how, others).startswith("PASSED")
    assert edited(tmp_path, RIGID, how, others, (r"^D1\n", "")).startswith("FAILED")


@pytest.mark.parametrize("control", ["fanuc", "mitsubishi", "generic"])
def test_a_curve_ends_before_other_words(control: str, tmp_path: Path) -> None:
    """G06.2 is modal, and no other words may stand in it (B-63324EN 4.17)."""
    how = ("--control", control, "-f", "g6.2")
    assert edited(tmp_path, DWELL, how).startswith("PASSED")
    assert edited(tmp_path, DWELL, how, (r"^G1\n(?=G4)", "")).startswith("FAILED")
