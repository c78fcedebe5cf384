"""Each CL statement is compared, or asks for nothing, or is NOT VERIFIED with its line, in both commands."""

from __future__ import annotations

import io

import pytest

from cornersmooth import postprocess, read, verify
from cornersmooth.errors import InputError, Verdict
from cornersmooth.kinematics import load_machine
from cornersmooth.nc import choose_form
from cornersmooth.settings import Settings

#: before the statement, five lines
HEAD = "UNITS/MM\nCUTTER/10,0,5,5,0,0,50\nLOADTL/4\nSPINDL/RPM,3000,CLW\nRAPID\n"
CL = HEAD + "GOTO/0,0,50,0,0,1\nFEDRAT/MMPM,300\n{}\nGOTO/0,0,-3\nGOTO/20,0,-3\nRAPID\nGOTO/20,0,50\nFINI\n"
LINE = 8

SILENT = (
    *("PARTNO X", "PPRINT X", "REMARK X", "$$ M30", "TPRINT/A,B", "DISPLY/ALL", "LETTER X", "PAINT/COLOR,31"),
    *(
        "INTOL/0.01",
        "OUTTOL/0.01",
        "TOLER/0.1",
        "ISN/7",
        "SEQNO/10,INCR,5",
        "STOCK/1,2",
        "MACHIN/UNCX01,1",
        "MODE/MILL",
    ),
    *(
        "SET/MODE,ABSOL",
        "CSI_SET_FLUTE_LENGTH/22.",
        "CSI_PATH_TOLERANCE/0.01",
        "CUTTER/8",
        "ORIGIN/0,0,0",
        "TRACUT/NOMORE",
    ),
    *("INSERT/[HOLDER=C40-M06EM2] 6MM CRB", "INSERT/Stock Size X36. Y35. Z1.", "PPWORD/CSYSOP,3192", "DELAY/0"),
)

UNREAD = (
    *("SET/OFSET,3", "OFSTNO/3", "MODE/INCR", "MODE/POLAR", "CUTCOM/ON,LENGTH", "CUTCOM/ADJUST,PLUS,3", "AUXFUN/30"),
    *("INSERT/M8", "INSERT M98 P100", "INSERT/CALL LBL 2", "INSERT/$MC_X=1", "DELAY/2,MIN", "DELAY/-1", "DELAY/3,4"),
    *("OPSKIP/ON", "CLAMP/ON", "TCP/OFF", "RESET/ALL", "PIVOTZ/100", "MAXDPM/20", "WORK/2", "FIXOFF/2", "COORD/2"),
    *(
        "INCR",
        "POLAR/ON",
        "TOOLLEN/120",
        "OSETNO/5",
        "UNCLAM/ON",
        "RTCP/ON",
        "TCPM/ON",
        "SUBPROG/7",
        "LOOP/3",
        "DWELL/5",
    ),
    *(
        "COOLNT/FLOOD,MIST",
        "COOLNT/FLOOD,OFF",
        "COOLNT/FLOOD,3",
        "COOLNT/OFF,FLOOD",
        "CSI_INSERT_CUSTOM_GCODE/G53 Z0.",
    ),
    *("STOP/7", "OPSTOP/ON", "SELECT/TURRET,3", "LOAD/WIRE,2", "REWIND/1", "PPFUN/15,7,OFF", "SWITCH/9", "PREFUN/OFF"),
    *(
        "RAPID/ZFIRST",
        "RAPID/MODIFY,XYPLAN",
        "RAPID/FEDTO,LENGTH,2",
        "THREAD/OFF",
        "SMOOTH/ON",
        "UNLOAD/TOOL",
        "START/X",
        "PPWORD/M8",
        "PPWORD/G53 Z0",
        "PPWORD/M,8",
        "SPINDL/3000,CLW,RANGE,2",
        "SPINDL/3000,RANGE,LOW",
    ),
    *("SPEED/4000,CLW", "TOOL/3", "LOADTL/4,2", "LOADTL/4,HOLDER,2", "END/7", "CHUCK/1,2"),
)

