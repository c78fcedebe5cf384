"""What becomes of every CL statement: words, comments, findings."""

from __future__ import annotations

import io
import re

import pytest

from cornersmooth.cl import read
from cornersmooth.errors import InputError, SettingsError, Verdict
from cornersmooth.kinematics import load_machine
from cornersmooth.nc import Frame, choose_form, fit_settings, write
from cornersmooth.pipeline import postprocess
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth
from cornersmooth.verify import verify
from nc.writing import codes, lines_of, text_of_cl

HEAD = ["%", "O0001", "G21 G90 G94 G17 G40 G49 G80", "G91 G28 Z0.", "G90"]
TAIL = ["M30", "%"]


def said(cl: str, *, start: str = "UNITS/MM\n") -> tuple[list[str], dict[str, int]]:
    """Blocks between the head and the first motion of statements that stand alone, and the findings."""
    lines, written = text_of_cl(f"{start}{cl}\nRAPID\nGOTO/0,0,0\nFINI\n")
    assert lines[:5] == HEAD
    assert lines[-2:] == TAIL
    return [line for line in lines[5 : lines.index("G54")] if not line.startswith("(UNITS")], codes(written)


@pytest.mark.parametrize(
    ("cl", "blocks"),
    [
        # spindle: the words in any order
        ("SPINDL/12000,RPM,CLW", ["S12000 M3"]),
        ("SPINDL/RPM,1000.000000,CLW", ["S1000 M3"]),
        ("SPINDL/CCLW,RPM,2546.479", ["S2546 M4"]),
        ("SPINDL/  500.0000,RPM, CLW", ["S500 M3"]),
        ("SPINDL/1200", ["S1200 M3"]),
        ("SPINDL/1200,CCLW\nSPINDL/OFF\nSPINDL/ON", ["S1200 M4", "M5", "M4"]),
        ("SPINDL/0,RPM", ["M5"]),
        ("SPINDL/1200,RPM,CLW,RANGE,2", ["S1200 M3", "(SPINDL/1200,RPM,CLW,RANGE,2)"]),  # what no block says
        ("SPINDL/1200,CLW,RANGE,2,MAXRPM,5000", ["S1200 M3", "(SPINDL/1200,CLW,RANGE,2,MAXRPM,5000)"]),
        ("SPINDL/RANGE,HIGH,1200,RPM", ["S1200 M3", "(SPINDL/RANGE,HIGH,1200,RPM)"]),
        ("SPINDL/LOCK", ["M19"]),
        ("SPINDL/LOCK,0.0", ["M19"]),
        ("SPINDL/ORIENT,0", ["M19"]),
        # coolant
        ("COOLNT/ON\nCOOLNT/MIST\nCOOLNT/OFF", ["M8", "M9", "M7", "M9"]),
        ("COOLNT/FLOOD", ["M8"]),
        ("COOLNT/FLOOD,ON", ["M8"]),
        ("COOLNT", ["M8"]),
        # tools
        ("LOADTL/2", ["T2 M6"]),
        ("LOADTL/2,1", ["T2 M6"]),
        ("LOADTL/2\nLOADTL/2,1", ["T2 M6", "(LOADTL/2,1)"]),
        ("LOADTL/         1", ["T1 M6"]),
        ("LOADTL/T12", ["T12 M6"]),
        ("LOAD/TOOL,13", ["T13 M6"]),
        ("TURRET/1,OSETNO,1", ["T1 M6"]),
        ("LOADTL/2, 0, 95., 2", ["T2 M6"]),
        ("LOADTL/2,LENGTH,95", ["T2 M6", "(LOADTL/2,LENGTH,95)"]),
        ("LOAD/TOOL,2,ADJUST,2", ["T2 M6"]),
        ("LOADTL/2,LENGTH,95,OSETNO,2", ["T2 M6", "(LOADTL/2,LENGTH,95,OSETNO,2)"]),
        ("LOADTL/2,IN,0,LENGTH,95,OSETNO,2", ["T2 M6", "(LOADTL/2,IN,0,LENGTH,95,OSETNO,2)"]),
        ("TOOLNO/2,10.0\nLOADTL/2", ["(TOOLNO/2,10.0)", "T2 M6"]),
        ("TOOLNO/3,10.0", ["T3 M6"]),
        ("LOAD/TOOL,13\nSELECT/TOOL,16\nLOAD/TOOL,16", ["T13 M6", "T16", "T16 M6"]),
        # waits
        ("DELAY/2.5", ["G4 P2500"]),
        ("DELAY/0.0001", ["G4 P1"]),
        ("DELAY/DWELL,1.5", ["G4 P1500"]),
        ("DELAY/DWELL,0", []),
        ("DELAY/0", []),
        ("SPINDL/1200,RPM,CLW\nDELAY/10,REV", ["S1200 M3", "G4 P500"]),
        ("STOP\nOPSTOP", ["M0", "M1"]),
        ("AUXFUN/8", ["M8"]),
        # cutter compensation off
        ("CUTCOM/OFF", ["G40"]),
        # text: what the machinist reads
        ("PPRINT OPERATION: zabusivanje", ["(OPERATION: zabusivanje)"]),
        ("PPRINT/'two (2) words'", ["(two [2] words)"]),
        ("TPRINT/T1 Drill D 10", ["(T1 Drill D 10)"]),
        ("$$ OPERATION NAME : x", ["(OPERATION NAME : x)"]),
        ("$$", []),
        ("PARTNO / MFG0001", ["(PARTNO / MFG0001)"]),
        ("INSERT/[HOLDER=C40-M06EM2] 6MM CRB", ["([HOLDER=C40-M06EM2] 6MM CRB)"]),
        ("TOOL PATH/A,TOOL,B\nEND-OF-PATH", ["(TOOL PATH/A,TOOL,B)"]),
        ("MODE/MILL\nREWIND/0", ["(MODE/MILL)"]),
        ("PPRINT " + 130 * "x", ["(" + 120 * "x" + ")", "(" + 10 * "x" + ")"]),
        ("SET/MODE,ABSOL", ["(SET/MODE,ABSOL)"]),
    ],
)
def test_what_is_understood(cl: str, blocks: list[str]) -> None:
    found, findings = said(cl)
    assert found == blocks
    assert findings == {}


