"""Words that are taken for others like them, and numbers that stand beside those that are looked at."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from cornersmooth.nc_reader.word_tables import CONTROLS
from cornersmooth.nc_words.rules import word_list
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


def judged(folder: Path, control: str, old: str, new: str, *, cl: str = FIVE, more: tuple[str, ...] = ()) -> str:
    """First line of ``verify`` for a program in which something has been replaced; the right one passes."""
    on = ("-e", EPS, "-H", H, "--control", control)
    (folder / "part.cls").write_text(cl)
    made = run("smooth", "part.cls", *on, *more, "-o", "part.nc", "--force", cwd=folder)
    assert made.returncode == DONE, made.stderr
    text = (folder / "part.nc").read_text()
    right = run("verify", "part.cls", "part.nc", *on, cwd=folder)
    assert right.stdout.startswith(b"PASSED"), right.stdout
    changed = re.sub(old, new, text, flags=re.MULTILINE)
    assert changed != text
    (folder / "part.nc").write_text(changed)
    return run("verify", "part.cls", "part.nc", *on, cwd=folder).stdout.decode().splitlines()[0]


@pytest.mark.parametrize(
    ("control", "old", "new", "verdict"),
    [
        ("siemens", "ORIWKS", "ORIMKS", "FAILED"),
        ("siemens", "ORIVECT", "ORIAXES", "FAILED"),
        ("siemens", "ORIVECT", "ORIPLANE", "NOT VERIFIED: .*TRAORI ORIWKS ORIPLANE"),
        ("siemens", "^(ORIWKS ORIVECT)", r"; \1", "FAILED"),
        ("siemens", "G710", "G71", "NOT VERIFIED: .*G71"),
        ("heidenhain", "FUNCTION TCPM F.*VECTOR", "M128", "NOT VERIFIED: .*M128"),
        ("heidenhain", r"^(\d+ LN .* F700)$", r"\1\n99 M6", "FAILED: .*M6"),
        ("heidenhain", r"^(\d+ LN .* F700)$", r"\1 M6", "FAILED: .*M6"),
        ("heidenhain", "^(8 M3)$", r"\1\n99 M6", "FAILED: .*M6"),
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
    listed = word_list(control)
    for rule in (*listed.words, *listed.blocks):
        text = rule.pattern.pattern
        shares = rule.pattern.groupindex.keys()
        assert shares <= {"length", "angle"}
        assert bool(shares) == (rule.share is not None), text
        rest = re.sub(r"\(\?P<\w+>[^()]*\)", "", text)
        if re.search(r"\\d|\.\*|\[1-9\]", rest) and not rule.never:
            assert rule.compared or rule.numbers or re.search("measured|compared", rule.says), text