#: read, and the control has no word for it
WITHOUT_WORD = (
    ("COOLNT/THRU", "fanuc"),
    ("COOLNT/AIR", "fanuc"),
    ("COOLNT/HIGH", "haas"),
    ("COOLNT/MIST", "heidenhain"),
)


def both(text: str, control: str = "fanuc") -> list[tuple[Verdict, str]]:
    """Verdict of smooth, and that of verify, and what they do not verify."""
    stream = io.BytesIO()
    machine = load_machine("table-ac") if control == "haas" else None
    form = choose_form(control, machine=machine)
    made = postprocess(text.encode(), stream, Settings(tolerance=0.02), form=form)
    found = verify(read(text.encode()), stream.getvalue(), tolerance=0.02, control=control, machine=machine)
    return [(made.verdict, made.judgement.text), (found.verdict, found.unverified)]


@pytest.mark.parametrize("statement", SILENT)
def test_these_ask_for_nothing(statement: str) -> None:
    assert {verdict for verdict, _ in both(CL.format(statement))} == {Verdict.PASSED}


@pytest.mark.parametrize("statement", UNREAD)
def test_these_are_not_understood(statement: str) -> None:
    for verdict, text in both(CL.format(statement)):
        assert verdict is Verdict.NOT_VERIFIED
        assert f"not understood: {statement} in CL line {LINE}" in text


@pytest.mark.parametrize(("statement", "control"), WITHOUT_WORD)
def test_a_word_that_the_control_has_not_is_not_verified(statement: str, control: str) -> None:
    for verdict, text in both(CL.format(statement), control):
        assert verdict is Verdict.NOT_VERIFIED
        assert f"the control has no word for: coolant {statement.partition('/')[2]} in CL line {LINE}" in text


def test_a_coolant_that_the_control_has_is_compared() -> None:
    assert {verdict for verdict, _ in both(CL.format("COOLNT/THRU"), "haas")} == {Verdict.PASSED}


@pytest.mark.parametrize("statement", ["FIXTURE/2", "WCS/2", "FIXTUR/1"])
def test_a_work_offset_is_not_compared(statement: str) -> None:
    for verdict, text in both(CL.replace("LOADTL/4", f"{statement}\nLOADTL/4").format("$$")):
        assert verdict is Verdict.NOT_VERIFIED
        assert f"not understood: {statement} in CL line 3" in text


def test_more_than_three_are_counted() -> None:
    text = both(CL.format("\n".join(f"WORK/{number}" for number in range(1, 6))))[0][1]
    assert "WORK/1 in CL line 8, WORK/2 in CL line 9, WORK/3 in CL line 10 and 2 more" in text


@pytest.mark.parametrize(
    "statement",
    ["TLDATA/TURN,INSERT,0.8,0.,0.", "TOOLNO/1,TURN,1", "MODE/TURN", "LOAD/TURRET,1", "TURRET/1,SETOOL,0,0,0"],
)
def test_turning_is_refused(statement: str) -> None:
    with pytest.raises(InputError, match=r"8: error\[CS179\]: .* is for a lathe") as caught:
        read(CL.format(statement).encode())
    assert caught.value.exit_code == 3


def test_the_length_register_of_a_tool_of_autodesk_is_its_last_number() -> None:
    stream = io.BytesIO()
    text = CL.replace("LOADTL/4", "LOADTL/4, 0, 40., 14").format("$$").encode()
    assert postprocess(text, stream, Settings(tolerance=0.02)).verdict is Verdict.PASSED
    assert b"H14" in stream.getvalue()
    wrong = stream.getvalue().replace(b"H14", b"H4")
    assert verify(read(text), wrong, tolerance=0.02).verdict is Verdict.FAILED
