"""What each statement means, on small files written by hand."""

from __future__ import annotations

import gzip
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cornersmooth.cl import read
from cornersmooth.cl import words as vocabulary
from cornersmooth.errors import InputError, SettingsError
from cornersmooth.model import FeedMode, Keep, Move, Program

UP = [0.0, 0.0, 1.0]


def program(text: str, **options: object) -> Program:
    return read(text.encode(), name="x.cls", **options)  # type: ignore[arg-type]


def codes(result: Program) -> dict[str, int]:
    return {finding.code: finding.count for finding in result.findings if finding.code != "CS132"}


def words(result: Program) -> list[tuple[int, int, str]]:
    return [(statement.pose, statement.line, statement.word) for statement in result.statements]


@pytest.mark.parametrize("ends", ["GOTO/5,6,7.1", "GOTO/5,6,$\n7.1", "GOTO/5,6,7. ", "GODLTA/7.1", "GOTO/1,1,1,0,0,1"])
def test_a_file_that_ends_in_the_number_of_a_position_is_to_check(ends: str) -> None:
    text = "UNITS/MM\nGOTO/1,2,3\n" + ends
    for data in (text.encode(), gzip.compress(text.encode()), text.encode("utf-16")):
        (found,) = (one for one in read(data).findings if one.code == "CS275")
        assert (found.line, found.to_check) == (3, True)
    for whole in ("\n", "\r", "\x1a", "\nFINI", "\nPAINT/COLOR,31", "\nEND-OF-PATH", " $$ 5"):
        assert "CS275" not in codes(program(text + whole))


# --- positions ---------------------------------------------------------------------------------------------------


def test_goto_forms() -> None:
    result = program("GOTO/1.,.5,-0.25\nGOTO / 1, 2, 3, 0, .6, .8\ngoto  /  4.,5.,6.\nGO TO/7,8,9,0,1,0,1,0,0\n")
    assert result.tip.tolist() == [[1, 0.5, -0.25], [1, 2, 3], [4, 5, 6], [7, 8, 9]]
    assert result.axis.tolist() == [UP, [0, 0.6, 0.8], [0, 0.6, 0.8], [0, 1, 0]]
    assert result.kind.tolist() == [Move.LINEAR] * 4
    assert result.line.tolist() == [1, 2, 3, 4]
    assert np.isnan(result.feed).all()
    assert result.statements == ()


@pytest.mark.parametrize(
    "text",
    [
        "GOTO/1,2,3,$\n0,.6,.8",
        "GOTO/1,2,3,  $ what stands here is a comment\n 0, .6, .8",
        "GOTO/ $\n1,$\n2,3 $ $$ 1ST\n,0,.6,.8",
        "GOTO/1,2,3,\n0,.6,.8",
        "N27   , GOTO/1,2,3,0,.6,.8",
        "C12 , GOTO/1,2,3,0,.6,.8",
        "N10 GOTO/1,2,3,0,.6,.8",
        "ID1) GOTO/1,2,3,0,.6,.8",
        "GOTO/1.D0,+2E0,3.0e+00,0,6d-1,8E-01",
        "GOTO/1,2,3,0,.6,.8 $$ behind",
        "GOTO/1 2\t3 0 .6 .8",
        "GOTO/- 1,2,3,0,.6,.8\nGODLTA/2,0",
    ],
)
def test_goto_spellings(text: str) -> None:
    result = program(text)
    assert result.tip[-1].tolist() == [1, 2, 3]
    assert np.allclose(result.axis[-1], [0, 0.6, 0.8], rtol=0, atol=1e-15)
    assert result.line[0] == 1


def test_coordinate_lines_are_further_points() -> None:
    result = program("GOTO/1,1,1\n2,2,2\n 3,3,3,0,1,0\nRAPID\nGOTO/4,4,4\n5,5,5,$\n0,.6,.8\n")
    assert result.tip[:, 0].tolist() == [1, 2, 3, 4, 5]
    assert result.line.tolist() == [1, 2, 3, 5, 6]
    assert result.kind.tolist() == [Move.LINEAR] * 3 + [Move.RAPID, Move.LINEAR]
    assert result.axis[3:].tolist() == [[0, 1, 0], [0, 0.6, 0.8]]
    assert codes(result) == {"CS195": 2}  # never in silence


@pytest.mark.parametrize("word", ["CONT", "MOVE", "cont", "Move "])
def test_cont_and_move_are_positions(word: str) -> None:
    result = program(f"GOTO/0,0,0\n{word}/1,2,3,0,.6,.8\nRAPID\n{word} / 4, 5, $\n6\nGOTO/7,8,9\n")
    assert result.tip[1:].tolist() == [[1, 2, 3], [4, 5, 6], [7, 8, 9]]
    assert result.axis[1:].tolist() == [[0, 0.6, 0.8]] * 3
    assert result.kind.tolist() == [Move.LINEAR, Move.LINEAR, Move.RAPID, Move.LINEAR]


@pytest.mark.parametrize(
    "text",
    [
        "GOTO/X1,Y2,Z3,I0,J.6,K.8",
        "goto/x1.,y2.0,z+3,i0,j0.6,k0.8",
        "GOTO / X 1, Y=2, Z3 ,I0,J6E-1,K.8",
        "GOTO/X1 Y2 Z3 I0 J.6 K.8",
        "GOTO/X1,Y2,Z3,$\nI0,J.6,K.8",
        "FROM/X1,Y2,Z3,I0,J.6,K.8",
    ],
)
def test_letters_before_the_numbers(text: str) -> None:
    result = program(f"{text}\nGOTO/X4,Y5,Z6\n")
    assert result.tip.tolist() == [[1, 2, 3], [4, 5, 6]]
    assert np.allclose(result.axis, [[0, 0.6, 0.8]] * 2, rtol=0, atol=1e-15)


@pytest.mark.parametrize(
    "text", ["GOTO/X1,Y2", "GOTO/Y1,X2,Z3", "GOTO/X1,Y2,Z3,A30", "GOTO/X1,Y2,Z3,K1", "GOTO/X1,2,Z3"]
)
def test_letters_that_leave_something_open(text: str) -> None:
    with pytest.raises(InputError, match="GOTO cannot be read"):
        program(f"{text}\n")


