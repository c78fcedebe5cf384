"""Hole cycles: plain moves that end where the cycle says, or no plunge at all."""

from __future__ import annotations

import io
import re
from itertools import chain, pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

from cornersmooth.errors import InputError, Verdict
from cornersmooth.kinematics import load_machine
from cornersmooth.nc import Frame, choose_form
from cornersmooth.pipeline import postprocess
from cornersmooth.settings import Settings
from cornersmooth.verify import verify
from nc.writing import codes, lines_of, text_of_cl

NX = "TOOL PATH/A,TOOL,B\nTLDATA/DRILL,MILL,8.0,0.0,80.0,118.0,35.0\nMSYS/0,0,0,1,0,0,0,1,0\n"
PLAIN = "UNITS/MM\n"
SOLIDWORKS = "UNIT/MM\nTRNTYP/WORLD,0,0,0\nCSYS/1.,0,0,0,0,1.,0,0,0,0,1.,0\n"


def moves(cl: str, form: str = "g1") -> tuple[list[str], dict[str, int]]:
    lines, written = text_of_cl(cl, form)
    lines = [re.sub(r"^G43 H\d+ ", "", line) for line in lines]
    return [line for line in lines if line[:3] in ("G0 ", "G1 ", "G4 ")], codes(written)


def heights(cl: str) -> tuple[list[str], dict[str, int]]:
    """Moves along Z as ``G0 30`` or ``G1 -3.2``."""
    lines, findings = moves(cl)
    short = []
    for line in lines:
        z = re.search(r" Z(-?[\d.]+)", line)
        short.append(f"{line[:2]} {float(z[1]):g}" if z else line)
    return short, findings


@pytest.mark.parametrize(
    ("cycle", "expected"),
    [
        ("CYCLE/DRILL,FEDTO,10,MMPM,250,RAPTO,3", ["G0 30", "G0 3", "G1 -10", "G0 30"]),
        ("CYCLE/DRILL,DEPTH,10,PERMIN,250,CLEAR,30,RETURN,30,RAPTO,27", ["G0 30", "G0 3", "G1 -10", "G0 30"]),
        ("CYCLE/DRILL,DEPTH,4.6,PERREV,0.08,CLEAR,2,RETURN,0", ["G0 30", "G0 2", "G1 -4.6", "G0 30"]),
        ("CYCLE/DRILL,DEPTH,4.6,MMPR,0.08,CLEAR,2,RETURN,0", ["G0 30", "G0 2", "G1 -4.6", "G0 30"]),
        ("CYCLE/DRILL,FEDTO,10,RAPTO,3,RTRCTO,50,MMPM,250", ["G0 50", "G0 3", "G1 -10", "G0 50"]),
        ("CYCLE/DRILL,FEDTO,10,RAPTO,3,RTRCTO,AUTO,MMPM,250", ["G0 30", "G0 3", "G1 -10", "G0 30"]),
        ("CYCLE/FACE,FEDTO,1,MMPM,250,RAPTO,3,DWELL,0.5", ["G0 30", "G0 3", "G1 -1", "G4 P500", "G0 30"]),
        ("CYCLE/DRILL,FEDTO,1,MMPM,250,RAPTO,3,DWELL,REV,5", ["G0 30", "G0 3", "G1 -1", "G4 P300", "G0 30"]),
        ("CYCLE/REAM,FEDTO,10,MMPM,250,RAPTO,3", ["G0 30", "G0 3", "G1 -10", "G1 3", "G0 30"]),
        (
            "CYCLE/DRILL,DEEP,FEDTO,10,MMPM,250,RAPTO,3,STEP,5,4",
            ["G0 30", "G0 3", "G1 -5", "G0 3", "G0 -4.5", "G1 -9", "G0 3", "G0 -8.5", "G1 -10", "G0 30"],
        ),
        (
            "CYCLE/BRKCHP,FEDTO,10,INCR,4,MMPM,250,RAPTO,3",
            ["G0 30", "G0 3", "G1 -4", "G0 -3.5", "G1 -8", "G0 -7.5", "G1 -10", "G0 30"],
        ),
        ("CYCLE/DRILL,FEDTO,10,MMPM,250", ["G0 30", "G1 -10", "G0 30"]),  # no clearance: feed all the way
    ],
)
def test_explicit_moves(cycle: str, expected: list[str]) -> None:
    cl = f"{PLAIN}SPINDL/1000,RPM,CLW\nRAPID\nGOTO/0,0,30\n{cycle}\nGOTO/10,0,0\nCYCLE/OFF\nFINI\n"
    found, findings = heights(cl)
    assert found == ["G0 30", *expected]
    assert findings == {"CS316": 1}