@pytest.mark.parametrize(
    "cl",
    [
        "COOLNT/",  # a parameter of the CAM system that was left empty
        "COOLNT/THRU",
        "LOADTL/'EM10'",
        "LOADTL/1.5",
        "LOADTL/-1",
        "LOAD/PUNCH,3",
        "DELAY/10,REV",  # the spindle stands
        "DELAY/-1",
        "DELAY/1,2",
        "DELAY/DWELL",
        "DELAY/DWELL,1,REV",
        "CUTCOM/LEFT,SOMETHING",
        "AUXFUN/30",  # it would end the program
        "SWITCH/9",
    ],
)
def test_what_is_not_understood_becomes_a_comment_and_a_warning(cl: str) -> None:
    found, findings = said(cl)
    assert found[-1].startswith(f"({cl.splitlines()[-1].partition('/')[0]}")
    assert findings == {"CS310": 1}


@pytest.mark.parametrize(
    "spindle",
    [
        *(
            "500,FAST",
            "500,600,RPM",
            "LOCK,90",
            "RPM,3000,CLW,RADIUS",
            "-500,RPM",
            "500,HIGH",
            "500,CLW,CCLW",
            "OFF,CLW",
        ),
        "500,SFM,CLW",  # no cutter, no revolutions
        "500,SFM,CLW\nTURRET/2",  # the diameter is that of the part
        "500,RPM,MAXRPM,400",
    ],
)
def test_a_spindle_that_is_not_understood_is_an_error(spindle: str) -> None:
    with pytest.raises(InputError, match=r":\d: error\[CS115\]: SPINDL/.* is not understood"):
        text_of_cl(f"UNITS/MM\n{'CUTTER/9' * ('TURRET' in spindle)}\nSPINDL/{spindle}\nRAPID\nGOTO/0,0,9\nFINI\n")


def test_unknown_words_are_counted_by_word() -> None:
    _, written = text_of_cl("UNITS/MM\nABC/1\nABC/2\nDEF\nGOTO/1,0,0\nFINI\n")
    found = {finding.text.split()[0]: (finding.count, finding.line) for finding in written.findings[:2]}
    assert found == {"ABC": (2, 2), "DEF": (1, 4)}


@pytest.mark.parametrize("cl", ["PAINT/PATH\nPAINT/COLOR,31\nPAINT/SPEED,10"])
def test_paint_is_counted_and_left_out(cl: str) -> None:
    assert said(cl) == ([], {"CS317": 3})


