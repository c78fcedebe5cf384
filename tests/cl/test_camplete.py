"""Autodesk's CAMplete APT: work offset, turned planes, taps; and spellings of cycles that mean one thing."""

from __future__ import annotations

import io

import numpy as np
import pytest

from cornersmooth import postprocess, read, verify
from cornersmooth.errors import InputError, SettingsError, Verdict
from cornersmooth.nc import Frame, choose_form
from cornersmooth.settings import Settings

SECTION = """PPRINT/'NEW SECTION'
CSI_TOOL_PATH/Op{tool}

UNITS/MM
MULTAX/{multax}

MCS/{axes}

CUTTER/8., 4., 0., 0., 0., 0., 40.
CSI_SET_FLUTE_LENGTH/22.
LOADTL/{tool}, 0, 40., {tool}
SPINDL/RPM,900,CLW
COOLNT/FLOOD
{zero}CSI_PATH_TOLERANCE/0.01
"""
UPRIGHT = "1., 0., 0., $\n0., 1., 0., $\n0., 0., 1., $\n0., 0., 0."
TURNED = "1., 0., 0., $\n0., 0.8, 0.6, $\n0., -0.6, 0.8, $\n0., -20., -5."
CUT = "RAPID\nGOTO/0., 0., 40.\nFEDRAT/800., MMPM\nGOTO/0., 0., 0.\nGOTO/14., 3., 0.\nGOTO/27., 0., 0.\n"
TAP = "RAPID\nGOTO/5., 6., 40.\nCYCLE/RIGID, DEPTH, 12., PITCH, 1.25, CLEAR, 30., RETURN, 30., RAPTO, 5.\n"
TAP += "GOTO/5., 6., 0.\nCYCLE/OFF\n"


def part(*sections: str) -> bytes:
    return ("MACHIN/UMC\nMODE/MILL\nPARTNO/'4711'\n" + "".join(sections) + "END\nFINI\n").encode()


def section(tool: int, motion: str, *, axes: str = UPRIGHT, zero: str = "", multax: str = "OFF") -> str:
    return SECTION.format(tool=tool, axes=axes, zero=zero, multax=multax) + motion


def written(data: bytes, control: str = "fanuc", frame: Frame | None = None) -> tuple[Verdict, str]:
    stream = io.BytesIO()
    result = postprocess(data, stream, Settings(tolerance=0.02), form=choose_form(control), frame=frame)
    return result.verdict, stream.getvalue().decode()


def test_a_section_in_a_turned_plane_is_read_into_the_system_of_the_work_offset() -> None:
    # origin + 40 times its Z axis; whichever section comes first
    for sections in ((section(3, CUT), section(4, CUT, axes=TURNED)), (section(4, CUT, axes=TURNED), section(3, CUT))):
        program = read(part(*sections))
        turned = slice(4, 8) if "LOADTL/3" in sections[0] else slice(0, 4)
        assert program.tip[turned] == pytest.approx(
            np.array([[0, -44, 27], [0, -20, -5], [14, -17.6, -3.2], [27, -20, -5]])
        )
        assert program.axis[turned] == pytest.approx(np.array([[0, -0.6, 0.8]] * 4))
        assert program.axis[[*range(4)] if turned.start else [*range(4, 8)]].tolist() == [[0, 0, 1]] * 4


def test_a_multi_axis_section_has_its_axes_turned_too() -> None:
    motion = "GOTO/0., 0., 40., 0., 0., 1.\nGOTO/0., 0., 0., 0.6, 0., 0.8\n"
    program = read(part(section(4, motion, axes=TURNED, multax="ON")))
    assert program.axis == pytest.approx(np.array([[0, -0.6, 0.8], [0.6, -0.48, 0.64]]))


def test_a_matrix_that_is_no_turn_is_refused() -> None:
    for wrong in (TURNED.replace("-0.6, 0.8", "0.6, 0.8"), TURNED.replace("0., 0.8, 0.6", "0., 0.8, 0.7")):
        with pytest.raises(InputError, match=r"error\[CS117\]: MCS changes"):
            read(part(section(3, CUT), section(4, CUT, axes=wrong)))