@pytest.mark.parametrize(
    "cycle",
    [
        "CYCLE/DRILL,    3.000000,    5.000000",  # depth? clearance? feed? CATIA's table decides
        "CYCLE/TAP,FEDTO,10,MMPM,250,RAPTO,3",
        "CYCLE/BORE,NODRAG,FEDTO,10,MMPM,250,RAPTO,3",
        "CYCLE/DRILL,CSINK,20,FEDTO,10,MMPM,250,RAPTO,3",
        "CYCLE/DRILL,FEDTO,10,DEPTH,12,MMPM,250,RAPTO,3",
        "CYCLE/DRILL,FEDTO,10,MMPM,250,RAPTO,-3",
        "CYCLE/DRILL,MMPM,250,RAPTO,3",
        "CYCLE/DRILL,FEDTO",
        "CYCLE/DRILL,FEDTO,10,FEDTO,20,MMPM,250",
        "CYCLE/DRILL,FEDTO,10,MMPM,250,IPM,10",
        "CYCLE/DRILL,DEEP,FEDTO,10,MMPM,250,STEP,0",
        "CYCLE/DRILL,FEDTO,10,MMPM,250,DWELL,5,REV",  # the spindle stands
        "CYCLE/MILL,FEDTO,10",
        "CYCLE/INIT",
    ],
)
def test_what_is_not_understood_is_an_error_or_left_out_and_never_plunges(cycle: str) -> None:
    cl = f"{PLAIN}RAPID\nGOTO/0,0,30\n{cycle}\nGOTO/10,5,0\nGOTO/20,5,0\nCYCLE/OFF\nFINI\n"
    with pytest.raises(InputError, match="the hole cycle is not written") as refused:
        text_of_cl(cl)
    assert (refused.value.code, refused.value.line) == ("CS342", 1 + cl[: cl.index("CYCLE/")].count("\n"))
    lines, written = text_of_cl(cl, frame=Frame(skip_cycles=True))
    assert codes(written) == {"CS315": 2}
    assert "(NOT DRILLED: HOLE AT X10.0000 Y5.0000 Z0.0000)" in lines
    places = [line for line in lines if line.startswith("G0 ")]
    assert [line.split(" I")[0] for line in places[1:]] == [
        "G0 X10.0000 Y5.0000 Z30.0000",
        "G0 X20.0000 Y5.0000 Z30.0000",
    ]
    assert not [line for line in lines if line.startswith("G1 ")]


def test_nx_counts_depths_upwards() -> None:
    """NX: CYCLE/DRILL,RAPTO,3.0000,FEDTO,-33.0043,RTRCTO,AUTO,MMPM,250.0000."""
    text = (
        NX + "RAPID\nGOTO/0,0,50,0,0,1\nCYCLE/DRILL,RAPTO,3.0,FEDTO,{},RTRCTO,AUTO,MMPM,250.0\nGOTO/0,0,10\nCYCLE/OFF\n"
    )
    found, findings = heights(text.format("-33.0043"))
    assert found == ["G0 50", "G0 13", "G1 -23.0043", "G0 50"]
    assert findings == {"CS316": 1}
    with pytest.raises(InputError, match="its words are not understood"):
        heights(text.format("33.0043"))