def test_cutting_speed_becomes_revolutions_at_the_diameter_of_a_mill() -> None:
    for cl in ("CUTTER/10,0,5,5,0,0,50\nSPINDL/100,SMM,CLW", "TLDATA/MILL,10,0,80,0,0\nSPINDL/SMM,CLW,100"):
        found, findings = said(cl)
        assert found[-1] == "S3183 M3"
        assert findings == {"CS322": 1}
    lines, _ = text_of_cl("UNITS/INCHES\nCUTTER/0.5,0,0.25\nSPINDL/100,SFM\nRAPID\nGOTO/0,0,0\nFINI\n")
    assert "S764 M3" in lines
    assert "S2865 M3" in text_of_cl("LOADTL/4\nCUTTER/10\nSPINDL/SMM,90,CLW\nRAPID\nGOTO/0,0,0\nFINI\n")[0]


def test_a_spindle_that_is_not_stopped_where_it_should_goes_off_at_the_next_tool() -> None:
    cl = "UNITS/MM\nLOADTL/1\nSPINDL/900,CLW\nRAPID\nGOTO/0,0,9\nSPINDL/LOCK\nLOADTL/2\nRAPID\nGOTO/0,0,9\nFINI\n"
    lines = lines_of(choose_form("heidenhain"), cl)  # which has no word to orient it
    first, second = (next(k for k, line in enumerate(lines) if f"CALL {tool} Z" in line) for tool in (1, 2))
    assert any(line.endswith(" M5") for line in lines[first:second])


def test_a_dwell_under_feed_per_revolution_is_warned_of_where_it_may_count_turns() -> None:
    cl = "LOADTL/1\nSPINDL/900,CLW\nRAPID\nGOTO/0,0,9\nFEDRAT/0.1,MMPR\nGOTO/0,0,0\nDELAY/2\nGOTO/9,0,0\nFINI\n"
    for control, count in (("fanuc", 1), ("mitsubishi", 1), ("siemens", 0), ("generic", 1)):
        result = postprocess(cl.encode(), io.BytesIO(), Settings(), form=choose_form(control))
        codes = [finding.code for finding in result.findings]
        assert codes.count("CS383") == count, control
        slow = cl.replace("0.1,MMPR", "90,MMPM").encode()
        result = postprocess(slow, io.BytesIO(), Settings(), form=choose_form(control))
        assert "CS383" not in [finding.code for finding in result.findings]


THROUGH = """LOADTL/1
SPINDL/900,RPM,CLW
COOLNT/THRU
RAPID
GOTO/0,0,50
FEDRAT/100,MMPM
GOTO/0,0,0
COOLNT/FLOOD
GOTO/9,0,0
COOLNT/THRU
GOTO/9,9,0
COOLNT/OFF
GOTO/20,9,0
COOLNT/THRU
GOTO/20,30,0
RAPID
GOTO/20,30,50
LOADTL/2
RAPID
GOTO/0,0,50
GOTO/0,0,0
RAPID
GOTO/0,0,50
FINI
"""


def test_coolant_through_the_spindle_of_haas_has_its_own_end() -> None:
    stream = io.BytesIO()
    form = choose_form("haas", machine=load_machine("table-bc"))
    postprocess(THROUGH.encode(), stream, Settings(), form=form)
    lines = stream.getvalue().decode().splitlines()
    coolant = [line for line in lines if line in ("M8", "M9", "M88", "M89")]
    assert coolant == ["M88", "M89", "M8", "M9", "M88", "M89", "M88", "M89", "M88", "M89"]
    assert lines[lines.index("T2 M6") + 1 :][:2] == ["S900 M3", "M88"]  # the spindle first
    program = read(THROUGH.encode(), name="through.cls")
    lines = [line for line in lines if "CORNERSMOOTH" not in line and "SHA256" not in line and "PARTS" not in line]

    def verdict(*changed: str) -> Verdict:
        text = "\n".join(changed) + "\n"
        how = {"control": "haas", "machine": form.machine, "tolerance": 0.01, "axis_length": 10}
        return verify(program, text.encode(), **how).verdict

    assert verdict(*lines) == Verdict.PASSED
    for k, line in enumerate(lines):
        ended = any("M6" in one or "M30" in one for one in lines[k : k + 8])  # they stop the coolant themselves
        if line in coolant and not (line == "M89" and ended):
            for other in ([], [{"M89": "M9", "M9": "M89"}.get(line, "M7")]):
                assert verdict(*lines[:k], *other, *lines[k + 1 :]) == Verdict.FAILED, (k, line, other)