@pytest.mark.parametrize(
    ("number", "control", "block"),
    [
        (1, "fanuc", "G54"),
        (2, "fanuc", "G55"),
        (6, "fanuc", "G59"),
        (9, "fanuc", "G54.1 P3"),
        (3, "siemens", "G56"),
        (5, "siemens", "G505"),
        (2, "heidenhain", "DATUM SETTING Q339=+2"),
    ],
)
def test_zero_is_the_work_offset(number: int, control: str, block: str) -> None:
    data = part(section(3, CUT, zero=f"ZERO/{number}\n"), section(4, CUT, zero=f"ZERO/{number}\n"))
    verdict, text = written(data, control)
    assert verdict is Verdict.PASSED
    assert any(line.endswith(block) for line in text.splitlines())
    other = {"G54": "G55", "G505": "G506", "DATUM SETTING Q339=+2": "DATUM SETTING Q339=+3"}.get(block, "G54")
    wrong = verify(read(data), text.replace(block, other).encode(), tolerance=0.02, control=control)
    assert wrong.verdict is Verdict.FAILED
    assert any(
        "where the CL file asks for number" in one.text and one.code in ("CS559", "CS571") for one in wrong.problems
    )


def test_another_work_offset_within_the_path_is_refused() -> None:
    first, second = section(3, CUT, zero="ZERO/1\n"), section(4, CUT, zero="ZERO/2\n")
    with pytest.raises(InputError, match=r"error\[CS117\]: ZERO/2 changes"):
        read(part(first, second))
    with pytest.raises(InputError, match=r"error\[CS117\]: ZERO/2 changes"):
        read(part(section(3, CUT), second))
    assert written(part(section(3, CUT), first.replace("LOADTL/3", "LOADTL/4")))[0] is Verdict.PASSED


def test_the_option_and_the_file_do_not_both_name_the_work_offset() -> None:
    data = part(section(3, CUT, zero="ZERO/2\n"))
    with pytest.raises(SettingsError, match="CS248"):
        written(data, frame=Frame(work_offset="G54"))
    with pytest.raises(SettingsError, match="CS216"):
        written(data, "generic")
    verdict, text = written(data, frame=Frame(work_offset=""))
    assert (verdict, "G55" in text) == (Verdict.PASSED, False)


def test_cutcom_on_before_its_side_says_nothing_more() -> None:
    cut = CUT.replace("GOTO/14", "CUTCOM/ON\nCUTCOM/LEFT, 3\nGOTO/14") + "CUTCOM/OFF\nGOTO/40., 0., 0.\n"
    verdict, text = written(part(section(3, cut)))
    assert verdict is Verdict.PASSED
    assert text.count("G41 D3") == 1
    for alone in (cut.replace("CUTCOM/LEFT, 3\n", ""), cut.replace("CUTCOM/ON\n", "CUTCOM/ON\nGOTO/1., 0., 0.\n")):
        assert written(part(section(3, alone)))[0] is Verdict.NOT_VERIFIED


def test_an_arc_in_a_turned_plane_turns_about_its_axis() -> None:
    arc = CUT + "CIRCLE/27., 10., 0., 0., 0., -1., 10., 90., 0.0, 0.0, 0.0\nGOTO/37., 10., 0.\n"
    program = read(part(section(4, arc, axes=TURNED)))
    assert program.arcs.normal == pytest.approx(np.array([[0, -0.6, 0.8]]))
    assert np.degrees(program.arcs.sweep) == pytest.approx([90])
    assert written(part(section(4, arc, axes=TURNED)))[0] is Verdict.PASSED


def test_zero_of_apt_still_changes_the_coordinates() -> None:
    with pytest.raises(InputError, match=r"error\[CS117\]: ZERO changes"):
        read(b"UNITS/MM\nZERO/1\nGOTO/0,0,0\n")


def test_a_part_in_two_planes_with_offset_taps_and_two_tools_gets_through() -> None:
    for control in ("fanuc", "siemens", "heidenhain"):
        sections = (section(3, CUT, zero="ZERO/2\n"), section(5, TAP, zero="ZERO/2\n"))
        turned = section(4, CUT, axes=TURNED, zero="ZERO/2\n")
        assert written(part(*sections, turned), control)[0] is Verdict.PASSED