def test_axis_is_normalised() -> None:
    result = program("GOTO/0,0,0,0.1,0.2,0.975\n")
    assert np.linalg.norm(result.axis[0]) == pytest.approx(1, abs=1e-15)
    assert result.axis[0] == pytest.approx(np.array([0.1, 0.2, 0.975]) / np.linalg.norm([0.1, 0.2, 0.975]), abs=1e-15)


def test_long_axis_needs_lenient() -> None:
    with pytest.raises(InputError, match=r"x\.cls:1: error\[\w+\]: tool axis is 2 long"):
        program("GOTO/0,0,0,0,0,2\n")
    result = program("GOTO/0,0,0,0,0,2\nGOTO/0,0,0,0,3,0\n", lenient=True)
    assert result.axis.tolist() == [UP, [0, 1, 0]]
    assert codes(result) == {"CS139": 2}


def test_creo_leaves_out_plus_z() -> None:
    head = "$$*         Pro/CLfile  Version 9.0\n"
    body = "GOTO / 0, 0, 0,  $\n0, .6, .8\nGOTO / 1, 0, 0\n"
    assert program(head + body).axis.tolist() == [[0, 0.6, 0.8], UP]
    assert program(body).axis.tolist() == [[0, 0.6, 0.8], [0, 0.6, 0.8]]
    assert program(head + body, dialect="nx").axis.tolist() == [[0, 0.6, 0.8], [0, 0.6, 0.8]]


def test_solidworks_csys_sets_the_axis() -> None:
    text = (
        "TRNTYP/WORLD,0,0,0\nGOTO/0,0,0,0,.6,.8\nCSYS/0,0,1.,0,0,1.,0,0,-1.,0,0,0\nGOTO/0,0,0\nTLAXIS/0,1,0\nGOTO/1,0,0"
    )
    assert program(text).axis.tolist() == [[0, 0.6, 0.8], [1, 0, 0], [0, 1, 0]]


def test_tool_path_starts_upright() -> None:
    text = "TOOL PATH/A,TOOL,B\nGOTO/0,0,0,0,1,0\nEND-OF-PATH\nTOOL PATH/B,TOOL,B\nGOTO/0,0,0\n"
    assert program(text).axis.tolist() == [[0, 1, 0], UP]


def test_multax_off_locks_the_axis() -> None:
    text = "MULTAX\nGOTO/0,0,0,0,1,0\nMULTAX/OFF\nGOTO/1,0,0,1,0,0\nGOTO/2,0,0\nMULTAX/ON\nGOTO/3,0,0,1,0,0\n"
    result = program(text, dialect="catia")
    assert result.axis.tolist() == [[0, 1, 0]] * 3 + [[1, 0, 0]]
    assert codes(result) == {"CS137": 1}


OFF = "MULTAX/ON\nGOTO/0,0,0,.6,0,.8\nmultax / off\nLOADTL/4\n{}"


@pytest.mark.parametrize(
    "after", ["GOTO/1,0,0\n", "GODLTA/1,0\n", "CONT/1,0,0\n", "GOTO/1,0,$\n0\n", "GOTO/1,0,0,0,0,1\n"]
)
@pytest.mark.parametrize("head", ["", "TOOL PATH/A,TOOL,B\n", "UNIT/MM\n", "CSI_SET_FLUTE_LENGTH/20.\n"])
def test_axis_after_multax_off_is_asked_for(head: str, after: str) -> None:
    text = head + OFF.format(after)
    with pytest.raises(InputError, match=r":[567]: error\[\w+\]: .*after MULTAX/OFF.*\n.*--dialect catia"):
        program(text)
    assert program(text, dialect="hsm").axis[1].tolist() == UP
    assert program(text, dialect="catia").axis[1] == pytest.approx([0.6, 0, 0.8])


@pytest.mark.parametrize(
    ("after", "axis"),
    [
        ("TLAXIS/0,0,1\nGOTO/1,0,0\n", UP),
        ("TLAXIS/0,.6,.8\nGOTO/1,0,0\n", [0, 0.6, 0.8]),
        ("GOTO/1,0,0,.6,0,.8\n", [0.6, 0, 0.8]),
        ("MULTAX/ON\nGOTO/1,0,0\n", [0.6, 0, 0.8]),
        ("TOOL PATH/A,TOOL,B\nGOTO/1,0,0\n", UP),
    ],
)
def test_axis_after_multax_off_that_is_stated(after: str, axis: list[float]) -> None:
    assert program(OFF.format(after)).axis[1] == pytest.approx(axis)


@pytest.mark.parametrize(
    ("head", "axis"),
    [
        ("MODE/MILL\nCSI_SET_FLUTE_LENGTH/20.\n", UP),
        ("CSI_TOOL_PATH/Face\nCSI_SET_PATH_PARAM/TOOL_BREAK=ON\n", UP),
        ("MCSYS/ NUM, 1, POINT, 0, 0, 0, VECTOR, 1, 0, 0, VECTOR, 0, 1, 0\nTCP/ OFF\n", UP),
        ("$$     CATIA APT VERSION 1.0\n", [0.6, 0, 0.8]),
        ("$$*         Pro/CLfile  Version 9.0\n", UP),
        ("REMARK a.as  NCLCAM\n", [0.6, 0, 0.8]),
    ],
)
def test_axis_after_multax_off_of_known_systems(head: str, axis: list[float]) -> None:
    assert program(head + OFF.format("GOTO/1,0,0\n")).axis[1] == pytest.approx(axis)


def test_incremental_positions() -> None:
    text = "FROM/1,1,1,0,0,1\nGODLTA/1,2\nGODLTA/0,0,3,0,.6,.8\nGODLTA/-5\nGOTO/0,0,0,0,1,0\nRAPID\nGODLTA/2\n"
    result = program(text)
    assert result.tip == pytest.approx(np.array([[1, 1, 1], [2, 3, 1], [2, 3, 4], [2, 0, 0], [0, 0, 0], [0, 2, 0]]))
    assert result.kind.tolist() == [Move.FROM, 2, 2, 2, 2, Move.RAPID]