def test_insert_with_nc_words_is_not_passed_through() -> None:
    assert said("INSERT/M88$") == (["(M88$)"], {"CS320": 1})


def test_several_tools_have_their_own_lengths() -> None:
    lines, _ = text_of_cl(
        "UNITS/MM\nFEDRAT/100,MMPM\nLOADTL/2\nSPINDL/500,RPM,CLW\nGOTO/0,0,0\nGOTO/1,0,0\n"
        "LOAD/TOOL,5,ADJUST,25\nSPINDL/700,RPM,CLW\nGOTO/1,0,0\nGOTO/2,0,0\nSPINDL/OFF\nFINI\n"
    )
    assert [line.split(" X")[0] for line in lines[6:-2]] == [
        "T2 M6",
        "S500 M3",
        "G54",
        "G43.5 H2",
        "G1",
        "G1",
        "G91 G28 Z0.",
        "G90",
        "G49",
        "M5",
        "M1",
        "T5 M6",
        "S700 M3",
        "G54",
        "G43.5 H25",
        "G1",  # again: after the change the tool is elsewhere
        "G1",
        "M5",
        "G91 G28 Z0.",
        "G90",
        "G49",
    ]


def test_end_in_the_middle_is_a_stop_and_m30_comes_once() -> None:
    lines, written = text_of_cl("UNITS/MM\nFEDRAT/100,MMPM\nGOTO/0,0,0\nEND\nGOTO/1,0,0\nEND\nFINI\n")
    assert codes(written) == {"CS318": 1}
    assert lines.index("M0") > lines.index("(END)")
    assert [line for line in lines if line in ("M30", "M2", "M0")] == ["M0", "M30"]


def test_cutter_compensation_names_its_register() -> None:
    cl = (
        "UNITS/MM\nLOADTL/4\nFEDRAT/100,MMPM\nGOTO/0,0,0\nCUTCOM/LEFT,XYPLAN\nGOTO/5,0,0\nGOTO/5,5,0\nCUTCOM/OFF\n"
        "CUTCOM/RIGHT,XYPLAN,14\nGOTO/9,5,0\nCUTCOM/OFF\nGOTO/0,0,0\nFINI\n"
    )
    lines, written = text_of_cl(cl)
    kept = [line for line in lines if line[:3] in ("G40", "G41", "G42", "G18", "G17")]
    assert kept == ["G41 D4", "G40", "G42 D14", "G40"]
    assert codes(written) == {"CS319": 2}
    assert "G1 X5.0000 Y0.0000 Z0.0000 I0.0000000 J0.0000000 K1.0000000" in lines


@pytest.mark.parametrize("plane", ["ZXPLAN", "YZPLAN"])
def test_cutter_compensation_is_in_xy_alone(plane: str) -> None:
    """Programs with G18 before G41 were written, and verification refused each."""
    with pytest.raises(InputError, match=f"CS336.*{plane}"):
        text_of_cl(f"UNITS/MM\nLOADTL/4\nFEDRAT/100,MMPM\nGOTO/0,0,0\nCUTCOM/LEFT,{plane}\nGOTO/5,5,5\nFINI\n")


def test_a_tool_along_z_is_compensated_without_tool_tip_control() -> None:
    """With cycles of the control: most refuse G41 with it. A tool that tilts has it under tool tip control."""
    cl = (
        "UNITS/MM\nLOADTL/4\nFEDRAT/100,MMPM\nGOTO/0,0,0,0,0,1\nCUTCOM/LEFT\nGOTO/5,0,0,0,0,1\nCUTCOM/OFF\n"
        "GOTO/9,5,0,{}\nFINI\n"
    )
    form = choose_form("fanuc", None)
    lines = lines_of(form, cl.format("0,0,1"), frame=Frame(cycles="native"))
    assert "G43.5 H4" not in lines
    assert "G1 X5.0000 Y0.0000 Z0.0000" in lines
    for axis, cycles in (("0,0,1", "moves"), ("0,0.6,0.8", "native")):
        lines = lines_of(form, cl.format(axis), frame=Frame(cycles=cycles))
        assert "G43.5 H4" in lines


def test_from_is_no_motion_and_no_comment() -> None:
    lines, _ = text_of_cl("UNITS/MM\nPPRINT before\nFROM/1,2,300\nFEDRAT/100,MMPM\nGOTO/0,0,0\nFINI\n")
    assert "(before)" in lines
    assert not [line for line in lines if "300" in line]