@pytest.mark.parametrize(
    ("dialect", "cycle", "same"),
    [
        ("hsm", "RIGID,DEPTH,12,PITCH,1.25,CLEAR,30,RAPTO,5", "TAP,DEPTH,12,MMPR,1.25,CLEAR,30,RAPTO,5"),
        (
            "hsm",
            "BORE,FEDTO,12,MMPM,150,CLEAR,30,RETURN,30,RAPTO,5,ORIENT,0",
            "BORE,FEDTO,12,MMPM,150,RETURN,30,RAPTO,5",
        ),
        ("creo", "TAP,DEPTH,15,TPI,20,CLEAR,2", "TAP,DEPTH,15,MMPR,1.27,CLEAR,2"),
        ("creo", "CSINK,DEPTH,4,MMPM,120,CLEAR,2,CSKDIA,8", "CSINK,DEPTH,4,MMPM,120,CLEAR,2"),
        ("nx", "TAP,FLOAT,RAPTO,5,FEDTO,-12,MMPR,1.25", "TAP,RAPTO,5,FEDTO,-12,MMPR,1.25"),
        ("nx", "DRILL,RAPTO,3,FEDTO,-12,OPTION,CAM,2,MMPM,180", "DRILL,RAPTO,3,FEDTO,-12,MMPM,180"),
    ],
)
def test_spellings_that_mean_one_thing(dialect: str, cycle: str, same: str) -> None:
    text = "UNITS/MM\nLOADTL/1\nSPINDL/RPM,900,CLW\nRAPID\nGOTO/5,6,40\nCYCLE/{}\nGOTO/5,6,0\nCYCLE/OFF\nFINI\n"
    found = []
    for one in (cycle, same):
        stream = io.BytesIO()
        reading = {"dialect": dialect}
        result = postprocess(read(text.format(one).encode(), **reading), stream, Settings(tolerance=0.02))
        assert result.verdict is Verdict.PASSED
        found.append([line for line in stream.getvalue().decode().splitlines() if not line.startswith("(")])
    assert found[0] == found[1]


@pytest.mark.parametrize(
    "cycle", ["BORE,NODRAG", "BORE,BACK", "BORE,ORIENT,30", "DRILL,OPTION,3", "DRILL,CSINK,9,TLANGL,90"]
)
def test_what_means_more_is_not_drilled(cycle: str) -> None:
    text = f"UNITS/MM\nLOADTL/1\nSPINDL/RPM,900,CLW\nRAPID\nGOTO/5,6,40\nCYCLE/{cycle},RAPTO,3,FEDTO,-12,MMPM,80\n"
    with pytest.raises(InputError, match=r"6: error\[CS342\]"):
        postprocess(read((text + "GOTO/5,6,0\nCYCLE/OFF\nFINI\n").encode(), dialect="nx"), io.BytesIO())


CATIA = (
    "$$     CATIA APT VERSION 1.0\nUNITS/MM\nLOADTL/1\nSPINDL/900,RPM,CLW\nRAPID\nGOTO/5,6,40\nCYCLE/{}\nGOTO/5,6,0\n"
    "CYCLE/OFF\nFINI\n"
)


@pytest.mark.parametrize(
    ("order", "cycle", "same"),
    [
        ("DEPTH,FEED,CLEAR", "DRILL,   26.0,   85.0,    1.0,MMPM", "DRILL,DEPTH,26,MMPM,85,CLEAR,1"),
        ("depth, feed", "DRILL,    3.0,    5.0", "DRILL,DEPTH,3,PERMIN,5"),
        ("DEPTH,SKIP,FEED,CLEAR,STEP", "DEEP,30,7,85,2,4,MMPM", "DEEP,DEPTH,30,MMPM,85,CLEAR,2,STEP,4"),
        ("DEPTH,PITCH,CLEAR", "TAP,12,1.25,3", "TAP,DEPTH,12,MMPR,1.25,CLEAR,3"),
        ("DEPTH,FEED,CLEAR", "DRILL,DEPTH,26,MMPM,85,CLEAR,1", "DRILL,DEPTH,26,MMPM,85,CLEAR,1"),
    ],
)
def test_an_order_names_the_numbers_of_a_cycle(order: str, cycle: str, same: str) -> None:
    found = []
    for one, reading in ((cycle, {"cycle_order": order}), (same, {})):
        stream = io.BytesIO()
        result = postprocess(read(CATIA.format(one).encode(), **reading), stream, Settings(tolerance=0.02))
        assert result.verdict is Verdict.PASSED
        found.append([line for line in stream.getvalue().decode().splitlines() if not line.startswith("(")])
    assert found[0] == found[1]