@pytest.mark.parametrize("tail", ["", " $$"])
def test_incremental_positions_hold_the_axis(tail: str) -> None:
    """Also in Creo files, where a GOTO without an axis is upright; `tail` keeps GOTO off the fast path."""
    for head, last in (("", [0, 0.6, 0.8]), ("$$-> FEATNO / 1\n", UP)):
        tilted, short = f"GOTO/0,0,0,0,.6,.8{tail}\n", f"GOTO/0,0,0{tail}\n"
        result = program(f"{head}{tilted}GODLTA/1,0\nGODLTA/5\n{short}GODLTA/5\n")
        assert result.axis.tolist() == [[0, 0.6, 0.8]] * 3 + [last] * 2
        assert result.tip[2] == pytest.approx(np.array([1, 3, 4]))
        assert result.tip[4] == pytest.approx(5 * np.array(last))


def test_from_and_gohome() -> None:
    result = program("FROM/0,0,9,0,1,0\nRAPID\nGOTO/0,0,5\nGOTO/0,0,0\nGOHOME/0,0,9\nGOHOME\n")
    assert result.kind.tolist() == [Move.FROM, Move.RAPID, Move.LINEAR, Move.RAPID]
    assert result.axis.tolist() == [[0, 1, 0]] * 4
    assert words(result) == [(4, 6, "GOHOME")]


# --- rapid and feed ----------------------------------------------------------------------------------------------


def test_rapid_holds_for_one_motion_and_the_feed_comes_back() -> None:
    text = "FEDRAT/MMPM,250.\nGOTO/0,0,0\nRAPID \nGOTO/1,0,0\nGOTO/2,0,0\nRAPID/\nRAPID\n$$ x\nGOTO/3,0,0\nGOTO/4,0,0\n"
    result = program(text)
    assert result.kind.tolist() == [2, 1, 2, 1, 2]
    assert result.feed.tolist() == [250] * 5
    assert words(result) == [(3, 8, "$$")]


def test_rapid_modes() -> None:
    result = program("RAPID/ON\nGOTO/0,0,0\nGOTO/1,0,0\nRAPID/OFF\nGOTO/2,0,0\nRAPID/FEDTO,LENGTH,2.\nGOTO/3,0,0\n")
    assert result.kind.tolist() == [1, 1, 2, 2]
    assert codes(result) == {"CS140": 1}
    assert words(result) == [(3, 6, "RAPID")]  # what is not understood stays, and the verdict names it


def test_feed_between_rapid_and_goto_keeps_the_rapid() -> None:
    result = program("RAPID\nFEDRAT/MMPM,100\nGOTO/0,0,0\nGOTO/1,0,0\n")
    assert result.kind.tolist() == [1, 2]
    assert result.feed.tolist() == [100, 100]
    assert codes(result) == {"CS135": 1}


@pytest.mark.parametrize(
    ("feed", "units", "value", "mode"),
    [
        ("MMPM,250.0000", "MM", 250.0, FeedMode.PER_MINUTE),
        ("  300.0000,MMPM", "INCHES", 300.0, FeedMode.PER_MINUTE),
        ("10.000000,  IPM", "MM", 254.0, FeedMode.PER_MINUTE),
        ("PERMIN,141", "MM", 141.0, FeedMode.PER_MINUTE),
        ("PERMIN,10", "INCHES", 254.0, FeedMode.PER_MINUTE),
        ("10", "INCH", 254.0, FeedMode.PER_MINUTE),
        ("0.3,MMPR", "MM", 0.3, FeedMode.PER_REVOLUTION),
        (".01,IPR", "INCHES", 0.254, FeedMode.PER_REVOLUTION),
        (".01,PERREV", "INCHES", 0.254, FeedMode.PER_REVOLUTION),
        ("1.,FPM", "MM", 304.8, FeedMode.PER_MINUTE),
        ("150,MMPF", "INCHES", 150.0, FeedMode.PER_MINUTE),
    ],
)
def test_feed_units(feed: str, units: str, value: float, mode: FeedMode) -> None:
    result = program(f"UNITS/{units}\nFEDRAT/{feed}\nGOTO/1,0,0\n")
    assert result.feed[0] == pytest.approx(value, rel=1e-15)
    assert result.feed_mode[0] == mode


def test_feed_without_a_unit_keeps_the_mode() -> None:
    result = program("UNITS/MM\nFEDRAT/.2,MMPR\nGOTO/0,0,0\nFEDRAT/.3\nGOTO/1,0,0\nFEDRAT/100,MMPM\nGOTO/2,0,0\n")
    assert result.feed.tolist() == [0.2, 0.3, 100]
    assert result.feed_mode.tolist() == [1, 1, 0]


@pytest.mark.parametrize(
    "feed",
    ["INVERS,AUTO", "LOCK,ON", "50,FOO", "INVERS,10", "LENGTH,50", "300,100,MMPM", ".05,MMPT", "MMPM", "1,IPM,MMPM"],
)
def test_a_feed_that_is_not_understood_is_an_error(feed: str) -> None:
    for lenient in (False, True):
        with pytest.raises(InputError, match=r"x.cls:2: error\[CS136\]: FEDRAT/") as caught:
            program(f"FEDRAT/MMPM,5\nFEDRAT/{feed}\nGOTO/0,0,0\nGOTO/1,0,0\n", lenient=lenient)
        assert caught.value.exit_code == 3


# --- units -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("head", "kinds"),
    [
        ("MODE/MILL\nCOOLNT/ON\nCOOLNT/MIST\n", ["MIST"]),
        ("MODE/MILL\nCOOLNT/ON\nGOTO/0,0,0\nCOOLNT/MIST\n", ["ON", "MIST"]),
        ("CSI_TOOL_PATH/1\nCOOLNT/OFF\nCOOLNT/ON\n", ["OFF", "ON"]),
        ("MCSYS/NUM,1,POINT,0,0,0,VECTOR,1,0,0,VECTOR,0,1,0\nCOOLNT/ THRU\nCOOLNT/ ON\n", ["THRU"]),
        ("COOLNT/ON\nCOOLNT/MIST\n", ["ON", "MIST"]),
    ],
)
def test_coolant_on_beside_a_kind_is_none_of_its_own_in_posts_of_autodesk(head: str, kinds: list[str]) -> None:
    result = program(f"{head}GOTO/1,0,0\nFINI\n")
    assert [one.args[0] for one in result.statements if one.word == "COOLNT"] == kinds