def test_feed_per_revolution_switches_there_and_back() -> None:
    lines, _ = text_of_cl(
        "UNITS/MM\nFEDRAT/100,MMPM\nGOTO/0,0,0\nFEDRAT/0.1,MMPR\nGOTO/1,0,0\nGOTO/2,0,0\nRAPID\nGOTO/3,0,0\n"
        "FEDRAT/100,MMPM\nGOTO/4,0,0\nFINI\n"
    )
    feeds = [line.split()[-1] if " F" in line else line for line in lines if line in ("G94", "G95") or " F" in line]
    assert feeds == ["F100.", "G95", "F0.1", "G94", "F100."]


def test_comments_stand_where_they_stood() -> None:
    lines, _ = text_of_cl(
        "UNITS/MM\nFEDRAT/100,MMPM\nGOTO/0,0,0\nPPRINT one\nPPRINT two\n"
        "GOTO/9,0,0\nSTOP\nGOTO/9,9,0\nPPRINT three\nFINI\n"
    )
    order = [line for line in lines if line[0] == "(" or line == "M0"]
    assert order == ["(UNITS/MM)", "(one)", "(two)", "M0", "(three)"]


@pytest.mark.parametrize(("spindle", "count"), [("", 1), ("SPINDL/CLW\n", 1), ("SPINDL/500,RPM,CLW\n", 0)])
def test_feed_per_revolution_wants_a_speed(spindle: str, count: int) -> None:
    _, written = text_of_cl(f"UNITS/MM\n{spindle}FEDRAT/0.1,MMPR\nGOTO/0,0,0\nGOTO/1,0,0\nFINI\n")
    assert codes(written).get("CS324", 0) == count


def test_the_way_home_is_the_retract_and_the_next_motion_comes_from_above() -> None:
    lines, written = text_of_cl(
        "UNITS/MM\nLOADTL/2\nSPINDL/500,RPM,CLW\nRAPID\nGOTO/0,0,9\nFEDRAT/100,MMPM\nGOTO/0,0,0\nGOHOME\n"
        "RAPID\nGOTO/5,0,9\nGOTO/5,0,0\nFINI\n"
    )
    assert codes(written) == {"CS332": 1}
    at = lines.index("(GOHOME)")
    assert lines[at + 1 : at + 6] == ["G91 G28 Z0.", "G90", "G49", "G54", "G43.5 H2"]
    assert lines[at + 6].startswith("G0 X5.0000 Y0.0000 Z9.0000 ")


def test_what_a_tool_change_stops_goes_on_behind_it() -> None:
    lines, written = text_of_cl(
        "UNITS/MM\nLOADTL/2\nSPINDL/500,RPM,CLW\nCOOLNT/ON\nRAPID\nGOTO/0,0,9\nFEDRAT/100,MMPM\nGOTO/0,0,0\n"
        "LOADTL/3\nRAPID\nGOTO/0,0,9\nGOTO/0,0,0\nFINI\n"
    )
    change = lines.index("T3 M6")
    assert [line for line in lines[:change] if line in ("M9", "M5")] == ["M9", "M5"]
    assert lines[change + 1 : change + 3] == ["S500 M3", "M8"]
    assert [line for line in lines[change:] if line in ("M9", "M5")] == ["M9", "M5"]
    assert codes(written) == {"CS331": 1}


HALTED = """LOADTL/1
SPINDL/900,RPM,CLW
COOLNT/ON
RAPID
GOTO/0,0,50
FEDRAT/100,MMPM
GOTO/0,0,0
STOP
GOTO/9,0,0
STOP
SPINDL/700,RPM,CLW
GOTO/20,0,0
OPSTOP
COOLNT/OFF
GOTO/30,0,0
RAPID
GOTO/30,0,50
OPSTOP
CYCLE/DRILL,FEDTO,5,MMPM,90,RAPTO,3,RTRCTO,50
GOTO/30,0,0
CYCLE/OFF
OPSTOP
LOADTL/2
SPINDL/500,RPM,CLW
RAPID
GOTO/0,0,50
GOTO/0,0,0
FINI
"""