def test_a_tilted_hole_is_drilled_along_the_tool() -> None:
    axis = np.array([0.6, 0.0, 0.8])
    cl = (
        f"{PLAIN}MULTAX/ON\nRAPID\nGOTO/56,0,48,0.6,0,0.8\n"
        "CYCLE/DRILL,FEDTO,10,MMPM,250,RAPTO,5\nGOTO/20,0,0,0.6,0,0.8\nCYCLE/OFF\nFINI\n"
    )
    for form in ("g1", "g6.2"):
        lines, _ = moves(cl, form)
        places: NDArray[np.float64] = np.array([re.findall(r"[XYZ](-?[\d.]+)", line) for line in lines], float)
        along = (places - [20, 0, 0]) @ axis
        above = [80] if form == "g6.2" else []  # where it comes down along the tool from
        np.testing.assert_allclose(along, [*above, 60, 5, -10, 60], atol=1e-3)
        np.testing.assert_allclose(places - [20, 0, 0] - along[:, None] * axis, 0, atol=1e-3)
        assert [line[:2] for line in lines[len(above) :]] == ["G0", "G0", "G1", "G0"]
        assert lines[2 + len(above)].endswith(" F250.")


def test_solidworks_pecks() -> None:
    cl = (
        SOLIDWORKS + "RAPID/\nGOTO/3,2,25.\nCYCLE/INIT\n"
        "CYCLE/DEEP2,FEDTO,8.,1STPECK,5.,SUBPECK,2.,MMPM,670.56,RAPTO,3.,RTRCTO,25.4\nGOTO/3,2,-0.4\nCYCLE/OFF\n"
    )
    found, findings = heights(cl)
    assert found == [
        "G0 25",
        "G0 2.6",
        "G1 -5.4",
        "G0 2.6",
        "G0 -4.9",
        "G1 -7.4",
        "G0 2.6",
        "G0 -6.9",
        "G1 -8.4",
        "G0 25",
    ]
    assert findings == {"CS316": 1}


def test_the_last_peck_takes_what_would_hardly_be_left() -> None:
    """Two pecks of 2.4102 mm leave 0.001 mm of 4.8214: no tool comes out and back for that."""
    found, _ = heights(
        f"{PLAIN}RAPID\nGOTO/0,0,20\nCYCLE/DEEP,FEDTO,4.8214,STEP,2.4102,MMPM,90,RAPTO,2\nGOTO/0,0,0\nCYCLE/OFF\nFINI\n"
    )
    assert found == ["G0 20", "G0 2", "G1 -2.4102", "G0 2", "G0 -1.9102", "G1 -4.8214", "G0 20"]


def test_several_holes_share_the_height_of_travel() -> None:
    found, findings = heights(
        f"{PLAIN}RAPID\nGOTO/0,0,20\nCYCLE/DRILL,FEDTO,5,IPM,10,RAPTO,2\nGOTO/10,0,0\nPPRINT next\nGOTO/20,0,8\n"
        "GOTO/30,0,19\nCYCLE/OFF\nRAPID\nGOTO/30,0,50\nFINI\n"
    )
    holes = ["G0 20", "G0 2", "G1 -5", "G0 20"], ["G0 20", "G0 10", "G1 3", "G0 21"], ["G0 21", "G1 14", "G0 21"]
    assert found == ["G0 20", *chain(*holes), "G0 50"]
    assert findings == {"CS316": 3}