def test_more_numbers_than_the_order_names_are_not_drilled() -> None:
    for reading in ({}, {"cycle_order": "DEPTH,FEED"}):
        with pytest.raises(InputError, match=r"error\[CS342\]"):
            postprocess(read(CATIA.format("DRILL,26,85,1,MMPM").encode(), **reading), io.BytesIO())
    for wrong in ("DEPTH,SPEED", "DEPTH,DEPTH"):
        with pytest.raises(SettingsError, match="CS230"):
            read(CATIA.format("OFF").encode(), cycle_order=wrong)


def test_rules_of_tables_are_refused_for_cl_files() -> None:
    for rule in ({"scale": 1000.0}, {"flip_axis": True}, {"between_passes": 20.0}):
        with pytest.raises(SettingsError, match="CS230"):
            read(CATIA.format("OFF").encode(), **rule)


def test_an_origin_of_catia_without_a_shift_is_a_work_offset_that_is_not_compared() -> None:
    data = CATIA.format("OFF").replace("LOADTL/1", "ORIGIN/0,0,0,1,1\nLOADTL/1").encode()
    assert postprocess(data, io.BytesIO(), Settings(tolerance=0.02)).verdict is Verdict.NOT_VERIFIED
    for wrong in (data.replace(b"ORIGIN/0,0,0", b"ORIGIN/0,0,1"), data.replace(b"$$     CATIA APT VERSION", b"$$")):
        with pytest.raises(InputError, match=r"error\[CS117\]: ORIGIN changes"):
            read(wrong)


def test_a_g_code_of_prefun_is_told_as_one() -> None:
    with pytest.raises(InputError, match=r"error\[CS115\]: PREFUN/54 is not understood\nhint: a G code may move"):
        read(b"UNITS/MM\nPREFUN/54\nGOTO/0,0,0\n")


@pytest.mark.parametrize(
    ("cycles", "args"),
    [
        ("DRILL,FEDTO,5,RAPTO,2,MMPM,90\nCYCLE/ON", "DRILL,FEDTO,5,RAPTO,2,MMPM,90"),
        ("DRILL,FEDTO,5,DWELL,REV,4\nCYCLE/OFF\nCYCLE/ON,DEPTH,7", "DRILL,DWELL,REV,4,DEPTH,7"),
        ("DEEP,FEDTO,9,STEP,4,3,RTRCTO,AUTO\nCYCLE/ON,INCR,2,RETURN,8", "DEEP,FEDTO,9,INCR,2,RETURN,8"),
        ("DRILL,FEDTO,5\nCYCLE/INIT\nCYCLE/ON,IPM,3", "DRILL,FEDTO,5,IPM,3"),
        ("ON,FEDTO,7", "ON,FEDTO,7"),
        ("DRILL,ON,DEPTH,12,PERMIN,85", "DRILL,DEPTH,12,PERMIN,85"),
        ("DEEP,12,INCR,8,MMPM,85,20,RAPTO,17", "DEEP,DEPTH,12,INCR,8,MMPM,85,RAPTO,3"),
        ("DRILL,-12,MMPM,85,1", "DRILL,-12,MMPM,85,1"),
    ],
)
def test_a_cycle_has_all_the_words_that_hold(cycles: str, args: str) -> None:
    program = read(f"UNITS/MM\nGOTO/0,0,30\nCYCLE/{cycles}\nGOTO/5,6,0\nCYCLE/OFF\nFINI\n".encode())
    found = [one for one in program.statements if one.word == "CYCLE"][-2].args
    assert ",".join(f"{value:g}" if isinstance(value, float) else value for value in found) == args