@pytest.mark.parametrize("head", ["MODE/MILL\n", "MCSYS/NUM,1,POINT,0,0,0,VECTOR,1,0,0,VECTOR,0,1,0\n"])
def test_three_numbers_after_a_tilted_axis_are_none_of_autodesk(head: str) -> None:
    """Its posts write six under MULTAX/ON; by MODE/MILL the file of another system was taken for theirs, along +Z."""
    text = f"{head}UNITS/MM\nMULTAX/ON\nGOTO/0,0,5,0,0.6,0.8\n{{}}GOTO/1,0,0\nFINI\n"
    with pytest.raises(InputError, match=r":5: error\[CS188\]: .* after the axis 0,0.6,0.8"):
        program(text.format(""))
    assert program(text.format(""), dialect="plain").axis[1].tolist() == [0, 0.6, 0.8]
    assert program(text.format("MULTAX/OFF\n")).axis[1].tolist() == UP
    assert program(text.format("GOTO/0,0,6,0,0,1\n")).axis[2].tolist() == UP


def test_inch_files_are_converted_exactly() -> None:
    result = program("UNITS / INCHES\nFEDRAT/1.,IPM\nGOTO/0.1,1.,-3.3333\n")
    assert result.units == "inch"
    assert result.tip[0].tolist() == [0.1 * 25.4, 25.4, -3.3333 * 25.4]
    assert result.mm_per_unit == 25.4


@pytest.mark.parametrize(
    ("text", "units"),
    [("FEDRAT/10.,IPM\n", "inch"), ("FEDRAT/10.,MMPM\n", "mm"), ("", "mm"), ("REMARK a.as  NCLCAM\n", "inch")],
)
def test_units_that_are_not_stated(text: str, units: str) -> None:
    result = program(text + "GOTO/1,0,0\n")
    assert result.units == units
    assert [finding.severity for finding in result.findings if finding.code == "CS132"] == ["note"]


def test_units_asked_for_win() -> None:
    result = program("UNITS/INCHES\nGOTO/1,0,0\n", units="mm")
    assert result.tip[0, 0] == 1
    assert codes(result) == {"CS133": 1}


# --- statements --------------------------------------------------------------------------------------------------


def test_statements_keep_place_order_and_text() -> None:
    text = (
        "$$ head\nPARTNO/ A/B, $$ 'C'\nLOADTL/ 2,LENGTH,  50.5,,adjust\nGOTO/0,0,0\n"
        "SPINDL/RPM, $ x\n  1000.,CLW $$ on\n"
        "PPRINT cost 5$, a;b\nGOTO/1,0,0\nCOOLNT/flood;STOP\nFINI\n"
    )
    result = program(text)
    assert [(s.pose, s.line, s.word, s.args, s.text) for s in result.statements] == [
        (0, 1, "$$", ("head",), "$$ head"),
        (0, 2, "PARTNO", ("A/B, $$ 'C'",), "PARTNO/ A/B, $$ 'C'"),
        (0, 3, "LOADTL", (2.0, "LENGTH", 50.5, "", "ADJUST"), "LOADTL/ 2,LENGTH,  50.5,,adjust"),
        (1, 5, "SPINDL", ("RPM", 1000.0, "CLW"), "SPINDL/RPM, 1000.,CLW"),
        (1, 5, "$$", ("on",), "$$ on"),
        (1, 7, "PPRINT", ("cost 5$, a;b",), "PPRINT cost 5$, a;b"),
        (2, 9, "COOLNT", ("FLOOD",), "COOLNT/flood"),
        (2, 9, "STOP", (), "STOP"),
        (2, 10, "FINI", (), "FINI"),
    ]
    assert codes(result) == {}


@pytest.mark.parametrize(
    ("text", "word", "argument"),
    [
        ("PPRINT/'A, B $$ C'", "PPRINT", "'A, B $$ C'"),
        ("PARTNO Part Operation.1", "PARTNO", "Part Operation.1"),
        ("PARTNO / MFG0001", "PARTNO", "MFG0001"),
        ("INSERT/[HOLDER=C40-M06EM2] 6MM CRB 2FL 19 LOC", "INSERT", "[HOLDER=C40-M06EM2] 6MM CRB 2FL 19 LOC"),
        ("TPRINT/T1 Drill D 10", "TPRINT", "T1 Drill D 10"),
        ("TOOL  PATH/7_KONTUR,TOOL,FACE_MILL", "TOOL PATH", "7_KONTUR,TOOL,FACE_MILL"),
        ("PPRINT/ GOTO/1,2,3", "PPRINT", "GOTO/1,2,3"),
        ("REMARK GOTO/1,2,3 $", "REMARK", "GOTO/1,2,3 $"),
        ("PPRINT/FIRST $\nSECOND", "PPRINT", "FIRST SECOND"),
    ],
)
def test_text_is_never_taken_apart(text: str, word: str, argument: str) -> None:
    result = program(f"{text}\nGOTO/0,0,0\n")
    (statement,) = result.statements
    assert (statement.word, statement.args) == (word, (argument,))
    assert len(result) == 1


def test_a_text_that_ends_in_a_dollar_swallows_no_motion() -> None:
    result = program("PPRINT/COST 5$\nGOTO/1,0,0\nREMARK 5$\nGOTO/2,0,0\nPPRINT/5 $\nRAPID\nGOTO/3,0,0\n")
    assert result.kind.tolist() == [2, 2, 1]


def test_creo_tables_in_comments_go_on() -> None:
    result = program("$$-> CSYS / 1.0, 0.0,  $\n            0.0, 1.0,  $\n   0.0\nGOTO / 1, 2, 3\n")
    assert [statement.word for statement in result.statements] == ["$$"]
    assert result.line.tolist() == [4]


