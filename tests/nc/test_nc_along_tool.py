"""The ways to the first position behind a retract, and away from the last before one, along the tool."""

from __future__ import annotations

import io
import re
from itertools import product

import numpy as np
import pytest

from cornersmooth.cl import read
from cornersmooth.kinematics import load_machine
from cornersmooth.nc import Frame, fit_settings, write
from cornersmooth.nc_reader import read_nc
from cornersmooth.nc_reader.elements import Element
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth
from cornersmooth.verify import verify
from nc.cases import CHOSEN, Case
from oracle.share import covering_share

EPS, H = 0.01, 10.0
UPRIGHT, TILTED = "0,0,1", "0.48,0.36,0.8"
CL = (
    "UNITS/{units}\nLOADTL/3\nSPINDL/9000,RPM,CLW\nCOOLNT/ON\nRAPID\nGOTO/1,2,5,{axis}\nFEDRAT/80,{feed}\n"
    "GOTO/1,2,0\nGOTO/3,2,0\nGOTO/3,4,0\nLOADTL/4\nSPINDL/9000,RPM,CLW\nRAPID\nGOTO/3,4,5\nFEDRAT/80,{feed}\n"
    "GOTO/0,2,0\nRAPID\nGOTO/0,2,5\nFINI\n"
)
CASES = [
    case
    for case in CHOSEN
    if case.control != "generic" and (case.tcp or not load_machine(case.machine).swings_the_tool)  # two tools
]


def text_of(case: Case, units: str, frame: Frame):
    form = case.choose()
    axis = UPRIGHT if form.orientation == "fixed" else TILTED
    program = read(CL.format(units=units, axis=axis, feed="MMPM" if units == "MM" else "IPM").encode(), name="part.cls")
    settings = fit_settings(Settings(tolerance=EPS), form, program.units)
    stream = io.BytesIO()
    write(smooth(program, settings), stream, form=form, frame=frame)
    return program, stream.getvalue().decode().splitlines(), settings.tolerance


def unnumbered(line: str) -> str:
    return re.sub(r"^\d+ ", "", line)


def problems(case: Case, program, lines: list[str], tolerance: float):
    data = ("\n".join(lines) + "\n").encode()
    options = {"control": case.control, "machine": case.choose().machine, "tcp": case.tcp}
    return verify(program, data, tolerance=tolerance, axis_length=H, skip_cycles=True, **options).problems


@pytest.mark.parametrize(("units", "case"), covering_share(product(["MM", "INCHES"], CASES), 6), ids=str)
def test_rapids_along_the_tool_stand_at_both_ends(case: Case, units: str) -> None:
    program, lines, tolerance = text_of(case, units, Frame(approach=50.0, retract=100.0))
    assert problems(case, program, lines, tolerance) == ()
    data = ("\n".join(lines) + "\n").encode()
    form = case.choose()
    found = read_nc(data, control=case.control, machine=form.machine, tcp=case.tcp)
    # a program that has been read before is measured alike, and stays as it is
    ends = found.tip.copy()
    options = {"control": case.control, "machine": form.machine, "tcp": case.tcp}
    assert verify(program, found, tolerance=tolerance, axis_length=H, skip_cycles=True, **options).problems == ()
    np.testing.assert_array_equal(found.tip, ends)
    rapid = found.kind == Element.RAPID
    axis = found.second if found.second_is == "vector" else found.second - found.tip
    up = axis[0] / np.linalg.norm(axis[0])
    # down to the first position of each tool, up from the last one
    steps = np.diff(found.tip, axis=0)
    heights, aside = steps @ up, np.linalg.norm(steps - np.outer(steps @ up, up), axis=1)
    along = rapid[1:] & (aside < 0.01)
    assert np.count_nonzero(along & (np.abs(heights + 50.0) < 0.01)) == 2
    assert np.count_nonzero(along & (np.abs(heights - 100.0) < 0.01)) == 2


@pytest.mark.parametrize("case", covering_share([case for case in CASES if case.tcp][::2], 4), ids=str)
def test_ways_that_are_not_along_the_tool_are_found(case: Case) -> None:
    program, lines, tolerance = text_of(case, "MM", Frame(approach=50.0, retract=100.0))
    bare = {unnumbered(line) for line in text_of(case, "MM", Frame())[1]}
    rapids = [k for k, line in enumerate(lines) if re.search(r"(G0|L) ?.*\bZ", line) and unnumbered(line) not in bare]
    assert len(rapids) >= 4
    for k in rapids[:1] + rapids[-1:]:
        aside = re.sub(
            r"(\bX[+]?)(-?)(\d+)", lambda match: f"{match[1]}{match[2]}{int(match[3]) + 7}", lines[k], count=1
        )
        assert problems(case, program, [*lines[:k], aside, *lines[k + 1 :]], tolerance)
        # to the wrong side
        below = re.sub(r"(\bZ)[+]?(\d+)", r"\1-\2", lines[k], count=1)
        assert problems(case, program, [*lines[:k], below, *lines[k + 1 :]], tolerance)