@pytest.mark.parametrize(
    ("approach", "cycle", "radii", "warned"),
    [
        (100.0, "CYCLE/DRILL,RAPTO,3,FEDTO,-10,MMPM,200", [100, 53, 40, 100, 100, 53, 40, 100], 0),
        (51.0, "CYCLE/DRILL,RAPTO,3,FEDTO,-10,MMPM,200", [51, 53, 40, 53, 53, 40, 53], 1),
        (51.0, "CYCLE/DRILL,RAPTO,3,FEDTO,-10,MMPM,200,RTRCTO,30", [51, 80, 53, 40, 80, 80, 53, 40, 80], 0),
        (-100.0, "CYCLE/DRILL,RAPTO,3,FEDTO,-10,MMPM,200", [100, 53, 40, 53, 53, 40, 53], 2),
    ],
)
def test_the_tool_turns_from_hole_to_hole_as_high_as_it_came(
    approach: float, cycle: str, radii: list[float], warned: int
) -> None:
    """Between holes around a cylinder the straight way at the clearance goes through the part."""
    lines, findings = moves(
        f"UNITS/MM\nLOADTL/1\nSPINDL/900,CLW\nRAPID\nGOTO/{approach},0,0,{np.sign(approach)},0,0\n{cycle}\nGOTO/50,0,0,1,0,0\n"
        "GOTO/0,50,0,0,1,0\nCYCLE/OFF\nFINI\n"
    )
    places = [re.search(r"X([-\d.]+) Y([-\d.]+) Z", line) for line in lines]
    found = [float(np.hypot(float(place[1]), float(place[2]))) for place in places if place]
    np.testing.assert_allclose(found, radii, atol=1e-3)
    assert findings.get("CS384", 0) == warned


def test_pecks_without_depth_are_one_feed_and_a_warning() -> None:
    found, findings = heights(
        NX + "RAPID\nGOTO/0,0,50,0,0,1\nCYCLE/DRILL,DEEP,RAPTO,3.0,FEDTO,-9,MMPM,250.0\nGOTO/0,0,0\nCYCLE/OFF\n"
    )
    assert found == ["G0 50", "G0 3", "G1 -9", "G0 50"]
    assert findings == {"CS316": 1, "CS321": 1}


def test_feed_of_the_cycle_does_not_outlive_it() -> None:
    lines, _ = moves(
        f"{PLAIN}FEDRAT/800,MMPM\nGOTO/0,0,30\nCYCLE/DRILL,FEDTO,5,MMPM,250,RAPTO,2\nGOTO/0,0,0\nCYCLE/OFF\nGOTO/9,9,30\nFINI\n"
    )
    assert [line.split()[-1] for line in lines if " F" in line] == ["F800.", "F250.", "F800."]


def test_the_corner_after_a_hole_is_passed_exactly() -> None:
    """The tool comes down from above the hole, not along the segment from its position."""
    lines, _ = moves(
        f"{PLAIN}FEDRAT/800,MMPM\nRAPID\nGOTO/0,0,30\nCYCLE/DRILL,FEDTO,5,MMPM,250,RAPTO,2\nGOTO/0,0,0\nCYCLE/OFF\n"
        "GOTO/9,0,0\nGOTO/9,9,0\nGOTO/0,9,0\nFINI\n"
    )
    assert "G1 X9.0000 Y0.0000 Z0.0000 I0.0000000 J0.0000000 K1.0000000 F800." in lines
    assert not [line for line in lines if " X9.0000 Y9.0000" in line]


@pytest.mark.parametrize(("cycle", "why"), [("BORE,ORIENT", "its words"), ("TAP", "a tap takes a spindle")])
def test_holes_left_out_are_gone_over_as_high_as_the_tool_came(cycle: str, why: str) -> None:
    cl = (
        f"{PLAIN}RAPID\nGOTO/100,0,0,1,0,0\nCYCLE/{cycle},RAPTO,3,FEDTO,10,MMPM,200\nGOTO/50,0,0,1,0,0\n"
        "GOTO/0,50,0,0,1,0\nCYCLE/OFF\nFINI\n"
    )
    form, frame = choose_form("fanuc", "g1"), Frame(skip_cycles=True, comments=False)
    lines = lines_of(form, cl, frame=frame)
    assert sum("NOT DRILLED" in line for line in lines) == 2
    places = [re.match(r"G0 X([-\d.]+) Y([-\d.]+) Z", line) for line in lines]
    assert {float(np.hypot(float(one[1]), float(one[2]))) for one in places if one} == {100.0}
    with pytest.raises(InputError, match=why) as refused:
        lines_of(form, cl)
    assert refused.value.code == "CS342"