def test_unknown_words_are_kept_and_counted_once() -> None:
    result = program("FOOBAR/1\nGOTO/0,0,0\nFOOBAR/2,A\nQUUX\n*** stray\nCSI_SET_X/1\n")
    assert [statement.word for statement in result.statements] == ["FOOBAR", "FOOBAR", "QUUX", "?", "CSI_SET_X"]
    assert [(f.code, f.line, f.count) for f in result.findings if f.code != "CS132"] == [
        ("CS130", 1, 2),
        ("CS130", 4, 1),
        ("CS131", 5, 1),
    ]
    assert all(f.severity == "warning" for f in result.findings if f.code != "CS132")


def test_synonyms() -> None:
    result = program("SYN/'TLAXIS','$$*TLAXIS'\nTLAXIS/ 0.0, 1.0, 0.0\nSYN/'MOVETO','GOTO'\nMOVETO/1,2,3\n")
    assert result.axis.tolist() == [UP]
    assert result.tip.tolist() == [[1, 2, 3]]


def test_cycles_make_holes() -> None:
    cycle = "CYCLE/INIT\nCYCLE/DEEP2,FEDTO,2.7,1STPECK,5.\nGOTO/1,0,0\nGOTO/2,0,0\nCYCLE/OFF\n"
    text = f"GOTO/0,0,9\n{cycle}RAPID\nGOTO/2,0,9\n"
    result = program(text)
    assert result.kind.tolist() == [Move.LINEAR, Move.HOLE, Move.HOLE, Move.RAPID]
    assert words(result) == [(1, 2, "CYCLE"), (1, 3, "CYCLE"), (3, 6, "CYCLE")]
    assert result.statements[1].args == ("DEEP2", "FEDTO", 2.7, "1STPECK", 5.0)


def test_rapid_inside_a_cycle_is_pointed_out() -> None:
    result = program("CYCLE/DRILL,5.\nRAPID\nGOTO/1,0,0\nCYCLE/OFF\nGOTO/2,0,0\n")
    assert result.kind.tolist() == [Move.HOLE, Move.LINEAR]
    assert codes(result) == {"CS144": 1}


def test_cutcom_spans_are_kept() -> None:
    span = "CUTCOM/LEFT,XYPLAN\nGOTO/1,0,0\nGOTO/2,0,0\nCUTCOM/OFF\n"
    text = f"GOTO/0,0,0\n{span}GOTO/3,0,0\nCUTCOM/ON,LENGTH,7\nGOTO/4,0,0\n"
    result = program(text)
    assert result.keep.tolist() == [0, *[Keep.CUTTER_COMPENSATION] * 3, 0]
    assert codes(result) == {"CS138": 1}


@pytest.mark.parametrize(
    "text",
    [
        *("TRANS/0,0,0", "TRACUT/NOMORE", "ROTABL/    0.000000,,TABLE,CLW", "TRNTYP/WORLD,0,0,0", "WPLANE/OFF"),
        *("LCS/OFF", "LCS/ON,1,0,0,0,0,1,0,0,0,0,1,0", "FIXTURE/2", "ORIGIN/0,0,0"),
    ],
)
def test_coordinate_changes_that_change_nothing(text: str) -> None:
    result = program(f"{text}\nGOTO/1,0,0\n")
    assert len(result.statements) == 1


#: positions are in these systems: CAMplete, DMG MORI MfgSuite
TURNED = ["MCS/1,0,0,0,0,1,0,-1,0,0,0,0", "MCSYS/NUM,1,POINT,0,0,0,VECTOR,1,0,0,VECTOR,0,0,1"]


@pytest.mark.parametrize(
    "text",
    [
        *(
            "TRANS/1,0,0",
            "TRACUT/M1",
            "ROTABL/90,CLW",
            "TRNTYP/LOCAL,0",
            *TURNED,
            "wplane / on",
            "WPLANE/1",
            "ROTHED/30",
        ),
        *("LOAD/HEAD,2", "SET/ORIGIN,5,5,5", "mode/scale,2"),
        *("LCS/ON,0.8,0,0.6,10,0,1,0,0,-0.6,0,0.8,5", "HEAD/2", "MATRIX/1,2,3", "TLCOMP/ON,LEFT", "ORIGIN", "ZERO/1"),
    ],
)
def test_coordinate_changes_are_refused(text: str) -> None:
    with pytest.raises(InputError, match="changes the coordinates"):
        program(f"{text}\nGOTO/1,0,0\n")
    if not text.upper().startswith(("LOAD", "SET", "MODE")):
        assert codes(program(f"{text}\nGOTO/1,0,0\n", lenient=True)) == {"CS143": 1}


def test_several_systems_are_pointed_out() -> None:
    text = (
        "MSYS/0,0,0,1,0,0,0,1,0\nGOTO/0,0,0\nMSYS/0,0,0,1,0,0,0,1,0\nGOTO/1,0,0\nMSYS/0,0,5,1,0,0,0,1,0\nGOTO/2,0,0\n"
    )
    result = program(text)
    assert codes(result) == {"CS146": 1}
    assert result.tip.tolist() == [[0, 0, 0], [1, 0, 0], [2, 0, 5]]


@pytest.mark.parametrize(
    "text",
    [
        "MCS/1,0,0,0,1,0,0,0,1,0,0,0\nGOTO/0,0,0\nMCS/1,0,0,0,1,0,0,0,1,0,0,5\n",
        "MCSYS/NUM,1,POINT,0,0,0,VECTOR,1,0,0,VECTOR,0,1,0\nGOTO/0,0,0\n"
        "MCSYS/NUM,2,POINT,0,0,0,VECTOR,1,0,0,VECTOR,0,1,0\n",
        "FIXTURE/1\nGOTO/0,0,0\nFIXTURE/2\n",
        "GOTO/0,0,0\nMSYS/0,0,10,1,0,0,0,1,0\n",
        "GOTO/0,0,0\nMCS/1,0,0,0,1,0,0,0,1,0,0,10\n",
        "GOTO/0,0,0\nWCS/2\n",
        "$$-> CSYS / 1,0,0,0, $\n0,1,0,0, $\n0,0,1,0\nGOTO/0,0,0\n$$-> CSYS / 1,0,0,0, $\n0,0,-1,0, $\n0,1,0,0\n",
        "$$*CATIA0\n$$ A\n$$ 1. 0. 0. 0.\n$$ 0. 1. 0. 0.\n$$ 0. 0. 1. 0.\nGOTO/0,0,0\n"
        "$$*CATIA0\n$$ B\n$$ 1. 0. 0. 0.\n$$ 0. 0. -1. 0.\n$$ 0. 1. 0. 0.\n",
    ],
)
def test_systems_that_change_are_refused(text: str) -> None:
    with pytest.raises(InputError, match="changes the coordinates"):
        program(f"{text}GOTO/1,0,0\n")


