"""Operations of a CL file: where they begin in each dialect, and one alone with what holds where it begins."""

from __future__ import annotations

import io
import json
from pathlib import Path

import numpy as np
import pytest

from cornersmooth.cl import read
from cornersmooth.cl.operations import find_operations
from cornersmooth.errors import InputError, Verdict
from cornersmooth.pipeline import postprocess
from oracle.command import run
from oracle.files import OWN, SAMPLES

#: files in the manner of each dialect, and number, name, tool and first line of each operation
FILES = {
    "nx": (
        "TOOL PATH/ROUGH,TOOL,D10\nTLDATA/MILL,10,0,50,0,0\nLOADTL/3\nRAPID\nGOTO/0,0,9,0,0,1\nGOTO/1,0,0\n"
        "END-OF-PATH\n"
        "TOOL PATH/FINISH,TOOL,D6\nTLDATA/MILL,6,3,50,0,0\nLOADTL/4\nRAPID\nGOTO/0,0,9\nGOTO/2,0,0\nEND-OF-PATH\n",
        [(1, "ROUGH", 3, 1), (2, "FINISH", 4, 8)],
    ),
    "catia": (
        "$$*CATIA0\n$$ OPERATION NAME : Tool Change.1\nLOADTL/1\n$$ OPERATION NAME : Sweep.1\nRAPID\nGOTO/0,0,9,0,0,1\n"
        "GOTO/1,0,0\nPPRINT OPERATION: Sweep.2\n$$ OPERATION NAME : Sweep.2\nRAPID\nGOTO/0,0,9\nGOTO/2,0,0\n",
        [(1, "Sweep.1", 1, 1), (2, "Sweep.2", 1, 8)],
    ),
    "creo": (
        "$$*          Pro/CLfile  Version 11.0\nPARTNO / X\n$$-> FEATNO / 402\nLOADTL / 1\nRAPID\nGOTO / 0,0,9,0,0,1\n"
        "GOTO / 1,0,0\n$$-> END /\n$$-> FEATNO / 556\nLOADTL / 2\nRAPID\nGOTO / 0,0,9\nGOTO / 2,0,0\nFINI\n",
        [(1, "FEATNO 402", 1, 1), (2, "FEATNO 556", 2, 9)],
    ),
    "tools alone": (
        "LOADTL/5\nRAPID\nGOTO/0,0,9,0,0,1\nGOTO/1,0,0\nLOADTL/6\nTOOLNO/6,8.0\nGOTO/2,0,0\nEND\n",
        [(1, "", 5, 1), (2, "", 6, 5)],
    ),
    "parts": (
        "PARTNO FIRST\nRAPID\nGOTO/0,0,9,0,0,1\nGOTO/1,0,0\nPARTNO SECOND\nGOTO/2,0,0\n",
        [(1, "FIRST", None, 1), (2, "SECOND", None, 5)],
    ),
    "one": ("PARTNO ONE\nGOTO/0,0,9,0,0,1\nGOTO/1,0,0\nFINI\n", [(1, "", None, 1)]),
}


@pytest.mark.parametrize("dialect", FILES)
def test_operations_begin_at_names_and_tools(dialect: str) -> None:
    text, wanted = FILES[dialect]
    program = read(text.encode(), name="part.cls")
    found = find_operations(program)
    assert [(one.number, one.name, one.tool, one.first_line) for one in found] == wanted
    assert [one.first for one in found] == [0, *(one.stop for one in found[:-1])]
    assert found[-1].stop == len(program)


def test_no_move_no_operation() -> None:
    assert find_operations(read(b"LOADTL/1\nFROM/0,0,9,0,0,1\nSPINDL/1000,CLW\n", name="part.cls")) == ()


HEAD = "PARTNO P\nUNITS/MM\nLOADTL/3\nSPINDL/3000,RPM,CLW\nCOOLNT/FLOOD\n"
ONE = "RAPID\nGOTO/0,0,30,0,0,1\nFEDRAT/300,MMPM\nGOTO/0,0,0\nGOTO/9,0,0\nGOTO/9,9,0\nRAPID\nGOTO/9,9,30\n"
TWO = "PPRINT OPERATION: two\nRAPID\nGOTO/0,0,30\nFEDRAT/250,MMPM\n"
TWO += "GOTO/0,0,-1\nGOTO/8,0,-1\nGOTO/8,8,-1\nRAPID\nGOTO/8,8,30\n"
#: half a circle from where the first operation ends
ARC = "FEDRAT/200,MMPM\nCIRCLE/9,4,30,0,0,1,5\nGOTO/9,-1,30\nGOTO/8,-1,30\n"