def test_what_a_stop_ends_is_said_again_before_the_tool_moves() -> None:
    stream = io.BytesIO()
    form = choose_form("fanuc", machine=load_machine("table-ac"))
    postprocess(HALTED.encode(), stream, Settings(), form=form, frame=Frame(cycles="native"))
    lines = stream.getvalue().decode().splitlines()
    stops = [k for k, line in enumerate(lines) if line in ("M0", "M1")]
    behind = [[line for line in lines[k + 1 : k + 4] if not line.startswith(("G", "(", "T"))] for k in stops]
    assert behind == [["S900 M3", "M8"], ["S700 M3", "M8"], ["M9", "S700 M3"], ["S700 M3"], []]  # M5 behind the retract
    assert lines[lines.index("T2 M6") + 1] == "S500 M3"
    program = read(HALTED.encode(), name="halted.cls")
    for k in stops[:4]:
        for j in range(k + 1, k + 3):
            if lines[j] in ("S900 M3", "S700 M3", "M8"):
                text = "\n".join([*lines[:j], *lines[j + 1 :]]) + "\n"
                how = {"control": "fanuc", "machine": form.machine, "tolerance": 0.01, "axis_length": 10}
                found = verify(program, text.encode(), **how)
                assert found.verdict in (Verdict.FAILED, Verdict.NOT_VERIFIED), lines[j]


def test_the_way_back_along_the_tool_is_a_motion_behind_a_stop() -> None:
    form = choose_form("fanuc", machine=load_machine("table-ac"))
    lines = lines_of(form, HALTED, frame=Frame(retract=20))
    change = lines.index("T2 M6")
    assert [line for line in lines[:change] if line[0] != "("][-6:-1] == [
        "S700 M3",
        "G0 X30.0000 Y0.0000 Z70.0000 A0.0000 C0.0000",
        "G91 G28 Z0.",
        "G90",
        "G49",
    ]


def test_what_is_switched_on_ahead_of_the_tool_waits_for_it() -> None:
    cl = (
        "UNITS/MM\n{}COOLNT/ON\n{}LOADTL/2\nRAPID\nGOTO/0,0,9\nFEDRAT/100,MMPM\nGOTO/0,0,0\n"
        "LOADTL/3\nCOOLNT/MIST\nRAPID\nGOTO/0,0,9\nGOTO/0,0,0\nFINI\n"
    )
    lines, written = text_of_cl(cl.format("SPINDL/500,RPM,CLW\n", ""))
    change = lines.index("T2 M6")
    assert not {"M8", "M9", "S500 M3", "M5"} & set(lines[:change])
    assert lines[change + 1 : change + 3] == ["S500 M3", "M8"]
    assert [line for line in lines if line in ("M7", "M8", "M9", "M5")] == ["M8", "M9", "M5", "M7", "M9", "M5"]
    assert codes(written) == {"CS331": 1}
    lines, _ = text_of_cl(cl.format("", "STOP\n"))  # the operator may look at it
    assert lines.index("M8") < lines.index("M0") < lines.index("T2 M6")


def test_a_length_register_is_no_tool() -> None:
    cl = "UNITS/MM\nLOADTL/{}\nSPINDL/500,CLW\nRAPID\nGOTO/0,0,9\nFEDRAT/100,MMPM\nGOTO/0,0,0\n{}GOTO/9,0,0\nFINI\n"
    lines, written = text_of_cl(cl.format("2,ADJUST,12", "LOADTL/ADJUST,3\n"))
    assert [line for line in lines if "T" in line and "(" not in line] == ["T2 M6"]
    assert "(LOADTL/ADJUST,3)" in lines
    assert codes(written) == {"CS310": 1}
    for said in ("T2,ADJUST,12", "ADJUST,12,2"):
        lines, _ = text_of_cl(cl.format(said, ""))
        assert "T2 M6" in lines
        assert any("H12" in line for line in lines)


def test_fragments_say_what_is_missing() -> None:
    """No tool, no spindle, a first move at feed: each is counted."""
    _, written = text_of_cl("UNITS/MM\nFEDRAT/100,MMPM\nGOTO/0,0,0\nGOTO/1,0,0\nFINI\n")
    assert codes(written, fragment=False) == {"CS333": 1, "CS334": 1, "CS335": 1}


def test_a_spindle_without_a_speed_is_said() -> None:
    cl = "UNITS/MM\nLOADTL/1\n{}RAPID\nGOTO/0,0,9\nFEDRAT/100,MMPM\nGOTO/0,0,0\nFINI\n"
    lines, written = text_of_cl(cl.format("SPINDL/ON\n"))
    assert "M3" in lines
    assert codes(written, fragment=False) == {"CS335": 1}
    _, written = text_of_cl(cl.format("SPINDL/900,CLW\nSPINDL/OFF\nSPINDL/ON\n"))
    assert codes(written, fragment=False) == {}