#: CL text of cycles, and the heights that the tool goes to
UNDERSTOOD = {
    "ISO 4343 begins a cycle with ON": (
        "CYCLE/DRILL,ON,DEPTH,12,PERMIN,85,CLEAR,5,RAPTO,3,RETURN,20\nGOTO/10,0,0\n",
        ["G0 2", "G1 -12", "G0 30"],
    ),
    "a fixed order: depth, unit, feed, clearance": (
        "CYCLE/DRILL, 12, MMPM, 85, 1\nGOTO/10,0,0\n",
        ["G0 1", "G1 -12", "G0 30"],
    ),
    "a fixed order with words after it": (
        "CYCLE/DRILL, 12, MMPM, 85, 20, RAPTO, 17\nGOTO/10,0,0\n",
        ["G0 3", "G1 -12", "G0 30"],
    ),
    "a fixed order with pecks": (
        "CYCLE/DEEP, 12, INCR, 8, MMPM, 85, 20, RAPTO, 17\nGOTO/10,0,0\n",
        ["G0 3", "G1 -8", "G0 3", "G0 -7.5", "G1 -12", "G0 30"],
    ),
    "ON goes on with another depth": (
        "CYCLE/DRILL,FEDTO,5,MMPM,250,RAPTO,2\nGOTO/10,0,0\nCYCLE/ON,FEDTO,7\nGOTO/20,0,0\nCYCLE/OFF\nRAPID\n"
        "GOTO/20,0,30\nCYCLE/ON\nGOTO/30,0,0\n",
        ["G0 2", "G1 -5", "G0 30", "G0 30", "G0 2", "G1 -7", "G0 30", "G0 30", "G0 2", "G1 -7", "G0 30"],
    ),
    "another word for the same takes its place": (
        "CYCLE/DRILL,DEEP,STEP,4,DEPTH,8,MMPM,250,CLEAR,2\nGOTO/10,0,0\nCYCLE/ON,FEDTO,9,INCR,9,RAPTO,3\nGOTO/10,0,0\n",
        ["G0 2", "G1 -4", "G0 2", "G0 -3.5", "G1 -8", "G0 30", "G0 3", "G1 -9", "G0 30"],
    ),
}


@pytest.mark.parametrize("name", UNDERSTOOD)
def test_other_spellings_are_understood(name: str) -> None:
    said, expected = UNDERSTOOD[name]
    cl = f"{PLAIN}SPINDL/1000,RPM,CLW\nRAPID\nGOTO/10,0,30\n{said}CYCLE/OFF\nFINI\n"
    found, _ = heights(cl)
    assert found == ["G0 30", *expected]
    out = io.BytesIO()
    result = postprocess(cl.encode(), out)
    assert [one.code for one in result.findings].count("CS385") == ("fixed order" in name)
    assert result.verification is not None
    assert result.verification.problems == ()
    deeper = re.sub(rb"Z(-\d+\.\d)", rb"Z\g<1>9", out.getvalue())
    assert verify(result.program, deeper, tolerance=0.01, axis_length=10.0).verdict is not Verdict.PASSED


def test_the_feed_of_on_takes_the_place_of_the_first() -> None:
    lines, _ = moves(
        f"{PLAIN}GOTO/0,0,30\nCYCLE/DRILL,FEDTO,5,MMPM,250,RAPTO,2\nGOTO/0,0,0\nCYCLE/ON,PERMIN,90\nGOTO/9,0,0\nCYCLE/OFF\nFINI\n"
    )
    assert [line.partition("F")[2] for line in lines if line.startswith("G1") and "F" in line][-2:] == ["250.", "90."]


@pytest.mark.parametrize(
    "cycle",
    [
        *("CYCLE/ON,FEDTO,7", "CYCLE/DRILL, 12, MMPM, 85", "CYCLE/DRILL,-12,MMPM,85,1", "CYCLE/DRILL,12,85,1"),
        "CYCLE/DRILL,DEPTH,-12,MMPM,85,CLEAR,1",
    ],
)
def test_numbers_whose_meaning_is_open_are_refused(cycle: str) -> None:
    with pytest.raises(InputError, match="its words are not understood"):
        heights(f"{PLAIN}RAPID\nGOTO/0,0,30\n{cycle}\nGOTO/10,0,0\nCYCLE/OFF\nFINI\n")