def words(middle: str, at_once: str = "") -> list[str]:
    """Acting statements with which the second operation begins, where `middle` and `at_once` come before its moves."""
    text = HEAD + ONE + middle + TWO.replace("RAPID\n", f"{at_once}RAPID\n", 1)
    program = read(text.encode(), name="part.cls", operation="two")
    return [statement.text for statement in program.statements if statement.acts and statement.pose == 0]


@pytest.mark.parametrize(
    ("middle", "at_once", "wanted"),
    [
        ("", "", ["LOADTL/3", "SPINDL/3000,RPM,CLW", "COOLNT/FLOOD"]),
        ("SPINDL/OFF\nCOOLNT/OFF\n", "", ["LOADTL/3"]),
        ("SPINDL/OFF\n", "SPINDL/500,RPM,CCLW\n", ["LOADTL/3", "COOLNT/FLOOD", "SPINDL/500,RPM,CCLW"]),
        ("SPINDL/OFF\n", "SPINDL/ON\n", ["LOADTL/3", "SPINDL/3000,RPM,CLW", "COOLNT/FLOOD", "SPINDL/ON"]),
        ("SPINDL/900,RPM,CLW\nSPINDL/800\n", "", ["LOADTL/3", "COOLNT/FLOOD", "SPINDL/900,RPM,CLW", "SPINDL/800"]),
        ("COOLNT/OFF\nCOOLNT/MIST\n", "", ["LOADTL/3", "SPINDL/3000,RPM,CLW", "COOLNT/MIST"]),
        ("", "COOLNT/FLOOD\n", ["LOADTL/3", "SPINDL/3000,RPM,CLW", "COOLNT/FLOOD"]),
        ("", "LOADTL/7\nSPINDL/1,RPM,CLW\nCOOLNT/MIST\n", ["LOADTL/7", "SPINDL/1,RPM,CLW", "COOLNT/MIST"]),
        ("", "LOADTL/7\n", ["SPINDL/3000,RPM,CLW", "COOLNT/FLOOD", "LOADTL/7"]),
        ("DELAY/2\nOPSTOP\n", "", ["LOADTL/3", "SPINDL/3000,RPM,CLW", "COOLNT/FLOOD"]),
        ("CUTCOM/LEFT\nCUTCOM/OFF\n", "", ["LOADTL/3", "SPINDL/3000,RPM,CLW", "COOLNT/FLOOD"]),
    ],
)
def test_an_operation_begins_with_what_holds_there(middle: str, at_once: str, wanted: list[str]) -> None:
    assert words(middle, at_once) == wanted


def test_an_operation_has_its_own_moves_feeds_and_lines() -> None:
    whole = read((HEAD + ONE + TWO).encode(), name="part.cls")
    alone = read((HEAD + ONE + TWO).encode(), name="part.cls", operation="2")
    np.testing.assert_array_equal(alone.tip, [[0, 0, 30], [0, 0, -1], [8, 0, -1], [8, 8, -1], [8, 8, 30]])
    np.testing.assert_array_equal(alone.line, whole.line[5:])
    np.testing.assert_array_equal(alone.feed[1:4], [250.0] * 3)
    assert (alone.source.operation, alone.source.operation_name) == (2, "two")
    first = read((HEAD + ONE + TWO).encode(), name="part.cls", operation="1")
    assert len(first) + len(alone) == len(whole)
    assert [statement.word for statement in first.statements] == ["PARTNO", "UNITS", "LOADTL", "SPINDL", "COOLNT"]


def test_what_may_hold_on_and_is_not_known_is_named() -> None:
    program = read((HEAD + ONE + "AUXFUN/51\n" + TWO).encode(), name="part.cls", operation="two")
    (finding,) = [one for one in program.findings if one.code == "CS178"]
    assert (finding.line, finding.count, finding.to_check) == (14, 1, True)
    assert "AUXFUN" in finding.text


@pytest.mark.parametrize(
    ("text", "which", "code", "said"),
    [
        (HEAD + ONE + TWO, "three", "CS168", "there is no operation three"),
        (HEAD + ONE + TWO, "3", "CS168", "it has 1, 2 two"),
        (HEAD + ONE + TWO + TWO, "two", "CS168", "several operations are called two"),
        (HEAD + ONE + "PPRINT OPERATION: two\n" + ARC, "two", "CS169", "begins with an arc"),
        (HEAD + ONE + "CUTCOM/LEFT\n" + TWO, "two", "CS169", "begins under cutter compensation"),
        ("LOADTL/1\nFROM/0,0,9,0,0,1\n", "1", "CS168", "it has none"),
    ],
)
def test_a_wrong_operation_is_an_error_with_the_list(text: str, which: str, code: str, said: str) -> None:
    with pytest.raises(InputError) as error:
        read(text.encode(), name="part.cls", operation=which)
    assert error.value.code == code
    assert said in str(error.value)