@pytest.mark.parametrize("way", ["approach", "retract"])
def test_a_control_without_a_retract_takes_no_way_to_it(way: str) -> None:
    program = read(b"UNITS/MM\nGOTO/0,0,0\nGOTO/1,0,0\nFINI\n", name="part.cls")
    form = choose_form("generic")
    smoothed = smooth(program, fit_settings(Settings(), form, program.units))
    with pytest.raises(SettingsError, match="generic has no retract"):
        write(smoothed, io.BytesIO(), form=form, frame=Frame(**{way: 20.0}))


@pytest.mark.parametrize("tools", [1, 2])
def test_first_motions_are_said_where_the_control_has_no_retract(tools: int) -> None:
    """`generic` has nothing around the motion: each tool's first feed, and its tilt, are counted all the same."""
    tool = "LOADTL/{}\nSPINDL/900,CLW\nFEDRAT/100,MMPM\nGOTO/0,0,{},0.6,0,0.8\nGOTO/1,0,0\n"
    cl = "UNITS/MM\nMULTAX\n" + "".join(tool.format(number + 1, number) for number in range(tools)) + "FINI\n"
    program = read(cl.encode(), name="part.cls")
    form = choose_form("generic")
    written = write(smooth(program, fit_settings(Settings(), form, program.units)), io.BytesIO(), form=form)
    assert codes(written, fragment=False) == {"CS333": tools, "CS337": tools}
    said = next(finding for finding in written.findings if finding.code == "CS333")
    assert said.text.endswith("it feeds from where the machine is; put a RAPID before it")


@pytest.mark.parametrize(
    ("control", "machine", "axis", "count"),
    [("fanuc", "", "0.6,0,0.8", 2), ("mitsubishi", "", "0.6,0,0.8", 2), ("fanuc", "", "0,0,1", 0)]
    + [("siemens", "", "0.6,0,0.8", 0), ("fanuc", "table-ac", "0.6,0,0.8", 0)],
)
def test_tip_control_where_a_tilted_tool_has_left_the_table(control: str, machine: str, axis: str, count: int) -> None:
    """Vectors cannot bring the table back to zero before G43.5 comes on again: for the second and the third tool."""
    tool = (
        "LOADTL/{}\nSPINDL/900,CLW\nRAPID\nGOTO/0,0,9,0,0,1\nFEDRAT/100,MMPM\nGOTO/9,0,0,{}\nRAPID\nGOTO/9,0,9,0,0,1\n"
    )
    cl = f"UNITS/MM\nMULTAX\n{tool.format(1, axis)}{tool.format(2, '0,0,1')}{tool.format(3, '0,0,1')}FINI\n"
    program = read(cl.encode(), name="part.cls")
    form = choose_form(control, machine=load_machine(machine) if machine else None)
    written = write(smooth(program, fit_settings(Settings(), form, program.units)), io.BytesIO(), form=form)
    assert codes(written, fragment=False).get("CS358", 0) == count


def test_compensation_without_words_for_it_is_refused() -> None:
    cl = "UNITS/MM\nLOADTL/1\nRAPID\nGOTO/0,0,9\nCUTCOM/LEFT\nFEDRAT/100,MMPM\nGOTO/9,0,0\nFINI\n"
    with pytest.raises(InputError, match=r"part\.cls:5: error\[\w+\]: heidenhain is given no cutter compensation"):
        lines_of(choose_form("heidenhain"), cl)


def test_several_tools_have_no_common_length_where_it_counts() -> None:
    cl = "UNITS/MM\nLOADTL/1\nRAPID\nGOTO/0,0,9\nLOADTL/2\nRAPID\nGOTO/9,0,0\nFINI\n"
    head, table = load_machine("head-ac"), load_machine("table-ac")
    assert lines_of(choose_form("fanuc", machine=table, tcp=False), cl)
    for other in ("", "LOADTL/1,2\n"):  # CATIA loads a tool twice
        assert lines_of(choose_form("fanuc", machine=head, tcp=False), cl.replace("LOADTL/2\n", other))
    with pytest.raises(SettingsError, match=r"part\.cls:5: error\[\w+\]: the length of tool 2 goes into"):
        lines_of(choose_form("fanuc", machine=head, tcp=False), cl)