def test_forms_with_a_point_on_the_axis_come_down_along_the_tool() -> None:
    """They have no words for a place over the position: all axes go at once to a place above it."""
    case = Case("fanuc", "g6.2")
    program, lines, tolerance = text_of(case, "MM", Frame())
    first = next(k for k, line in enumerate(lines) if " G0 X" in line)
    above, at = (np.array(re.findall(r"[XYZUVW]([-\d.]+)", line), float) for line in lines[first : first + 2])
    np.testing.assert_allclose(above - at, 20 * np.tile([0.48, 0.36, 0.8], 2), atol=2e-4)
    assert problems(case, program, lines, tolerance) == ()


def test_rapids_of_the_cl_file_along_the_tool_must_stay() -> None:
    """What looks like a way of a post may be the CL file's own: without it something is missing."""
    case = Case("fanuc", "g1")
    program, lines, tolerance = text_of(case, "MM", Frame())
    last = max(k for k, line in enumerate(lines) if line.startswith("G0 X"))
    assert problems(case, program, [*lines[:last], *lines[last + 1 :]], tolerance)


def test_a_rapid_away_from_a_hole_that_is_not_tapped_is_the_cl_files_own() -> None:
    cl = (
        "UNITS/MM\nLOADTL/3\nRAPID\nGOTO/1,2,-5,0,0,1\nCYCLE/TAP,FEDTO,9,MMPM,250,RAPTO,3\nGOTO/1,2,-9\nCYCLE/OFF\n"
        "RAPID\nGOTO/1,2,50\nLOADTL/4\nRAPID\nGOTO/1,2,40\nFINI\n"
    )
    case = Case("fanuc", "g1")
    program = read(cl.encode(), name="part.cls")
    stream, form = io.BytesIO(), case.choose()
    smoothed = smooth(program, fit_settings(Settings(tolerance=EPS), form, "mm"))
    write(smoothed, stream, form=form, frame=Frame(skip_cycles=True))
    assert problems(case, program, stream.getvalue().decode().splitlines(), EPS) == ()


#: a cut that is left after 10 mm, 5 mm upwards; what it is left and gone on with, and what is wrong with the motion
WAYS = {
    "at feed": (["G0 X10. Z5."], ["G0 Z5.", "G1 Z0. F80."], set()),
    "at feed, within a move": (["G1 X6.", "G0 Z5."], ["G0 Z5.", "G1 Z0. F80."], set()),
    "in rapid": (["G0 X10. Z5."], ["G0 Z0."], {"CS582"}),
    "in rapid, at twice": (["G0 X10. Z5."], ["G0 Z5.", "G0 Z0."], {"CS582"}),
    "in rapid from hardly above": (["G0 X10. Z0.5"], ["G0 Z0."], {"CS582"}),
    "at feed from elsewhere, within a move": (["G1 X6.", "G0 Z5."], ["G1 Z0. F80."], {"CS582"}),
    "in rapid, within a move": (["G1 X6.", "G0 Z5."], ["G0 Z0."], {"CS582"}),
    "at feed from hardly above": (["G0 X10. Z0.5"], ["G0 Z5.", "G1 Z0. F80."], {"CS533"}),
    "at feed to hardly above": (["G0 X10. Z5."], ["G0 Z0.5", "G1 Z0. F80."], {"CS533"}),
}


@pytest.mark.parametrize(("out", "back", "wrong"), WAYS.values(), ids=WAYS)
def test_a_cut_goes_on_at_feed_from_clear_above(out: list[str], back: list[str], wrong: set[str]) -> None:
    cl = "UNITS/MM\nRAPID\nGOTO/0,0,0,0,0,1\nFEDRAT/80,MMPM\nGOTO/10,0,0\nGOTO/20,0,0\nGOTO/20,9,0\nFINI\n"
    place = "X6. Y0." if "G1 X6." in out else "X10. Y0."
    lines = ["G21 G90 G94 G17 G40 G49 G80", "G91 G28 Z0.", "G90", "G54", "G43.5 H1", "G0 X0. Y0. Z0. I0. J0. K1."]
    lines += ["G1 X10. F80." if "G1 X6." not in out else "G1 X3. F80.", *out, "G91 G28 Z0.", "G90"]
    lines += [f"G0 {place}", *back, "G1 X20.", "G1 Y9.", "G91 G28 Z0.", "G90", "G49", "M30"]
    found = verify(read(cl.encode()), ("\n".join(lines) + "\n").encode(), tolerance=EPS, axis_length=H)
    assert {one.code for one in found.problems} & {"CS531", "CS532", "CS533", "CS536", "CS582"} == wrong
    assert len(found.rewinds) == (not wrong)