#: a second operation on the side of the part, as NX writes it
SIDE = """TOOL PATH/TOP,TOOL,D10
MSYS/0.0,0.0,0.0,1.0,0.0,0.0,0.0,1.0,0.0
GOTO/0,0,0,0,0,1
GOTO/30,0,0
TOOL PATH/SIDE,TOOL,D10
MSYS/0.0,-40.0,-20.0,1.0,0.0,0.0,0.0,0.0,1.0
{}
"""


@pytest.mark.parametrize(
    ("text", "tip", "axis"),
    [
        ("GOTO/30,0,0,0,0,1", [30, -40, -20], [0, -1, 0]),
        ("GOTO/30,0,0", [30, -40, -20], [0, -1, 0]),
        ("GOTO/1,2,3,0,1,0 $$", [1, -43, -18], [0, 0, 1]),
        ("GODLTA/5,0,0", [35, 0, 0], [0, -1, 0]),  # from where the tool is
        ("CLEARP/XYPLAN,9\nGOTO/30,0,0\nRETRCT", [30, -49, -20], [0, -1, 0]),
        ("GOTO/1,2,3\nTOOL PATH/C\nMSYS/0.0,0.0,0.0,1.0,0.0,0.0,0.0,1.0,0.0\nGOTO/4,5,6", [4, 5, 6], UP),
        ("GOTO/1,0,0\nCIRCLE/0,0,0,0,0,-1,1,.06,.5,10,0\nGOTO/0,1,0", [0, -40, -19], [0, -1, 0]),
    ],
)
def test_a_turned_system_of_nx_is_carried_out(text: str, tip: list[float], axis: list[float]) -> None:
    result = program(SIDE.format(text))
    assert result.tip[-1] == pytest.approx(tip)
    assert result.axis[-1] == pytest.approx(axis)
    assert result.tip[:2].tolist() == [[0, 0, 0], [30, 0, 0]]
    if "CIRCLE" in text:  # a quarter, left-handed about -Z of the system, which is Y of the part
        assert result.arcs.centre.tolist() == [[0, -40, -20]]
        assert result.arcs.normal[0] == pytest.approx([0, -1, 0])
        assert result.arcs.sweep == pytest.approx([np.pi / 2])


@pytest.mark.parametrize(
    ("plane", "z"),
    [
        ("CLEARP/XYPLAN,60", 60),
        ("CLEARP/60", 60),
        ("CLEARP/0,0,1,60", 60),
        ("CLEARP/0,0,-2,-120", 60),
        ("CLRSRF/9,9,60", 60),
    ],
)
def test_retract_goes_to_the_clearance_plane(plane: str, z: float) -> None:
    result = program(f"{plane}\nGOTO/0,0,50,0,0,1\nGOTO/20,0,0\nRETRCT\nGOTO/80,40,0\nRAPID\nretrct\nGOTO/1,2,3\n")
    assert result.tip[2:].tolist() == [[20, 0, z], [80, 40, 0], [80, 40, z], [1, 2, 3]]
    assert result.kind[2:].tolist() == [Move.LINEAR, Move.LINEAR, Move.RAPID, Move.LINEAR]


def test_retract_goes_along_the_tool() -> None:
    result = program("CLEARP/XYPLAN,8\nGOTO/1,2,0,.6,0,.8\nRETRCT\nRETRCT\nCLEARP/YZPLAN,10\nRETRCT\nGOTO/0,0,9\n")
    assert result.tip == pytest.approx(np.array([[1, 2, 0], [7, 2, 8], [7, 2, 8], [10, 2, 12], [0, 0, 9]]))
    assert result.axis == pytest.approx(np.array([[0.6, 0, 0.8]] * 5))
    above = program("CLEARP/XYPLAN,8\nGOTO/0,0,9\nRETRCT\nGOTO/1,0,9\n")
    assert above.tip.tolist() == [[0, 0, 9], [1, 0, 9]]
    assert codes(above) == {"CS194": 1}


@pytest.mark.parametrize(
    "plane", ["", "CLEARP/XYPLAN,60\nCLEARP/OFF", "CLEARP/60\nCLRSRF/1,2,3,0,0,1,5", "CLEARP/S,1,2"]
)
def test_retract_without_a_plane_is_refused(plane: str) -> None:
    with pytest.raises(InputError, match="no clearance plane is known"):
        program(f"{plane}\nGOTO/0,0,0\nRETRCT\nGOTO/1,0,0\n")


@pytest.mark.parametrize("text", ["RAPID/10,10,0", "RAPID/10", "MULTAX/1", "MULTAX/SOMETIMES"])
def test_options_that_nobody_knows_are_refused(text: str) -> None:
    with pytest.raises(InputError, match=rf"x\.cls:2: error\[\w+\]: {text} is not understood"):
        program(f"GOTO/0,0,0\n{text}\nGOTO/1,0,0\n")


@pytest.mark.parametrize("text", ["G01 X10 Y5", "g1x10.y5.z-.5f100", "X10 Y5", "N10 G54", "G54 $$ behind"])
def test_nc_blocks_are_refused(text: str) -> None:
    with pytest.raises(InputError, match=r"x\.cls:2: error\[\w+\]: .* is a block of an NC program"):
        program(f"GOTO/0,0,0\n{text}\nGOTO/1,0,0\n")