@pytest.mark.parametrize("head", [NX, "MODE/MILL\nUNITS/MM\n"], ids=["nx", "hsm"])
def test_the_fixed_order_is_that_of_dialects_that_have_it(head: str) -> None:
    """Autodesk's post of ISO 4343 has it, too, but writes the bottoms of holes: they were drilled twice as deep."""
    with pytest.raises(InputError, match="its words are not understood"):
        heights(f"{head}RAPID\nGOTO/0,0,30,0,0,1\nCYCLE/DRILL,12,MMPM,85,15,RAPTO,10\nGOTO/10,0,-12\nCYCLE/OFF\n")


@pytest.mark.parametrize(
    ("head", "cycle", "height"),
    [
        ("$$-> FEATNO / 1\n", "DEPTH,10,MMPM,250,CLEAR,5,RAPTO,1", "G0 4"),
        ("$$-> FEATNO / 1\n", "DEPTH,10,MMPM,250,RAPTO,1", "G0 1"),
        (
            "MCSYS/NUM,1,POINT,0,0,0,VECTOR,1,0,0,VECTOR,0,1,0\n",
            "DEPTH,10,PERMIN,250,CLEAR,15,RETURN,15,RAPTO,12",
            "G0 3",
        ),
        ("MCSYS/NUM,1,POINT,0,0,0,VECTOR,1,0,0,VECTOR,0,1,0\n", "DEPTH,10,PERMIN,250,CLEAR,15,RETURN,20", "G0 15"),
        ("CSI_TOOL_PATH/1\n", "FEDTO,10,MMPM,250,CLEAR,15,RETURN,15,RAPTO,3", "G0 3"),
        ("$$-> FEATNO / 1\n", "DEPTH,10,MMPM,250,CLEAR,5,RAPTO,5", "RAPTO counts from CLEAR down"),
    ],
)
def test_rapto_beside_clear_counts_from_there_down_but_in_camplete(head: str, cycle: str, height: str) -> None:
    cl = f"{head}UNITS/MM\nRAPID\nGOTO/0,0,30,0,0,1\nCYCLE/DRILL,{cycle}\nGOTO/10,0,0\nCYCLE/OFF\nFINI\n"
    if height.startswith("G0"):
        found, _ = heights(cl)
        assert found[found.index("G1 -10") - 1] == height
    else:
        with pytest.raises(InputError, match=height):
            heights(cl)


@pytest.mark.parametrize("cycles", ["moves", "native"])
def test_holes_that_return_to_the_controls_own_height_are_verified(cycles: str) -> None:
    """NX: RTRCTO,AUTO; in the second hole the last of seven pecks ends at the bottom but for arithmetic."""
    cl = NX + "UNITS/INCHES\nLOADTL/1\nSPINDL/RPM,900,CLW\nRAPID\nGOTO/0,0,3,0,0,1\n"
    cl += "CYCLE/DRILL,DEEP,STEP,0.1,RAPTO,0.1,FEDTO,-0.7,RTRCTO,AUTO,IPM,10\nGOTO/2,0,0\nGOTO/2,1,-0.2\nCYCLE/OFF\n"
    cl += "CYCLE/DRILL,RAPTO,0.1,FEDTO,-0.5,RTRCTO,AUTO,IPR,0.004\nGOTO/3,1,0\nCYCLE/OFF\nRAPID\nGOTO/2,1,3\nFINI\n"
    form = choose_form("fanuc", machine=load_machine("table-bc"))
    result = postprocess(
        cl.encode(), io.BytesIO(), Settings(tolerance=0.01), form=form, frame=Frame(cycles=cycles), processes=1
    )
    assert result.verification is not None
    assert result.verification.problems == ()