@pytest.mark.parametrize(
    ("control", "axis", "machine", "count"),
    [
        ("fanuc", "0,0,1", "", 0),
        ("fanuc", "0.6,0,0.8", "", 1),
        ("fanuc", "0,0,1", "table-ac", 0),
        ("fanuc", "0.6,0,0.8", "table-ac", 1),  # at zero where tip control comes on
        ("haas", "0.6,0,0.8", "table-ac", 0),
    ],
)
def test_a_tilted_first_pose_is_said_where_the_text_cannot_turn_the_tool_before(control, axis, machine, count) -> None:
    cl = f"UNITS/MM\nMULTAX\nLOADTL/1\nRAPID\nGOTO/0,0,9,{axis}\nFEDRAT/100,MMPM\nGOTO/9,0,0\nFINI\n"
    program = read(cl.encode(), name="part.cls")
    form = choose_form(control, machine=load_machine(machine) if machine else None)
    written = write(smooth(program, fit_settings(Settings(), form, program.units)), io.BytesIO(), form=form)
    assert codes(written, fragment=False).get("CS337", 0) == count


@pytest.mark.parametrize(
    ("cl", "line", "text"),
    [
        ("LOADTL/1\nRAPID\nGOTO/0,0,5\nGOTO/0,0,0\n", 5, "a feed move before any feed"),
        ("LOADTL/1\nRAPID\nGOTO/0,0,5\nFEDRAT/0.1,MMPR\nGOTO/0,0,0\n", 6, "no spindle speed"),
        ("CUTTER/8,0,4\nRAPID\nGOTO/0,0,5\nFEDRAT/9,MMPM\nCUTCOM/LEFT\nGOTO/0,0,3\nGOTO/9,3,5\n", 6, "without any way"),
    ],
)
def test_what_the_interpreter_refuses_is_refused_with_its_line_in_the_cl_file(cl: str, line: int, text: str) -> None:
    form = choose_form("linuxcnc", machine=load_machine("xyzac-trt"))
    program = read(("UNITS/MM\n" + cl + "FINI\n").encode(), name="part.cls")
    with pytest.raises(InputError, match=text) as refused:
        write(smooth(program, fit_settings(Settings(), form, "mm")), io.BytesIO(), form=form)
    assert refused.value.line == line
    fanuc = choose_form("fanuc")
    write(smooth(program, fit_settings(Settings(), fanuc, "mm")), io.BytesIO(), form=fanuc)


@pytest.mark.parametrize(("control", "machine"), [("linuxcnc", "xyzac-trt"), ("fanuc", ""), ("siemens", "table-ac")])
def test_a_short_lead_in_under_cutter_compensation_is_said(control: str, machine: str) -> None:
    cl = "UNITS/MM\nCUTTER/8,0,4\nRAPID\nGOTO/0,0,5\nFEDRAT/9,MMPM\nCUTCOM/LEFT\nGOTO/0,{},5\nGOTO/9,3,5\nFINI\n"
    form = choose_form(control, machine=load_machine(machine) if machine else None)
    for length, said_so in ((3, True), (5, False)):
        program = read(cl.format(length).encode(), name="part.cls")
        written = write(smooth(program, fit_settings(Settings(), form, "mm")), io.BytesIO(), form=form)
        assert ("CS345" in {finding.code for finding in written.findings}) == said_so


@pytest.mark.parametrize(
    ("control", "form"), [("fanuc", "g1"), ("fanuc", "g6.2"), ("siemens", "bspline"), ("heidenhain", "g1")]
)
def test_a_tool_begins_at_a_pose_that_repeats_the_last_one_with_its_tool_axis(control: str, form: str) -> None:
    """The pose is no motion in the CL file; the new tool must go there all the same."""
    there = "GOTO/40,0,0,0.2,0.1,0.97467943\n"
    head = "UNITS/MM\nLOADTL/1\nSPINDL/900,CLW\nFEDRAT/300,MMPM\nRAPID\nGOTO/0,0,30,0.1,0,0.99498744\nGOTO/0,0,0\n"
    cl = f"{head}{there}LOADTL/2\nSPINDL/800,CLW\n{there}GOTO/60,5,0\nFINI\n"
    words = r"X\+?40\.0+ Y\+?0\.0+ Z\+?0\.0+ (\S+ \S+ [^ ]*[\d.]+)"
    found = [axis[1] for line in lines_of(choose_form(control, form), cl) if (axis := re.search(words, line))]
    assert len(found) > 1
    assert len(set(found)) == 1