MOTION = """GOCLER PLUNGE/5 POSITN/ZAXIS,100 INDPOS/BAXIS,45 SAFPOS HOME GOINCR/1,2 THREAD/TURN PROBE/1
MOVETO/1 BREAK ARCSLP/-2 GO/TO GOLFT/C1 POCKET/1 TLLFT,GOFWD/C1 INSERT/G28Z0 INSERT/x10.y5 APPROACH RETRACT
"""
REPETITION = """COPY/1,SAME,5 INDEX/1 CALL/M1 CALSUB/7 CALSUB DEFSUB/7 ENDSUB M1=MACRO/A TERMAC LOOPST LOOPND JUMPTO/A
INCLUD/ROUGH.CLS READ/2 DO/10 REPEAT/3"""


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        *((text, "moves the tool") for text in MOTION.split()),
        *((text, "repeats, calls or includes") for text in REPETITION.split()),
    ],
)
@pytest.mark.parametrize("spell", [str, str.lower, lambda text: text.replace("/", " / ", 1)])
def test_what_is_not_carried_out_is_refused(text: str, reason: str, spell: Callable[[str], str]) -> None:
    for tail in ("", " $$ behind") if "INSERT" not in text else ("",):
        with pytest.raises(InputError, match=rf"x\.cls:2: error\[\w+\]: .* {reason}"):
            program(f"GOTO/0,0,0\n{spell(text)}{tail}\nGOTO/1,0,0\n")


def test_each_refused_word_has_one_source_and_no_handler() -> None:
    words = [word for _, source, words in vocabulary._REFUSED for word in words.split() if source]
    assert len(words) == len(set(words)) == len(vocabulary.REFUSED_WORDS)
    carried_out = vocabulary.MOTION_WORDS | vocabulary.STATE_WORDS | vocabulary.PLAIN_WORDS | vocabulary.TEXT_WORDS
    assert not carried_out & set(words)


@pytest.mark.parametrize(
    "text", ["SLIDE/1,2,3", "SLIDE/FAST,1,2,3,4", "SLIDE 1 2 3", "SLIDE 1.,2.,3.", "P1=POINT/1,2,3", "* 1 2 3"]
)
def test_unknown_words_with_a_row_of_numbers_are_refused(text: str) -> None:
    with pytest.raises(InputError, match=r"x\.cls:2: error\[\w+\]: unknown statement .* may move the tool"):
        program(f"GOTO/0,0,0\n{text}\n")
    assert len(program(f"GOTO/0,0,0\n{text}\n", lenient=True)) == 1


@pytest.mark.parametrize(
    "text",
    ["SLIDE/1,2", "SLIDE/A,1,B,2,C,3", "STOCK/BLOCK,0,0,0,1,1,1", "CSI_X/1,2,3", "INSERT/M8", "HOMEY", "INDPOS/NOMORE"],
)
def test_words_that_do_not_look_like_motion_are_kept(text: str) -> None:
    assert len(program(f"GOTO/0,0,0\n{text}\n").statements) == 1


@pytest.mark.parametrize(
    ("text", "count"),
    [
        ("GOTO/1,0,0\nFROM/5,0,0\nGOTO/6,0,0\nGOTO/7,0,0\nFROM/0,0,0\nFROM/0,9,0\nGOTO/1,0,0", 2),
        ("FROM/5,0,0\nGOTO/6,0,0", 0),  # where the first tool comes from
        ("GOTO/1,0,0\nFROM/5,0,0\nRAPID\nGOTO/6,0,0\nFROM/9,0,0", 0),
        ("GOTO/1,0,0\nFROM/1,0,0\nGOTO/6,0,0", 0),
    ],
)
def test_a_feed_from_where_the_tool_is_not_is_said(text: str, count: int) -> None:
    assert codes(program(f"{text}\n")).get("CS185", 0) == count


def test_fini_ends_the_file() -> None:
    assert codes(program("GOTO/1,0,0\nFINI\n$$ bye\nSPINDL/OFF\n")) == {"CS144": 1}
    assert len(program("GOTO/1,0,0\nEND\nGOTO/2,0,0\nFINI\n")) == 2
    with pytest.raises(InputError, match=r"x\.cls:3: error\[\w+\]: GOTO after FINI"):
        program("GOTO/1,0,0\nFINI\nGOTO/2,0,0\n")
    assert len(program("GOTO/1,0,0\nFINI\nGOTO/2,0,0\nGOTO/3,0,0,0,1,0\n", lenient=True)) == 1


# --- columns and line numbers -------------------------------------------------------------------------------------


LISTING = ["UNITS/MM", "FEDRAT/500,MMPM", "$$ a comment", "GOTO/1,2,3,$", "0,.6,.8", "RAPID", "GOTO/4,5,6", "FINI"]


@pytest.mark.parametrize(
    ("form", "refused"),
    [
        (lambda text, n: f"{text:<72}{n:08d}", "CS189:1"),
        (lambda text, n: f"{text:<72}PT {n:5d}" if "GOTO" in text else text, "CS189:7"),
        (lambda text, n: f"{text:<72}{n:<8d}", "CS189:1"),
        (lambda text, n: f"{text:<80}" if n % 20 else f"{text:<72}A{n:07d}", "CS189:2"),
        (lambda text, n: f"{n:05d} {text}", "CS190:1"),
        (lambda text, n: f"{n:5d}:  {text}", "CS190:1"),
        (lambda text, n: f"{n}\t{text}", "CS190:1"),
        (lambda text, n: f"N{n} {text}" if text[0].isalpha() else text, None),
        (lambda text, n: f"{text:<90}", None),
    ],
)
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_numbers_beside_the_statements(form: Callable[[str, int], str], refused: str | None, end: str) -> None:
    text = "".join(form(line, 10 * n) + end for n, line in enumerate(LISTING, 1))
    if refused is not None:
        with pytest.raises(InputError) as caught:
            program(text)
        assert f"{caught.value.code}:{caught.value.line}" == refused
        return
    result = program(text)
    assert result.tip.tolist() == [[1, 2, 3], [4, 5, 6]]
    assert np.allclose(result.axis, [[0, 0.6, 0.8]] * 2, rtol=0, atol=1e-15)
    assert result.feed.tolist() == [500, 500]
    assert result.line.tolist() == [4, 7]
    assert not codes(result)