@pytest.mark.parametrize("which", ["two", "TWO", "2"])
def test_names_are_found_in_any_case_and_numbers_too(which: str) -> None:
    assert read((HEAD + ONE + TWO).encode(), name="part.cls", operation=which).source.operation == 2


@pytest.mark.parametrize("control", ["fanuc", "siemens", "heidenhain"])
def test_an_operation_alone_is_written_and_verified_by_the_command(control: str, tmp_path: Path) -> None:
    (tmp_path / "part.cls").write_text(HEAD + ONE + TWO)
    out = ["-o", "two.nc", "--report", "two.json", "--control", control, "--operation", "two"]
    assert run("smooth", "part.cls", *out, cwd=tmp_path).returncode == 0
    contents = json.loads((tmp_path / "two.json").read_text())
    assert contents["input"]["operation"] == {"number": 2, "name": "two"}
    assert (contents["verdict"], contents["input"]["poses"]) == ("PASSED", 5)
    text = (tmp_path / "two.nc").read_text()
    assert "S3000" in text  # the spindle, and the tool and the coolant
    assert {"fanuc": "T3 M6", "siemens": "T3", "heidenhain": "TOOL CALL 3 Z"}[control] in text
    assert "M8" in text
    assert ("X9." in text or "X+9" in text) is False  # nothing of operation 1
    told = run("verify", "part.cls", "two.nc", "--operation", "2", cwd=tmp_path)
    assert (told.returncode, told.stdout[:6]) == (0, b"PASSED")
    # the program's own word is not enough: it leaves out another operation
    told = run("verify", "part.cls", "two.nc", cwd=tmp_path)
    assert (told.returncode, told.stdout[:12]) == (1, b"NOT VERIFIED")
    assert b"name it with --operation" in told.stdout
    told = run("verify", "part.cls", "two.nc", "--operation", "1", cwd=tmp_path)
    assert (told.returncode, told.stdout[:6]) == (1, b"FAILED")


def test_the_command_names_the_operations_and_ends_with_3(tmp_path: Path) -> None:
    (tmp_path / "part.cls").write_text(HEAD + ONE + TWO)
    told = run("smooth", "part.cls", "-o", "o.nc", "--operation", "tow", cwd=tmp_path)
    assert told.returncode == 3
    assert b"it has 1, 2 two" in told.stderr
    assert not (tmp_path / "o.nc").exists()


def test_info_lists_operations_and_tools(tmp_path: Path) -> None:
    (tmp_path / "part.cls").write_text(FILES["nx"][0])
    contents = json.loads(run("info", "part.cls", "--json", cwd=tmp_path).stdout)
    assert [(one["number"], one["name"], one["tool"], one["poses"]) for one in contents["operations"]] == [
        (1, "ROUGH", 3, 2),
        (2, "FINISH", 4, 2),
    ]
    assert [(one["first_line"], one["last_line"]) for one in contents["operations"]] == [(1, 7), (8, 14)]
    assert [(one["number"], one["operations"]) for one in contents["tools"]] == [(3, [1]), (4, [2])]
    assert ["10" in one["shape"] for one in contents["tools"]] == [True, False]
    said = run("info", "part.cls", cwd=tmp_path).stdout.decode()
    assert "operation 2   FINISH, T4, lines 8 to 14, 2 poses" in said
    alone = json.loads(run("info", "part.cls", "--json", "--operation", "finish", cwd=tmp_path).stdout)
    assert alone["poses"] == 2


def test_an_nc_program_has_no_operations(tmp_path: Path) -> None:
    (tmp_path / "part.cls").write_text(HEAD + ONE + TWO)
    assert run("smooth", "part.cls", "-o", "o.nc", cwd=tmp_path).returncode == 0
    for command in ("info o.nc --operation 1", "verify o.nc o.nc --operation 1"):
        told = run(*command.split(), cwd=tmp_path)
        assert told.returncode == 2
        assert b"--operation is for CL files" in told.stderr


@pytest.mark.parametrize("path", [*sorted(OWN.iterdir()), SAMPLES / "two_tools.cls"], ids=lambda path: path.name)
def test_operations_are_the_whole_file_and_each_is_right_alone(path: Path) -> None:
    """Every pose belongs to one operation; where a file has several, each is written and PASSED alone."""
    whole = read(path)
    found = find_operations(whole)
    assert [one.first for one in found] == [0, *(one.stop for one in found[:-1])]
    assert found[-1].stop == len(whole)
    for one in found if len(found) > 1 else ():
        alone = read(path, operation=str(one.number))
        np.testing.assert_array_equal(alone.tip, whole.tip[one.first : one.stop])
        np.testing.assert_array_equal(alone.feed, whole.feed[one.first : one.stop])
        assert postprocess(alone.with_feed(500.0), io.BytesIO()).verdict == Verdict.PASSED