def test_the_tool_leaves_a_hole_at_the_height_at_which_it_comes_to_the_next_one_of_another_cycle() -> None:
    """A clamp between them may be as high as the second cycle says: up at once, then across."""
    first, second = ("CYCLE/DRILL,FEDTO,{},RAPTO,3,RTRCTO,{},MMPM,250".format(*one) for one in ((10, 20), (8, 50)))
    holes = f"{first}\nGOTO/0,0,0\n{second}\nGOTO/20,0,0\nCYCLE/OFF\n"
    found, _ = heights(f"{PLAIN}LOADTL/1\nSPINDL/900,CLW\nRAPID\nGOTO/0,0,30,0,0,1\n{holes}FINI\n")
    assert found[found.index("G0 3") :] == ["G0 3", "G1 -10", "G0 50", "G0 50", "G0 3", "G1 -8", "G0 50"]


def test_moves_behind_a_cycle_of_the_control_go_up_before_they_go_across() -> None:
    """The cycle ends at its own height of travel, the hole after it lies higher: straight up, then straight across."""
    tap, drill = "CYCLE/TAP,FEDTO,4,RAPTO,3,RTRCTO,3,MMPM,100", "CYCLE/DRILL,FEDTO,4,RAPTO,3,RTRCTO,3,MMPM,250"
    holes = f"{tap}\nGOTO/0,0,0\n{drill}\nGOTO/20,0,40\nCYCLE/OFF\n"
    cl = f"{PLAIN}LOADTL/1\nSPINDL/900,CLW\nRAPID\nGOTO/0,0,30,0,0,1\n{holes}FINI\n"
    lines, _ = text_of_cl(cl)
    cycle = next(k for k, line in enumerate(lines) if "G84" in line)
    behind = [line for line in lines[cycle:] if line.startswith(("G0 ", "G1 "))]
    places = [tuple(float(x) for x in re.findall(r"[XZ](-?[\d.]+)", line)) for line in behind]
    assert places == [(0.0, 43.0), (20.0, 43.0), (20.0, 36.0), (20.0, 43.0)]


@pytest.mark.parametrize("heights_of_return", [(50, 80), (80, 50)])
def test_holes_before_and_behind_the_way_home_have_heights_of_their_cycles(heights_of_return: tuple[int, int]) -> None:
    first, second = (f"CYCLE/DRILL,FEDTO,10,RAPTO,3,RTRCTO,{one},MMPM,250" for one in heights_of_return)
    holes = f"{first}\nGOTO/0,0,0\nGOHOME\n{second}\nGOTO/20,0,0\nCYCLE/OFF\n"
    found, _ = heights(f"{PLAIN}LOADTL/1\nSPINDL/900,CLW\nRAPID\nGOTO/0,0,30,0,0,1\n{holes}FINI\n")
    drilled = [[f"G0 {one}", "G0 3", "G1 -10", f"G0 {one}"] for one in heights_of_return]
    assert [line for line in found if " X" not in line][-8:] == drilled[0] + drilled[1]


@pytest.mark.parametrize("heights_of_return", [(20, 50), (50, 20)])
@pytest.mark.parametrize("between", ["LOADTL/2\nSPINDL/900,CLW", "GOHOME"])
def test_without_a_retract_the_tool_goes_across_at_the_higher_level(
    between: str, heights_of_return: tuple[int, int]
) -> None:
    """Neither a tool change nor GOHOME leads anywhere there: a rapid aslant to the next hole might collide."""
    first, second = (f"CYCLE/DRILL,FEDTO,10,RAPTO,3,RTRCTO,{one},MMPM,250" for one in heights_of_return)
    holes = f"{first}\nGOTO/0,0,0\n{between}\n{second}\nGOTO/20,0,0\nCYCLE/OFF\n"
    cl = f"{PLAIN}LOADTL/1\nSPINDL/900,CLW\nRAPID\nGOTO/0,0,10,0,0,1\n{holes}FINI\n"
    lines = lines_of(choose_form("generic"), cl)
    rapids = [tuple(float(x) for x in re.findall(r"[XZ](-?[\d.]+)", line)) for line in lines if line[:3] == "G0 "]
    across = [(before[1], after[1]) for before, after in pairwise(rapids) if before[0] != after[0]]
    assert across == [(50.0, 50.0)]