def test_long_lines_are_not_cut() -> None:
    """Of the systems that know no columns: long arguments, and integers that end there."""
    ends = ["1.00000000", "         1", "0.", "-1", "1"]
    lines = [f"{'GOTO/0.,0.,':<{width}}{end}" for width in (64, 70, 72, 75, 100) for end in ends]
    assert program("\n".join(lines)).tip[:, 2].tolist() == [1, 1, 0, -1, 1] * 5


# --- the file ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "data",
    [
        b"GOTO/1,2,3\r\nGOTO/4,5,6\r\n",
        b"GOTO/1,2,3\rGOTO/4,5,6",
        b"GOTO/1,2,3\nGOTO/4,5,6\r\n\x1a",
        b"\xef\xbb\xbfGOTO/1,2,3\n\n\nGOTO/4,5,6",
        "GOTO/1,2,3\nGOTO/4,5,6\n".encode("utf-16"),
        gzip.compress(b"GOTO/1,2,3\nGOTO/4,5,6\n", mtime=0),
    ],
)
def test_line_ends_and_encodings(data: bytes) -> None:
    assert read(data).tip.tolist() == [[1, 2, 3], [4, 5, 6]]


def test_text_is_utf8_or_else_windows_1252() -> None:
    for text in ("PPRINT Généré".encode(), "PPRINT Généré".encode("cp1252")):
        assert read(text + b"\nGOTO/1,2,3\n").statements[0].args == ("Généré",)


def test_files_and_names(tmp_path: Path) -> None:
    path = tmp_path / "part.cls.gz"
    path.write_bytes(gzip.compress(b"GOTO/1,2,3\nGOTO/1,2\n"))
    with pytest.raises(InputError) as caught:
        read(path)
    assert (caught.value.file, caught.value.line, caught.value.code) == (str(path), 2, "CS110")
    path.write_bytes(b"GOTO/1,2,3\n")
    assert read(path).source.name == "part.cls.gz"
    assert read(b"GOTO/1,2,3\n", name="<stdin>").source.name == "<stdin>"
    with pytest.raises(InputError, match="cannot be read"):
        read(tmp_path / "none.cls")
    path.write_bytes(gzip.compress(b"GOTO/1,2,3\n")[:-5])
    with pytest.raises(InputError, match="gzip"):
        read(path)


@pytest.mark.parametrize("options", [{"dialect": "foo"}, {"units": "cm"}, {"format": "x"}, {"arc_rule": "up"}])
def test_unknown_options(options: dict[str, str]) -> None:
    with pytest.raises(SettingsError, match="use one of"):
        program("GOTO/1,2,3\n", **options)


@pytest.mark.parametrize(
    ("head", "dialect"),
    [
        ("TOOL PATH/A,TOOL,B", "nx"),
        ("$$     CATIA APT VERSION 1.0", "catia"),
        ("$$*         Pro/CLfile  Version 11.0", "creo"),
        ("PARTNO/1\nUNIT/MM\nCSI_SET_FLUTE_LENGTH/3.2", "solidworks"),
        ("CSI_SET_FLUTE_LENGTH/20.\nCSI_TOOL_PATH/Face2", "hsm"),
        ("MCSYS/ NUM, 1, POINT, 0, 0, 0, VECTOR, 1, 0, 0, VECTOR, 0, 1, 0", "mfgsuite"),
        ("CSI_SET_FLUTE_LENGTH/20.", "plain"),
        ("MODE/MILL\nPARTNO/'x'", "hsm"),
        ("REMARK a.as  27-APR-2021  NCLCAM     2020.00", "ncl"),
        ("PPRINT/APTCL-SPEC,MAKINO-FF,1", "makino"),
        ("PARTNO X", "plain"),
    ],
)
def test_dialects_are_recognised(head: str, dialect: str) -> None:
    assert program(f"{head}\nGOTO/1,2,3\n").source.dialect == dialect


def test_points_go_to_their_own_reader() -> None:
    assert read(b"x,y,z,i,j,k\n1,2,3,0,0,1\n").source.format == "points"
    assert read(b"1,2,3,0,0,1\n4,5,6,0,0,1\n").source.format == "points"
    with pytest.raises(InputError):
        read(b"1,2,3,0,0,1\n", format="apt")


def test_import_is_light() -> None:
    code = "import sys, cornersmooth.cl; sys.exit('scipy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


# --- Creo, however its head is spelt --------------------------------------------------------------------------------

CREO = (
    "{head}UNITS / MM\nLOADTL / 1\nMULTAX / ON\nSPINDL / RPM, 3000.0, CLW\nRAPID\nGOTO / 0.0, 0.0, 30.0,  $\n"
    "0.6, 0.0, 0.8\nFEDRAT / 300.0, MMPM\nGOTO / 0.0, 0.0, 0.0,  $\n0.6, 0.0, 0.8\nGOTO / 20.0, 5.0, 0.0\n{more}FINI\n"
)
CAMERA = "    CAMERA/ 1.0, 0.0, 0.0,$\n {:.1f},  $\n  0.0, 1.0, 0.0,$\n 0.0,  $\n 0.0, 0.0, 1.0, 0.0\n"


@pytest.mark.parametrize(
    "head",
    [
        "$$*         Pro/CLfile  Version 11.0 - 11.0.1.0\n",
        "$$-> FEATNO / 12\n",
        "REMARK *          PRO/CLFILE  VERSION 9.0 - 9.0.3.0\n",
        "REMARK -> MFGNO / A1\n",
        "REMARK -> FEATNO / 12\n",
        "PPWORD/CSYSOP,3192\n",
        CAMERA.format(0.0),
    ],
)
def test_three_numbers_of_creo_are_upright_without_an_option(head: str) -> None:
    result = program(CREO.format(head=head, more=""))
    assert result.source.dialect == "creo"
    assert result.axis.tolist() == [[0.6, 0, 0.8], [0.6, 0, 0.8], [0, 0, 1]]
    assert "CS130" not in [one.code for one in result.findings]


def test_camera_is_the_coordinate_system_of_creo() -> None:
    same = CREO.format(head=CAMERA.format(5.0), more=CAMERA.format(5.0))
    assert len(program(same)) == 3
    with pytest.raises(InputError, match=r"error\[CS117\]: CSYS changes the coordinates"):
        program(CREO.format(head=CAMERA.format(5.0), more=CAMERA.format(6.0)))
